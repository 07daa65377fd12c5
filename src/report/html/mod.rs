//! The report as one self-contained page: both meshes to turn and compare, charts, figures and timings.

mod charts;
mod coarsen;
mod points;
mod scene;

use super::Report;
use super::figures;
use super::figures::Row;
use crate::error::escaped;
use crate::grammar::in_groups;
use crate::measure::{Crossing, Measures, measure_some};
use crate::mesh::features::{Curve, FeatureOptions, find_features};
use crate::mesh::repair::repair_with;
use crate::mesh::unit_frame::UnitFrame;
use crate::picture::{WORST, centre_distances, check, distance_colour, quality_colour, quality_shares};
use crate::pipeline::UserCurves;
use crate::{Error, Method, ProgressToken, Result, TriMesh};
use askama::Template;
use charts::Chart;
use glam::DVec3;
use points::faces_around;
use scene::{MOST_LINES, Packed, Space, base64, pack, pack_lines};
use std::path::Path;

pub use scene::MOST_FACES;

/// three.js as far as view.js needs it; see ci/vendor.sh.
const THREE: &[u8] = include_bytes!("assets/three/three.min.js.gz");

/// The contents of a page.
#[derive(Debug, Clone, Copy)]
pub struct PageInput<'a> {
    /// The run.
    pub report: &'a Report<'a>,
    /// The mesh that was remeshed, as read from its file or built from points or a volume.
    pub input: &'a TriMesh,
    /// The points from which the input was built; they are drawn instead of it.
    pub points: Option<&'a [DVec3]>,
    /// The mesh that the run made.
    pub output: &'a TriMesh,
}

#[derive(Template)]
#[template(path = "page.html")]
struct Page<'a> {
    style: &'static str,
    scripts: [&'static str; 3],
    three: String,
    program: String,
    /// Names of both files.
    names: [String; 2],
    /// Problems of the run and other remarks.
    warnings: &'a [String],
    notes: Vec<&'a String>,
    panels: [Panel<'a>; 2],
    /// What the figures of the input are of, and what distances are from and to.
    measured: &'static str,
    meaning: &'static str,
    sides: DVec3,
    lines: String,
    line_count: usize,
    curves_note: String,
    tables: [String; 2],
    worst: f64,
    largest: String,
    figures: Vec<[String; 3]>,
    course: Vec<Row>,
    angles: Chart,
    valences: Chart,
    convergence: Option<Chart>,
    phases: Vec<Timed>,
    stages: Vec<Timed>,
    options: String,
}

/// A mesh on the page.
struct Panel<'a> {
    name: &'static str,
    file: &'a str,
    packed: Packed,
    /// How many vertices and faces, or points.
    size: String,
    /// Whether each face stands for a point.
    is_points: bool,
    /// Empty if every face is drawn.
    note: String,
}

/// A phase or a kernel.
struct Timed {
    name: String,
    seconds: String,
    calls: u64,
    /// Of the longest, in per cent.
    share: f64,
}

/// The page, as HTML.
///
/// The input is shown as the run used it, repaired. Meshes above [`MOST_FACES`] triangles are drawn
/// simplified, and the page says so; figures are always those of the whole mesh.
///
/// # Errors
/// [`Error::Input`] for a mesh without faces, with coordinates that are not finite or indices out of range.
pub fn page(page: &PageInput) -> Result<String> {
    let Report { options, summary, device, .. } = page.report;
    let mut repaired = repair_with(page.input, &options.repairs())?;
    let user_edges = UserCurves::new(page.input, &mut repaired, options, false).edges(&repaired.mesh)?;
    let input = &repaired.mesh;
    let output = page.output;
    check(output)?;
    let known = summary.input_self_intersecting_faces.map_or(Crossing::Skip, Crossing::Known);
    let measures = measure_some(input, None, known, &ProgressToken::default())?;

    let discs = page.points.map(|points| faces_around(points, input)).transpose()?;
    let shown = discs.as_ref().unwrap_or(input);
    let (there, back) = rayon::join(|| centre_distances(shown, output), || centre_distances(output, input));
    let largest = there.iter().chain(&back).copied().fold(0.0, f64::max);
    let space = Space::around([shown, output]);
    let packed = |mesh: &TriMesh, distances: &[f64]| {
        let shares: Vec<f64> = distances.iter().map(|d| d / largest.max(f64::MIN_POSITIVE)).collect();
        pack(mesh, &space, &quality_shares(mesh), &shares)
    };
    let (curves, curves_note) = curves(page.report, input, user_edges)?;
    let files = [&page.report.input_file, &page.report.output_file].map(|name| escaped(name));
    let files = files.each_ref().map(String::as_str);
    let content = Page {
        style: include_str!("assets/page.css"),
        scripts: [
            include_str!("assets/decode.js"),
            include_str!("assets/view.js"),
            include_str!("assets/page.js"),
        ],
        three: base64(THREE),
        program: format!("{} {}", page.report.program, page.report.version),
        names: files.map(file_name),
        warnings: &summary.warnings,
        notes: page.report.notes.iter().chain(&summary.remarks).collect(),
        panels: [
            match page.points {
                None => Panel::of_mesh("Input", files[0], input, packed(input, &there)?),
                Some(points) => Panel::of_points(files[0], points.len(), packed(shown, &there)?),
            },
            Panel::of_mesh("Output", files[1], output, packed(output, &back)?),
        ],
        measured: if discs.is_some() { "Surface through the points" } else { "Input" },
        meaning: match discs {
            None => "from each triangle's middle to the other mesh",
            Some(_) => "from each point to the output, and back to the surface through the points",
        },
        sides: space.sides,
        lines: pack_lines(&curves, &space)?,
        line_count: curves.len(),
        curves_note,
        tables: [colour_table(quality_colour), colour_table(distance_colour)],
        worst: WORST,
        largest: distance_text(largest, UnitFrame::of(input)?.scale),
        figures: figures_of_both(&measures, &summary.output),
        course: figures::course(summary, device).into_iter().chain(figures::cost(summary)).collect(),
        angles: charts::angles([input, output]),
        valences: charts::valences([&measures.valence.histogram, &summary.output.valence.histogram]),
        convergence: charts::convergence(&summary.steps),
        phases: phases(page.report),
        stages: stages(page.report),
        options: super::to_json(&super::Settings::of(options))?,
    };
    // askama drops the newline at the end of the template.
    content.render().map(|text| text + "\n").map_err(|e| Error::Internal(e.to_string()))
}

impl<'a> Panel<'a> {
    fn of_mesh(name: &'static str, file: &'a str, mesh: &TriMesh, packed: Packed) -> Self {
        let note = if packed.faces < mesh.triangles.len() {
            format!(
                "Drawn here with only {} faces; the figures are of the whole mesh.",
                digits_in_groups(packed.faces)
            )
        } else {
            String::new()
        };
        let [vertices, faces] = [mesh.vertices.len(), mesh.triangles.len()].map(digits_in_groups);
        Self {
            name,
            file,
            packed,
            size: format!("{vertices} vertices, {faces} faces"),
            is_points: false,
            note,
        }
    }

    /// The input, which has this many points.
    fn of_points(file: &'a str, count: usize, packed: Packed) -> Self {
        let note = if packed.faces < count {
            format!("{} of them are drawn here.", digits_in_groups(packed.faces))
        } else {
            String::new()
        };
        let size = format!("{} points", digits_in_groups(count));
        Self { name: "Input", file, packed, size, is_points: true, note }
    }
}

/// The edges of the feature curves of the run, and a note on them.
fn curves(report: &Report, mesh: &TriMesh, user_edges: Vec<[u32; 2]>) -> Result<(Vec<[DVec3; 2]>, String)> {
    let options = report.options;
    if options.method != Method::CoarseToFine {
        return Ok((Vec::new(), "This preset does not detect features.".to_owned()));
    }
    let wanted = FeatureOptions {
        feature_angle: options.coarse_to_fine.feature_angle,
        user_edges,
        round_facets: report.summary.features.is_some_and(|found| found.discarded.facet_edges > 0),
        ..FeatureOptions::new(report.summary.spacing)
    };
    let mut found = find_features(mesh, &wanted)?.curves;
    if found.is_empty() {
        return Ok((Vec::new(), "The input has no sharp or open edges.".to_owned()));
    }
    let all: usize = found.iter().map(Curve::edges).sum();
    found.sort_by(|a, b| b.length.total_cmp(&a.length));
    let ends = found.iter().flat_map(Curve::edge_ends);
    let ends: Vec<[DVec3; 2]> =
        ends.map(|pair| pair.map(|v| mesh.vertices[v as usize])).take(MOST_LINES).collect();
    let note = if ends.len() < all {
        format!("The longest {} of {all} edges are drawn.", ends.len())
    } else {
        String::new()
    };
    Ok((ends, note))
}

/// 256 colours of a scale as red, green and blue, in base64.
fn colour_table(colour: impl Fn(f64) -> [u8; 3]) -> String {
    let bytes: Vec<u8> = (0..256).flat_map(|k| colour(f64::from(k) / 255.0)).collect();
    base64(&bytes)
}

fn distance_text(distance: f64, diagonal: f64) -> String {
    format!("{distance:.3e} ({:.3} % of the diagonal)", 100.0 * distance / diagonal)
}

fn figures_of_both(input: &Measures, output: &Measures) -> Vec<[String; 3]> {
    let before = figures::measures(input);
    let of = |name: &str| before.iter().find(|row| row.0 == name).map_or(String::new(), |row| row.1.clone());
    figures::measures(output).into_iter().map(|(name, text)| [name.to_owned(), of(name), text]).collect()
}

fn phases(report: &Report) -> Vec<Timed> {
    let phases = &report.summary.timings.phases;
    let longest = phases.iter().map(|phase| phase.milliseconds).fold(f64::MIN_POSITIVE, f64::max);
    let timed = phases.iter().map(|phase| Timed {
        name: phase.name.to_owned(),
        seconds: [phase.milliseconds, phase.waiting_milliseconds].map(figures::seconds).join(", "),
        calls: 1,
        share: 100.0 * phase.milliseconds / longest,
    });
    timed.collect()
}

/// The timed kernels and copies, the longest first.
fn stages(report: &Report) -> Vec<Timed> {
    let stages = report.summary.timings.stages.iter();
    let mut timed: Vec<_> = stages.filter_map(|stage| Some((stage, stage.milliseconds?))).collect();
    timed.sort_by(|a, b| b.1.total_cmp(&a.1));
    let longest = timed.first().map_or(f64::MIN_POSITIVE, |first| first.1.max(f64::MIN_POSITIVE));
    let timed = timed.into_iter().map(|(stage, milliseconds)| Timed {
        name: stage.name.clone(),
        seconds: format!("{milliseconds:.1} ms"),
        calls: stage.calls,
        share: 100.0 * milliseconds / longest,
    });
    timed.collect()
}

/// The name without its folder.
fn file_name(path: &str) -> String {
    Path::new(path).file_name().map_or_else(|| path.to_owned(), |name| name.to_string_lossy().into_owned())
}

/// A count with its digits in groups of three.
fn digits_in_groups(count: usize) -> String {
    in_groups(&count.to_string(), '\u{202f}')
}
