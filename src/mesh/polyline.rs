//! Polylines with the arc length to each of their points.

use glam::DVec3;

/// A curve of straight edges, with the arc length from its beginning to each point. Lengths are in the unit
/// of the points.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Polyline {
    points: Vec<DVec3>,
    along: Vec<f64>,
    closed: bool,
    drawn: bool,
}

impl Polyline {
    /// Through at least two `points`; a `closed` one ends with its first.
    pub fn new(points: Vec<DVec3>, closed: bool) -> Self {
        let mut arc_length = 0.0;
        let rest = points.windows(2).map(|pair| {
            arc_length += pair[0].distance(pair[1]);
            arc_length
        });
        let along = std::iter::once(0.0).chain(rest).collect();
        Self { points, along, closed, drawn: false }
    }

    /// This line, marked as `drawn` by a user or not: a drawn curve is meant as it is.
    #[must_use]
    pub fn drawn(self, drawn: bool) -> Self {
        Self { drawn, ..self }
    }

    /// Whether a user has drawn it, also as the border between two labels.
    pub fn is_drawn(&self) -> bool {
        self.drawn
    }

    /// The length of the whole curve.
    pub fn length(&self) -> f64 {
        self.along.last().copied().unwrap_or(0.0)
    }

    /// How many of its points are between two edges.
    pub fn bends(&self) -> usize {
        self.points.len().saturating_sub(if self.closed { 1 } else { 2 })
    }

    /// How much it turns to and fro: the sum of the angles by which it turns at its points, less the angle of
    /// all these turns together, over their number; in radians. 0 where it turns the same way everywhere, as
    /// a circle does.
    pub fn raggedness(&self) -> f64 {
        let directions = self.points.windows(2).map(|pair| (pair[1] - pair[0]).normalize_or_zero());
        let mut directions: Vec<DVec3> = directions.collect();
        if self.closed {
            directions.extend(directions.first().copied());
        }
        let (mut angles, mut together) = (0.0, DVec3::ZERO);
        for pair in directions.windows(2) {
            let axis = pair[0].cross(pair[1]);
            let angle = axis.length().atan2(pair[0].dot(pair[1]));
            angles += angle;
            together += angle * axis.normalize_or_zero();
        }
        (angles - together.length()) / self.bends().max(1) as f64
    }

    /// Whether it ends where it begins.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// The arc length at point `k`. Panics if there is none.
    pub fn arc_length_at(&self, k: usize) -> f64 {
        self.along[k]
    }

    /// The arc lengths of the points between two arc lengths, both excluded.
    pub fn arc_lengths_between(&self, from: f64, to: f64) -> &[f64] {
        let [first, last] =
            [self.along.partition_point(|a| *a <= from), self.along.partition_point(|a| *a < to)];
        &self.along[first..last.max(first)]
    }

    /// The edge at an arc length, and the arc lengths at which it begins and ends.
    pub fn edge(&self, arc_length: f64) -> (usize, [f64; 2]) {
        let edge = self.along.partition_point(|a| *a <= arc_length).clamp(1, self.along.len() - 1) - 1;
        (edge, [self.along[edge], self.along[edge + 1]])
    }

    /// The point at an arc length and the direction there; arc lengths wrap around a closed curve.
    pub fn at(&self, arc_length: f64) -> (DVec3, DVec3) {
        let arc_length = if self.closed { arc_length.rem_euclid(self.length()) } else { arc_length };
        let (edge, [from, to]) = self.edge(arc_length);
        let (p, q) = (self.points[edge], self.points[edge + 1]);
        let length = (to - from).max(f64::MIN_POSITIVE);
        (p.lerp(q, ((arc_length - from) / length).clamp(0.0, 1.0)), (q - p) / length)
    }

    /// The curve's points between two arc lengths, which may lie beyond the ends of a closed curve: the arc
    /// length of each and its distance from the chord.
    pub fn deviations(&self, from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> {
        let [p, q] = [from, to].map(|arc_length| self.at(arc_length).0);
        let length = self.length();
        let turns = if self.closed { -1..=1 } else { 0..=0 };
        turns.flat_map(move |turn| {
            let begin = f64::from(turn) * length;
            let first = self.along.partition_point(|a| a + begin <= from);
            let points = self.along[first..].iter().zip(&self.points[first..]);
            points.take_while(move |(a, _)| **a + begin < to).map(move |(a, point)| {
                let share = (*point - p).dot(q - p) / (q - p).length_squared().max(f64::MIN_POSITIVE);
                (a + begin, point.distance(p.lerp(q, share.clamp(0.0, 1.0))))
            })
        })
    }

    /// The largest distance of the curve from the chord between two arc lengths.
    pub fn deviation(&self, from: f64, to: f64) -> f64 {
        self.deviations(from, to).map(|(_, distance)| distance).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    fn square() -> Polyline {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
        Polyline::new(corners.iter().map(|[x, y]| DVec3::new(*x, *y, 0.0)).collect(), true)
    }

    #[test]
    fn points_lie_at_their_arc_lengths() {
        let square = square();
        assert_eq!(square.length(), 4.0);
        for (arc_length, x, y) in
            [(0.0, 0.0, 0.0), (1.5, 1.0, 0.5), (3.75, 0.0, 0.25), (4.25, 0.25, 0.0), (-0.5, 0.0, 0.5)]
        {
            assert!(square.at(arc_length).0.distance(DVec3::new(x, y, 0.0)) < 1e-12, "{arc_length}");
        }
        let open = Polyline::new(vec![DVec3::ZERO, DVec3::X], false);
        assert_eq!([-1.0, 2.0].map(|arc_length| open.at(arc_length).0), [DVec3::ZERO, DVec3::X]);
        assert_eq!(open.at(0.5).1, DVec3::X);
    }

    #[test]
    fn chords_miss_the_corners_between() {
        let square = square();
        let half = 0.125_f64.sqrt();
        assert!((square.deviation(0.5, 1.5) - half).abs() < 1e-12);
        // Over the beginning, from either side.
        assert!(
            (square.deviation(3.5, 4.5) - half).abs() < 1e-12
                && (square.deviation(-0.5, 0.5) - half).abs() < 1e-12
        );
        assert_eq!(square.deviation(0.0, 1.0), 0.0);
        assert_eq!(
            square.deviations(0.5, 2.5).map(|(arc_length, _)| arc_length).collect::<Vec<_>>(),
            [1.0, 2.0]
        );
    }

    #[test]
    fn stairs_are_ragged_and_circles_are_not() {
        use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};
        let open = |points: &mut dyn Iterator<Item = DVec3>| Polyline::new(points.collect(), false);
        let stairs = |k: i32| DVec3::new(f64::from((k + 1) / 2), f64::from(k / 2), 0.0);
        let arc = |k: i32| DVec2::from_angle(f64::from(k % 8) * TAU / 8.0).extend(0.0);
        let stairs = open(&mut (0..20).map(stairs));
        assert!((stairs.raggedness() - FRAC_PI_2).abs() < 1e-12 && stairs.bends() == 18);
        assert!(open(&mut (0..7).map(arc)).raggedness().abs() < 1e-12);
        let circle = Polyline::new((0..9).map(arc).collect(), true);
        assert!(circle.raggedness().abs() < 1e-12 && circle.bends() == 8);
        // To the left and back.
        let jog = [[0, 0], [1, 0], [2, 1], [3, 1]].map(|[x, y]| DVec3::new(f64::from(x), f64::from(y), 0.0));
        assert!((open(&mut jog.into_iter()).raggedness() - FRAC_PI_4).abs() < 1e-12);
        for few in 1..4 {
            let line = open(&mut (0..few).map(|k| DVec3::splat(f64::from(k))));
            assert_eq!(line.raggedness(), 0.0, "{few}");
        }
        // Equal points have no direction.
        assert_eq!(open(&mut [DVec3::X; 4].into_iter()).raggedness(), 0.0);
    }
}
