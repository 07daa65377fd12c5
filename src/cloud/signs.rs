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
/// Two areas disagree if at least this many times the root of the samples in the smaller one are opposite to
/// samples of the other: about half of those along the rim of a round one.
const RIM: f64 = 1.0;
/// And if the smaller one has at least this share of the samples.
const AREA: f64 = 0.005;
/// Pairs at least as sure join samples to areas.
const JOINS: f64 = 0.6;
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
    let pairs = chunks.try_reduce(Pairs::default, |a, b| Ok(a.plus(b)))?;
    // Of pairs with a wrong sign, as many are in front of each other as behind.
    let wrong = 2.0 * pairs.crossed as f64;
    if wrong > SHARE * (pairs.agree as f64 + wrong) && pairs.are_of_one_sheet() {
        return Ok(true);
    }
    let of = |list: &[DVec3]| samples.iter().map(|i| list[*i as usize]).collect::<Vec<DVec3>>();
    areas_disagree(&of(&points), &of(&cloud.normals), progress)
}

/// Whether the normals of a whole area are opposite to those around it: few pairs tell, those along its rim.
fn areas_disagree(points: &[DVec3], normals: &[DVec3], progress: &ProgressToken) -> Result<bool> {
    let tree = KdTree::new(points);
    let all: Vec<u32> = (0..points.len() as u32).collect();
    let near = all.par_chunks(CHUNK).map(|samples| {
        progress.poll()?;
        let (mut pairs, mut found) = (Vec::new(), Vec::new());
        for own in samples {
            tree.nearest_few(points[*own as usize], PAIRS + 1, &mut found);
            for (_, other) in found.iter().filter(|(_, other)| other != own) {
                let [(p, m), (q, n)] =
                    [*own, *other].map(|i| (points[i as usize], normals[i as usize].normalize_or_zero()));
                let sure = agreement(p, m, q, n);
                if p != q && sure.abs() >= SURE {
                    pairs.push((*own, *other, sure, (p - q).dot(m - n) > 0.0));
                }
            }
        }
        Ok(pairs)
    });
    let near: Vec<Vec<(u32, u32, f64, bool)>> = near.collect::<Result<_>>()?;
    let mut areas = Partition::new(points.len());
    let pairs = || near.iter().flatten();
    pairs().filter(|(_, _, sure, _)| *sure >= JOINS).for_each(|(a, b, ..)| areas.join(*a, *b));
    let mut sizes = vec![0_usize; points.len()];
    all.iter().for_each(|i| sizes[areas.root(*i) as usize] += 1);
    let mut rims: HashMap<(u32, u32), Pairs> = HashMap::new();
    for (a, b, sure, is_apart) in pairs() {
        let between = edge_key(areas.root(*a), areas.root(*b));
        if between.0 != between.1 {
            let count = rims.entry(between).or_default();
            match (*sure > 0.0, is_apart) {
                (true, _) => count.agree += 1,
                (false, true) => count.apart += 1,
                (false, false) => count.crossed += 1,
            }
        }
    }
    Ok(rims.into_iter().any(|((a, b), pairs)| {
        let smaller = sizes[a as usize].min(sizes[b as usize]) as f64;
        let is_rim = pairs.crossed as f64 >= RIM * smaller.sqrt() && pairs.crossed > pairs.agree;
        smaller >= AREA * points.len() as f64 && is_rim && pairs.are_of_one_sheet()
    }))
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

    /// Whether the opposite ones are not of two sheets back to back.
    fn are_of_one_sheet(self) -> bool {
        self.crossed as f64 > CROSSED * (self.apart + self.crossed) as f64
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
