//! Whether given normals agree with each other, as those of programs do not that find them without signs.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::PointCloud;
use super::orient::agreement;
use crate::mesh::half_edges::edge_key;
use crate::mesh::kd_tree::KdTree;
use crate::mesh::topology::Partition;
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
/// An area counts if it has at least this share of the samples.
const AREA: f64 = 0.005;
/// Pairs at least as sure join samples to areas.
const JOINS: f64 = 0.6;
/// Samples between two polls.
const CHUNK: usize = 1 << 9;

/// Two points that are near each other and surely agree or do not.
#[derive(Clone, Copy)]
struct NearPair {
    ends: [u32; 2],
    /// See [`agreement`].
    agreement: f64,
    /// Whether each is in front of the other.
    is_apart: bool,
}

/// Numbers of pairs of neighbours.
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
    let samples: Vec<u32> = (0..points.len() as u32).step_by(points.len().div_ceil(SAMPLES)).collect();
    let near = near_pairs(&points, &cloud.normals, &samples, progress)?;
    let mut all = Pairs::default();
    near.iter().for_each(|pair| all.count(pair));
    // Of pairs with a wrong sign, as many are in front of each other as behind.
    let wrong = 2.0 * all.crossed as f64;
    if wrong > SHARE * (all.agree as f64 + wrong) && all.are_of_one_sheet() {
        return Ok(true);
    }
    if samples.len() == points.len() {
        return Ok(areas_disagree(points.len(), &near));
    }
    let of = |list: &[DVec3]| samples.iter().map(|i| list[*i as usize]).collect::<Vec<DVec3>>();
    let numbers: Vec<u32> = (0..samples.len() as u32).collect();
    let near = near_pairs(&of(&points), &of(&cloud.normals), &numbers, progress)?;
    Ok(areas_disagree(samples.len(), &near))
}

/// The samples with their nearest points, as far as they say anything.
fn near_pairs(
    points: &[DVec3],
    normals: &[DVec3],
    samples: &[u32],
    progress: &ProgressToken,
) -> Result<Vec<NearPair>> {
    let tree = KdTree::new(points);
    let at = |i: u32| (points[i as usize], normals[i as usize].normalize_or_zero());
    let chunks = samples.par_chunks(CHUNK).map(|samples| {
        progress.poll()?;
        let (mut pairs, mut found) = (Vec::new(), Vec::new());
        for own in samples {
            tree.nearest_few(points[*own as usize], PAIRS + 1, &mut found);
            for (_, other) in found.iter().filter(|(_, other)| other != own) {
                let ((p, m), (q, n)) = (at(*own), at(*other));
                let agreement = agreement(p, m, q, n);
                if p != q && agreement.abs() >= SURE {
                    let is_apart = (p - q).dot(m - n) > 0.0;
                    pairs.push(NearPair { ends: [*own, *other], agreement, is_apart });
                }
            }
        }
        Ok(pairs)
    });
    let chunks: Vec<Vec<NearPair>> = chunks.collect::<Result<_>>()?;
    Ok(chunks.concat())
}

/// Whether the normals of a whole area are opposite to those around it: few pairs tell, those along its rim.
fn areas_disagree(samples: usize, near: &[NearPair]) -> bool {
    let mut areas = Partition::new(samples);
    near.iter()
        .filter(|pair| pair.agreement >= JOINS)
        .for_each(|pair| areas.join(pair.ends[0], pair.ends[1]));
    let mut sizes = vec![0_usize; samples];
    (0..samples as u32).for_each(|i| sizes[areas.root(i) as usize] += 1);
    let mut rims: HashMap<(u32, u32), Pairs> = HashMap::new();
    for pair in near {
        let [a, b] = pair.ends.map(|i| areas.root(i));
        if a != b {
            rims.entry(edge_key(a, b)).or_default().count(pair);
        }
    }
    rims.into_iter().any(|((a, b), pairs)| {
        let smaller = sizes[a as usize].min(sizes[b as usize]) as f64;
        // A round area has several times as many pairs along its rim.
        let is_rim = pairs.crossed as f64 >= smaller.sqrt() && pairs.crossed > pairs.agree;
        smaller >= AREA * samples as f64 && is_rim && pairs.are_of_one_sheet()
    })
}

impl Pairs {
    fn count(&mut self, pair: &NearPair) {
        match (pair.agreement > 0.0, pair.is_apart) {
            (true, _) => self.agree += 1,
            (false, true) => self.apart += 1,
            (false, false) => self.crossed += 1,
        }
    }

    /// Whether the opposite ones are not of two sheets back to back.
    fn are_of_one_sheet(self) -> bool {
        self.crossed as f64 > CROSSED * (self.apart + self.crossed) as f64
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

    /// A ball with outward normals, turned where `turns` holds.
    fn ball(turns: impl Fn(DVec3) -> bool) -> PointCloud {
        let mut cloud = PointCloud::default();
        for k in 0..8000 {
            let (z, angle) = (1.0 - (2.0 * f64::from(k) + 1.0) / 8000.0, 2.4 * f64::from(k));
            let (sin, cos) = angle.sin_cos();
            let p = DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
            cloud.points.push(3.0 * p);
            cloud.normals.push(if turns(p) { -p } else { p });
        }
        cloud
    }

    #[test]
    fn a_turned_area_is_found_by_its_rim() {
        let disagree = |cloud: &PointCloud| normals_disagree(cloud, &ProgressToken::default()).unwrap();
        assert!(!disagree(&ball(|_| false)));
        // All inward normals agree.
        assert!(!disagree(&ball(|_| true)));
        for (what, least) in [("half", 0.0), ("a twentieth", 0.9), ("a fiftieth", 0.96)] {
            assert!(disagree(&ball(|p| p.x > least)), "{what}");
        }
        // As they are where all are to look at a camera.
        assert!(disagree(&ball(|p| p.dot(DVec3::Z) < 0.3)));
    }
}
