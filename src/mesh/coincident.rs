//! Vertices of different parts of a surface that are at exactly the same place.

use std::collections::HashMap;

use glam::DVec3;

use super::quick_hash::QuickMap;
use super::{TriMesh, position_key};

/// How far a vertex moves towards the mean of its neighbours, as a share of the distance: more than what
/// 32-bit coordinates round to on meshes of up to some million vertices, and less than anybody sees.
const STEP: f64 = 1e-4;

/// Moves all but the first of the vertices at one place towards their neighbours by a little: readers weld
/// vertices at the same place, and parts of a surface that only touch would become one. Returns how many
/// moved.
pub(crate) fn separate_coincident(mesh: &mut TriMesh) -> usize {
    let mut first: QuickMap<[u64; 3], u32> = QuickMap::default();
    first.reserve(mesh.vertices.len());
    let later: Vec<u32> = (0..)
        .zip(&mesh.vertices)
        .filter(|(v, p)| *first.entry(position_key(**p)).or_insert(*v) != *v)
        .map(|(v, _)| v)
        .collect();
    if later.is_empty() {
        return 0;
    }
    let mut sums: HashMap<u32, (DVec3, f64)> = later.iter().map(|v| (*v, (DVec3::ZERO, 0.0))).collect();
    for triangle in &mesh.triangles {
        for (k, v) in triangle.iter().enumerate() {
            if let Some((sum, count)) = sums.get_mut(v) {
                for other in [triangle[(k + 1) % 3], triangle[(k + 2) % 3]] {
                    *sum += mesh.vertices[other as usize];
                    *count += 1.0;
                }
            }
        }
    }
    let mut moved = 0;
    for v in later {
        let (sum, count) = sums[&v];
        let here = mesh.vertices[v as usize];
        // A vertex without triangles is nobody's.
        let to = if count > 0.0 { here.lerp(sum / count, STEP) } else { here };
        moved += usize::from(to != here);
        mesh.vertices[v as usize] = to;
    }
    moved
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;
    use crate::mesh::submesh::append;

    #[test]
    fn vertices_at_one_place_part_by_little_and_others_stay() {
        let cube = sample("box").unwrap();
        let mut both = cube.clone();
        let mut beside = cube.clone();
        beside.vertices.iter_mut().for_each(|v| *v += DVec3::X);
        append(&mut both, &beside);
        // Not part of any triangle.
        both.vertices.push(DVec3::ZERO);
        let before = both.clone();
        assert_eq!(separate_coincident(&mut both), 4);
        assert_eq!(both.vertices[..8], before.vertices[..8]);
        let moves = both.vertices.iter().zip(&before.vertices).map(|(a, b)| a.distance(*b));
        let moves: Vec<f64> = moves.filter(|distance| *distance > 0.0).collect();
        assert!(moves.len() == 4 && moves.iter().all(|m| (1e-6..1e-3).contains(m)), "{moves:?}");
        let once = both.clone();
        assert_eq!((separate_coincident(&mut both), both), (0, once));
    }
}
