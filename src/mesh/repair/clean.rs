//! Drops faces without an area and repeated faces.

use std::collections::hash_map::Entry;

use glam::DVec3;

use super::counts::RepairCounts;
use crate::TriMesh;
use crate::mesh::quick_hash::QuickMap;

/// A triangle counts as flat when twice its area is at most this share of its longest edge squared. Edges
/// computed in f64 are exact to about 1e-16, so below some 1e-15 the area is rounding alone; the rest is a
/// margin.
const FLAT: f64 = 1e-14;

/// What [`clean`] leaves.
pub(super) struct Cleaned {
    pub triangles: Vec<[u32; 3]>,
    /// The number that each had.
    pub origin: Vec<u32>,
    /// The vertices of those dropped as flat.
    pub flat: Vec<u32>,
}

/// The triangles with other vertices for theirs, without those that are flat or repeat an earlier one.
pub(super) fn clean(mesh: &TriMesh, vertex: impl Fn(u32) -> u32, counts: &mut RepairCounts) -> Cleaned {
    let mut flat = Vec::new();
    // Of the faces so far, whether their vertices run as the sorted ones do.
    let mut seen: QuickMap<[u32; 3], bool> = QuickMap::default();
    seen.reserve(mesh.triangles.len());
    let mut triangles = Vec::with_capacity(mesh.triangles.len());
    let mut origin = Vec::with_capacity(mesh.triangles.len());
    for (number, triangle) in (0..).zip(&mesh.triangles) {
        let welded = triangle.map(&vertex);
        let mut key = welded;
        key.sort_unstable();
        if is_flat(welded.map(|vertex| mesh.vertices[vertex as usize])) {
            counts.degenerate_faces_removed += 1;
            flat.extend(welded);
            continue;
        }
        let runs_up = [[0, 1, 2], [1, 2, 0], [2, 0, 1]].iter().any(|turn| turn.map(|k| welded[k]) == key);
        match seen.entry(key) {
            Entry::Vacant(free) => {
                free.insert(runs_up);
                triangles.push(welded);
                origin.push(number);
            }
            Entry::Occupied(first) if *first.get() != runs_up => counts.opposite_faces_merged += 1,
            Entry::Occupied(_) => counts.duplicate_faces_removed += 1,
        }
    }
    Cleaned { triangles, origin, flat }
}

/// Whether a triangle with these corners is dropped for want of an area.
pub(crate) fn is_flat(corners: [DVec3; 3]) -> bool {
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
