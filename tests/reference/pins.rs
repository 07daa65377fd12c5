//! The fourth component of a site on a surface with curves, as `glsl/common/pins.glsl` decodes it.

use super::octahedral;
use glam::{DVec2, DVec3};

/// A site on a surface with curves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mark {
    /// It moves in this patch.
    Interior(u32),
    /// It stays. The curve has this direction and goes on for so many quarters of a spacing.
    Pinned { direction: DVec3, quarters: u32, anywhere: bool },
}

impl Mark {
    /// A corner.
    pub const CORNER: Self = Self::Pinned { direction: DVec3::Z, quarters: 0, anywhere: true };

    pub fn is_pinned(self) -> bool {
        matches!(self, Self::Pinned { .. })
    }

    /// Whether a site with this mark is one of the patch, or on a curve.
    pub fn is_in(self, patch: u32) -> bool {
        self.is_pinned() || self == Self::Interior(patch)
    }

    pub fn counts_anywhere(self) -> bool {
        matches!(self, Self::Pinned { anywhere: true, .. })
    }

    pub fn encode(self) -> f32 {
        match self {
            Self::Interior(patch) => patch as f32,
            Self::Pinned { direction, quarters, anywhere } => {
                let code = ten_bits(direction) | u32::from(anywhere) << 20 | quarters << 21;
                -((code + 1) as f32)
            }
        }
    }

    /// The direction as the kernels have it, and how far the curve goes on in spacings.
    pub fn line(self) -> Option<(DVec3, f64)> {
        let Self::Pinned { direction, quarters, .. } = self else { return None };
        let code = ten_bits(direction);
        let axis = |bits: u32| f64::from(bits & 1023) / 511.0 - 1.0;
        let rounded = octahedral::from_square(DVec2::new(axis(code), axis(code >> 10)));
        (quarters > 0).then_some((rounded, f64::from(quarters) / 4.0))
    }
}

fn ten_bits(direction: DVec3) -> u32 {
    let packed = octahedral::pack(direction);
    let bits = |half: u32| ((f64::from(half as u16 as i16) / 32767.0 + 1.0) * 511.0).round() as u32;
    bits(packed) | bits(packed >> 16) << 10
}
