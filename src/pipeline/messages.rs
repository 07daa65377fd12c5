//! What a run tells its user in words.

use crate::measure::Measures;
use crate::mesh::repair::RepairCounts;
use crate::mesh::topology::Topology;
use crate::options::Options;
use crate::sites::connect::ConnectCounts;
use crate::stages::face::cell::FlagCounts;

/// What a user should know of the input, and of what it led to.
pub(crate) fn remarks(
    repaired: &RepairCounts,
    input: &Topology,
    crossing: Option<usize>,
    collapsed: usize,
) -> Vec<String> {
    let mut list = repaired.notes();
    let turned = input.inconsistent_edges.saturating_sub(input.nonmanifold_edges);
    let lines = [
        (input.nonmanifold_edges, "edges of the input with more than two faces stay junctions"),
        (input.nonmanifold_vertices, "vertices of the input where parts of the surface only touch"),
        (turned, "edges of the input with faces turned against each other"),
        (crossing.unwrap_or(0), "faces of the input intersect others"),
        (
            collapsed,
            "components made by collapsing edges: smaller, or with smaller details, than cells can keep",
        ),
    ];
    list.extend(lines.iter().filter(|(count, _)| *count > 0).map(|(count, text)| format!("{count} {text}")));
    list
}

/// What went wrong, one line each.
pub(crate) fn warnings(
    options: &Options,
    wanted: usize,
    input: &Topology,
    output: &Measures,
    connected: &ConnectCounts,
    flags: &FlagCounts,
    fault: Option<String>,
) -> Vec<String> {
    let got = &output.topology;
    let mut list = Vec::new();
    let mut say = |bad: bool, text: String| {
        if bad {
            list.push(text);
        }
    };
    let lost = flags.triangle_overflow + flags.plane_overflow + flags.corner_overflow + flags.badly_closed;
    say(lost > 0, format!("{lost} sites have no face (see flags in the report)"));
    say(
        options.has_plane_faces() && !input.is_closed_manifold(),
        "the input is not a closed manifold; this preset connects closed surfaces only".into(),
    );
    say(
        connected.unfilled_faces > 0,
        format!("{} faces could not be filled and are holes", connected.unfilled_faces),
    );
    say(got.vertices != wanted, format!("the result uses {} of {wanted} vertices", got.vertices));
    say(
        input.is_closed_manifold() && !got.is_closed_manifold(),
        "the result is not a closed manifold".into(),
    );
    say(
        (got.components, got.euler, got.boundary_loops)
            != (input.components, input.euler, input.boundary_loops),
        format!(
            "topology differs: {} components, Euler characteristic {}, {} boundary loops instead of {}, {}, {}",
            got.components,
            got.euler,
            got.boundary_loops,
            input.components,
            input.euler,
            input.boundary_loops
        ),
    );
    list.extend(fault);
    list
}
