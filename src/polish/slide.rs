//! Relaxation of vertices along their curves.

use glam::DVec3;

use super::relax::folds_or_flattens;
use super::worst::score;
use crate::mesh::NONE;
use crate::mesh::polyline::Polyline;
use crate::mesh::triangle::doubled_normal;

/// Step towards the mean of the neighbours, as a share of the distance.
const STRIDE: f64 = 1.0;
/// Minimum distance to the next vertex on the curve, as a share of the arc length between the vertices before
/// and after.
const LEAST_GAP: f64 = 0.3;
/// Trial steps for the worst triangle, as shares of that arc length.
const TRIALS: [f64; 6] = [0.08, -0.08, 0.04, -0.04, 0.02, -0.02];
/// Largest distance of the curve from the chords to the vertices before and after, as a share of that arc
/// length.
const MAX_DEVIATION: f64 = 0.01;
/// Minimum gain of a move for the worst triangle, in its score.
const MIN_GAIN: f64 = 1e-4;

/// A curve and the vertices that may slide along it.
#[derive(Debug, Clone, PartialEq)]
pub struct SlidingCurve {
    /// The curve.
    pub line: Polyline,
    /// Vertices on it, in order from its beginning to its end, with the arc length of each.
    pub sliders: Vec<(u32, f64)>,
}

/// The sliding curves of a mesh.
pub(crate) struct SlidingCurves {
    pub(super) curves: Vec<SlidingCurve>,
    /// The number of each vertex among all sliders, or [`NONE`].
    slider: Vec<u32>,
    sliders: usize,
}

impl SlidingCurves {
    pub(crate) fn new(curves: Vec<SlidingCurve>, vertices: usize) -> Self {
        let mut slider = vec![NONE; vertices];
        let all = curves.iter().flat_map(|curve| &curve.sliders);
        let sliders = (0..).zip(all).map(|(k, (v, _))| slider[*v as usize] = k).count();
        Self { curves, slider, sliders }
    }

    /// The triangles around each slider.
    fn stars(&self, triangles: &[[u32; 3]]) -> Vec<Vec<[u32; 3]>> {
        let mut stars = vec![Vec::new(); self.sliders];
        for triangle in triangles {
            for v in triangle {
                if let Some(star) = stars.get_mut(self.slider[*v as usize] as usize) {
                    star.push(*triangle);
                }
            }
        }
        stars
    }

    /// Moves every slider once: towards the mean of its neighbours, or, if `lift`, to where the lowest score
    /// of its triangles is highest.
    pub(crate) fn slide(
        &mut self,
        triangles: &[[u32; 3]],
        points: &mut [DVec3],
        lengths: &[f64],
        lift: bool,
    ) {
        if self.curves.is_empty() {
            return;
        }
        let stars = self.stars(triangles);
        let mut star = stars.iter();
        for SlidingCurve { line, sliders } in &mut self.curves {
            for k in 0..sliders.len() {
                let Some(star) = star.next() else { return };
                let (v, arc_length) = sliders[k];
                let [before, after] = beside(line, sliders, k);
                let gap = after - before;
                let bounded =
                    |arc_length: f64| arc_length.clamp(before + LEAST_GAP * gap, after - LEAST_GAP * gap);
                let new = if lift {
                    let worst = |p: DVec3| {
                        star.iter().map(|t| score(corners_with(*t, points, v, p))).fold(1.0, f64::min)
                    };
                    let mut best = (worst(points[v as usize]) + MIN_GAIN, arc_length);
                    for step in TRIALS {
                        let trial = bounded(arc_length + step * gap);
                        let reached = worst(line.at(trial).0);
                        if reached > best.0 {
                            best = (reached, trial);
                        }
                    }
                    best.1
                } else {
                    let others = star.iter().flatten().filter(|w| **w != v);
                    // As in the relaxation of other vertices.
                    let weighted = others.map(|w| {
                        let weight = lengths
                            .get(v as usize)
                            .map_or(1.0, |here| 2.0 * here / (here + lengths[*w as usize]));
                        (weight, weight * points[*w as usize])
                    });
                    let (weights, sum) =
                        weighted.fold((0.0, DVec3::ZERO), |(w, s), (weight, p)| (w + weight, s + p));
                    let mean = sum / f64::max(weights, f64::MIN_POSITIVE);
                    let (here, direction) = line.at(arc_length);
                    bounded(arc_length + STRIDE * (mean - here).dot(direction))
                };
                let to = line.at(new).0;
                let folds = star.iter().any(|t| {
                    let old = t.map(|w| points[w as usize]);
                    folds_or_flattens(old, corners_with(*t, points, v, to), doubled_normal(old))
                });
                let cuts_off = || {
                    let deviation = |arc_length: f64| {
                        line.deviation(before, arc_length).max(line.deviation(arc_length, after))
                    };
                    deviation(new) > (MAX_DEVIATION * gap).max(deviation(arc_length))
                };
                if new != arc_length && !folds && !cuts_off() {
                    points[v as usize] = to;
                    sliders[k].1 = new;
                }
            }
        }
    }
}

/// Arc lengths of the vertices before and after a slider, or of the ends of the curve.
fn beside(line: &Polyline, sliders: &[(u32, f64)], k: usize) -> [f64; 2] {
    let [first, last] = if line.is_closed() {
        // Once around the curve.
        [sliders[sliders.len() - 1].1 - line.length(), sliders[0].1 + line.length()]
    } else {
        [0.0, line.length()]
    };
    [
        k.checked_sub(1).map_or(first, |before| sliders[before].1),
        sliders.get(k + 1).map_or(last, |(_, after)| *after),
    ]
}

/// The corners of a triangle if `v` were at `p`.
fn corners_with(triangle: [u32; 3], points: &[DVec3], v: u32, p: DVec3) -> [DVec3; 3] {
    triangle.map(|w| if w == v { p } else { points[w as usize] })
}
