//! Where points of space lie on a mesh.

use glam::DVec3;
use rayon::prelude::*;

use super::TriMesh;
use super::correspondence::{QueryPoint, SurfacePoint, SurfaceSearch, snapped};
use super::triangle::closest_on_triangle;
use super::unit_frame::UnitFrame;
use crate::{Error, ProgressToken, Result};

/// Points that each thread takes in a row; those that follow each other are near each other.
const CHUNK: usize = 512;

/// Points whose places on a mesh are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointsToLocate<'a> {
    /// In the mesh's unit.
    pub points: &'a [DVec3],
    /// The direction that the surface faces at each point, of any length; empty if any will do.
    pub normals: &'a [DVec3],
    /// By how much nearer, in the mesh's unit, a triangle that faces away from a point's normal must be to
    /// count.
    pub margin: f64,
}

/// For each point the nearest one of `mesh`, among triangles that face as its normal does, unless one that
/// faces away is nearer by more than the margin.
///
/// # Errors
/// [`Error::Input`]: a mesh without triangles, a coordinate that is not finite, or a point too far away for
/// the distance to be a number; [`Error::Cancelled`].
/// Panics unless there are as many normals as points, or none.
pub fn locate(
    mesh: &TriMesh,
    wanted: &PointsToLocate,
    progress: &ProgressToken,
) -> Result<Vec<SurfacePoint>> {
    let PointsToLocate { points, normals, margin } = *wanted;
    assert!(normals.is_empty() || normals.len() == points.len());
    if mesh.triangles.is_empty() {
        return Err(Error::input(None, "the mesh has no triangles", "give one with triangles"));
    }
    let frame = UnitFrame::of(mesh)?;
    // Far from a small mesh, lengths overflow.
    if let Some(at) = points.iter().position(|p| !frame.to_unit(*p).length_squared().is_finite()) {
        return Err(Error::input(None, format!("point {at} is too far away"), "leave it out"));
    }
    let unit = TriMesh {
        vertices: mesh.vertices.iter().map(|p| frame.to_unit(*p)).collect(),
        triangles: mesh.triangles.clone(),
    };
    let search = SurfaceSearch::new(&unit);
    let margin = margin / frame.scale;
    let chunks = points.par_chunks(CHUNK).zip((0..points.len()).into_par_iter().step_by(CHUNK));
    let found = chunks.take_any_while(|_| !progress.is_cancelled()).flat_map_iter(|(chunk, start)| {
        let mut rank = 0;
        let place = |(index, point): (usize, &DVec3)| {
            let at = frame.to_unit(*point);
            let triangle = match normals.get(index) {
                Some(normal) => search.find(&QueryPoint { at, normal: *normal, margin }, &mut rank),
                // A mesh with a frame has a triangle that is near.
                None => search.bvh.closest_from(at, &mut rank).map_or(0, |near| near.triangle),
            };
            let closest = closest_on_triangle(at, unit.corners(triangle as usize));
            SurfacePoint { triangle, barycentric: snapped(closest.barycentric) }
        };
        (start..).zip(chunk).map(place).collect::<Vec<_>>()
    });
    let found = found.collect();
    progress.poll()?;
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheet at height 0 that faces up, and one below it that faces down.
    fn plate(thickness: f64) -> TriMesh {
        let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let square =
            |z: f64| [corner(0.0, 0.0, z), corner(1.0, 0.0, z), corner(1.0, 1.0, z), corner(0.0, 1.0, z)];
        let vertices = [square(0.0), square(-thickness)].concat();
        TriMesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]] }
    }

    #[test]
    fn normals_choose_the_side_within_the_margin() {
        let mesh = plate(0.1);
        let points = [DVec3::new(0.6, 0.2, -0.02), DVec3::new(0.2, 0.6, 3.0)];
        let place = |normals: &[DVec3], margin: f64| {
            let wanted = PointsToLocate { points: &points, normals, margin };
            locate(&mesh, &wanted, &ProgressToken::default()).unwrap()
        };
        let triangles = |found: Vec<SurfacePoint>| found.iter().map(|p| p.triangle).collect::<Vec<u32>>();
        assert_eq!(triangles(place(&[], 0.0)), [0, 1]);
        // The lower side is 0.06 farther from the first point than the upper one, and 0.1 from the second.
        for (margin, expected) in [(0.05, [0, 1]), (0.07, [2, 1]), (0.11, [2, 3])] {
            assert_eq!(triangles(place(&[-DVec3::Z; 2], margin)), expected, "{margin}");
        }
        let found = place(&[], 0.0);
        let far = PointsToLocate { points: &[1e308 * DVec3::ONE], normals: &[], margin: 0.0 };
        let refused = locate(&mesh, &far, &ProgressToken::default()).unwrap_err();
        assert!(refused.to_string().contains("point 0 is too far away"), "{refused}");
        assert!(found[0].position(&mesh).distance(DVec3::new(0.6, 0.2, 0.0)) < 1e-12);
    }
}
