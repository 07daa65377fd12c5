//! Convex polygons and their cuts.

use glam::DVec3;

/// A triangle cut three times has at most six corners.
const MOST_CORNERS: usize = 6;

/// A corner of a polygon.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    pub at: DVec3,
    /// Rank of a triangle of the other surface that is near.
    pub near: u32,
}

/// A convex polygon.
#[derive(Debug, Clone, Copy)]
pub(super) struct Polygon {
    corners: [Corner; MOST_CORNERS],
    count: usize,
}

impl Polygon {
    const EMPTY: Self = Self { corners: [Corner { at: DVec3::ZERO, near: 0 }; MOST_CORNERS], count: 0 };

    /// A triangle.
    pub fn new(corners: [Corner; 3]) -> Self {
        corners.into_iter().fold(Self::EMPTY, |mut polygon, corner| {
            polygon.push(corner);
            polygon
        })
    }

    /// Its corners in their order.
    pub fn corners(&self) -> &[Corner] {
        &self.corners[..self.count]
    }

    fn push(&mut self, corner: Corner) {
        self.corners[self.count] = corner;
        self.count += 1;
    }

    /// The parts where a linear function is below and above zero, if there are both and it is finite. It has
    /// `value(k)` at corner `k`; up to `tiny` counts as zero. Corners that the cut makes are near the
    /// triangle at `near`.
    pub fn cut(&self, value: impl Fn(usize) -> f64, tiny: f64, near: u32) -> Option<[Self; 2]> {
        let mut values = [0.0; MOST_CORNERS];
        for (k, v) in values.iter_mut().enumerate().take(self.count) {
            *v = value(k);
            if v.abs() <= tiny {
                *v = 0.0;
            }
        }
        let values = &values[..self.count];
        if values.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let crossings = (0..self.count).filter(|&k| values[k] * values[(k + 1) % self.count] < 0.0).count();
        let both = values.iter().any(|v| *v < 0.0) && values.iter().any(|v| *v > 0.0);
        if !both || crossings > 2 || (crossings == 2 && self.count == MOST_CORNERS) {
            return None;
        }
        let [mut below, mut above] = [Self::EMPTY; 2];
        for (k, &v) in values.iter().enumerate() {
            let next = (k + 1) % self.count;
            let (p, q) = (self.corners[k], self.corners[next]);
            if v <= 0.0 {
                below.push(p);
            }
            if v >= 0.0 {
                above.push(p);
            }
            if v * values[next] < 0.0 {
                let at = p.at + (q.at - p.at) * (v / (v - values[next]));
                below.push(Corner { at, near });
                above.push(Corner { at, near });
            }
        }
        Some([below, above])
    }

    /// Triangles that make up the polygon.
    pub fn triangles(&self) -> impl Iterator<Item = [Corner; 3]> {
        let corners = self.corners;
        // The shorter diagonal of a quadrilateral makes the better triangles.
        let far = |i: usize, j: usize| corners[i].at.distance_squared(corners[j].at);
        let first = usize::from(self.count == 4 && far(1, 3) < far(0, 2));
        let count = self.count;
        (2..count.max(2)).map(move |k| [first, first + k - 1, first + k].map(|k| corners[k % count]))
    }
}
