//! The change of units between a mesh's file and the computation.

use glam::DVec3;

use super::TriMesh;
use crate::{Error, Result};

/// Maps a bounding box to centre 0 and diagonal 1, and back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitFrame {
    /// Centre of the bounding box, in the file's units.
    pub centre: DVec3,
    /// Diagonal of the bounding box, in the file's units; finite and above 0.
    pub scale: f64,
}

/// Decimals that tell places and lengths in a mesh of this diagonal to a ten-thousandth of it.
pub(crate) fn decimals(diagonal: f64) -> usize {
    (4.0 - diagonal.log10().floor()).clamp(0.0, 300.0) as usize
}

impl UnitFrame {
    /// The frame of all vertices of `mesh`, used by a face or not.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] without vertices, with a coordinate that is not finite, with all vertices at one
    /// point, and with a diagonal beyond the range of f64.
    pub fn of(mesh: &TriMesh) -> Result<Self> {
        if let Some(vertex) = mesh.vertices.iter().position(|vertex| !vertex.is_finite()) {
            let place = Some(format!("vertex {vertex}"));
            return Err(Error::input(place, "a coordinate is not finite", "remove or repair the vertex"));
        }
        let Some([lo, hi]) = mesh.bounds() else {
            return Err(Error::input(
                None,
                "the mesh has no vertices",
                "give a mesh with vertices and faces",
            ));
        };
        // Halved first, because hi - lo can overflow; squared only after division, for the same reason.
        let half = 0.5 * hi - 0.5 * lo;
        let largest = half.max_element();
        if largest == 0.0 {
            return Err(Error::input(None, "all vertices are at one point", "give a mesh with a surface"));
        }
        let scale = (half / largest).length() * largest * 2.0;
        if !scale.is_finite() {
            return Err(Error::input(
                None,
                "the coordinates are too large for 64-bit numbers",
                "scale it \
            down",
            ));
        }
        Ok(Self { centre: 0.5 * lo + 0.5 * hi, scale })
    }

    /// A point in the file's units, mapped into the unit frame.
    pub fn to_unit(self, point: DVec3) -> DVec3 {
        // Divided, not multiplied by the inverse, which overflows for the smallest boxes.
        (point - self.centre) / self.scale
    }

    /// A point of the unit frame, mapped back into the file's units.
    pub fn to_input_units(self, point: DVec3) -> DVec3 {
        point * self.scale + self.centre
    }
}
