//! Ways to specify the number of vertices of a result.

use crate::mesh::features::spacing_of;
use crate::mesh::topology::topology;
use crate::mesh::unit_frame::UnitFrame;
use crate::{Error, Result, TriMesh};
use serde::{Deserialize, Serialize};

/// The fewest vertices of a closed surface.
const FEWEST: usize = 4;

/// A length on a mesh; above 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "kebab-case")]
pub enum Length {
    /// In the units of the input.
    Units(f64),
    /// As a fraction of the diagonal of the input's bounding box.
    OfDiagonal(f64),
}

impl Length {
    /// As a fraction of a diagonal of this length.
    pub(crate) fn share_of(self, diagonal: f64) -> f64 {
        match self {
            Self::Units(length) => length / diagonal,
            Self::OfDiagonal(share) => share,
        }
    }
}

/// The size of a result. [`Size::vertices`] converts it to the number of vertices that [`crate::Options`]
/// takes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Size {
    /// This number of vertices.
    Vertices(usize),
    /// The number of vertices at which a closed surface has this number of triangles.
    /// [`crate::Options::faces`] is exact for other surfaces, too.
    Faces(usize),
    /// The number of vertices at which the edges of an even mesh have this length, in input units; above 0.
    EdgeLength(f64),
    /// Like [`Size::EdgeLength`], as a fraction of the diagonal of the input's bounding box; above 0.
    RelativeEdgeLength(f64),
    /// This number times the input's vertices; above 0.
    Ratio(f64),
    /// As many vertices as the input has.
    AsInput,
}

impl Size {
    /// The edge length, if that is what is given.
    pub(crate) fn length(self) -> Option<Length> {
        match self {
            Self::EdgeLength(length) => Some(Length::Units(length)),
            Self::RelativeEdgeLength(share) => Some(Length::OfDiagonal(share)),
            Self::Vertices(_) | Self::Faces(_) | Self::Ratio(_) | Self::AsInput => None,
        }
    }

    /// Checks what can be checked without a mesh.
    ///
    /// # Errors
    /// [`Error::Usage`] for a length or ratio that is not a number above 0.
    pub fn validate(self) -> Result<()> {
        let (name, value) = match self {
            Self::EdgeLength(value) | Self::RelativeEdgeLength(value) => ("edge length", value),
            Self::Ratio(value) => ("ratio", value),
            Self::Vertices(_) | Self::Faces(_) | Self::AsInput => return Ok(()),
        };
        if value > 0.0 && value.is_finite() {
            return Ok(());
        }
        Err(Error::usage(format!("the {name} {value} is out of range"), "give a number above 0"))
    }

    /// The number of vertices for the repaired mesh `input`; except for [`Size::Vertices`], at least 4.
    ///
    /// The edge length is that of a hexagonal layout of the vertices on the area of the input.
    ///
    /// # Errors
    /// [`Error::Usage`] as [`Size::validate`], and for more vertices than an index can count;
    /// [`Error::Input`] for a mesh without extent.
    pub fn vertices(self, input: &TriMesh) -> Result<usize> {
        self.validate()?;
        // The length at which one vertex has the whole area; each vertex has the share of its square.
        let at_length = |length: f64| spacing_of(input, 1).map(|whole| (whole / length).powi(2));
        let wanted = match self {
            Self::Vertices(count) => return Ok(count),
            Self::Faces(count) => (count / 2) as f64 + topology(input).euler as f64,
            Self::AsInput => input.vertices.len() as f64,
            Self::Ratio(ratio) => ratio * input.vertices.len() as f64,
            Self::EdgeLength(length) => at_length(length)?,
            Self::RelativeEdgeLength(share) => at_length(share * UnitFrame::of(input)?.scale)?,
        };
        if wanted >= f64::from(u32::MAX) {
            return Err(Error::usage(
                format!("this size asks for {wanted:.3e} vertices, more than an index can count"),
                "ask for longer edges or a smaller ratio",
            ));
        }
        // In range by the check above, so nothing is cut off.
        Ok((wanted.round() as usize).max(FEWEST))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;

    #[test]
    fn lengths_and_ratios_become_counts() {
        let unit = sample("box").unwrap();
        // Six unit squares.
        let expected = (2.0 * 6.0 / (3f64.sqrt() * 0.05 * 0.05)).round() as usize;
        assert_eq!(Size::EdgeLength(0.05).vertices(&unit).unwrap(), expected);
        let relative = Size::RelativeEdgeLength(0.05 / 3f64.sqrt());
        assert!(relative.vertices(&unit).unwrap().abs_diff(expected) <= 1);
        assert_eq!(Size::AsInput.vertices(&unit).unwrap(), 8);
        assert_eq!(Size::Ratio(2.5).vertices(&unit).unwrap(), 20);
        assert_eq!(Size::Ratio(0.01).vertices(&unit).unwrap(), 4);
        assert_eq!(Size::EdgeLength(100.0).vertices(&unit).unwrap(), 4);
        assert_eq!(Size::Vertices(3).vertices(&unit).unwrap(), 3);
        assert_eq!(Size::Faces(1001).vertices(&unit).unwrap(), 502);
    }

    #[test]
    fn sizes_that_cannot_be_are_refused() {
        let unit = sample("box").unwrap();
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            for size in [Size::EdgeLength(bad), Size::RelativeEdgeLength(bad), Size::Ratio(bad)] {
                assert!(matches!(size.vertices(&unit), Err(Error::Usage { .. })), "{size:?}");
            }
        }
        for size in [Size::EdgeLength(1e-6), Size::EdgeLength(1e-300), Size::Ratio(1e9)] {
            assert!(matches!(size.vertices(&unit), Err(Error::Usage { .. })), "{size:?}");
        }
    }
}
