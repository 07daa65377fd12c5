//! How long edges are to be over the surface, from the options.

use crate::mesh::sizing::{Bounds, SizeField, along_curve, curvature, graded};
use crate::mesh::spacing;
use crate::options::{Options, Sizing};
use crate::stages::surface_curves::SurfaceCurves;
use crate::{Error, Result, TriMesh};

/// Unless told otherwise, no edge is wanted to be so many times shorter or longer than those of a uniform mesh.
const RANGE: f64 = 8.0;
/// What is flatter than this, in the unit-diagonal frame, is flat.
const FLAT: f64 = 0.01;

/// What a field is made from.
pub(super) struct SizeWish<'a> {
    pub options: &'a Options,
    /// Numbers at the vertices of the surface, for [`Sizing::Given`].
    pub given: &'a [f64],
    /// Of the input's bounding box, in its units.
    pub diagonal: f64,
}

/// The field over `surface`, which is in the unit-diagonal frame, with its curves.
///
/// # Errors
/// [`Error::Usage`] for bounds that exclude a uniform mesh, [`Error::Input`] for numbers that are no lengths.
pub(super) fn size_field(
    surface: &TriMesh,
    curves: Option<&SurfaceCurves>,
    wish: &SizeWish,
) -> Result<SizeField> {
    let SizeWish { options, given, diagonal } = *wish;
    let area: f64 = (0..surface.triangles.len()).map(|t| area(surface, t)).sum();
    let spacing = spacing(area, options.vertices);
    let wished = match &options.sizing {
        Sizing::Uniform => return Ok(SizeField::default()),
        Sizing::Curvature { gradation } => {
            let bends = bends(surface, curves, spacing);
            bends.iter().map(|bend| bend.max(FLAT).powf(-0.5 * gradation)).collect()
        }
        Sizing::Given(_) => given.to_vec(),
    };
    let [least, largest] = [(options.min_edge, 1.0 / RANGE), (options.max_edge, RANGE)]
        .map(|(length, share)| length.map_or(share * spacing, |length| length.share_of(diagonal)));
    if least > spacing || largest < spacing {
        let (name, length) = if least > spacing { ("min-edge", least) } else { ("max-edge", largest) };
        let problem = format!(
            "--{name} {} does not go with {} vertices, whose edges have {} on average",
            length * diagonal,
            options.vertices,
            spacing * diagonal
        );
        return Err(Error::usage(problem, "ask for another number of vertices, or another length"));
    }
    let bounds = Bounds { spacing, least, largest, growth: options.growth };
    Ok(SizeField::new(surface.clone(), graded(surface, &wished, &bounds)))
}

/// How much the surface, or a curve on it, bends at each vertex.
fn bends(surface: &TriMesh, curves: Option<&SurfaceCurves>, spacing: f64) -> Vec<f64> {
    let Some(curves) = curves else { return curvature(surface, &[], spacing) };
    let mut bends = curvature(surface, &curves.on_curve, spacing);
    for (line, vertices) in curves.polylines().zip(curves.vertices()) {
        for (k, v) in vertices.iter().enumerate() {
            let bend = &mut bends[*v as usize];
            *bend = bend.max(along_curve(line, line.way_to(k), spacing));
        }
    }
    bends
}

fn area(mesh: &TriMesh, t: usize) -> f64 {
    let [a, b, c] = mesh.corners(t);
    0.5 * (b - a).cross(c - a).length()
}
