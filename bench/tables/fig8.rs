//! Figs. 8 and 9: time and quality as the number of vertices grows.

use crate::markdown::{Table, number, significant};
use crate::plots::{Chart, Series};
use crate::preset::Preset;
use crate::row::{Figures, Row};
use crate::runs::Bench;
use crate::section::Section;
use anyhow::Result;

/// The paper's sizes; larger ones are run with the default only.
const PAPERS: [usize; 3] = [10_000, 20_000, 30_000];
const LARGER: [usize; 3] = [100_000, 300_000, 1_000_000];
/// Kinds of work that [`Row::stages`] tells apart, in the order of an iteration.
const STAGES: [&str; 5] = ["search", "normals", "face", "projection", "other"];

/// On the model `fertility`.
///
/// # Errors
/// Those of the device and of reading the model.
pub fn section(bench: &mut Bench) -> Result<Section> {
    let mut table = Table::new([
        "model",
        "#V",
        "method",
        "it",
        "search ms",
        "normals ms",
        "face ms",
        "projection ms",
        "other ms",
        "total ms",
        "T s",
        "paper T s",
        "Qmin",
        "Qavg",
        "θmin",
        "θ<30°",
        "topology",
        "note",
    ]);
    let (mut rows, mut charts) = (Vec::new(), Vec::new());
    for model in bench.models(&["fertility"])? {
        for preset in [Preset::Rtf, Preset::Default] {
            let larger: &[usize] = if preset == Preset::Default { &LARGER } else { &[] };
            let largest = bench.largest;
            let papers = if bench.quick { &PAPERS[..2] } else { &PAPERS };
            for vertices in papers.iter().chain(larger).filter(|n| **n <= largest) {
                let row = bench.preset(&model, preset, bench.scaled(*vertices))?;
                let timed = bench.paper.fertility.iter().find(|t| t.vertices == *vertices);
                let comparable = model.original && preset == Preset::Rtf && !bench.quick;
                table.push(cells(&row, timed.filter(|_| comparable).map(|t| t.seconds)));
                rows.push(row);
            }
        }
        charts.extend(plots(bench, &model.title, &rows, model.original && !bench.quick));
    }
    let title = "Figs. 8 and 9: time and quality against the number of vertices".to_owned();
    let text = vec![
        "Device time by kind of work: for rtf of one iteration; for default of the whole run with all levels."
            .to_owned(),
        "`search` is all searches for neighbours, also before the projection; `T` is wall time.".to_owned(),
    ];
    Ok(Section { name: "fig8", title, text, table, rows, charts })
}

/// The divisor of a row's times: iterations, or 1 for the default, whose iterations differ in cost.
fn share(row: &Row) -> f64 {
    if row.method == Preset::Default.name() { 1.0 } else { f64::from(row.iterations.unwrap_or(1)) }
}

fn cells(row: &Row, papers: Option<f64>) -> Vec<String> {
    let figure = |of: fn(&Figures) -> f64, digits| number(row.figures.as_ref().map(of), digits);
    let stage = |name: &&str| row.stages.get(*name).map(|ms| ms / share(row));
    let mut cells = vec![row.model.clone(), row.wanted.to_string(), row.method.clone()];
    cells.push(number(row.iterations.map(f64::from), 0));
    cells.extend(STAGES.iter().map(|name| significant(stage(name))));
    let total = row.figures.is_some().then(|| row.stages.values().sum::<f64>() / share(row));
    cells.extend([significant(total), significant(row.seconds), significant(papers)]);
    cells.extend([figure(|f| f.q_min, 3), figure(|f| f.q_avg, 3), figure(|f| f.theta_min, 2)]);
    cells.push(figure(|f| f.below_30, 3));
    cells.push(row.figures.as_ref().map_or(String::new(), |f| f.topology.clone()));
    cells.push(row.note.clone());
    cells
}

fn plots(bench: &Bench, model: &str, rows: &[Row], with_paper: bool) -> Vec<Chart> {
    let of = |preset: Preset| rows.iter().filter(move |row| row.method == preset.name());
    let points = |preset: Preset, value: &dyn Fn(&Row) -> Option<f64>| -> Vec<[f64; 2]> {
        of(preset).filter_map(|row| Some([row.wanted as f64, value(row)?])).collect()
    };
    let mut stages: Vec<Series> = STAGES
        .iter()
        .map(|name| {
            let value = |row: &Row| row.stages.get(name).map(|ms| ms / share(row));
            Series { name: (*name).to_owned(), points: points(Preset::Rtf, &value) }
        })
        .collect();
    let total = |row: &Row| row.figures.as_ref().map(|_| row.stages.values().sum::<f64>() / share(row));
    stages.push(Series { name: "total".to_owned(), points: points(Preset::Rtf, &total) });
    let both = |value: &dyn Fn(&Row) -> Option<f64>| -> Vec<Series> {
        [Preset::Rtf, Preset::Default]
            .map(|preset| Series { name: preset.name().to_owned(), points: points(preset, value) })
            .into()
    };
    let mut whole = both(&|row| row.seconds);
    if with_paper {
        let points = bench.paper.fertility.iter().map(|t| [t.vertices as f64, t.seconds]).collect();
        whole.push(Series { name: "paper".to_owned(), points });
    }
    let quality = both(&|row| row.figures.as_ref().map(|f| f.q_avg));
    let chart = |file: &str, title: &str, label, logarithmic, series| Chart {
        file: file.to_owned(),
        title: format!("{model}: {title}"),
        labels: ["vertices", label],
        logarithmic,
        series,
    };
    vec![
        chart("fig8-stages", "an iteration of rtf", "device milliseconds", [true, true], stages),
        chart("fig8-time", "time of a run", "seconds", [true, true], whole),
        chart("fig9-quality", "quality", "mean quality of triangles", [true, false], quality),
    ]
}
