//! Subdivision by halving long edges; the surface stays the same.

use super::TriMesh;
use super::half_edges::{EdgeTable, edge_key};
use super::triangle::doubled_normal;
use crate::{ProgressToken, Result};
use glam::DVec3;
use std::collections::HashMap;

/// A mesh with some of its edges halved. Vertices and the triangles without such edges keep their places; new
/// ones follow.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Halved {
    /// The mesh.
    pub mesh: TriMesh,
    /// For each triangle, the one that it is a part of.
    pub origin: Vec<u32>,
    /// For each new vertex the ends of the edge that it halves, which may itself be half of another.
    pub halves: Vec<[u32; 2]>,
}

/// Halves all edges longer than `length`, which is above 0, again and again, in the triangles on both sides
/// alike; `None` if there are no such edges. The longest go first. Edges stay as they are once there would be
/// more than `most` triangles, or if their middle, rounded, is one of their ends.
///
/// Vertices and the triangles without such edges keep their places; new ones follow.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub fn halve_long_edges(
    mesh: &TriMesh,
    length: f64,
    most: usize,
    progress: &ProgressToken,
) -> Result<Option<TriMesh>> {
    let halved = halve_edges(mesh, (length, DVec3::distance), most, progress)?;
    Ok(halved.map(|halved| halved.mesh))
}

/// Like [`halve_long_edges`], for all edges whose `size`, a function of their ends, is above a `limit`.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub fn halve_edges(
    mesh: &TriMesh,
    (limit, size): (f64, impl Fn(DVec3, DVec3) -> f64),
    most: usize,
    progress: &ProgressToken,
) -> Result<Option<Halved>> {
    let mut halved: Option<Halved> = None;
    loop {
        progress.poll()?;
        let now = halved.as_ref().map_or(mesh, |halved| &halved.mesh);
        let Some(next) = halve_once(now, limit, &size, most) else { return Ok(halved) };
        halved = Some(match halved {
            None => next,
            Some(mut before) => {
                before.halves.extend(next.halves);
                let origin = next.origin.iter().map(|t| before.origin[*t as usize]).collect();
                Halved { mesh: next.mesh, origin, halves: before.halves }
            }
        });
    }
}

/// About how many triangles [`halve_long_edges`] makes, if there is room.
pub fn halved_count(mesh: &TriMesh, length: f64) -> f64 {
    let parts = |size: f64| (size / length).log2().ceil().exp2();
    let of = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        if longest <= length {
            return 1.0;
        }
        // Of an equilateral triangle the side, and of a sliver, which is cut across, next to nothing.
        let across = doubled_normal([a, b, c]).length() / longest * 2.0 / 3_f64.sqrt();
        parts(longest) * parts(across).max(2.0)
    };
    (0..mesh.triangles.len()).map(of).sum()
}

/// Halves every edge whose size is above the limit and above half of the largest.
fn halve_once(
    mesh: &TriMesh,
    limit: f64,
    size: &impl Fn(DVec3, DVec3) -> f64,
    most: usize,
) -> Option<Halved> {
    let table = EdgeTable::new(&mesh.triangles);
    let at = |v: u32| mesh.vertices[v as usize];
    let size = |(a, b): (u32, u32)| {
        let has_middle = ![at(a), at(b)].contains(&at(a).midpoint(at(b)));
        if has_middle { size(at(a), at(b)) } else { 0.0 }
    };
    let largest = table.edges().map(|sides| size(sides[0].ends())).fold(0.0, f64::max);
    let from = limit.max(0.5 * largest);
    let mut vertices = mesh.vertices.clone();
    let mut middles = HashMap::new();
    let mut halves = Vec::new();
    let mut count = mesh.triangles.len();
    for sides in table.edges() {
        let (a, b) = sides[0].ends();
        if size((a, b)) > from {
            middles.insert((a, b), vertices.len() as u32);
            vertices.push(at(a).midpoint(at(b)));
            halves.push([a, b]);
            count += sides.len();
        }
    }
    if middles.is_empty() || count > most {
        return None;
    }
    let mut triangles = mesh.triangles.clone();
    let mut origin: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let middle = |k: usize| middles.get(&edge_key(corners[k], corners[(k + 1) % 3])).copied();
        let mut parts = parts(*corners, [0, 1, 2].map(middle), |a, b| {
            vertices[a as usize].distance_squared(vertices[b as usize])
        });
        triangles[t] = parts.next().unwrap_or(*corners);
        triangles.extend(parts);
        origin.resize(triangles.len(), t as u32);
    }
    Some(Halved { mesh: TriMesh { vertices, triangles }, origin, halves })
}

/// The parts of a triangle with vertices in the middle of some of its sides, that of side k between corners k
/// and k + 1.
fn parts(
    [a, b, c]: [u32; 3],
    middles: [Option<u32>; 3],
    distance: impl Fn(u32, u32) -> f64,
) -> impl Iterator<Item = [u32; 3]> {
    // Three and a rest, or fewer.
    let none = [u32::MAX; 3];
    let two = |[a, b, c]: [u32; 3], ab: u32, bc: u32| {
        if distance(ab, c) < distance(a, bc) {
            [[ab, b, bc], [a, ab, c], [ab, bc, c], none]
        } else {
            [[ab, b, bc], [a, ab, bc], [a, bc, c], none]
        }
    };
    let one = |[a, b, c]: [u32; 3], ab: u32| [[a, ab, c], [ab, b, c], none, none];
    let parts = match middles {
        [None, None, None] => [[a, b, c], none, none, none],
        [Some(ab), None, None] => one([a, b, c], ab),
        [None, Some(bc), None] => one([b, c, a], bc),
        [None, None, Some(ca)] => one([c, a, b], ca),
        [Some(ab), Some(bc), None] => two([a, b, c], ab, bc),
        [None, Some(bc), Some(ca)] => two([b, c, a], bc, ca),
        [Some(ab), None, Some(ca)] => two([c, a, b], ca, ab),
        [Some(ab), Some(bc), Some(ca)] => [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]],
    };
    parts.into_iter().filter(move |part| *part != none)
}
