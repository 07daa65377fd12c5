//! The restricted Voronoi diagram of sites on a mesh, with all components of each cell, in f64 on the host.

use crate::mesh::TriMesh;
use crate::mesh::kd_tree::KdTree;
use crate::mesh::triangle::area;
use crate::mesh::unit_frame::UnitFrame;
use crate::{ProgressToken, Result};
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::AddAssign;

/// Triangles that one thread takes in a row.
const CHUNK: usize = 256;
/// A triangle that may meet the cells of more sites than this is halved first, unless it is [`SMALL`].
const FEW: usize = 24;
/// A triangle is small if its radius is at most this fraction of the distance to the nearest site.
const SMALL: f64 = 0.5;
/// Maximum number of times that a triangle is halved: many sites may coincide.
const MOST_HALVINGS: u32 = 40;
/// Outweighs the rounding of a distance.
const LENIENT: f64 = 1.0 + 1e-9;

/// Integrals over a site's cell, relative to the site.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CellMoments {
    /// Area; 0 if the site has no cell.
    pub area: f64,
    /// Integral of the vector from the site.
    pub first: DVec3,
    /// Integral of the squared distance to the site.
    pub energy: f64,
}

impl AddAssign for CellMoments {
    fn add_assign(&mut self, other: Self) {
        self.area += other.area;
        self.first += other.first;
        self.energy += other.energy;
    }
}

/// Sites with a search structure that finds their parts of any triangle.
pub struct RestrictedVoronoi<'a> {
    sites: &'a [DVec3],
    tree: KdTree<'a>,
}

/// The memory of one thread.
#[derive(Default)]
struct Scratch {
    near: Vec<u32>,
    parts: Vec<(u32, [f64; 3])>,
    polygon: Vec<DVec3>,
    clipped: Vec<DVec3>,
}

impl<'a> RestrictedVoronoi<'a> {
    /// Of finite sites; of coincident ones the first has the cell.
    pub fn new(sites: &'a [DVec3]) -> Self {
        Self { sites, tree: KdTree::new(sites) }
    }

    /// The cells on a mesh, one for each site; the same for every number of threads. Panics if an index of
    /// `mesh` is out of range.
    pub fn cells(&self, mesh: &TriMesh) -> Vec<CellMoments> {
        self.cells_on(&(0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect::<Vec<_>>())
    }

    /// Like [`RestrictedVoronoi::cells`], on loose triangles.
    pub fn cells_on(&self, triangles: &[[DVec3; 3]]) -> Vec<CellMoments> {
        let parts: Vec<Vec<(u32, CellMoments)>> =
            triangles.par_chunks(CHUNK).map(|chunk| self.parts(chunk)).collect();
        let mut cells = vec![CellMoments::default(); self.sites.len()];
        for (site, part) in parts.into_iter().flatten() {
            cells[site as usize] += part;
        }
        cells
    }

    /// What each site's cell has of the triangles of a mesh: convex polygons, one for each triangle, in the
    /// order of the triangles. They are the same for every number of threads. Panics if an index of `mesh` is
    /// out of range.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub(crate) fn polygons(&self, mesh: &TriMesh, progress: &ProgressToken) -> Result<Vec<Vec<Vec<DVec3>>>> {
        let of_chunk = |(chunk, triangles): (usize, &[[u32; 3]])| {
            let mut scratch = Scratch::default();
            let first = chunk * CHUNK;
            let of_triangle = |t| self.polygons_of(mesh.corners(t), &mut scratch);
            match progress.is_cancelled() {
                true => Vec::new(),
                false => (first..first + triangles.len()).flat_map(of_triangle).collect::<Vec<_>>(),
            }
        };
        let parts: Vec<_> = mesh.triangles.par_chunks(CHUNK).enumerate().map(of_chunk).collect();
        progress.poll()?;
        let mut cells = vec![Vec::new(); self.sites.len()];
        parts.into_iter().flatten().for_each(|(site, polygon)| cells[site as usize].push(polygon));
        Ok(cells)
    }

    /// The polygons of one triangle, each with its site. Halves of it tell which sites bound each other.
    fn polygons_of(&self, corners: [DVec3; 3], scratch: &mut Scratch) -> Vec<(u32, Vec<DVec3>)> {
        let mut rivals: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
        let mut halves = vec![(corners, MOST_HALVINGS)];
        while let Some((half, halvings)) = halves.pop() {
            if !self.find_near(half, halvings, scratch) {
                halves.extend(bisect(half).map(|half| (half, halvings - 1)));
                continue;
            }
            for own in 0..scratch.parts.len() {
                if self.part(half, own, scratch).area > 0.0 {
                    let near = scratch.parts.iter().map(|(site, _)| *site);
                    rivals.entry(scratch.parts[own].0).or_default().extend(near);
                }
            }
        }
        let mut polygons = Vec::new();
        for (site, near) in rivals {
            scratch.parts = near.into_iter().map(|other| (other, [0.0; 3])).collect();
            let own = scratch.parts.iter().position(|(other, _)| *other == site);
            if own.is_some_and(|own| self.part(corners, own, scratch).area > 0.0) {
                let at = self.sites[site as usize];
                polygons.push((site, scratch.polygon.iter().map(|p| *p + at).collect()));
            }
        }
        polygons
    }

    /// The parts of triangles, each with its site.
    fn parts(&self, triangles: &[[DVec3; 3]]) -> Vec<(u32, CellMoments)> {
        let mut scratch = Scratch::default();
        let mut parts = Vec::new();
        triangles
            .iter()
            .for_each(|corners| self.add_parts(*corners, MOST_HALVINGS, &mut scratch, &mut parts));
        parts
    }

    fn add_parts(
        &self,
        corners: [DVec3; 3],
        halvings: u32,
        scratch: &mut Scratch,
        result: &mut Vec<(u32, CellMoments)>,
    ) {
        if !self.find_near(corners, halvings, scratch) {
            for half in bisect(corners) {
                self.add_parts(half, halvings - 1, scratch, result);
            }
            return;
        }
        for own in 0..scratch.parts.len() {
            let moments = self.part(corners, own, scratch);
            if moments.area > 0.0 {
                result.push((scratch.parts[own].0, moments));
            }
        }
    }

    /// Fills `parts` with the sites that may have a part of a triangle; false if they are so many that it is
    /// to be halved first, which may be done this many times.
    fn find_near(&self, corners: [DVec3; 3], halvings: u32, scratch: &mut Scratch) -> bool {
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let radius = corners.iter().map(|p| p.distance(middle)).fold(0.0, f64::max);
        scratch.parts.clear();
        let Some(nearest) = self.tree.nearest(middle) else { return true };
        // No site farther away than that is the nearest at any point of the triangle.
        let far = self.sites[nearest as usize].distance(middle);
        let reach = LENIENT * (far + 2.0 * radius);
        let halves_help = halvings > 0 && radius > SMALL * far;
        let most = if halves_help { FEW } else { self.sites.len() };
        if !self.tree.within(middle, reach, most, &mut scratch.near) {
            return false;
        }
        scratch.near.sort_unstable();
        self.drop_dominated(corners, scratch);
        true
    }

    /// Fills `parts` with the near sites, without those that another one is nearer than at all corners.
    fn drop_dominated(&self, corners: [DVec3; 3], scratch: &mut Scratch) {
        let squares = |site: u32| corners.map(|p| p.distance_squared(self.sites[site as usize]));
        scratch.parts.clear();
        scratch.parts.extend(scratch.near.iter().map(|site| (*site, squares(*site))));
        let all = std::mem::take(&mut scratch.parts);
        let nearer = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).all(|(a, b)| a < b);
        let alone = |(_, mine): &&(u32, [f64; 3])| !all.iter().any(|(_, other)| nearer(other, mine));
        scratch.parts.extend(all.iter().filter(alone));
    }

    /// What the bisectors with the others leave to site `own` of the parts.
    fn part(&self, corners: [DVec3; 3], own: usize, scratch: &mut Scratch) -> CellMoments {
        let Scratch { parts, polygon, clipped, .. } = scratch;
        let (site, _) = parts[own];
        let at = self.sites[site as usize];
        polygon.clear();
        polygon.extend(corners.map(|p| p - at));
        for (j, _) in parts.iter().filter(|(j, _)| *j != site) {
            let to_other = self.sites[*j as usize] - at;
            if to_other == DVec3::ZERO {
                if *j < site {
                    polygon.clear();
                }
                continue;
            }
            let half_sq = 0.5 * to_other.length_squared();
            clip(polygon, |p| p.dot(to_other) - half_sq, clipped);
            std::mem::swap(polygon, clipped);
        }
        moments(polygon)
    }
}

/// Both halves of a triangle, cut through the middle of its longest side.
pub(crate) fn bisect([a, b, c]: [DVec3; 3]) -> [[DVec3; 3]; 2] {
    let [ab, bc, ca] = [a.distance_squared(b), b.distance_squared(c), c.distance_squared(a)];
    let [p, q, r] = if ab >= bc && ab >= ca {
        [a, b, c]
    } else if bc >= ca {
        [b, c, a]
    } else {
        [c, a, b]
    };
    let middle = 0.5 * (p + q);
    [[p, middle, r], [middle, q, r]]
}

/// Writes the part of a convex polygon where `beyond` is not positive.
fn clip(polygon: &[DVec3], beyond: impl Fn(DVec3) -> f64, kept: &mut Vec<DVec3>) {
    kept.clear();
    for m in 0..polygon.len() {
        let (p, q) = (polygon[m], polygon[(m + 1) % polygon.len()]);
        let (f, g) = (beyond(p), beyond(q));
        if f <= 0.0 {
            kept.push(p);
        }
        if (f <= 0.0) != (g <= 0.0) {
            kept.push(p.lerp(q, f / (f - g)));
        }
    }
}

/// Of a convex polygon, about the origin.
fn moments(polygon: &[DVec3]) -> CellMoments {
    let mut sum = CellMoments::default();
    let Some((a, rest)) = polygon.split_first() else { return sum };
    for pair in rest.windows(2) {
        let [b, c] = [pair[0], pair[1]];
        let area = area([*a, b, c]);
        let squares = a.length_squared() + b.length_squared() + c.length_squared();
        sum += CellMoments {
            area,
            first: area / 3.0 * (*a + b + c),
            energy: area / 6.0 * (squares + a.dot(b) + b.dot(c) + c.dot(*a)),
        };
    }
    sum
}

/// How evenly sites are spread over a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Energy {
    /// Integral over the mesh of the squared distance to the nearest site, in the fourth power of the mesh's
    /// unit.
    pub energy: f64,
    /// Relative excess over the least possible on a plane of the same area, where all cells are regular
    /// hexagons: 0.02 is 2 %. Sites off a curved mesh can be below 0.
    pub excess: f64,
}

/// The energy of sites on `mesh`.
///
/// # Errors
/// [`crate::Error::Input`] if `mesh` has no extent or a coordinate that is not finite.
pub fn energy(mesh: &TriMesh, sites: &[DVec3]) -> Result<Energy> {
    let frame = UnitFrame::of(mesh)?;
    let unit = |points: &[DVec3]| points.iter().map(|p| frame.to_unit(*p)).collect::<Vec<_>>();
    let (vertices, sites) = (unit(&mesh.vertices), unit(sites));
    let cells =
        RestrictedVoronoi::new(&sites).cells(&TriMesh { vertices, triangles: mesh.triangles.clone() });
    let sum = cells.iter().fold(CellMoments::default(), |mut sum, cell| {
        sum += *cell;
        sum
    });
    let hexagons = 5.0 / (18.0 * 3f64.sqrt()) * sum.area * sum.area / sites.len() as f64;
    Ok(Energy { energy: sum.energy * frame.scale.powi(4), excess: sum.energy / hexagons - 1.0 })
}
