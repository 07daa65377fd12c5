//! Relaxation of vertices along their curves.

use glam::DVec3;

use super::relax::folds_or_flattens;
use super::star::Star;
use super::target::Target;
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

/// Where vertices slide to.
#[derive(Clone, Copy)]
pub(super) enum Aim<'a> {
    /// Towards the mean of their neighbours.
    Even,
    /// To where the lowest score of their triangles is highest.
    Worst,
    /// To where the mean quality of their triangles is highest, without another loss, and these are no
    /// farther from the surface. Angles with at most this cosine may become smaller.
    Mean(&'a Target, f64),
}

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

    /// Moves every slider once; returns those that have moved.
    pub(crate) fn slide(
        &mut self,
        triangles: &[[u32; 3]],
        points: &mut [DVec3],
        lengths: &[f64],
        aim: Aim<'_>,
    ) -> Vec<u32> {
        let mut moved = Vec::new();
        if self.curves.is_empty() {
            return moved;
        }
        let stars = self.stars(triangles);
        let mut star = stars.iter();
        for SlidingCurve { line, sliders } in &mut self.curves {
            for k in 0..sliders.len() {
                let Some(star) = star.next() else { return moved };
                let (v, arc_length) = sliders[k];
                let slider = Slider { v, arc_length, beside: beside(line, sliders, k), line, star, points };
                if let Some((arc_length, to)) = slider.moved(lengths, aim) {
                    points[v as usize] = to;
                    sliders[k].1 = arc_length;
                    moved.push(v);
                }
            }
        }
        moved
    }
}

/// A vertex on a curve.
struct Slider<'a> {
    v: u32,
    arc_length: f64,
    /// Arc lengths of the vertices before and after it.
    beside: [f64; 2],
    line: &'a Polyline,
    /// The triangles around it.
    star: &'a [[u32; 3]],
    points: &'a [DVec3],
}

impl Slider<'_> {
    /// The arc length and position that it moves to, if it moves.
    fn moved(&self, lengths: &[f64], aim: Aim<'_>) -> Option<(f64, DVec3)> {
        let new = match aim {
            Aim::Even => self.towards_mean(lengths),
            Aim::Worst => self.best_trial(|p| self.worst(p)),
            Aim::Mean(target, most_cosine) => {
                let here = self.points[self.v as usize];
                let edges = self.star.iter().map(|t| opposite(*t, self.v).map(|w| self.points[w as usize]));
                let star = Star::new(edges, here, most_cosine);
                let new = self.best_trial(|p| star.quality_at(p).unwrap_or(f64::NEG_INFINITY));
                if star.is_farther([here, self.line.at(new).0], |p| Some(target.nearest(p)?.0)) {
                    return None;
                }
                new
            }
        };
        let to = self.line.at(new).0;
        let moves = new != self.arc_length && !self.folds(to) && !self.cuts_off(new);
        moves.then_some((new, to))
    }

    /// Keeps an arc length from the vertices before and after.
    fn bounded(&self, arc_length: f64) -> f64 {
        let [before, after] = self.beside;
        let gap = after - before;
        arc_length.clamp(before + LEAST_GAP * gap, after - LEAST_GAP * gap)
    }

    /// The arc length of the trial with the highest value, or the present one.
    fn best_trial(&self, value: impl Fn(DVec3) -> f64) -> f64 {
        let gap = self.beside[1] - self.beside[0];
        let mut best = (value(self.points[self.v as usize]) + MIN_GAIN, self.arc_length);
        for step in TRIALS {
            let trial = self.bounded(self.arc_length + step * gap);
            let reached = value(self.line.at(trial).0);
            if reached > best.0 {
                best = (reached, trial);
            }
        }
        best.1
    }

    /// The lowest score of the triangles with the vertex at `p`.
    fn worst(&self, p: DVec3) -> f64 {
        self.star.iter().map(|t| score(corners_with(*t, self.points, self.v, p))).fold(1.0, f64::min)
    }

    /// Weighted as in the relaxation of other vertices.
    fn towards_mean(&self, lengths: &[f64]) -> f64 {
        let others = self.star.iter().flatten().filter(|w| **w != self.v);
        let weighted = others.map(|w| {
            let weight =
                lengths.get(self.v as usize).map_or(1.0, |here| 2.0 * here / (here + lengths[*w as usize]));
            (weight, weight * self.points[*w as usize])
        });
        let (weights, sum) = weighted.fold((0.0, DVec3::ZERO), |(w, s), (weight, p)| (w + weight, s + p));
        let mean = sum / f64::max(weights, f64::MIN_POSITIVE);
        let (here, direction) = self.line.at(self.arc_length);
        self.bounded(self.arc_length + STRIDE * (mean - here).dot(direction))
    }

    fn folds(&self, to: DVec3) -> bool {
        self.star.iter().any(|t| {
            let old = t.map(|w| self.points[w as usize]);
            folds_or_flattens(old, corners_with(*t, self.points, self.v, to), doubled_normal(old))
        })
    }

    /// Whether the chords to the vertices before and after would leave the curve.
    fn cuts_off(&self, new: f64) -> bool {
        let [before, after] = self.beside;
        let deviation = |arc_length: f64| {
            self.line.deviation(before, arc_length).max(self.line.deviation(arc_length, after))
        };
        deviation(new) > (MAX_DEVIATION * (after - before)).max(deviation(self.arc_length))
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

/// The other corners of a triangle, behind `v` and before it.
fn opposite([a, b, c]: [u32; 3], v: u32) -> [u32; 2] {
    if v == a {
        [b, c]
    } else if v == b {
        [c, a]
    } else {
        [a, b]
    }
}

/// The corners of a triangle if `v` were at `p`.
fn corners_with(triangle: [u32; 3], points: &[DVec3], v: u32, p: DVec3) -> [DVec3; 3] {
    triangle.map(|w| if w == v { p } else { points[w as usize] })
}
