//! Colours of faces by quality or by distance.

use super::drawable::check;
use crate::mesh::bvh::Bvh;
use crate::mesh::quality::TriangleQuality;
use crate::{Result, TriMesh};
use glam::DVec3;
use rayon::prelude::*;

/// A colour: red, green and blue.
pub type Colour = [u8; 3];

/// The quality that the darkest colour stands for; 1 is the lightest.
pub(crate) const WORST: f64 = 0.4;
/// Distances below this share of the coordinates are rounding, as in files of 32-bit numbers.
const ROUNDING: f64 = 1e-6;

/// A colour for each face by its quality, [`TriangleQuality::q`]: light for equilateral ones, dark for
/// slivers.
pub fn quality_colours(mesh: &TriMesh) -> Vec<Colour> {
    quality_shares(mesh).into_iter().map(quality_colour).collect()
}

/// The colour for a position on the quality scale, 0..=1.
pub(crate) fn quality_colour(share: f64) -> Colour {
    colour_at(colorous::VIRIDIS, share)
}

/// The colour of a share of the largest distance, 0..=1.
pub(crate) fn distance_colour(share: f64) -> Colour {
    colour_at(colorous::YELLOW_ORANGE_RED, share)
}

/// The position of each face on the quality scale: 0 at [`WORST`] or below, 1 if equilateral.
pub(crate) fn quality_shares(mesh: &TriMesh) -> Vec<f64> {
    let of = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        // Scaled, so that powers of lengths neither overflow nor underflow.
        let size = [b - a, c - a]
            .map(|side| side.abs().max_element())
            .iter()
            .fold(f64::MIN_POSITIVE, |m, x| m.max(*x));
        let quality = TriangleQuality::new([DVec3::ZERO, (b - a) / size, (c - a) / size]);
        ((quality.q - WORST) / (1.0 - WORST)).clamp(0.0, 1.0)
    };
    (0..mesh.triangles.len()).into_par_iter().map(of).collect()
}

/// Colours by distance.
#[derive(Debug, Clone, PartialEq)]
pub struct DistanceColours {
    /// For each face, or for each vertex of a mesh without faces.
    pub colours: Vec<Colour>,
    /// The largest distance of a triangle's centroid, in the meshes' units.
    pub largest: f64,
}

/// Colours each triangle of each mesh by the distance of its centroid from `reference`, or each vertex of a
/// mesh without triangles: pale for small distances, dark red for the largest distance of all these meshes.
/// Differences by rounding stay pale.
///
/// # Errors
/// [`crate::Error::Input`] if the reference has no faces.
pub fn distance_colours(meshes: &[TriMesh], reference: &TriMesh) -> Result<Vec<DistanceColours>> {
    check(reference)?;
    let distances: Vec<Vec<f64>> = meshes.iter().map(|mesh| centre_distances(mesh, reference)).collect();
    let rounding =
        reference.bounds().map_or(0.0, |[low, high]| ROUNDING * low.abs().max(high.abs()).max_element());
    let darkest = distances.iter().flatten().copied().fold(rounding.max(f64::MIN_POSITIVE), f64::max);
    let of = |distances: Vec<f64>| DistanceColours {
        colours: distances.iter().map(|d| distance_colour(d / darkest)).collect(),
        largest: distances.into_iter().fold(0.0, f64::max),
    };
    Ok(distances.into_iter().map(of).collect())
}

/// The distance of each face's centroid from `reference`, in the meshes' units, or of each vertex of a mesh
/// without faces. Panics if an index is out of range.
pub(crate) fn centre_distances(mesh: &TriMesh, reference: &TriMesh) -> Vec<f64> {
    let tree = Bvh::new(reference);
    let of = |p: DVec3| tree.closest(p).map_or(0.0, |found| found.distance_sq.sqrt());
    if mesh.triangles.is_empty() {
        return mesh.vertices.par_iter().map(|p| of(*p)).collect();
    }
    let centre = |t: usize| mesh.corners(t).into_iter().sum::<DVec3>() / 3.0;
    (0..mesh.triangles.len()).into_par_iter().map(|t| of(centre(t))).collect()
}

fn colour_at(scale: colorous::Gradient, share: f64) -> Colour {
    let colour = scale.eval_continuous(share.clamp(0.0, 1.0));
    [colour.r, colour.g, colour.b]
}
