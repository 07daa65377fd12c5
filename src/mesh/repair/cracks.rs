//! Cracks: boundaries that lie on each other but for rounding, which are closed, and wider ones, which are
//! found.

use super::boundary::{BoundaryEdge, boundary_edges, vertices_of};
use super::counts::RepairCounts;
use super::{joints, weld};
use crate::TriMesh;
use crate::mesh::bvh::{Aabb, Bvh};
use crate::mesh::half_edges::{EdgeTable, edge_key};
use crate::mesh::kd_tree::KdTree;
use crate::mesh::triangle::closest_on_triangle;
use glam::DVec3;
use std::collections::HashMap;

/// Vertices this close may differ by rounding alone, as a share of the largest coordinate: 32 units in the
/// last of 24 binary digits.
const ROUNDING: f64 = 32.0 * f32::EPSILON as f64;
/// Vertices closer than this share of the shortest edge at them may become one.
const OF_SHORTEST_EDGE: f64 = 0.01;
/// More vertices than this at one place are not a crack.
const MOST_AT_ONE_PLACE: usize = 256;

/// Rounds of closing, which only meshes of many T-joints on each other need.
const ROUNDS: usize = 32;

/// A side of a crack is a boundary edge this close to another, as a fraction of its length.
const NARROW: f64 = 1e-3;
/// The cosine of the angle between the two sides of a crack is at least this.
const PARALLEL: f64 = 0.99;
/// The cosine of the angle between the faces at the two sides of a crack is at most this: the sides of a
/// thin wall are not a crack.
const SAME_SIDE: f64 = 0.9;

/// Boundary edges that lie close to others.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Cracks {
    /// How many they are.
    pub edges: usize,
    /// A [`super::RepairOptions::weld`] that closes them.
    pub weld: f64,
}

/// Closes cracks no wider than rounding: makes one of boundary vertices where that puts two boundary edges on
/// each other, and joins boundary edges to the boundary vertices on them. Returns how far apart they may be,
/// and the edges then.
pub(super) fn close(
    mesh: &mut TriMesh,
    origin: &mut Vec<u32>,
    counts: &mut RepairCounts,
) -> (f64, EdgeTable) {
    let largest = mesh.vertices.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let rounding = ROUNDING * largest;
    // An edge that is joined to vertices may become one with others.
    let mut table = EdgeTable::new(&mesh.triangles);
    for _ in 0..ROUNDS {
        let open = boundary_edges(mesh, &table);
        if open.is_empty() {
            break;
        }
        let before = counts.crack_vertices_welded + counts.edges_joined;
        let to = pairs(mesh, &open, rounding);
        if (0..).zip(&to).any(|(v, to)| v != *to) {
            counts.crack_vertices_welded += weld::merge(mesh, origin, to, Some(&open), counts);
        }
        let reach = reaches(mesh, rounding);
        joints::join(mesh, origin, |v| Some(reach[v as usize]), counts);
        // Faces may be gone even if nothing is closed.
        table = EdgeTable::new(&mesh.triangles);
        if counts.crack_vertices_welded + counts.edges_joined == before {
            break;
        }
    }
    (rounding, table)
}

/// How far off each vertex may be from another that it becomes one with.
fn reaches(mesh: &TriMesh, rounding: f64) -> Vec<f64> {
    let mut reach = vec![rounding; mesh.vertices.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let corners = mesh.corners(t);
        for k in 0..3 {
            let length = OF_SHORTEST_EDGE * corners[k].distance(corners[(k + 1) % 3]);
            for v in [triangle[k], triangle[(k + 1) % 3]] {
                reach[v as usize] = reach[v as usize].min(length);
            }
        }
    }
    reach
}

/// For each vertex the nearest of the earlier ones that stay, if both are on the boundary and close enough;
/// else itself.
fn pairs(mesh: &TriMesh, open: &[BoundaryEdge], rounding: f64) -> Vec<u32> {
    let reach = reaches(mesh, rounding);
    let mut to: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    let boundary = vertices_of(open);
    let points: Vec<DVec3> = boundary.iter().map(|v| mesh.vertices[*v as usize]).collect();
    let tree = KdTree::new(&points);
    let mut near = Vec::new();
    for (v, at) in boundary.iter().zip(&points) {
        if !tree.within(*at, reach[*v as usize], MOST_AT_ONE_PLACE, &mut near) {
            continue;
        }
        let stays = near.iter().map(|place| boundary[*place as usize]).filter(|w| w < v);
        let nearest = stays
            .filter(|w| to[*w as usize] == *w)
            .map(|w| (mesh.vertices[w as usize].distance(*at), w))
            .filter(|(distance, w)| *distance <= reach[*w as usize])
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        if let Some((_, w)) = nearest {
            to[*v as usize] = w;
        }
    }
    to
}

/// For each vertex, whether two boundary edges, one of them at it, become one where vertices go `to` others.
pub(super) fn closing(open: &[BoundaryEdge], to: &[u32]) -> Vec<bool> {
    let welded = |edge: &BoundaryEdge| edge_key(to[edge.from as usize], to[edge.to as usize]);
    let mut sides: HashMap<(u32, u32), u32> = HashMap::new();
    open.iter().for_each(|edge| *sides.entry(welded(edge)).or_default() += 1);
    let mut closes = vec![false; to.len()];
    for edge in open.iter().filter(|edge| sides[&welded(edge)] == 2) {
        closes[edge.from as usize] = true;
        closes[edge.to as usize] = true;
    }
    closes
}

/// The cracks of a repaired mesh that are wider than rounding but much narrower than its edges are long;
/// `None` if there are none.
pub fn cracks(mesh: &TriMesh) -> Option<Cracks> {
    let open = boundary_edges(mesh, &EdgeTable::new(&mesh.triangles));
    // Edges as flat triangles.
    let segments = open.iter().map(|edge| [edge.from, edge.to, edge.to]).collect();
    let bvh = Bvh::new(&TriMesh { vertices: mesh.vertices.clone(), triangles: segments });
    let [low, high] = mesh.bounds()?;
    let mut found = 0;
    let mut widest = 0.0_f64;
    for edge in &open {
        if let Some(width) = width_at(mesh, &open, &bvh, edge) {
            found += 1;
            widest = widest.max(width);
        }
    }
    (found > 0).then(|| Cracks { edges: found, weld: in_one_digit(2.0 * widest / (high - low).length()) })
}

/// The next larger number of one digit.
fn in_one_digit(share: f64) -> f64 {
    let power = share.log10().floor();
    let digit = (share / 10_f64.powf(power)).ceil();
    format!("{digit}e{power}").parse().unwrap_or(share)
}

/// How far a boundary edge is from the other side of the crack that it belongs to, if it does.
fn width_at(mesh: &TriMesh, open: &[BoundaryEdge], bvh: &Bvh, edge: &BoundaryEdge) -> Option<f64> {
    let at = |v: u32| mesh.vertices[v as usize];
    let [a, b] = [edge.from, edge.to].map(at);
    let reach = NARROW * a.distance(b);
    let middle = a.midpoint(b);
    let own = [edge.from, edge.to, edge.apex];
    // From the edge through its face.
    let height = |edge: &BoundaryEdge| {
        let [a, b, apex] = [edge.from, edge.to, edge.apex].map(at);
        (apex - a).reject_from(b - a)
    };
    // Across a face so thin there is another boundary, but no crack.
    if height(edge).length() <= reach {
        return None;
    }
    let inwards = |edge: &BoundaryEdge| height(edge).normalize_or_zero();
    let mut width: Option<f64> = None;
    let bounds = Aabb { min: middle - DVec3::splat(reach), max: middle + DVec3::splat(reach) };
    bvh.overlapping(&bounds, |index| {
        let other = &open[index as usize];
        let [c, d] = [other.from, other.to].map(at);
        // Edges of one face, or of two that share an edge, are no two sides.
        let touches = own.contains(&other.apex) || [other.from, other.to].contains(&edge.apex);
        let nearest = |p: DVec3| closest_on_triangle(p, [c, d, d]).point;
        let is_side = !touches
            && nearest(middle).distance(middle) <= reach
            && (b - a).normalize_or_zero().dot((d - c).normalize_or_zero()).abs() >= PARALLEL
            && inwards(edge).dot(inwards(other)) <= SAME_SIDE;
        if is_side {
            // To the vertex that an end is to be welded to, or else to the edge that it is on.
            let off = |end: DVec3| {
                let to_vertex = end.distance(c).min(end.distance(d));
                if to_vertex <= 4.0 * reach { to_vertex } else { end.distance(nearest(end)) }
            };
            let [one, two] = [a, b].map(off).map(|off| if off <= 4.0 * reach { off } else { 0.0 });
            let own = one.max(two).max(middle.distance(nearest(middle)));
            width = Some(width.map_or(own, |width| width.min(own)));
        }
    });
    width
}
