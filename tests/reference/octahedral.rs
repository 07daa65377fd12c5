//! Unit vectors in two signed 16-bit integers, as in `glsl/common/octahedral.glsl`.

use glam::{DVec2, DVec3};

fn sign(x: f64) -> f64 {
    if x < 0.0 { -1.0 } else { 1.0 }
}

fn fold(p: DVec2) -> DVec2 {
    DVec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
}

pub fn pack(n: DVec3) -> u32 {
    let p = n.truncate() / n.abs().element_sum();
    let p = if n.z < 0.0 { fold(p) } else { p };
    let short = |x: f64| u32::from((x * 32767.0).round() as i16 as u16);
    short(p.x) | short(p.y) << 16
}

pub fn unpack(packed: u32) -> DVec3 {
    let float = |half: u32| (f64::from(half as u16 as i16) / 32767.0).max(-1.0);
    from_square(DVec2::new(float(packed), float(packed >> 16)))
}

/// The unit vector of a point in the square from -1 to 1.
pub fn from_square(p: DVec2) -> DVec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    let p = if z < 0.0 { fold(p) } else { p };
    p.extend(z).normalize()
}
