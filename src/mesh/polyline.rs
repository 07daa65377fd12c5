//! Points along a curve.

use glam::DVec3;

/// A curve of straight edges, with the way from its beginning to each point.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Polyline {
    points: Vec<DVec3>,
    along: Vec<f64>,
    closed: bool,
}

impl Polyline {
    /// Through at least two `points`; a `closed` one ends with its first.
    pub fn new(points: Vec<DVec3>, closed: bool) -> Self {
        let mut way = 0.0;
        let rest = points.windows(2).map(|pair| {
            way += pair[0].distance(pair[1]);
            way
        });
        let along = std::iter::once(0.0).chain(rest).collect();
        Self { points, along, closed }
    }

    /// The whole way.
    pub fn length(&self) -> f64 {
        self.along.last().copied().unwrap_or(0.0)
    }

    /// Whether its end is its beginning.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// The way to point `k`. Panics if there is none.
    pub fn way_to(&self, k: usize) -> f64 {
        self.along[k]
    }

    /// The ways to the points between two ways, both excluded.
    pub fn ways_between(&self, from: f64, to: f64) -> &[f64] {
        let [first, last] =
            [self.along.partition_point(|a| *a <= from), self.along.partition_point(|a| *a < to)];
        &self.along[first..last.max(first)]
    }

    /// The edge at a way, and the ways at which it begins and ends.
    pub fn edge(&self, way: f64) -> (usize, [f64; 2]) {
        let edge = self.along.partition_point(|a| *a <= way).clamp(1, self.along.len() - 1) - 1;
        (edge, [self.along[edge], self.along[edge + 1]])
    }

    /// The point at a way, which may go round a closed one, and the direction there.
    pub fn at(&self, way: f64) -> (DVec3, DVec3) {
        let way = if self.closed { way.rem_euclid(self.length()) } else { way };
        let (edge, [from, to]) = self.edge(way);
        let (p, q) = (self.points[edge], self.points[edge + 1]);
        let length = (to - from).max(f64::MIN_POSITIVE);
        (p.lerp(q, ((way - from) / length).clamp(0.0, 1.0)), (q - p) / length)
    }

    /// The points of the curve between two ways, which may go past the ends of a closed one, each with its
    /// way and how far it is from the chord.
    pub fn strays(&self, from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> {
        let [p, q] = [from, to].map(|way| self.at(way).0);
        let length = self.length();
        let rounds = if self.closed { -1..=1 } else { 0..=0 };
        rounds.flat_map(move |round| {
            let begin = f64::from(round) * length;
            let first = self.along.partition_point(|a| a + begin <= from);
            let points = self.along[first..].iter().zip(&self.points[first..]);
            points.take_while(move |(a, _)| **a + begin < to).map(move |(a, point)| {
                let share = (*point - p).dot(q - p) / (q - p).length_squared().max(f64::MIN_POSITIVE);
                (a + begin, point.distance(p.lerp(q, share.clamp(0.0, 1.0))))
            })
        })
    }

    /// How far the curve is from the chord between two ways.
    pub fn stray(&self, from: f64, to: f64) -> f64 {
        self.strays(from, to).map(|(_, distance)| distance).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Polyline {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
        Polyline::new(corners.iter().map(|[x, y]| DVec3::new(*x, *y, 0.0)).collect(), true)
    }

    #[test]
    fn points_lie_at_their_ways() {
        let square = square();
        assert_eq!(square.length(), 4.0);
        for (way, x, y) in
            [(0.0, 0.0, 0.0), (1.5, 1.0, 0.5), (3.75, 0.0, 0.25), (4.25, 0.25, 0.0), (-0.5, 0.0, 0.5)]
        {
            assert!(square.at(way).0.distance(DVec3::new(x, y, 0.0)) < 1e-12, "{way}");
        }
        let open = Polyline::new(vec![DVec3::ZERO, DVec3::X], false);
        assert_eq!([-1.0, 2.0].map(|way| open.at(way).0), [DVec3::ZERO, DVec3::X]);
        assert_eq!(open.at(0.5).1, DVec3::X);
    }

    #[test]
    fn chords_miss_the_corners_between() {
        let square = square();
        let half = 0.125_f64.sqrt();
        assert!((square.stray(0.5, 1.5) - half).abs() < 1e-12);
        // Over the beginning, from either side.
        assert!(
            (square.stray(3.5, 4.5) - half).abs() < 1e-12 && (square.stray(-0.5, 0.5) - half).abs() < 1e-12
        );
        assert_eq!(square.stray(0.0, 1.0), 0.0);
        assert_eq!(square.strays(0.5, 2.5).map(|(way, _)| way).collect::<Vec<_>>(), [1.0, 2.0]);
    }
}
