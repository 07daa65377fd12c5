//! Edge lengths that the user asks for in parts of the surface: where they hold on the repaired mesh, which
//! is divided there as finely as the lengths change.

use super::kept::Kept;
use super::memory::MOST_HALVED;
use super::pinned::WholeEdges;
use super::prepare::submesh_values;
use crate::mesh::NONE;
use crate::mesh::bvh::Bvh;
use crate::mesh::half_edges::{EdgeSet, edge_key, next};
use crate::mesh::repair::Repaired;
use crate::mesh::sizing::{grown, vertices_with};
use crate::mesh::spacing;
use crate::mesh::subdivide::{Halved, halve_edges};
use crate::mesh::submesh::{extract, used_vertices};
use crate::mesh::topology::{Topology, topology};
use crate::mesh::unit_frame::UnitFrame;
use crate::options::{Length, Options, Refinement, Region};
use crate::{Error, ProgressToken, Result, TriMesh};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashSet;
use std::sync::Arc;

/// A point this close to a sphere or box, in diagonals, is in it.
const CLOSE: f64 = 1e-9;
/// Of the vertices asked for, those outside need at least this share.
const LEAST_REST: f64 = 1.0 / 64.0;
/// The mesh is divided for so many vertices at most while their number is not known.
const ROOM: usize = 1 << 20;
/// In regions smaller than their edges, the mesh is divided down to this share of an edge.
const FINEST: f64 = 0.25;
/// A vertex this many edges from the triangles of a region is in it.
const OFF: f64 = 0.1;
/// Fewer edges than this say nothing about the lengths in a region.
const ENOUGH: usize = 30;

/// The lengths on a repaired mesh.
#[derive(Debug, Clone, Default)]
pub(crate) struct Refined {
    /// The length at each vertex of the mesh, in diagonals of its box; infinite where none is asked for.
    /// Empty if there are none at all.
    pub lengths: Vec<f64>,
    /// Lengths that edges must not fall below, next to longer edges that stay whole: likewise, 0 where there
    /// are none.
    pub least: Vec<f64>,
    /// Names of the regions that no part of the mesh is in.
    pub missed: Vec<String>,
    /// Topology of the mesh before it was divided, if it was.
    pub undivided: Option<Topology>,
    /// The regions.
    places: Arc<Vec<Place>>,
    /// The number of the region that each vertex has its length from; [`NONE`] where there is none.
    place_of: Vec<u32>,
}

impl Refined {
    /// What the options ask for. The mesh becomes finer in the regions and around them, and `curves`, edges
    /// by their ends, become the parts of themselves.
    ///
    /// Without a number of `vertices`, this finds out how many there will be.
    ///
    /// # Errors
    /// [`Error::Usage`] if the lengths need more vertices than there will be, [`Error::Cancelled`].
    pub fn new(
        repaired: &mut Repaired,
        (options, vertices): (&Options, Option<usize>),
        (half_edges, whole): ([&mut Vec<u32>; 2], &WholeEdges),
        progress: &ProgressToken,
    ) -> Result<Self> {
        let list = &options.coarse_to_fine.refine;
        if list.is_empty() {
            return Ok(Self::default());
        }
        let scale = UnitFrame::of(&repaired.mesh)?.scale;
        let places: Vec<Place> = list.iter().map(|one| Place::new(one, repaired, scale)).collect();
        let growth = options.coarse_to_fine.growth;
        let size = |a: DVec3, b: DVec3| {
            let reach = 0.5 * a.distance(b);
            let allowed =
                |place: &Place| place.finest + growth * (place.distance(a.midpoint(b)) - reach).max(0.0);
            let allowed = places.iter().map(allowed).fold(f64::INFINITY, f64::min);
            whole.size((a, b), allowed)
        };
        // Found out before edges are halved for it, since that takes long.
        if vertices.is_none() && least_vertices(&places, repaired) >= f64::from(u32::MAX) {
            return Err(too_short());
        }
        let most = repaired.mesh.triangles.len() + MOST_HALVED * vertices.unwrap_or(ROOM);
        let halved = halve_edges(&repaired.mesh, (1.0, &size), most, progress)?;
        let now = halved.as_ref().map_or(&repaired.mesh, |halved| &halved.mesh);
        if 2 * now.triangles.len() > most && is_coarse(now, size) {
            let Some(vertices) = vertices else { return Err(too_short()) };
            let problem = format!("the lengths of `refine` need far more than {vertices} vertices");
            return Err(Error::option("refine", problem, "ask for more vertices, or for longer edges"));
        }
        let undivided = halved.map(|halved| divide(repaired, halved, half_edges));
        let mut place_of = vec![NONE; repaired.mesh.vertices.len()];
        let mut missed = Vec::new();
        let length_of = |place: u32| places.get(place as usize).map_or(f64::INFINITY, |place| place.length);
        for (number, place) in (0..).zip(&places) {
            let inside = place.vertices(repaired);
            if inside.is_empty() {
                missed.push(place.name.clone());
            }
            for v in inside {
                let own = &mut place_of[v as usize];
                *own = if place.length < length_of(*own) { number } else { *own };
            }
        }
        if missed.len() == list.len() {
            return Ok(Self { missed, undivided, ..Self::default() });
        }
        let lengths = place_of.iter().map(|place| length_of(*place) / scale).collect();
        Ok(Self { lengths, missed, undivided, places: Arc::new(places), place_of, ..Self::default() })
    }

    /// The lengths that edges of a mesh with so many `vertices` are to have at its vertices, in diagonals:
    /// those of the regions, from which they grow to the usual one.
    pub fn wanted(&self, mesh: &TriMesh, growth: f64, vertices: usize) -> Result<Vec<f64>> {
        let frame = UnitFrame::of(mesh)?;
        let usual = spacing(mesh.area(), vertices) / frame.scale;
        let unit = mesh.vertices.iter().map(|p| frame.to_unit(*p)).collect();
        let unit = TriMesh { vertices: unit, triangles: mesh.triangles.clone() };
        let own = |length: &f64| if length.is_finite() { *length } else { usual };
        Ok(grown(&unit, self.lengths.iter().map(own).collect(), growth))
    }

    /// Takes the lengths of these vertices, of so many in all, for others.
    pub fn keep_shorter(&mut self, lengths: &[(u32, f64)], count: usize) {
        if !lengths.is_empty() && self.is_empty() {
            (self.lengths, self.place_of) = (vec![f64::INFINITY; count], vec![NONE; count]);
        }
        for (v, length) in lengths {
            let own = &mut self.lengths[*v as usize];
            if length < own {
                (*own, self.place_of[*v as usize]) = (*length, NONE);
            }
        }
    }

    /// What is to be said of the regions that no part of the mesh is in: only what is `kept` is, or nothing.
    pub fn remarks_on_missed(&self, options: &Options, kept: Option<&Kept>) -> Result<Vec<String>> {
        let mut list = Vec::new();
        if self.missed.is_empty() {
            return Ok(list);
        }
        let part = kept.map(Kept::part);
        for one in &options.coarse_to_fine.refine {
            let name = one.region.name();
            if !self.missed.contains(&name) {
                continue;
            }
            let is_in = |part: &Repaired| {
                let scale = UnitFrame::of(&part.mesh)?.scale;
                Ok(!Place::new(one, part, scale).vertices(part).is_empty())
            };
            let is_kept = part.as_ref().map_or(Ok(false), is_in)?;
            let why =
                if is_kept { "all of the surface there is kept" } else { "no part of the surface is there" };
            list.push(format!("`refine` {name} has no effect: {why}"));
        }
        Ok(list)
    }

    /// Keeps what belongs to `part`, which has these triangles of the mesh.
    pub fn keep(&mut self, mesh: &TriMesh, triangles: &[u32], part: &TriMesh) {
        self.lengths = submesh_values(&self.lengths, mesh, triangles, part);
        self.place_of = submesh_values(&self.place_of, mesh, triangles, part);
    }

    /// The lengths times a factor for each region.
    pub fn scaled(&self, factors: &[f64]) -> Vec<f64> {
        let factor = |place: u32| factors.get(place as usize).copied().unwrap_or(1.0);
        self.lengths.iter().zip(&self.place_of).map(|(length, place)| length * factor(*place)).collect()
    }

    /// For each region how much longer than asked for the edges of a mesh are there, whose vertices are in
    /// the units of the input; 1 where there are too few to tell, and where edges are to be longer than
    /// `longest`, since those around keep them short.
    pub fn achieved(&self, mesh: &TriMesh, growth: f64, longest: f64) -> Vec<f64> {
        let place_of = |p: DVec3| {
            let inside = self.places.iter().enumerate().filter(|(_, place)| place.contains(p));
            inside.min_by(|a, b| a.1.length.total_cmp(&b.1.length)).map(|(number, _)| number)
        };
        let of_vertex: Vec<Option<usize>> = mesh.vertices.par_iter().map(|p| place_of(*p)).collect();
        let mut sums = vec![(0.0, 0usize); self.places.len()];
        let corners = mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        for [a, b] in corners {
            let [p, q] = [a, b].map(|v| mesh.vertices[v as usize]);
            let (Some(own), other) = (of_vertex[a as usize], of_vertex[b as usize]) else { continue };
            if other == Some(own) && self.places[own].length < longest {
                let wanted = |place: &Place| place.length + growth * place.distance(p.midpoint(q));
                let wanted = self.places.iter().map(wanted).fold(f64::INFINITY, f64::min);
                let (sum, count) = &mut sums[own];
                (*sum, *count) = (*sum + p.distance(q) / wanted, *count + 1);
            }
        }
        let mean = |&(sum, count): &(f64, usize)| if count < ENOUGH { 1.0 } else { sum / count as f64 };
        sums.iter().map(mean).collect()
    }

    /// Whether no vertex has a length.
    pub fn is_empty(&self) -> bool {
        self.lengths.is_empty()
    }
}

/// Divides the mesh, where lists of half-edges become those of their parts; returns its topology before.
pub(super) fn divide(repaired: &mut Repaired, halved: Halved, half_edges: [&mut Vec<u32>; 2]) -> Topology {
    let undivided = topology(&repaired.mesh);
    let Halved { mesh, origin, halves } = halved;
    let halves = (repaired.mesh.vertices.len() as u32, halves);
    for list in half_edges {
        *list = parts_of(list, &repaired.mesh, &mesh, &halves);
    }
    repaired.origin = origin.iter().map(|t| repaired.origin[*t as usize]).collect();
    repaired.mesh = mesh;
    undivided
}

/// Whether an edge is twice as long as its size allows.
fn is_coarse(mesh: &TriMesh, size: impl Fn(DVec3, DVec3) -> f64) -> bool {
    let is_long = |[a, b]: [DVec3; 2]| size(a, b) > 2.0;
    (0..mesh.triangles.len())
        .map(|t| mesh.corners(t))
        .any(|[a, b, c]| [[a, b], [b, c], [c, a]].into_iter().any(is_long))
}

/// The error that the lengths, or those at kept vertices, take `share` times as many vertices as there are,
/// at least or at most.
pub(crate) fn refuse_share(options: &Options, vertices: usize, share: f64) -> Error {
    let count = vertices as f64 * share;
    if options.coarse_to_fine.refine.is_empty() {
        let (does, size) = if share > 1.0 { ("need", "more") } else { ("leave room for", "fewer") };
        let problem = format!(
            "edges at kept points and boundaries {does} about {count:.0} vertices, and there are {vertices}"
        );
        return Error::option("vertices", problem, format!("ask for {size} vertices"));
    }
    if share > 1.0 {
        let needed = (count * (1.0 + LEAST_REST)).ceil();
        let problem =
            format!("the lengths of `refine` alone need about {needed} vertices, and there are {vertices}");
        return Error::option("refine", problem, "ask for more vertices, or for longer edges");
    }
    let problem =
        format!("the lengths of `refine` leave room for about {count:.0} vertices, and there are {vertices}");
    Error::option("refine", problem, "ask for fewer vertices, or for shorter edges")
}

/// The number of vertices of a mesh whose edges have the length `outside` except where the options' `refine`
/// says otherwise, on the repaired mesh.
///
/// # Errors
/// [`Error::Usage`] for options out of range and more vertices than an index can count; [`Error::Input`] for
/// a mesh without extent.
pub(crate) fn refined_vertices(repaired: &Repaired, options: &Options, outside: Length) -> Result<usize> {
    options.coarse_to_fine.check_ranges()?;
    let mut repaired = repaired.clone();
    let frame = UnitFrame::of(&repaired.mesh)?;
    let refined = Refined::new(
        &mut repaired,
        (options, None),
        ([&mut Vec::new(), &mut Vec::new()], &WholeEdges::default()),
        &ProgressToken::default(),
    )?;
    let outside = outside.share_of(frame.scale);
    let unit = TriMesh {
        vertices: repaired.mesh.vertices.iter().map(|p| frame.to_unit(*p)).collect(),
        triangles: repaired.mesh.triangles,
    };
    let mut lengths = refined.lengths;
    lengths.resize(unit.vertices.len(), f64::INFINITY);
    lengths.iter_mut().filter(|length| length.is_infinite()).for_each(|length| *length = outside);
    let count = vertices_with(&unit, &grown(&unit, lengths, options.coarse_to_fine.growth));
    if count >= f64::from(u32::MAX) {
        let problem = format!("these lengths ask for {count:.3e} vertices, more than an index can count");
        return Err(Error::usage(problem, "ask for longer edges"));
    }
    Ok((count.round() as usize).max(4))
}

fn too_short() -> Error {
    let problem = "the lengths of `refine` are too short: they need millions of vertices";
    Error::option("refine", problem, "give longer ones")
}

/// About how many vertices the triangles that lie within a place need at least.
fn least_vertices(places: &[Place], repaired: &Repaired) -> f64 {
    let needed = |place: &Place| {
        let mut is_in = vec![false; repaired.mesh.vertices.len()];
        place.vertices(repaired).into_iter().for_each(|v| is_in[v as usize] = true);
        let within = repaired.mesh.triangles.iter().enumerate();
        let within = within.filter(|(_, triangle)| triangle.iter().all(|v| is_in[*v as usize]));
        let area: f64 = within.map(|(t, _)| repaired.mesh.triangle_area(t)).sum();
        area * 2.0 / 3f64.sqrt() / place.length.powi(2)
    };
    places.iter().map(needed).fold(0.0, f64::max)
}

/// What is in a region.
#[derive(Debug)]
enum Shape {
    Sphere(DVec3, f64),
    Box(DVec3, DVec3),
    /// Some of the input's triangles, and the tree over them.
    Triangles(HashSet<u32>, Bvh),
}

/// A region with its length, in the units of the mesh.
#[derive(Debug)]
struct Place {
    name: String,
    shape: Shape,
    length: f64,
    /// How long edges of the mesh may be in it.
    finest: f64,
    close: f64,
}

impl Place {
    fn new(one: &Refinement, repaired: &Repaired, scale: f64) -> Self {
        let Refinement { region, length } = one;
        let length = length.share_of(scale) * scale;
        let (shape, extent) = match region {
            Region::Sphere { centre, radius } => (Shape::Sphere(*centre, *radius), *radius),
            Region::Box { low, high } => (Shape::Box(*low, *high), (*high - *low).min_element()),
            Region::Triangles { triangles, .. } => {
                let wanted: HashSet<u32> = triangles.iter().copied().collect();
                let own = (0..).zip(&repaired.origin).filter(|(_, origin)| wanted.contains(origin));
                let part = extract(&repaired.mesh, &own.map(|(t, _)| t).collect::<Vec<u32>>());
                (Shape::Triangles(wanted, Bvh::new(&part)), length)
            }
        };
        let close = match shape {
            // Vertices may leave the surface slightly.
            Shape::Triangles(..) => OFF * length,
            _ => CLOSE * scale,
        };
        let finest = extent.clamp(FINEST * length, length);
        Self { name: region.name(), shape, length, finest, close }
    }

    /// How far a point is from the region; 0 inside.
    fn distance(&self, p: DVec3) -> f64 {
        match &self.shape {
            Shape::Sphere(centre, radius) => (p.distance(*centre) - radius).max(0.0),
            Shape::Box(low, high) => p.distance(p.clamp(*low, *high)),
            Shape::Triangles(_, tree) => {
                tree.closest(p).map_or(f64::INFINITY, |closest| closest.distance_sq.sqrt())
            }
        }
    }

    fn contains(&self, p: DVec3) -> bool {
        self.distance(p) <= self.close
    }

    /// The vertices of the mesh that are in the region, some more than once.
    fn vertices(&self, repaired: &Repaired) -> Vec<u32> {
        let mesh = &repaired.mesh;
        if let Shape::Triangles(wanted, _) = &self.shape {
            let own = mesh.triangles.iter().zip(&repaired.origin);
            return own.filter(|(_, t)| wanted.contains(t)).flat_map(|(corners, _)| *corners).collect();
        }
        // Vertices of no triangle do not count.
        let used = used_vertices(mesh.vertices.len(), &mesh.triangles);
        let within = |reach: f64| -> Vec<u32> {
            let is_in = |v: &u32| used[*v as usize] && self.distance(mesh.vertices[*v as usize]) <= reach;
            (0..mesh.vertices.len() as u32).filter(is_in).collect()
        };
        let found = within(self.close);
        // The surface may run through it between vertices.
        if found.is_empty() { within(self.finest) } else { found }
    }
}

/// Half-edges of a mesh as those of the one that its edges were halved in; `halves` are the ends of the edges
/// that the vertices from `first` on halve.
pub(super) fn parts_of(
    list: &[u32],
    before: &TriMesh,
    after: &TriMesh,
    (first, halves): &(u32, Vec<[u32; 2]>),
) -> Vec<u32> {
    if list.is_empty() {
        return Vec::new();
    }
    let ends = |mesh: &TriMesh, half: u32| {
        let [a, b] = [half, next(half)].map(|corner| mesh.triangles.as_flattened()[corner as usize]);
        edge_key(a, b)
    };
    let mut edges: EdgeSet = list.iter().map(|half| ends(before, *half)).collect();
    for (middle, [a, b]) in (*first..).zip(halves) {
        if edges.contains(&edge_key(*a, *b)) {
            edges.extend([edge_key(*a, middle), edge_key(middle, *b)]);
        }
    }
    (0..3 * after.triangles.len() as u32).filter(|half| edges.contains(&ends(after, *half))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::repair::repair;
    use crate::mesh::samples::sample;

    fn refined(repaired: &mut Repaired, refine: Vec<Refinement>, half_edges: &mut Vec<u32>) -> Refined {
        let options = Options::new(5000).refine(refine);
        let progress = ProgressToken::default();
        let half_edges = ([half_edges, &mut Vec::new()], &WholeEdges::default());
        Refined::new(repaired, (&options, Some(5000)), half_edges, &progress).unwrap()
    }

    #[test]
    fn a_coarse_mesh_becomes_finer_in_a_region_and_edges_keep_their_parts() {
        let mesh = sample("box").unwrap();
        let mut repaired = repair(&mesh).unwrap();
        let edge = |mesh: &TriMesh, half: u32| {
            [half, next(half)]
                .map(|corner| mesh.vertices[mesh.triangles.as_flattened()[corner as usize] as usize])
        };
        // An edge of the box that ends in the region.
        let at = mesh.vertices[7];
        let is_wanted = |half: &u32| edge(&mesh, *half)[0] == at && edge(&mesh, *half)[1].distance(at) == 1.0;
        let wanted = (0..36).find(is_wanted).unwrap();
        let ends = edge(&mesh, wanted);
        let mut half_edges = vec![wanted];
        let sphere = Region::Sphere { centre: at, radius: 0.1 };
        let one = Refinement { region: sphere, length: Length::Units(0.02) };
        let found = refined(&mut repaired, vec![one], &mut half_edges);
        assert!(found.missed.is_empty() && found.undivided.unwrap().vertices == 8);
        let inside = |v: usize| repaired.mesh.vertices[v].distance(at) <= 0.1;
        let scale = 3f64.sqrt();
        assert_eq!(found.lengths.len(), repaired.mesh.vertices.len());
        for (v, length) in found.lengths.iter().enumerate() {
            assert_eq!(length.is_finite(), inside(v), "{v}");
            assert!(!inside(v) || (length * scale - 0.02).abs() < 1e-12);
        }
        assert!((repaired.mesh.area() / mesh.area() - 1.0).abs() < 1e-12);
        for (t, origin) in repaired.origin.iter().enumerate() {
            let (own, theirs) = (repaired.mesh.doubled_normal(t), mesh.doubled_normal(*origin as usize));
            assert!(own.normalize().dot(theirs.normalize()) > 1.0 - 1e-9, "{t} is not a part of {origin}");
        }
        // Both sides of the whole edge.
        let parts = half_edges.iter().map(|half| edge(&repaired.mesh, *half));
        assert!((parts.clone().map(|[a, b]| a.distance(b)).sum::<f64>() - 2.0).abs() < 1e-12);
        let off = |p: DVec3| p.distance(ends[0]) + p.distance(ends[1]) - 1.0;
        assert!(half_edges.len() > 4 && parts.flatten().all(|p| off(p).abs() < 1e-12));
    }

    #[test]
    fn the_shortest_length_counts_and_regions_elsewhere_are_named() {
        let mesh = sample("torus").unwrap();
        let mut repaired = repair(&mesh).unwrap();
        let length = |units: f64| Length::Units(units);
        let all = Region::Box { low: DVec3::splat(-9.0), high: DVec3::splat(9.0) };
        let half = Region::Box { low: DVec3::splat(-9.0), high: DVec3::new(0.0, 9.0, 9.0) };
        let far = Region::Sphere { centre: DVec3::splat(9.0), radius: 1.0 };
        let list = [(half, 0.3), (all, 0.5), (far, 0.1)];
        let list = list.map(|(region, units)| Refinement { region, length: length(units) });
        let found = refined(&mut repaired, list.to_vec(), &mut Vec::new());
        assert_eq!(found.missed, ["sphere:9,9,9,1"]);
        let scale = UnitFrame::of(&repaired.mesh).unwrap().scale;
        for (p, length) in repaired.mesh.vertices.iter().zip(&found.lengths) {
            let wanted = if p.x <= 0.0 { 0.3 } else { 0.5 };
            assert!((length * scale - wanted).abs() < 1e-9, "{p}: {length}");
        }
        let doubled = found.scaled(&[2.0]);
        let is_doubled = doubled.iter().zip(&found.lengths).filter(|(two, one)| **two == 2.0 * **one).count();
        assert_eq!(is_doubled, repaired.mesh.vertices.iter().filter(|p| p.x <= 0.0).count());
    }
}
