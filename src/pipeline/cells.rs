//! The cells of a result's vertices.

use super::outcome::Outcome;
use crate::mesh::cell_mesh::{CellKind, CellMesh};
use crate::mesh::unit_frame::UnitFrame;
use crate::options::Options;
use crate::sites::restricted_voronoi::RestrictedVoronoi;
use crate::{ProgressToken, Result, TriMesh};

/// The cells, if the options ask for them: the tangent faces of the last iteration if the method has some,
/// else exact cells on the repaired input.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn cells_of(
    outcome: &mut Outcome,
    (result, input): (&TriMesh, &TriMesh),
    frame: &UnitFrame,
    options: &Options,
    progress: &ProgressToken,
) -> Result<Option<CellMesh>> {
    if !options.cells {
        return Ok(None);
    }
    if let Some(faces) = outcome.tangent_faces.take() {
        let of_vertices = faces.into_iter().map(|face| vec![face]).collect();
        return Ok(Some(CellMesh::new(CellKind::Tangent, of_vertices).in_units_of(frame)));
    }
    let unit = |points: &[glam::DVec3]| points.iter().map(|p| frame.to_unit(*p)).collect::<Vec<_>>();
    let surface = TriMesh { vertices: unit(&input.vertices), triangles: input.triangles.clone() };
    let cells = RestrictedVoronoi::new(&unit(&result.vertices)).polygons(&surface, progress)?;
    Ok(Some(CellMesh::new(CellKind::Exact, cells).in_units_of(frame)))
}
