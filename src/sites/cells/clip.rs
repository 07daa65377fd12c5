//! Triangles clipped by bisectors.

use glam::DVec3;

/// The line that an edge of a clipped triangle lies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Label {
    /// This edge of the triangle.
    Edge(usize),
    /// The bisector with this site.
    Site(u32),
}

/// Writes the part of `polygon` where `beyond` is not positive to `result`; false, and nothing written, if
/// that is all of it. The edge of point m runs to point m + 1 and has m's label.
pub(crate) fn cut(
    polygon: &[(DVec3, Label)],
    beyond: impl Fn(DVec3) -> f64,
    label: Label,
    result: &mut Vec<(DVec3, Label)>,
) -> bool {
    if polygon.iter().all(|(p, _)| beyond(*p) <= 0.0) {
        return false;
    }
    result.clear();
    for m in 0..polygon.len() {
        let (p, along) = polygon[m];
        let (q, _) = polygon[(m + 1) % polygon.len()];
        let (f, g) = (beyond(p), beyond(q));
        if f <= 0.0 {
            result.push((p, along));
        }
        if (f <= 0.0) != (g <= 0.0) {
            let crossing = p.lerp(q, f / (f - g));
            result.push((crossing, if f <= 0.0 { label } else { along }));
        }
    }
    true
}
