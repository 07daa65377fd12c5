//! Triangles clipped by bisectors.

use glam::DVec3;

/// The line that an edge of a clipped triangle lies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Label {
    /// This edge of the triangle.
    Edge(u8),
    /// The bisector with this site.
    Site(u32),
}

/// A polygon while it is clipped.
#[derive(Default)]
pub(crate) struct Clipped {
    /// Its corners; the edge of corner m runs to corner m + 1 and has m's label.
    pub polygon: Vec<(DVec3, Label)>,
    /// What is left by a cut.
    left: Vec<(DVec3, Label)>,
    /// How far the corners are beyond it.
    beyond: Vec<f64>,
}

impl Clipped {
    /// Begins with a triangle.
    pub fn start(&mut self, corners: [DVec3; 3]) {
        self.polygon.clear();
        self.polygon.extend((0..3).map(|m| (corners[m as usize], Label::Edge(m))));
    }

    /// Whether some of the polygon is where `beyond` is positive.
    #[inline]
    pub fn is_cut(&mut self, beyond: impl Fn(DVec3) -> f64) -> bool {
        self.beyond.clear();
        self.beyond.extend(self.polygon.iter().map(|(p, _)| beyond(*p)));
        !self.beyond.iter().all(|f| *f <= 0.0)
    }

    /// Leaves what is not beyond the cut that was last asked for; the new edge gets `label`.
    pub fn cut(&mut self, label: Label) {
        let Self { polygon, left, beyond } = self;
        left.clear();
        for m in 0..polygon.len() {
            let next = if m + 1 == polygon.len() { 0 } else { m + 1 };
            let ((p, along), (q, _)) = (polygon[m], polygon[next]);
            let (f, g) = (beyond[m], beyond[next]);
            if f <= 0.0 {
                left.push((p, along));
            }
            if (f <= 0.0) != (g <= 0.0) {
                let crossing = p.lerp(q, f / (f - g));
                left.push((crossing, if f <= 0.0 { label } else { along }));
            }
        }
        std::mem::swap(polygon, left);
    }
}
