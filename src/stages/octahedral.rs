//! Unit vectors in one word, as in `glsl/common/octahedral.glsl`.

use glam::{DVec2, DVec3};

/// A unit vector in two signed shorts, as `unpack_normal` in `glsl/project/records.glsl` reads it; off by at
/// most 5e-5.
pub fn pack(n: DVec3) -> u32 {
    let size = n.abs().element_sum();
    // Only a triangle without area has no normal; any direction will do.
    let n = if size > 0.0 { n / size } else { DVec3::Z };
    let sign = |x: f64| if x >= 0.0 { 1.0 } else { -1.0 };
    let flat = if n.z >= 0.0 {
        DVec2::new(n.x, n.y)
    } else {
        DVec2::new((1.0 - n.y.abs()) * sign(n.x), (1.0 - n.x.abs()) * sign(n.y))
    };
    let short = |x: f64| u32::from((x * 32767.0).round() as i16 as u16);
    short(flat.x) | short(flat.y) << 16
}
