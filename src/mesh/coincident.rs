//! Vertices of different parts of a surface that are at exactly the same place.

use std::collections::HashMap;
use std::hash::{BuildHasher, BuildHasherDefault};
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::chunks::CHUNK;
use super::quick_hash::{QuickHasher, QuickMap};
use super::{TriMesh, position_key};

/// How far a vertex moves towards the mean of its neighbours, as a share of the distance: more than what
/// 32-bit coordinates round to on meshes of up to some million vertices, and less than anybody sees.
const STEP: f64 = 1e-4;

/// Bits for each point, so that few share theirs.
const BITS_PER_POINT: usize = 16;

/// Moves all but the first of the vertices at one place towards their neighbours by a little: readers weld
/// vertices at the same place, and parts of a surface that only touch would become one. Returns how many
/// moved.
pub(crate) fn separate_coincident(mesh: &mut TriMesh) -> usize {
    let later = later_at_a_place(&mesh.vertices);
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

/// Whether some points are at one place.
pub(crate) fn has_coincident(points: &[DVec3]) -> bool {
    !later_at_a_place(points).is_empty()
}

/// The points at the place of one before them, in ascending order.
fn later_at_a_place(points: &[DVec3]) -> Vec<u32> {
    // A table of all positions does not fit in the caches. One of some bits each does, and most points share
    // theirs with no other.
    let bits = (BITS_PER_POINT * points.len()).next_power_of_two();
    let hasher = BuildHasherDefault::<QuickHasher>::default();
    let bit_of = |p: &DVec3| hasher.hash_one(position_key(*p)) as usize & (bits - 1);
    let seen: Vec<[AtomicU64; 2]> = (0..bits.div_ceil(64)).map(|_| Default::default()).collect();
    points.par_iter().with_min_len(CHUNK).for_each(|p| {
        let bit = bit_of(p);
        let ([once, twice], mask) = (&seen[bit / 64], 1 << (bit % 64));
        // Whichever of two threads is the second sees the bit of the first.
        if once.fetch_or(mask, Ordering::Relaxed) & mask != 0 {
            twice.fetch_or(mask, Ordering::Relaxed);
        }
    });
    let is_shared = |v: &u32| {
        let bit = bit_of(&points[*v as usize]);
        seen[bit / 64][1].load(Ordering::Relaxed) >> (bit % 64) & 1 != 0
    };
    let sharing = (0..points.len() as u32).into_par_iter().with_min_len(CHUNK).filter(is_shared);
    let mut sharing: Vec<u32> = sharing.collect();
    let mut first: QuickMap<[u64; 3], u32> = QuickMap::default();
    sharing.retain(|v| *first.entry(position_key(points[*v as usize])).or_insert(*v) != *v);
    sharing
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;
    use crate::mesh::submesh::append;

    #[test]
    fn the_first_at_a_place_is_not_among_the_later_ones() {
        // Two by two, and the last in the place of all zeros, however they are signed.
        let at = |k: u32| DVec3::new(f64::from(k / 2), 0.0, -0.0);
        let mut points: Vec<DVec3> = (0..2001).map(at).collect();
        points.push(DVec3::new(-0.0, 0.0, 0.0));
        let wanted: Vec<u32> = (0..1000).map(|k| 2 * k + 1).chain([2001]).collect();
        assert_eq!(later_at_a_place(&points), wanted);
        assert!(later_at_a_place(&[]).is_empty());
    }

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
