//! Remarks and warnings of a run, for its user.

use crate::grammar::counted;
use crate::measure::relative_volume;
use crate::mesh::repair::{Cracks, RepairCounts, Repaired, cracks};
use crate::mesh::topology::Topology;
use crate::pipeline::deviation::DeviationSummary;
use crate::pipeline::kept::Kept;
use crate::pipeline::rounding::Rounding;
use crate::pipeline::shape_warnings::Shapes;
use crate::pipeline::sides::are_opposite;
use crate::pipeline::warning::{Warning, WarningCode};
use crate::sites::connect::ConnectCounts;
use crate::stages::flags::FlagCounts;
use crate::{ProgressToken, Result};

/// What was unusual about the input, and what was done about it.
pub(crate) fn remarks(
    (repaired, kept): (&Repaired, Option<&Kept>),
    input: &Topology,
    crossing: Option<usize>,
    collapsed: usize,
    rounding: Option<&Rounding>,
) -> Vec<String> {
    let mut list = repaired.counts.notes();
    list.extend(kept.map(Kept::remark));
    let opposed = input.inconsistent_edges.saturating_sub(input.nonmanifold_edges);
    let lines = [
        (
            input.nonmanifold_edges,
            ["edge of the input has", "edges of the input have"],
            "more than two faces; junctions are kept",
        ),
        (
            input.nonmanifold_vertices,
            ["vertex of the input is", "vertices of the input are"],
            "non-manifold: parts of the surface only touch there",
        ),
        (opposed, ["edge of the input joins", "edges of the input join"], "faces of opposite orientation"),
        (crossing.unwrap_or(0), ["face of the input intersects", "faces of the input intersect"], "others"),
        (
            collapsed,
            ["component was too small or too detailed", "components were too small or too detailed"],
            "for Voronoi cells: remeshed by local operations",
        ),
    ];
    let present = lines.iter().filter(|(count, ..)| *count > 0);
    list.extend(present.map(|(count, words, rest)| format!("{} {rest}", counted(*count, *words))));
    list.extend(rounding.and_then(Rounding::remark));
    list
}

/// Cracks of the input, with what closes them.
pub(crate) fn describe_cracks(cracks: &Cracks) -> String {
    let edges = counted(cracks.edges, ["boundary edge lies", "boundary edges lie"]);
    format!("the input has cracks: {edges} close to others, and `weld` {:e} closes them", cracks.weld)
}

/// What [`warnings`] are about.
pub(crate) struct WarningInput<'a> {
    pub expected_vertices: usize,
    pub counts: &'a ConnectCounts,
    pub flags: &'a FlagCounts,
    pub fault: Option<String>,
    /// Warnings of sharp edges that were given up.
    pub given_up: Vec<Warning>,
    /// Faces of the input that intersect others, if they were counted.
    pub input_intersections: Option<usize>,
    /// What rounding to the format of the file changed, if anything.
    pub rounding: Option<&'a Rounding>,
    /// What repairing the input changed.
    pub repaired: &'a RepairCounts,
    /// About regions to be refined that no part of the surface is in.
    pub missed_regions: Vec<String>,
    /// About vertices to be kept.
    pub pinned: Vec<Warning>,
    /// What a largest deviation led to, if one was asked for.
    pub deviation: Option<DeviationSummary>,
    /// The shapes of input and result.
    pub shapes: Shapes<'a>,
}

/// The message that bodies of the input touch along faces, of which one of each pair is left. The two sides
/// of a sheet alone leave no edge with more than two faces.
fn touching_bodies(repaired: &RepairCounts, input: &Topology) -> Option<String> {
    let merged = repaired.opposite_faces_merged;
    let faces = counted(merged, ["face was", "faces were"]);
    let text = format!(
        "bodies of the input touch: {faces} merged with a face of opposite orientation, so that the bodies \
        share a wall; remesh each body separately to keep it closed"
    );
    (merged > 0 && input.nonmanifold_edges > 0).then_some(text)
}

/// What went wrong, one line each.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn warnings(of: &WarningInput, progress: &ProgressToken) -> Result<Vec<Warning>> {
    let Shapes { options, input: (input_mesh, input), result: (_, output), .. } = of.shapes;
    // First, since the others may follow from it.
    let warning = |code| move |text| Warning { code, text };
    let mut list: Vec<Warning> =
        of.rounding.and_then(Rounding::warning).map(warning(WarningCode::Rounding)).into_iter().collect();
    list.extend(of.missed_regions.iter().cloned().map(warning(WarningCode::Refine)));
    list.extend(of.pinned.iter().cloned());
    list.extend(touching_bodies(of.repaired, input).map(warning(WarningCode::TouchingBodies)));
    list.extend(of_topology(of));
    // A fault tells of them, too.
    let of_output = (output.self_intersecting_faces, of.input_intersections);
    list.extend(intersections(of_output, of.rounding).filter(|_| of.fault.is_none()));
    list.extend(of.given_up.iter().cloned());
    // Where rounding spoils triangles, other vertices do not help.
    if of.rounding.and_then(Rounding::warning).is_none() {
        list.extend(of.shapes.warnings(progress)?);
    }
    let deviation = of.deviation.and_then(|deviation| deviation.warning(options.vertices));
    list.extend(deviation.map(warning(WarningCode::Deviation)));
    list.extend(of.fault.clone().map(warning(WarningCode::Fault)));
    if input.boundary_edges > 0 {
        list.extend(cracks(input_mesh).as_ref().map(describe_cracks).map(warning(WarningCode::Cracks)));
    }
    Ok(list)
}

/// Tells of faces of a result that intersect others where those of the input do not: their numbers, as far as
/// they are known. Those that rounding made have a warning of their own.
pub(crate) fn intersections(
    (of_result, of_input): (Option<usize>, Option<usize>),
    rounding: Option<&Rounding>,
) -> Option<Warning> {
    let count = of_result.filter(|count| *count > rounding.map_or(0, |rounding| rounding.crossing))?;
    let faces = counted(count, ["self-intersecting face", "self-intersecting faces"]);
    let text = format!("{faces} (the input has none): ask for more vertices");
    (of_input == Some(0)).then_some(Warning { code: WarningCode::Intersections, text })
}

/// What went wrong with sites, vertices and topology.
fn of_topology(of: &WarningInput) -> Vec<Warning> {
    let WarningInput { counts, flags, .. } = *of;
    let Shapes { options, input: (input_mesh, input), result: (_, output), .. } = of.shapes;
    let got = &output.topology;
    let mut list = Vec::new();
    let mut say = |bad: bool, code: WarningCode, text: String| {
        if bad {
            list.push(Warning { code, text });
        }
    };
    let lost = flags.triangle_overflow + flags.plane_overflow + flags.corner_overflow + flags.badly_closed;
    say(
        lost > 0,
        WarningCode::LostFaces,
        format!("{} no face (see `flags` in the report)", counted(lost, ["site has", "sites have"])),
    );
    say(
        options.has_plane_faces() && !input.is_closed_manifold(),
        WarningCode::OpenInput,
        "the input is not a closed manifold, but this preset supports only closed surfaces".into(),
    );
    say(
        counts.unfilled_faces > 0,
        WarningCode::UnfilledFaces,
        format!(
            "{} not be triangulated and stayed open",
            counted(counts.unfilled_faces, ["face could", "faces could"])
        ),
    );
    say(
        got.vertices != of.expected_vertices,
        WarningCode::VertexCount,
        format!("the result has {} instead of {} vertices", got.vertices, of.expected_vertices),
    );
    say(
        input.is_closed_manifold() && !got.is_closed_manifold(),
        WarningCode::OpenResult,
        "the result is not a closed manifold".into(),
    );
    say(
        (got.components, got.euler, got.boundary_loops)
            != (input.components, input.euler, input.boundary_loops),
        WarningCode::Topology,
        format!(
            "the topology differs: {} instead of {}, Euler characteristic {} instead of {}, {} instead of {}",
            counted(got.components, ["component", "components"]),
            input.components,
            got.euler,
            input.euler,
            counted(got.boundary_loops, ["boundary loop", "boundary loops"]),
            input.boundary_loops
        ),
    );
    let input_volume = (input.boundary_edges == 0).then(|| relative_volume(input_mesh));
    say(
        input_volume.zip(output.relative_volume).is_some_and(|(one, other)| are_opposite(one, other)),
        WarningCode::InsideOut,
        "the result is inside out: ask for more vertices".into(),
    );
    list
}
