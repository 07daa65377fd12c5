//! Edge lengths over the surface, by which sites are weighted.

use crate::mesh::sizing::SizeField;
use crate::mesh::subdivide::Halved;
use crate::options::{Options, Sizing};
use crate::pipeline::coarse_to_fine::size_field::{Curvatures, SizeRequest, size_field};
use crate::pipeline::coarse_to_fine::surface_model::surface_vertices;
use crate::pipeline::plan::Plan;
use crate::sites::surface::Surface;
use crate::{Result, TriMesh};

/// The lengths on `surface`, which is `on` in the unit-diagonal frame: the run's mesh, or what halving its
/// edges made of it.
///
/// # Errors
/// Those of [`size_field`].
pub(crate) fn sizes(
    surface: &Surface,
    on: &TriMesh,
    plan: &Plan,
    options: &Options,
    diagonal: f64,
) -> Result<SizeField> {
    if !options.is_weighted() {
        return Ok(SizeField::default());
    }
    let mut given = Vec::new();
    if let Sizing::Given(values) = &plan.sizing {
        given = vec![1.0; surface.vertices.len()];
        let places = surface_vertices(surface, on).into_iter();
        places.zip(values).for_each(|(v, value)| given[v as usize] = *value);
    }
    let request = SizeRequest {
        options,
        min_edge: plan.min_edge,
        vertices: plan.vertices,
        sizing: &plan.sizing,
        has_bends: false,
        given: &given,
        fixed: &[],
        floors: &[],
        diagonal,
    };
    size_field(&surface.mesh(), (None, &Curvatures::default()), &request)
}

/// Adds the values at the middles of halved edges.
pub(crate) fn halve_values(sizing: &mut Sizing, halved: &Halved) {
    if let Sizing::Given(values) = sizing {
        for [a, b] in &halved.halves {
            values.push(0.5 * (values[*a as usize] + values[*b as usize]));
        }
    }
}
