//! Morton order: neighbours in space become neighbours in memory.

use crate::mesh::chunks::CHUNK;
use glam::DVec3;
use rayon::prelude::*;

/// Indices of `points` in Morton order of the unit-diagonal frame; ties by index.
pub(crate) fn morton_order(points: &[DVec3]) -> Vec<u32> {
    sort_order(&points.par_iter().with_min_len(CHUNK).map(|p| morton_code(*p)).collect::<Vec<_>>())
}

/// Indices in ascending order of their keys, ties by index.
pub(crate) fn sort_order(keys: &[u64]) -> Vec<u32> {
    let keyed = keys.par_iter().with_min_len(CHUNK).enumerate().map(|(i, key)| (*key, i as u32));
    let mut keyed: Vec<(u64, u32)> = keyed.collect();
    keyed.par_sort_unstable();
    keyed.into_par_iter().with_min_len(CHUNK).map(|(_, i)| i).collect()
}

/// 20 bits an axis over the cube of edge 2 around the origin, more than the unit-diagonal frame needs.
pub(crate) fn morton_code(p: DVec3) -> u64 {
    let cell = |x: f64| spread(((x + 1.0).clamp(0.0, 2.0) * f64::from((1_u32 << 19) - 1)) as u64);
    cell(p.x) | cell(p.y) << 1 | cell(p.z) << 2
}

/// Puts two zero bits after each of the low 21 bits.
fn spread(x: u64) -> u64 {
    let mut x = x & 0x1f_ffff;
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_interleave_the_axes() {
        assert_eq!(spread(0b111), 0b1_001_001);
        let low = morton_code(DVec3::splat(-1.0));
        assert_eq!(low, 0);
        assert!(morton_code(DVec3::new(-1.0, -1.0, 1.0)) > morton_code(DVec3::new(1.0, 1.0, -0.01)));
    }

    #[test]
    fn near_points_come_together() {
        let points: Vec<_> = (0..64)
            .map(|i| DVec3::new(if i % 2 == 0 { -0.4 } else { 0.4 }, 1e-3 * f64::from(i), 0.0))
            .collect();
        let order = morton_order(&points);
        assert!(order[..32].iter().all(|i| i % 2 == 0), "one side first: {order:?}");
    }
}
