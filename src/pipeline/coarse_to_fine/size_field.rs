//! The size field over the surface, from the options.

use super::bend_lengths::lengths_at_bends;
use super::levels::leaves_enough;
use crate::mesh::repair::connected_components;
use crate::mesh::sizing::{Bounds, Graded, SizeField, along_curve, curvature, graded};
use crate::mesh::spacing;
use crate::mesh::unit_frame::decimals;
use crate::options::{Length, Options, Sizing};
use crate::pipeline::refined::refuse_share;
use crate::sites::surface_curves::SurfaceCurves;
use crate::{Error, Result, TriMesh};
use std::borrow::Cow;
use std::ops::RangeInclusive;
use std::sync::OnceLock;

/// By default, sizes are at most this many times smaller or larger than the edge length of a uniform mesh.
const RANGE: f64 = 8.0;
/// Curvature below this, in the unit-diagonal frame, counts as flat.
const FLAT: f64 = 0.01;

/// Largest angle of a bend, in radians, that an edge longer than those of a uniform mesh may span.
const TURN: f64 = 0.7;
/// Where lengths are only fixed because a boundary is kept, they grow by this much from there: the less even
/// triangles in between are few.
const FROM_BOUNDARY: f64 = 0.8;
/// Lengths that the user fixed may take this many times the vertices that there are.
const EXACT: RangeInclusive<f64> = 0.95..=1.02;
/// Those next to kept edges alone: all are scaled alike then.
const ABOUT: RangeInclusive<f64> = 0.4..=1.25;
/// Minimum number of vertices of a component, unless a uniform mesh has fewer there.
const ENOUGH: usize = 60;

/// Input of [`size_field`].
pub(crate) struct SizeRequest<'a> {
    pub options: &'a Options,
    /// The shortest edge length.
    pub min_edge: Option<Length>,
    pub vertices: usize,
    pub sizing: &'a Sizing,
    /// Whether edges are to be shorter at bends.
    pub has_bends: bool,
    /// Sizes at the vertices of the surface, for [`Sizing::Given`].
    pub given: &'a [f64],
    /// Lengths at the vertices of the surface that stay, infinite elsewhere; empty if there are none.
    pub fixed: &'a [f64],
    /// Lengths below which those at the vertices of the surface do not fall; empty if there are none.
    pub floors: &'a [f64],
    /// Diagonal of the input's bounding box, in its units.
    pub diagonal: f64,
}

/// How much a surface with its curves bends, found once for all edge lengths with one spacing.
#[derive(Debug, Default)]
pub(crate) struct Curvatures(OnceLock<(f64, Vec<f64>)>);

impl Curvatures {
    /// Those at the vertices; the surface and its curves must always be the same.
    fn of(&self, surface: &TriMesh, curves: Option<&SurfaceCurves>, spacing: f64) -> Cow<'_, [f64]> {
        let (at, known) = self.0.get_or_init(|| (spacing, largest_curvatures(surface, curves, spacing)));
        if *at == spacing {
            return Cow::Borrowed(known);
        }
        Cow::Owned(largest_curvatures(surface, curves, spacing))
    }
}

/// The size field over `surface`, which is in the unit-diagonal frame, with its curves and how much it bends.
///
/// # Errors
/// [`Error::Usage`] for bounds that exclude a uniform mesh and fixed lengths for another number of vertices,
/// [`Error::Input`] for sizes that are not positive.
pub(crate) fn size_field(
    surface: &TriMesh,
    (curves, bent): (Option<&SurfaceCurves>, &Curvatures),
    request: &SizeRequest,
) -> Result<SizeField> {
    let SizeRequest { options, min_edge, vertices, sizing, has_bends, given, fixed, floors, diagonal } =
        *request;
    let max_edge = options.coarse_to_fine.max_edge;
    let spacing = spacing(surface.area(), vertices);
    if *sizing == Sizing::Automatic && has_bends {
        let field = lengths_at_bends(surface, &bent.of(surface, curves, spacing), spacing);
        let has_room = |curves: &SurfaceCurves| {
            leaves_enough(&curves.clone().with_sizes(&field), surface.area(), vertices)
        };
        return Ok(if curves.is_none_or(has_room) { field } else { SizeField::default() });
    }
    // Lengths that depend on the direction are made where they are used.
    if (sizing.is_even() || options.coarse_to_fine.sizing.aspect().is_some()) && fixed.is_empty() {
        return Ok(SizeField::default());
    }
    let curvatures = bent.of(surface, curves, spacing);
    let desired = match sizing {
        Sizing::Curvature { gradation } => {
            curvatures.iter().map(|curvature| curvature.max(FLAT).powf(-0.5 * gradation)).collect()
        }
        even if even.is_even() => vec![1.0; surface.vertices.len()],
        _ => given.to_vec(),
    };
    let [least, largest] = length_range([min_edge, max_edge], spacing, diagonal)?;
    let mut most = fit_for_cells(surface, &curvatures, spacing);
    most.iter_mut().for_each(|most| *most = most.min(largest));
    let growth = match sizing.is_even() && options.coarse_to_fine.refine.is_empty() {
        true => options.coarse_to_fine.growth.max(FROM_BOUNDARY),
        false => options.coarse_to_fine.growth,
    };
    let bounds = Bounds { spacing, least, largest: &most, growth, fixed, floors };
    let Graded { lengths, share } = graded(surface, &desired, &bounds);
    let may_be = if options.coarse_to_fine.refine.is_empty() { ABOUT } else { EXACT };
    if !fixed.is_empty() && !may_be.contains(&share) {
        return Err(refuse_share(options, vertices, share));
    }
    Ok(SizeField::new(surface.clone(), lengths))
}

/// The shortest and the longest edge length, from what the options say, for edges of this `spacing` on
/// average; all in diagonals, which are `diagonal` long.
///
/// # Errors
/// [`Error::Usage`] for bounds that exclude a uniform mesh.
pub(crate) fn length_range(
    [min_edge, max_edge]: [Option<Length>; 2],
    spacing: f64,
    diagonal: f64,
) -> Result<[f64; 2]> {
    let [least, largest] = [(min_edge, 1.0 / RANGE), (max_edge, RANGE)]
        .map(|(length, share)| length.map_or(share * spacing, |length| length.share_of(diagonal)));
    let decimals = decimals(diagonal);
    let in_units = |length: f64| format!("{:.decimals$}", length * diagonal);
    if least > largest && min_edge.is_some() && max_edge.is_some() {
        let problem = format!("`min_edge` {} is more than `max_edge` {}", in_units(least), in_units(largest));
        return Err(Error::option("min_edge", problem, "give a smaller `min_edge` or a larger `max_edge`"));
    }
    if least > spacing || largest < spacing {
        let (name, length, than, other) = match least > spacing {
            true => ("min_edge", least, "more", "smaller"),
            false => ("max_edge", largest, "less", "larger"),
        };
        let problem = format!(
            "`{name}` {} is {than} than {}, the mean edge length of the result",
            in_units(length),
            in_units(spacing)
        );
        let size = if least > spacing { "fewer vertices" } else { "more vertices" };
        return Err(Error::option(name, problem, format!("give a {other} `{name}`, or ask for {size}")));
    }
    Ok([least, largest])
}

/// The largest size at each vertex with which components have enough vertices, and tubes are round; nowhere
/// below the spacing, since a uniform mesh has no smaller sizes either.
fn fit_for_cells(surface: &TriMesh, curvatures: &[f64], spacing: f64) -> Vec<f64> {
    let (of_triangle, areas) = connected_components(surface);
    let mut most: Vec<f64> =
        curvatures.iter().map(|curvature| (TURN / curvature.max(FLAT)).max(spacing)).collect();
    for (triangle, part) in surface.triangles.iter().zip(of_triangle) {
        let enough = crate::mesh::spacing(areas[part as usize], ENOUGH).max(spacing);
        triangle.iter().for_each(|v| most[*v as usize] = most[*v as usize].min(enough));
    }
    most
}

/// Curvature of the surface, or of a curve on it if that is larger, at each vertex.
fn largest_curvatures(surface: &TriMesh, curves: Option<&SurfaceCurves>, spacing: f64) -> Vec<f64> {
    let Some(curves) = curves else { return curvature(surface, &[], spacing) };
    let mut curvatures = curvature(surface, &curves.on_curve, spacing);
    for (line, vertices) in curves.polylines().zip(curves.vertices()) {
        for (k, v) in vertices.iter().enumerate() {
            let largest = &mut curvatures[*v as usize];
            *largest = largest.max(along_curve(line, line.arc_length_at(k), spacing));
        }
    }
    curvatures
}
