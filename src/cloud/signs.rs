//! Whether given normals agree with each other, as those of programs do not that find them without signs.

use glam::DVec3;
use rayon::prelude::*;

use super::PointCloud;
use super::orient::agreement;
use crate::mesh::kd_tree::KdTree;
use crate::{ProgressToken, Result};

/// Points that are compared with their neighbours, at most.
const SAMPLES: usize = 20_000;
/// Neighbours that each is compared with.
const PAIRS: usize = 8;
/// Pairs less sure than this say nothing, such as those across a sharp edge.
const SURE: f64 = 0.3;
/// Normals disagree if more than this share of the pairs does: then one in 70 points the wrong way. Surfaces
/// suffer from 2 % on.
const SHARE: f64 = 0.03;
/// Of two sheets back to back, opposite points lie in front of each other, each on its own side. Where signs
/// are wrong, half of them do, so that at least this share of the opposite pairs does not.
const CROSSED: f64 = 0.35;
/// Samples between two polls.
const CHUNK: usize = 1 << 9;

/// Pairs of neighbours.
#[derive(Clone, Copy, Default)]
struct Pairs {
    /// With normals that agree.
    agree: usize,
    /// With opposite ones, each point in front of the other.
    apart: usize,
    /// With opposite ones, each point behind the other.
    crossed: usize,
}

/// Whether more of the normals than single ones are opposite to their neighbours', though they are of one
/// sheet. Unknown normals agree with any.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn normals_disagree(cloud: &PointCloud, progress: &ProgressToken) -> Result<bool> {
    let Some(origin) = cloud.points.first() else { return Ok(false) };
    let is_known = |n: &DVec3| n.is_finite() && *n != DVec3::ZERO;
    // If any is unknown, none is used.
    if cloud.normals.is_empty() || !cloud.normals.iter().all(is_known) {
        return Ok(false);
    }
    let points: Vec<DVec3> = cloud.points.iter().map(|p| *p - *origin).collect();
    let tree = KdTree::new(&points);
    let samples: Vec<u32> = (0..points.len() as u32).step_by(points.len().div_ceil(SAMPLES)).collect();
    let chunks = samples.par_chunks(CHUNK).map(|samples| {
        progress.poll()?;
        let (mut pairs, mut found) = (Pairs::default(), Vec::new());
        for own in samples {
            tree.nearest_few(points[*own as usize], PAIRS + 1, &mut found);
            for (_, other) in found.iter().filter(|(_, other)| other != own) {
                pairs.count([*own, *other].map(|i| (points[i as usize], cloud.normals[i as usize])));
            }
        }
        Ok(pairs)
    });
    let Pairs { agree, apart, crossed } = chunks.try_reduce(Pairs::default, |a, b| Ok(a.plus(b)))?;
    // Of pairs with a wrong sign, as many are in front of each other as behind.
    let wrong = 2.0 * crossed as f64;
    Ok(wrong > SHARE * (agree as f64 + wrong) && crossed as f64 > CROSSED * (apart + crossed) as f64)
}

impl Pairs {
    fn count(&mut self, [(p, m), (q, n)]: [(DVec3, DVec3); 2]) {
        let (m, n) = (m.normalize_or_zero(), n.normalize_or_zero());
        let agreement = agreement(p, m, q, n);
        if p == q || agreement.abs() < SURE {
            return;
        }
        if agreement > 0.0 {
            self.agree += 1;
        } else if (p - q).dot(m - n) > 0.0 {
            self.apart += 1;
        } else {
            self.crossed += 1;
        }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            agree: self.agree + other.agree,
            apart: self.apart + other.apart,
            crossed: self.crossed + other.crossed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two plates back to back, `gap` grid steps apart, with outward normals.
    fn plates(gap: f64) -> PointCloud {
        let mut cloud = PointCloud::default();
        for k in 0..2 * 40 * 40 {
            let (x, y, side) = (k % 40, k / 40 % 40, k / 1600);
            let noise = f64::from((k * 7919 + 13) % 101) / 101.0 - 0.5;
            let up = if side == 0 { -1.0 } else { 1.0 };
            cloud.points.push(DVec3::new(f64::from(x) + noise, f64::from(y) - noise, 0.5 * up * gap));
            cloud.normals.push(DVec3::Z * up);
        }
        cloud
    }

    #[test]
    fn thin_plates_are_no_disagreement_but_turned_normals_are() {
        for gap in [0.05, 0.3, 3.0] {
            let mut cloud = plates(gap);
            let disagree = |cloud: &PointCloud| normals_disagree(cloud, &ProgressToken::default()).unwrap();
            assert!(!disagree(&cloud), "{gap}");
            // Single wrong ones are no matter.
            cloud.normals.iter_mut().step_by(400).for_each(|n| *n = -*n);
            assert!(!disagree(&cloud), "{gap}");
            cloud.normals[7] = DVec3::ZERO;
            assert!(!disagree(&cloud), "{gap}");
        }
        let mut cloud = plates(3.0);
        for (k, normal) in cloud.normals.iter_mut().enumerate() {
            if (k * 7919) % 103 < 51 {
                *normal = -*normal;
            }
        }
        assert!(normals_disagree(&cloud, &ProgressToken::default()).unwrap());
    }
}
