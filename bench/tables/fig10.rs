//! Fig. 10: the effect of the lengths of the neighbour lists.

use crate::markdown::{Table, number, significant};
use crate::models::Model;
use crate::plots::{Chart, Series};
use crate::row::{Figures, Row};
use crate::runs::Bench;
use crate::section::Section;
use anyhow::Result;
use rtfmesh::Options;

/// A list's length: its name in the paper, the values, where it is set, and the work whose time it changes.
struct Length {
    name: &'static str,
    values: [u32; 4],
    set: fn(&mut Options, u32),
    stage: &'static str,
}

const LENGTHS: [Length; 3] = [
    Length {
        name: "k_nor",
        values: [8, 16, 32, 48],
        set: |o, k| o.all_at_once.k_normal = k,
        stage: "normals",
    },
    Length { name: "k_clip", values: [8, 16, 32, 48], set: |o, k| o.all_at_once.k_clip = k, stage: "face" },
    Length {
        name: "k_proj",
        values: [2, 8, 16, 32],
        set: |o, k| o.all_at_once.k_project = k,
        stage: "projection",
    },
];

/// Fewer than the paper's 160, because there are ten runs on each of two models.
const ITERATIONS: u32 = 20;

/// On torus and bunny; a quick run leaves the bunny out.
///
/// # Errors
/// Those of the device and of reading models.
pub fn section(bench: &mut Bench) -> Result<Section> {
    let mut table = Table::new([
        "model",
        "#V",
        "k",
        "value",
        "it",
        "Qmin",
        "Qavg",
        "θmin",
        "θ<30°",
        "stage",
        "stage ms/it",
        "search ms/it",
        "topology",
        "note",
    ]);
    let iterations = ITERATIONS;
    let (mut rows, mut charts) = (Vec::new(), Vec::new());
    let models: &[(&str, usize)] =
        if bench.quick { &[("torus", 10_000)] } else { &[("torus", 10_000), ("bunny", 20_000)] };
    for (name, vertices) in models {
        for model in bench.models(&[name])? {
            let mut quality = Vec::new();
            let mut times = Vec::new();
            for length in &LENGTHS {
                let mut found = Vec::new();
                for value in length.values {
                    let row = run(bench, &model, *vertices, iterations, (length, value))?;
                    table.push(cells(&row, length, value));
                    found.push((f64::from(value), row));
                }
                quality.push(series(length, &found, |row, _| row.figures.as_ref().map(|f| f.q_avg)));
                times.push(series(length, &found, per_iteration));
                rows.extend(found.into_iter().map(|(_, row)| row));
            }
            let chart = |what: &str, label, series| Chart {
                file: format!("fig10-{what}-{}", model.name),
                title: format!(
                    "{}, {} vertices, {iterations} iterations",
                    model.title,
                    bench.scaled(*vertices)
                ),
                labels: ["k", label],
                logarithmic: [false, false],
                series,
            };
            charts.push(chart("quality", "mean quality of triangles", quality));
            charts.push(chart("time", "milliseconds of the stage in an iteration", times));
        }
    }
    let title = "Fig. 10: lengths of the neighbour lists (rtf)".to_owned();
    let text = vec![format!(
        "{iterations} iterations, not the paper's 160. While one length varies, the others are 16, 32 and \
         16. One search serves normals and faces. Its time is listed beside the stage's, together with that \
         of the search before the projection."
    )];
    Ok(Section { name: "fig10", title, text, table, rows, charts })
}

fn run(
    bench: &mut Bench,
    model: &Model,
    vertices: usize,
    iterations: u32,
    (length, value): (&Length, u32),
) -> Result<Row> {
    let mut options = Options::rtf(bench.scaled(vertices)).iterations(iterations);
    (length.set)(&mut options, value);
    bench.row(model, "rtf", &options)
}

/// Milliseconds of the stage that this length is for.
fn per_iteration(row: &Row, length: &Length) -> Option<f64> {
    Some(row.stages.get(length.stage)? / f64::from(row.iterations?))
}

fn series(length: &Length, rows: &[(f64, Row)], value: impl Fn(&Row, &Length) -> Option<f64>) -> Series {
    let points = rows.iter().filter_map(|(k, row)| Some([*k, value(row, length)?])).collect();
    Series { name: format!("{} ({})", length.name, length.stage), points }
}

fn cells(row: &Row, length: &Length, value: u32) -> Vec<String> {
    let figure = |of: fn(&Figures) -> f64, digits| number(row.figures.as_ref().map(of), digits);
    let search = row.stages.get("search").zip(row.iterations).map(|(ms, n)| ms / f64::from(n));
    vec![
        row.model.clone(),
        row.wanted.to_string(),
        length.name.to_owned(),
        value.to_string(),
        number(row.iterations.map(f64::from), 0),
        figure(|f| f.q_min, 3),
        figure(|f| f.q_avg, 3),
        figure(|f| f.theta_min, 2),
        figure(|f| f.below_30, 3),
        length.stage.to_owned(),
        significant(per_iteration(row, length)),
        significant(search),
        row.figures.as_ref().map_or(String::new(), |f| f.topology.clone()),
        row.note.clone(),
    ]
}
