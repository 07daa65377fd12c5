//! Vertices on curves, relaxed along their curve.

use glam::DVec3;

use super::relax::spoils;
use super::worst::score;
use crate::mesh::polyline::Polyline;
use crate::mesh::triangle::doubled_normal;

/// Share of the way to the mean of the neighbours that a vertex goes.
const STRIDE: f64 = 1.0;
/// No nearer to the next vertex on the curve than this share of the way between the two beside it.
const LEAST_GAP: f64 = 0.3;
/// Trial steps, over the way between the two beside it, for the sake of the worst triangle.
const TRIALS: [f64; 6] = [0.08, -0.08, 0.04, -0.04, 0.02, -0.02];
/// Of a curve's bends, a vertex leaves none farther from the chords than this share of the way between the
/// two beside it.
const MAX_STRAY: f64 = 0.01;
/// What a move for the sake of the worst triangle must gain, in its score.
const MIN_GAIN: f64 = 1e-4;

/// A curve and the vertices that may slide along it.
#[derive(Debug, Clone, PartialEq)]
pub struct SlidingCurve {
    /// The curve.
    pub line: Polyline,
    /// Vertices on it, in order from its beginning to its end, with the way along it to each.
    pub sliders: Vec<(u32, f64)>,
}

/// The sliding_curves of a mesh with what is known of them.
pub(crate) struct SlidingCurves {
    sliding_curves: Vec<SlidingCurve>,
    /// Which of all sliders each vertex is, or `u32::MAX`.
    slider: Vec<u32>,
    sliders: usize,
}

impl SlidingCurves {
    pub(crate) fn new(sliding_curves: &[SlidingCurve], vertices: usize) -> Self {
        let mut slider = vec![u32::MAX; vertices];
        let all = sliding_curves.iter().flat_map(|sliding_curve| &sliding_curve.sliders);
        let sliders = (0..).zip(all).map(|(k, (v, _))| slider[*v as usize] = k).count();
        Self { sliding_curves: sliding_curves.to_vec(), slider, sliders }
    }

    /// The triangles of each slider.
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

    /// Moves every slider once towards the mean of its neighbours, or, if `lift`, to where its worst triangle
    /// is best.
    pub(crate) fn slide(
        &mut self,
        triangles: &[[u32; 3]],
        points: &mut [DVec3],
        lengths: &[f64],
        lift: bool,
    ) {
        if self.sliding_curves.is_empty() {
            return;
        }
        let stars = self.stars(triangles);
        let mut star = stars.iter();
        for SlidingCurve { line, sliders } in &mut self.sliding_curves {
            for k in 0..sliders.len() {
                let Some(star) = star.next() else { return };
                let (v, way) = sliders[k];
                let [before, after] = beside(line, sliders, k);
                let gap = after - before;
                let bounded = |way: f64| way.clamp(before + LEAST_GAP * gap, after - LEAST_GAP * gap);
                let new = if lift {
                    let worst =
                        |p: DVec3| star.iter().map(|t| score(moved(*t, points, v, p))).fold(1.0, f64::min);
                    let mut best = (worst(points[v as usize]) + MIN_GAIN, way);
                    for step in TRIALS {
                        let trial = bounded(way + step * gap);
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
                    let (here, direction) = line.at(way);
                    bounded(way + STRIDE * (mean - here).dot(direction))
                };
                let to = line.at(new).0;
                let folds = star.iter().any(|t| {
                    let old = t.map(|w| points[w as usize]);
                    spoils(old, moved(*t, points, v, to), doubled_normal(old))
                });
                let strays = || {
                    let stray = |way: f64| line.deviation(before, way).max(line.deviation(way, after));
                    stray(new) > (MAX_STRAY * gap).max(stray(way))
                };
                if new != way && !folds && !strays() {
                    points[v as usize] = to;
                    sliders[k].1 = new;
                }
            }
        }
    }
}

/// The ways to the vertices before and after a slider, or to the ends of the curve.
fn beside(line: &Polyline, sliders: &[(u32, f64)], k: usize) -> [f64; 2] {
    let [first, last] = if line.is_closed() {
        // Round the whole way.
        [sliders[sliders.len() - 1].1 - line.length(), sliders[0].1 + line.length()]
    } else {
        [0.0, line.length()]
    };
    [
        k.checked_sub(1).map_or(first, |before| sliders[before].1),
        sliders.get(k + 1).map_or(last, |(_, after)| *after),
    ]
}

/// The corners of a triangle if `v` stood at `p`.
fn moved(triangle: [u32; 3], points: &[DVec3], v: u32, p: DVec3) -> [DVec3; 3] {
    triangle.map(|w| if w == v { p } else { points[w as usize] })
}
