//! k-nearest neighbours by comparing all distances.

use glam::DVec3;

/// For every query the `k` nearest points (fewer if there are fewer), nearest first, ties by index.
pub fn nearest(queries: &[DVec3], points: &[DVec3], k: usize, exclude_self: bool) -> Vec<Vec<u32>> {
    queries
        .iter()
        .enumerate()
        .map(|(q, at)| {
            let mut all: Vec<(f64, u32)> = points
                .iter()
                .zip(0..)
                .filter(|(_, i)| !exclude_self || *i != q as u32)
                .map(|(p, i)| (p.distance_squared(*at), i))
                .collect();
            let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
            if k < all.len() {
                all.select_nth_unstable_by(k, order);
                all.truncate(k);
            }
            all.sort_unstable_by(order);
            all.into_iter().map(|(_, i)| i).collect()
        })
        .collect()
}
