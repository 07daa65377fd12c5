//! Exact connected cells: the part of each site's Voronoi cell on the surface that hangs together with the site.
//!
//! A cell starts in the site's own triangle, cut by the bisectors with the other sites, and goes on across the
//! triangle's edges that are left. A corner between two bisectors (j, k) is the triangle (i, j, k) of the dual, and
//! three cells see it. No tangent plane is involved, so creases, ear tips and rough spots come out as smooth ones do;
//! the price is host time that grows with the surface's triangles.
//!
//! Two figures certify the result: the areas of the cells sum to the surface's, and every corner is seen three times.

use super::connect::Fans;
use crate::mesh::edges::{NO_MATE, half_edge_mates};
use crate::mesh::triangle::closest_on_triangle;
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

/// A site's weight is less than this share of the squared spacing: sites on one circle then have one triangulation,
/// the same in every cell that sees it.
const WEIGHT: f64 = 1e-6;

/// A site whose normal disagrees counts if the surface leads to it within this many spacings.
const REACH: f64 = 2.5;

/// The surface as cells walk over it.
pub struct CellSurface<'a> {
    vertices: &'a [DVec3],
    triangles: &'a [[u32; 3]],
    normals: &'a [DVec3],
    mates: Vec<u32>,
}

/// Sites on the surface.
pub struct CellSites<'a> {
    /// Positions.
    pub positions: &'a [DVec3],
    /// The triangle under each.
    pub triangles: &'a [u32],
    /// Near sites of each, nearest first: entry `slot` of site i at `slot * sites + i`, `u32::MAX` after the last. A cell
    /// that needs more looks at all sites.
    pub near: &'a [u32],
    /// Edge length of a perfect layout.
    pub spacing: f64,
}

/// Cells as fans, with what certifies them.
#[derive(Debug, Clone)]
pub struct ConnectedCells {
    /// Counter-clockwise neighbours of every site.
    pub fans: Fans,
    /// What certifies them.
    pub certificate: Certificate,
}

/// What makes cells right: all zero, and `area` 1 but for rounding.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Certificate {
    /// Sum of the cells' areas relative to the surface's.
    pub area: f64,
    /// Corners that one or two of their three cells do not see.
    pub unshared_corners: usize,
    /// Cells whose boundary is not one closed curve, or meets a neighbour twice.
    pub broken_cells: usize,
}

impl<'a> CellSurface<'a> {
    /// Of a clean mesh with the unit normals of its triangles.
    pub fn new(vertices: &'a [DVec3], triangles: &'a [[u32; 3]], normals: &'a [DVec3]) -> Self {
        Self { vertices, triangles, normals, mates: half_edge_mates(triangles) }
    }

    /// The triangle across a side.
    fn across(&self, t: u32, side: usize) -> Option<u32> {
        Some(self.mates[3 * t as usize + side]).filter(|mate| *mate != NO_MATE).map(|mate| mate / 3)
    }

    fn corners(&self, t: u32) -> [DVec3; 3] {
        self.triangles[t as usize].map(|v| self.vertices[v as usize])
    }
}

/// The cells of all sites.
pub fn connected_cells(surface: &CellSurface, sites: &CellSites) -> ConnectedCells {
    let under = SitesByTriangle::new(surface.triangles.len(), sites.triangles);
    let cells: Vec<Cell> = (0..sites.positions.len() as u32)
        .into_par_iter()
        .map_init(Walk::default, |walk, i| walk.cell(surface, sites, &under, i))
        .collect();
    let whole: f64 =
        surface.triangles.iter().enumerate().map(|(t, _)| area(&surface.corners(t as u32))).sum();
    let mut broken_cells = 0;
    let fans = Fans::from_lists(cells.iter().map(|cell| {
        let (fan, sound) = order(&cell.corners);
        broken_cells += usize::from(!sound);
        fan
    }));
    let certificate = Certificate {
        area: cells.iter().map(|c| c.area).sum::<f64>() / whole,
        unshared_corners: unshared(&cells),
        broken_cells,
    };
    ConnectedCells { fans, certificate }
}

/// One cell: the pairs of sites that meet at its corners, counter-clockwise each, and its area.
struct Cell {
    corners: Vec<[u32; 2]>,
    area: f64,
}

/// What an edge of a clipped triangle lies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Label {
    /// This edge of the triangle.
    Edge(usize),
    /// The bisector with this site.
    Site(u32),
}

/// The sites in each triangle.
struct SitesByTriangle {
    start: Vec<u32>,
    sites: Vec<u32>,
}

impl SitesByTriangle {
    fn new(triangles: usize, site_triangles: &[u32]) -> Self {
        let mut start = vec![0; triangles + 1];
        for t in site_triangles {
            start[*t as usize + 1] += 1;
        }
        for t in 0..triangles {
            start[t + 1] += start[t];
        }
        let mut sites: Vec<u32> = (0..site_triangles.len() as u32).collect();
        sites.sort_by_key(|i| site_triangles[*i as usize]);
        Self { start, sites }
    }

    fn of(&self, t: u32) -> &[u32] {
        &self.sites[self.start[t as usize] as usize..self.start[t as usize + 1] as usize]
    }
}

/// A site that may cut a cell.
struct Candidate {
    distance_sq: f64,
    site: u32,
    /// Whether it counts; found out where it would cut, for it takes a walk over the surface.
    counts: Option<bool>,
}

/// A set of triangles that is emptied in no time.
#[derive(Default)]
struct Marks {
    round: u32,
    of: Vec<u32>,
}

impl Marks {
    fn clear(&mut self, triangles: usize) {
        self.of.resize(triangles, 0);
        self.round += 1;
    }

    /// Whether `t` was not in the set yet.
    fn insert(&mut self, t: u32) -> bool {
        std::mem::replace(&mut self.of[t as usize], self.round) != self.round
    }
}

/// The memory of one thread that walks cells.
#[derive(Default)]
struct Walk {
    /// Sites that may cut the cell, nearest first.
    candidates: Vec<Candidate>,
    /// The sites that the surface leads to nearby, sorted, once somebody asked.
    reached: Option<Vec<u32>>,
    visited: Marks,
    flooded: Marks,
    stack: Vec<u32>,
    polygon: Vec<(DVec3, Label)>,
    clipped: Vec<(DVec3, Label)>,
}

impl Walk {
    fn cell(&mut self, surface: &CellSurface, sites: &CellSites, under: &SitesByTriangle, i: u32) -> Cell {
        let at = sites.positions[i as usize];
        let mut cell = Cell { corners: Vec::new(), area: 0.0 };
        self.reached = None;
        let mut all = self.near_candidates(surface, sites, i);
        self.visited.clear(surface.triangles.len());
        self.stack.clear();
        self.visit(sites.triangles[i as usize]);
        while let Some(t) = self.stack.pop() {
            if !self.clip(surface, sites, under, i, t) && !all {
                self.all_candidates(surface, sites, i);
                all = true;
                self.clip(surface, sites, under, i, t);
            }
            let count = self.polygon.len();
            for m in 0..count {
                let (point, label) = self.polygon[m];
                let (next, _) = self.polygon[(m + 1) % count];
                cell.area += 0.5 * surface.normals[t as usize].dot((point - at).cross(next - at));
                match (self.polygon[(m + count - 1) % count].1, label) {
                    (Label::Site(j), Label::Site(k)) => cell.corners.push([j, k]),
                    (_, Label::Edge(side)) => {
                        if let Some(next) = surface.across(t, side) {
                            self.visit(next);
                        }
                    }
                    _ => {}
                }
            }
        }
        cell
    }

    fn visit(&mut self, t: u32) {
        if self.visited.insert(t) {
            self.stack.push(t);
        }
    }

    /// Leaves in `polygon` what the bisectors leave of a triangle; false if the candidates ended before the radius of
    /// security, so that others may cut it too.
    fn clip(
        &mut self,
        surface: &CellSurface,
        sites: &CellSites,
        under: &SitesByTriangle,
        i: u32,
        t: u32,
    ) -> bool {
        let at = sites.positions[i as usize];
        let farthest = |polygon: &[(DVec3, Label)]| {
            polygon.iter().map(|(p, _)| p.distance_squared(at)).fold(0.0, f64::max)
        };
        let corners = surface.corners(t);
        self.polygon.clear();
        self.polygon.extend((0..3).map(|m| (corners[m], Label::Edge(m))));
        let mut radius_sq = farthest(&self.polygon);
        let weight = |site: u32| WEIGHT * sites.spacing * sites.spacing * unit_hash(site);
        for c in 0..self.candidates.len() {
            let Candidate { distance_sq, site: j, counts } = self.candidates[c];
            // The weights shift a bisector by a hair.
            if distance_sq > 4.01 * radius_sq + 4.0 * WEIGHT * sites.spacing * sites.spacing {
                return true;
            }
            let other = sites.positions[j as usize];
            let (middle, direction) = (0.5 * (at + other), other - at);
            let offset = 0.5 * (weight(i) - weight(j));
            let beyond = |p: DVec3| (p - middle).dot(direction) - offset;
            if counts != Some(false)
                && cut(&self.polygon, beyond, Label::Site(j), &mut self.clipped)
                && self.counts(surface, sites, under, i, c)
            {
                std::mem::swap(&mut self.polygon, &mut self.clipped);
                if self.polygon.is_empty() {
                    return true;
                }
                radius_sq = farthest(&self.polygon);
            }
        }
        self.candidates.len() + 1 >= sites.positions.len()
    }

    /// The sites listed as near; true if that is all there are.
    fn near_candidates(&mut self, surface: &CellSurface, sites: &CellSites, i: u32) -> bool {
        let n = sites.positions.len();
        let listed = sites.near.iter().skip(i as usize).step_by(n).copied().take_while(|j| *j != u32::MAX);
        self.gather(surface, sites, i, listed);
        self.candidates.len() + 1 == n
    }

    fn all_candidates(&mut self, surface: &CellSurface, sites: &CellSites, i: u32) {
        self.gather(surface, sites, i, (0..sites.positions.len() as u32).filter(|j| *j != i));
    }

    /// Those of `from` count that are on the same side of the surface as site i, or that the surface leads to nearby.
    fn gather(&mut self, surface: &CellSurface, sites: &CellSites, i: u32, from: impl Iterator<Item = u32>) {
        let at = sites.positions[i as usize];
        let normal = |site: u32| surface.normals[sites.triangles[site as usize] as usize];
        let mine = normal(i);
        self.candidates.clear();
        self.candidates.extend(from.map(|j| Candidate {
            distance_sq: at.distance_squared(sites.positions[j as usize]),
            site: j,
            counts: (mine.dot(normal(j)) > 0.0).then_some(true),
        }));
        self.candidates
            .sort_unstable_by(|a, b| a.distance_sq.total_cmp(&b.distance_sq).then(a.site.cmp(&b.site)));
    }

    /// Whether candidate `c` of site i counts.
    fn counts(
        &mut self,
        surface: &CellSurface,
        sites: &CellSites,
        under: &SitesByTriangle,
        i: u32,
        c: usize,
    ) -> bool {
        if let Some(known) = self.candidates[c].counts {
            return known;
        }
        let reached = self.reached.take().unwrap_or_else(|| self.flood(surface, sites, under, i));
        let counts = reached.binary_search(&self.candidates[c].site).is_ok();
        self.reached = Some(reached);
        self.candidates[c].counts = Some(counts);
        counts
    }

    /// The sites, sorted, in triangles that hang together with that of site i within [`REACH`] spacings of it.
    fn flood(
        &mut self,
        surface: &CellSurface,
        sites: &CellSites,
        under: &SitesByTriangle,
        i: u32,
    ) -> Vec<u32> {
        let at = sites.positions[i as usize];
        let reach = REACH * sites.spacing;
        self.flooded.clear(surface.triangles.len());
        self.flooded.insert(sites.triangles[i as usize]);
        let mut stack = vec![sites.triangles[i as usize]];
        let mut found = Vec::new();
        while let Some(t) = stack.pop() {
            if closest_on_triangle(at, surface.corners(t)).point.distance(at) > reach {
                continue;
            }
            found.extend_from_slice(under.of(t));
            for next in (0..3).filter_map(|side| surface.across(t, side)) {
                if self.flooded.insert(next) {
                    stack.push(next);
                }
            }
        }
        found.sort_unstable();
        found
    }
}

/// Writes the part of `polygon` where `beyond` is not positive to `result`; false, and nothing written, if that is all
/// of it. The edge of point m runs to point m + 1 and has m's label.
fn cut(
    polygon: &[(DVec3, Label)],
    beyond: impl Fn(DVec3) -> f64,
    label: Label,
    result: &mut Vec<(DVec3, Label)>,
) -> bool {
    if polygon.iter().all(|(p, _)| beyond(*p) <= 0.0) {
        return false;
    }
    result.clear();
    for m in 0..polygon.len() {
        let (p, along) = polygon[m];
        let (q, _) = polygon[(m + 1) % polygon.len()];
        let (f, g) = (beyond(p), beyond(q));
        if f <= 0.0 {
            result.push((p, along));
        }
        if (f <= 0.0) != (g <= 0.0) {
            let crossing = p.lerp(q, f / (f - g));
            result.push((crossing, if f <= 0.0 { label } else { along }));
        }
    }
    true
}

/// The cyclic order of the neighbours, each followed by the one it shares a corner with; false if the corners do not
/// make one cycle, and then the longest stretch there is.
fn order(corners: &[[u32; 2]]) -> (Vec<u32>, bool) {
    let mut left = corners.to_vec();
    left.sort_unstable();
    left.dedup();
    let total = left.len();
    let mut best = Vec::new();
    let mut sound = true;
    while let Some(&[first, _]) =
        left.iter().find(|c| left.iter().all(|d| d[1] != c[0])).or_else(|| left.first())
    {
        let mut fan = vec![first];
        let mut at = first;
        while let Some(place) = left.iter().position(|c| c[0] == at) {
            at = left.remove(place)[1];
            if at == first {
                break;
            }
            sound &= !fan.contains(&at);
            fan.push(at);
        }
        sound &= at == first;
        if fan.len() > best.len() {
            best = fan;
        }
    }
    let sound = sound && best.len() == total && total > 2;
    (best, sound)
}

/// Corners not seen by exactly three cells.
fn unshared(cells: &[Cell]) -> usize {
    let mut corners: Vec<[u32; 3]> = cells
        .iter()
        .enumerate()
        .flat_map(|(i, cell)| cell.corners.iter().map(move |&[j, k]| smallest_first([i as u32, j, k])))
        .collect();
    corners.par_sort_unstable();
    corners.chunk_by(|a, b| a == b).filter(|same| same.len() != 3).count()
}

fn smallest_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

fn area([a, b, c]: &[DVec3; 3]) -> f64 {
    0.5 * (*b - *a).cross(*c - *a).length()
}

/// A fixed number in 0..1 for each index (the finaliser of MurmurHash3).
fn unit_hash(i: u32) -> f64 {
    let mut h = i.wrapping_add(0x9e37_79b9);
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    f64::from(h ^ (h >> 16)) / f64::from(u32::MAX)
}
