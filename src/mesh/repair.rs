//! What is wrong with a mesh in ways that have one obvious answer: duplicates, zero areas, leftovers.

use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};

use glam::DVec3;
use serde::Serialize;

use super::TriMesh;
use crate::{Error, Result};

/// A triangle counts as flat when twice its area is at most this share of its longest edge squared. Edges computed
/// in f64 are exact to about 1e-16, so below some 1e-15 the area is rounding alone; the rest is a margin.
const FLAT: f64 = 1e-14;

/// A mesh after [`repair`], with what was done to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Repaired {
    /// The mesh that is left; vertices and triangles in their old order.
    pub mesh: TriMesh,
    /// Of each triangle that is left, which of the input it was.
    pub origin: Vec<u32>,
    /// How much was changed.
    pub counts: RepairCounts,
}

/// How many vertices and faces [`repair`] took out, by reason.
#[derive(Serialize, Default, Clone, Copy, PartialEq, Debug)]
pub struct RepairCounts {
    /// Vertices at exactly the position of an earlier one, replaced by it.
    pub duplicate_vertices_welded: usize,
    /// Vertices that no face uses, after the faces below were dropped.
    pub unreferenced_vertices_dropped: usize,
    /// Faces with a vertex twice or without an area.
    pub degenerate_faces_dropped: usize,
    /// Faces over the same three vertices as an earlier one, in any order or orientation.
    pub duplicate_faces_dropped: usize,
}

/// Welds vertices at exactly equal positions (-0.0 equals 0.0), then drops faces without an area, repeated faces
/// (the first is kept) and unused vertices. Areas are judged relative to the triangle's own longest edge, so
/// neither size nor position of the mesh matters.
///
/// # Errors
///
/// [`Error::Input`] naming the face or vertex for an index out of range or a coordinate that is not finite;
/// without a place if no face with an area is left.
pub fn repair(mesh: &TriMesh) -> Result<Repaired> {
    check(mesh)?;
    let mut counts = RepairCounts::default();
    let first_there = weld(&mesh.vertices);
    counts.duplicate_vertices_welded = (0..).zip(&first_there).filter(|(own, first)| *own != **first).count();

    let mut seen = HashSet::with_capacity(mesh.triangles.len());
    let mut triangles = Vec::with_capacity(mesh.triangles.len());
    let mut origin = Vec::with_capacity(mesh.triangles.len());
    for (number, triangle) in (0..).zip(&mesh.triangles) {
        let welded = triangle.map(|vertex| first_there[vertex as usize]);
        let mut key = welded;
        key.sort_unstable();
        if is_flat(welded.map(|vertex| mesh.vertices[vertex as usize])) {
            counts.degenerate_faces_dropped += 1;
        } else if seen.insert(key) {
            triangles.push(welded);
            origin.push(number);
        } else {
            counts.duplicate_faces_dropped += 1;
        }
    }
    if triangles.is_empty() {
        return Err(Error::input(None, "the mesh has no faces with an area", "give a surface mesh"));
    }
    let kept = compact(&mesh.vertices, triangles);
    counts.unreferenced_vertices_dropped =
        mesh.vertices.len() - counts.duplicate_vertices_welded - kept.vertices.len();
    Ok(Repaired { mesh: kept, origin, counts })
}

fn check(mesh: &TriMesh) -> Result<()> {
    let count = mesh.vertices.len();
    if u32::try_from(count).map_or(true, |count| count == u32::MAX) {
        let problem = format!("the mesh has {count} vertices, more than the {} possible", u32::MAX - 1);
        return Err(Error::input(None, problem, "split or simplify the mesh first"));
    }
    if let Some(vertex) = mesh.vertices.iter().position(|vertex| !vertex.is_finite()) {
        let place = Some(format!("vertex {vertex}"));
        return Err(Error::input(place, "a coordinate is not finite", "remove or mend the vertex"));
    }
    for (face, triangle) in mesh.triangles.iter().enumerate() {
        if let Some(vertex) = triangle.iter().find(|vertex| **vertex as usize >= count) {
            let problem = format!("there is no vertex {vertex}, the mesh has {count}");
            return Err(Error::input(Some(format!("face {face}")), problem, "mend the face"));
        }
    }
    Ok(())
}

/// For each vertex the first one at the same position.
fn weld(vertices: &[DVec3]) -> Vec<u32> {
    let mut firsts: HashMap<[u64; 3], u32> = HashMap::with_capacity(vertices.len());
    let first_of = |(own, position): (u32, &DVec3)| {
        // Adding zero turns -0.0 into 0.0 and changes nothing else.
        match firsts.entry(position.to_array().map(|value| (value + 0.0).to_bits())) {
            Entry::Occupied(first) => *first.get(),
            Entry::Vacant(free) => *free.insert(own),
        }
    };
    (0..).zip(vertices).map(first_of).collect()
}

fn is_flat(corners: [DVec3; 3]) -> bool {
    let edges = |[a, b, c]: [DVec3; 3]| [b - a, c - b, a - c];
    let largest = |edges: &[DVec3; 3]| edges.iter().map(|edge| edge.abs().max_element()).fold(0.0, f64::max);
    let mut sides = edges(corners);
    if !largest(&sides).is_finite() {
        // Only coordinates near the end of f64's range get here; halving loses nothing there.
        sides = edges(corners.map(|corner| 0.5 * corner));
    }
    let unit = largest(&sides);
    if unit == 0.0 {
        return true;
    }
    // Sides of about 1: their products neither overflow nor vanish, whatever the units of the file.
    let mut sides = sides.map(|side| side / unit);
    sides.sort_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    let [shortest, middle, longest] = sides;
    shortest.cross(middle).length() <= FLAT * longest.length_squared()
}

fn compact(vertices: &[DVec3], mut triangles: Vec<[u32; 3]>) -> TriMesh {
    let mut used = vec![false; vertices.len()];
    for vertex in triangles.as_flattened() {
        used[*vertex as usize] = true;
    }
    let mut kept = Vec::with_capacity(vertices.len());
    let mut renamed = vec![u32::MAX; vertices.len()];
    for (old, position) in vertices.iter().enumerate() {
        if used[old] {
            renamed[old] = kept.len() as u32;
            kept.push(*position);
        }
    }
    for vertex in triangles.as_flattened_mut() {
        *vertex = renamed[*vertex as usize];
    }
    TriMesh { vertices: kept, triangles }
}
