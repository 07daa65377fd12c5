//! Symmetric results of symmetric inputs: one half is remeshed and mirrored.

use super::cells::cells_of;
use super::curves_of_whole::CurvesOfWhole;
use super::kept::in_units;
use super::measuring::{MeasureRequest, Measuring, correspondence_of};
use super::messages::{describe_cracks, intersections, remarks};
use super::outcome::Outcome;
use super::prepare::repaired_for;
use super::rounding::Rounding;
use super::shape_warnings::Shapes;
use super::small_angles::{MendingCounts, SmallAngleSummary};
use super::warning::Warning;
use super::{Remeshed, Summary, WarningCode, run};
use crate::gpu::Device;
use crate::grammar::counted;
use crate::mesh::mirror::Mirror;
use crate::mesh::repair::{RepairOptions, Repaired, cracks};
use crate::mesh::spacing;
use crate::mesh::topology::{Topology, topology};
use crate::mesh::unit_frame::UnitFrame;
use crate::options::{MeasureDepth, Options, Symmetry};
use crate::progress::ProgressReporter;
use crate::{CorrespondenceRequest, Error, Flow, Phase, Progress, ProgressToken, Result, TriMesh};

/// Inputs may differ from their mirror images by at most this fraction of the diagonal.
const TOLERANCE: f64 = 1e-3;
/// Runs with other numbers of vertices until the whole has the number asked for.
const TRIES: u32 = 4;

/// Remeshes the half of `mesh` on one side of its plane of symmetry, and mirrors the result.
///
/// # Errors
/// [`Error::Input`] for an input that is not symmetric; otherwise as [`super::remesh_repaired`].
pub(crate) fn remesh_symmetric(
    device: &Device,
    mesh: &TriMesh,
    repaired: Option<Repaired>,
    (options, symmetry): (&Options, Symmetry),
    callback: &mut dyn FnMut(Progress) -> Flow,
) -> Result<Remeshed> {
    let repaired = repaired_for(mesh, repaired, options, &ProgressToken::default())?;
    let (on, whole) = (&repaired.mesh, topology(&repaired.mesh));
    let Halved { mirror, half, cut } = halved(on, &whole, symmetry)?;
    let options = &in_units(options, on)?;
    let wanted = options.vertices;
    // As many vertices on the plane as edges fit along it.
    let on_plane = (cut / spacing(on.area(), wanted)).round() as usize;
    let mut count = (wanted + on_plane).div_ceil(2).max(4);
    let mut best: Option<(Remeshed, usize)> = None;
    let mut tried = Vec::new();
    for attempt in 0..TRIES {
        // Each run gets half of the progress that is left.
        let [from, to] = [attempt, attempt + 1].map(|k| 1.0 - 0.5_f64.powi(k as i32));
        let mut part = |now: Progress| {
            callback(Progress { fraction: from + (to - from) * now.fraction, attempt: 1, ..now })
        };
        let found =
            run(device, &half, None, &half_options(options, count), &mut ProgressReporter::new(&mut part))?;
        tried.push(count);
        let is_last = found.summary.finished_early;
        let joined = mirror.whole(found.mesh.clone());
        if !is_like(&joined, &whole) {
            if best.is_some() {
                break;
            }
            let problem =
                format!("the halves of a mesh of {wanted} vertices do not make a surface like the input");
            return Err(Error::usage(problem, "ask for more vertices, or remove `symmetric`"));
        }
        let total = joined.vertices.len();
        let found = Remeshed { mesh: joined, ..found };
        let is_better = |(_, off): &(Remeshed, usize)| total.abs_diff(wanted) < *off;
        if best.as_ref().is_none_or(is_better) {
            best = Some((found, total.abs_diff(wanted)));
        }
        // Twice what is off in one half, which has the plane's vertices too.
        let next = (count as i64 + (wanted as i64 - total as i64) / 2).max(4) as usize;
        if is_last || tried.contains(&next) {
            break;
        }
        count = next;
    }
    let Some((found, _)) = best else { return Err(Error::Internal("no half was remeshed".to_owned())) };
    let mut last = |now: Progress| callback(Progress { fraction: 1.0, attempt: 1, ..now });
    let mut progress = ProgressReporter::new(&mut last);
    progress.phase(Phase::Measure, 1.0, 0.0)?;
    let found = progress.during(|token| finish(mesh, &repaired, options, &whole, found, token))?;
    progress.done(1.0)?;
    Ok(found)
}

/// One half of a mesh.
pub(crate) struct Halved {
    mirror: Mirror,
    half: TriMesh,
    /// The length of the cut.
    cut: f64,
}

/// One half of the mesh, which has this topology.
///
/// # Errors
/// [`Error::Input`] if it is not symmetric.
pub(crate) fn halved(mesh: &TriMesh, whole: &Topology, symmetry: Symmetry) -> Result<Halved> {
    let mirror = find_mirror(mesh, symmetry)?;
    let (half, cut) = mirror.half(mesh);
    if is_like(&mirror.whole(half.clone()), whole) {
        return Ok(Halved { mirror, half, cut });
    }
    let problem = "a part of the surface lies in the plane of symmetry or touches it";
    Err(Error::input(None, problem, "remove that part, or remove `symmetric`"))
}

/// The plane that was asked for.
fn find_mirror(mesh: &TriMesh, symmetry: Symmetry) -> Result<Mirror> {
    let axes = match symmetry {
        Symmetry::X => 0..1,
        Symmetry::Y => 1..2,
        Symmetry::Z => 2..3,
        Symmetry::Automatic => 0..3,
    };
    let mirrors = axes.filter_map(|axis| Mirror::of(mesh, axis)).map(|m| (m.asymmetry(mesh), m));
    let found = mirrors.min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((off, mirror)) = found else {
        return Err(Error::input(None, "the mesh has no vertices", "give a mesh with vertices and faces"));
    };
    if off <= TOLERANCE {
        return Ok(mirror);
    }
    let axis = ["x", "y", "z"][mirror.axis];
    let problem = format!(
        "the input is not symmetric along {axis}: its mirror image is up to {:.3} % of the diagonal away, \
         and {} % may be",
        100.0 * off,
        100.0 * TOLERANCE
    );
    Err(Error::input(None, problem, "align it with the axes, choose another axis, or remove `symmetric`"))
}

/// The options for one half, which is repaired already and of which little is measured.
fn half_options(options: &Options, vertices: usize) -> Options {
    let mut half = options.clone();
    half.vertices = vertices;
    half.coarse_to_fine.symmetric = None;
    half.set_repairs(RepairOptions::default());
    half.correspondence = CorrespondenceRequest::NONE;
    half.measures = MeasureDepth::Basic;
    half.format = None;
    half.cells = false;
    half
}

/// Whether both halves make a surface like the input.
fn is_like(joined: &TriMesh, input: &Topology) -> bool {
    let got = topology(joined);
    let figures =
        |t: &Topology| (t.components, t.euler, t.boundary_loops, t.nonmanifold_edges, t.inconsistent_edges);
    figures(&got) == figures(input) && got.duplicate_faces == 0
}

/// Measures the whole.
fn finish(
    mesh: &TriMesh,
    repaired: &Repaired,
    options: &Options,
    input: &Topology,
    found: Remeshed,
    progress: &ProgressToken,
) -> Result<Remeshed> {
    let Remeshed { mesh: mut result, mut summary, .. } = found;
    let frame = UnitFrame::of(&repaired.mesh)?;
    let mut rounding = options.format.and_then(|format| Rounding::apply(&mut result, &frame, format));
    let correspondence = correspondence_of(&result, mesh, (repaired, None), options, None, progress)?;
    let measuring = Measuring {
        request: MeasureRequest::new(options),
        result: &result,
        reference: (&repaired.mesh, None),
        rounding: rounding.as_mut(),
        intersecting_faces: None,
        input_intersections: None,
    };
    let measured = measuring.measure(progress)?;
    let (on, count) = (&repaired.mesh, result.vertices.len());
    let cells = cells_of(&mut Outcome::default(), (&result, on), &frame, options, progress)?;
    let (crossing, simplified) = (measured.input_intersections, summary.collapsed_components);
    let mut list = remarks((repaired, None), input, crossing, simplified, rounding.as_ref());
    if count != options.vertices {
        let off = count.abs_diff(options.vertices);
        let word = if count < options.vertices { "fewer" } else { "more" };
        let reason = if off == 1 { ", since both halves are alike" } else { "" };
        let off = counted(off, ["vertex", "vertices"]);
        list.push(format!("{off} {word} than asked for{reason}"));
    }
    let SmallAngleSummary { edits, vertices, .. } = summary.small_angles.unwrap_or_default();
    let mended = MendingCounts { edits: 2 * edits, vertices: 2 * vertices };
    let smallest = measured.output.quality.min_angle;
    let curves = CurvesOfWhole::find(on, &frame, options, count)?;
    let (texts, codes) = (std::mem::take(&mut summary.warnings), std::mem::take(&mut summary.warning_codes));
    let faults = texts.into_iter().zip(codes);
    let fault = faults.filter(|(_, code)| *code == WarningCode::Fault);
    let fault = fault.map(|(text, code)| Warning { code, text: format!("in one half, {text}") }).next();
    let shapes = Shapes {
        options,
        input: (on, input),
        result: (&result, &measured.output),
        kept: None,
        metric: summary.metric,
        spacing: spacing(on.area(), count),
        diagonal: frame.scale,
    };
    let crossings = intersections((measured.output.self_intersecting_faces, crossing), rounding.as_ref());
    let rounded = rounding.as_ref().and_then(Rounding::warning);
    let rounded = rounded.map(|text| Warning { code: WarningCode::Rounding, text });
    let of_shapes = match rounded {
        None => shapes.warnings(progress)?,
        Some(_) => Vec::new(),
    };
    let mut warnings: Vec<Warning> = rounded.into_iter().chain(crossings).collect();
    warnings.extend(curves.warnings(options, progress)?);
    warnings.extend(of_shapes.into_iter().chain(fault));
    if input.boundary_edges > 0 {
        let text = cracks(on).as_ref().map(describe_cracks);
        warnings.extend(text.map(|text| Warning { code: WarningCode::Cracks, text }));
    }
    let summary = Summary {
        warning_codes: warnings.iter().map(|warning| warning.code).collect(),
        warnings: warnings.into_iter().map(|warning| warning.text).collect(),
        remarks: list,
        repaired: repaired.counts,
        input: input.clone(),
        input_self_intersecting_faces: crossing,
        output: measured.output,
        cells: cells.as_ref().map(|cells| cells.summary(on.area())),
        spacing: spacing(on.area(), count),
        features: Some(curves.summary(&result)),
        small_angles: SmallAngleSummary::new((&result, None), smallest, mended, options),
        ..summary
    };
    Ok(Remeshed { mesh: result, correspondence, cells, summary })
}
