//! Vertices on curves, relaxed along their curve.

use glam::DVec3;

use super::links::cross;
use super::relax::spoils;
use super::worst::score;

/// Share of the way to the mean of the neighbours that a vertex goes.
const STRIDE: f64 = 1.0;
/// No nearer to the next vertex on the curve than this share of the way between the two beside it.
const LEAST_GAP: f64 = 0.3;
/// Trial steps, over the way between the two beside it, for the sake of the worst triangle.
const TRIALS: [f64; 6] = [0.08, -0.08, 0.04, -0.04, 0.02, -0.02];
/// Of a curve's bends, a vertex leaves none farther from the chords than this share of the way between the two beside it.
const MAX_STRAY: f64 = 0.01;
/// What a move for the sake of the worst triangle must gain, in its score.
const MIN_GAIN: f64 = 1e-4;

/// A curve and the vertices that may slide along it.
#[derive(Debug, Clone, PartialEq)]
pub struct Rail {
    /// Its points, at least two; a closed one ends with its first.
    pub points: Vec<DVec3>,
    /// Whether its end is its beginning, and no corner.
    pub closed: bool,
    /// Vertices on it, in order from its beginning to its end, with the way along it to each.
    pub riders: Vec<(u32, f64)>,
}

impl Rail {
    /// The point at a way along the curve, and the direction of the curve there.
    fn at(&self, along: &[f64], way: f64) -> (DVec3, DVec3) {
        let edge = along.partition_point(|a| *a <= way).clamp(1, along.len() - 1) - 1;
        let (p, q) = (self.points[edge], self.points[edge + 1]);
        let length = (along[edge + 1] - along[edge]).max(f64::MIN_POSITIVE);
        (p.lerp(q, ((way - along[edge]) / length).clamp(0.0, 1.0)), (q - p) / length)
    }

    /// How far the curve's points between ways are from the chords.
    fn stray(&self, along: &[f64], ways: [f64; 3]) -> f64 {
        let length = along.last().copied().unwrap_or(0.0);
        let mut farthest_sq: f64 = 0.0;
        for pair in ways.windows(2) {
            let [p, q] = [pair[0], pair[1]].map(|way| self.at(along, self.within(way, length)).0);
            // Of a closed curve a chord may pass the beginning.
            for round in [-length, 0.0, length] {
                let first = along.partition_point(|a| a + round <= pair[0]);
                let between = along[first..].iter().take_while(|a| **a + round < pair[1]).count();
                for point in &self.points[first..first + between] {
                    let share = (*point - p).dot(q - p) / (q - p).length_squared().max(f64::MIN_POSITIVE);
                    farthest_sq = farthest_sq.max(point.distance_squared(p.lerp(q, share.clamp(0.0, 1.0))));
                }
            }
        }
        farthest_sq.sqrt()
    }

    /// A way on the curve, which may go round a closed one.
    fn within(&self, way: f64, length: f64) -> f64 {
        if self.closed { way.rem_euclid(length) } else { way }
    }

    fn along(&self) -> Vec<f64> {
        let mut way = 0.0;
        let rest = self.points.windows(2).map(|pair| {
            way += pair[0].distance(pair[1]);
            way
        });
        std::iter::once(0.0).chain(rest).collect()
    }
}

/// The rails of a mesh with what is known of them.
pub(super) struct Rails {
    rails: Vec<Rail>,
    /// The way along each rail to its points.
    along: Vec<Vec<f64>>,
    /// Which of all riders each vertex is, or `u32::MAX`.
    rider: Vec<u32>,
    riders: usize,
}

impl Rails {
    pub(super) fn new(rails: &[Rail], vertices: usize) -> Self {
        let mut rider = vec![u32::MAX; vertices];
        let all = rails.iter().flat_map(|rail| &rail.riders);
        let riders = (0..).zip(all).map(|(k, (v, _))| rider[*v as usize] = k).count();
        Self { rails: rails.to_vec(), along: rails.iter().map(Rail::along).collect(), rider, riders }
    }

    /// The triangles of each rider.
    fn stars(&self, triangles: &[[u32; 3]]) -> Vec<Vec<[u32; 3]>> {
        let mut stars = vec![Vec::new(); self.riders];
        for triangle in triangles {
            for v in triangle {
                if let Some(star) = stars.get_mut(self.rider[*v as usize] as usize) {
                    star.push(*triangle);
                }
            }
        }
        stars
    }

    /// Moves every rider once towards the mean of its neighbours, or, if `lift`, to where its worst triangle is best.
    pub(super) fn slide(&mut self, triangles: &[[u32; 3]], points: &mut [DVec3], lift: bool) {
        let stars = self.stars(triangles);
        let mut star = stars.iter();
        for (rail, along) in self.rails.iter_mut().zip(&self.along) {
            let (count, length) = (rail.riders.len(), along.last().copied().unwrap_or(0.0));
            for k in 0..count {
                let Some(star) = star.next() else { return };
                let (v, way) = rail.riders[k];
                let before = match k.checked_sub(1) {
                    Some(before) => rail.riders[before].1,
                    None if rail.closed => rail.riders[count - 1].1 - length,
                    None => 0.0,
                };
                let after = match rail.riders.get(k + 1) {
                    Some((_, after)) => *after,
                    None if rail.closed => rail.riders[0].1 + length,
                    None => length,
                };
                let gap = after - before;
                let bounded = |way: f64| way.clamp(before + LEAST_GAP * gap, after - LEAST_GAP * gap);
                let place = |way: f64| rail.at(along, rail.within(way, length));
                let new = if lift {
                    let worst =
                        |p: DVec3| star.iter().map(|t| score(moved(*t, points, v, p))).fold(1.0, f64::min);
                    let mut best = (worst(points[v as usize]) + MIN_GAIN, way);
                    for step in TRIALS {
                        let trial = bounded(way + step * gap);
                        let reached = worst(place(trial).0);
                        if reached > best.0 {
                            best = (reached, trial);
                        }
                    }
                    best.1
                } else {
                    let sum: DVec3 =
                        star.iter().flatten().filter(|w| **w != v).map(|w| points[*w as usize]).sum();
                    let mean = sum / (2.0 * star.len().max(1) as f64);
                    let (here, direction) = place(way);
                    bounded(way + STRIDE * (mean - here).dot(direction))
                };
                let to = place(new).0;
                let folds = star.iter().any(|t| {
                    let old = t.map(|w| points[w as usize]);
                    spoils(old, moved(*t, points, v, to), cross(old))
                });
                let strays = || {
                    let stray = |way: f64| rail.stray(along, [before, way, after]);
                    let now = stray(new);
                    now > MAX_STRAY * gap && now > stray(way)
                };
                if new != way && !folds && !strays() {
                    points[v as usize] = to;
                    rail.riders[k].1 = new;
                }
            }
        }
    }
}

/// The corners of a triangle if `v` stood at `p`.
fn moved(triangle: [u32; 3], points: &[DVec3], v: u32, p: DVec3) -> [DVec3; 3] {
    triangle.map(|w| if w == v { p } else { points[w as usize] })
}
