//! Tables 1 and 2: every method on the paper's models, beside the paper's rows.

use crate::models::Model;
use crate::paper::Published;
use crate::plots::{Chart, Series};
use crate::preset::Preset;
use crate::row::{Row, published};
use crate::runs::{Bench, table_of_rows};
use crate::section::Section;
use anyhow::Result;

/// Table 1.
///
/// # Errors
/// Those of the device and of reading models.
pub fn table1(bench: &mut Bench) -> Result<Section> {
    section(bench, 1, "table1", "Table 1: outputs of the paper's Fig. 7, and of other methods at that size")
}

/// Table 2.
///
/// # Errors
/// As [`table1`].
pub fn table2(bench: &mut Bench) -> Result<Section> {
    section(bench, 2, "table2", "Table 2: methods compared")
}

fn section(bench: &mut Bench, number: u8, name: &'static str, title: &str) -> Result<Section> {
    let of_table = |rows: &[Published]| rows.iter().filter(|row| row.table == number).cloned().collect();
    let (inputs, outputs): (Vec<Published>, Vec<Published>) =
        (of_table(&bench.paper.inputs), of_table(&bench.paper.outputs));
    let names: Vec<&str> = inputs.iter().map(|row| row.model.as_str()).collect();
    let mut table = table_of_rows(&["model", "from"]);
    let (mut rows, mut charts) = (Vec::new(), Vec::new());
    for model in bench.models(&names)? {
        let mut add = |from: &str, cells: Vec<String>| {
            table.push([vec![model.title.clone(), from.to_owned()], cells].concat());
        };
        for row in inputs.iter().filter(|row| row.model == model.name && model.original) {
            add("paper: input", published(row));
        }
        let input = bench.input(&model)?;
        add("input", input.cells());
        rows.push(input);
        let theirs: Vec<&Published> = outputs.iter().filter(|row| row.model == model.name).collect();
        let mut ours = Vec::new();
        for preset in presets(bench, number) {
            for Wanted { vertices, beside } in wanted(bench, preset, &theirs) {
                let row = bench.preset(&model, preset, vertices)?;
                let comparable = model.original && beside.is_some_and(|b| b.vertices == vertices);
                let beside = beside.filter(|_| comparable);
                if let Some(beside) = beside.filter(|b| preset.is_labelled(&b.method)) {
                    add(&format!("paper: {}", beside.method), published(beside));
                }
                add(preset.name(), row.cells());
                if let Some(beside) = beside {
                    add(&format!("{} / paper {}", preset.name(), beside.method), row.ratios(beside));
                }
                ours.push(row);
            }
        }
        let theirs = if model.original && !bench.quick { theirs } else { Vec::new() };
        charts.push(chart(name, &model, &ours, &theirs));
        rows.extend(ours);
    }
    let mut text = vec![
        format!("Rows of the paper: {}, on {}.", bench.paper.source, bench.paper.machine),
        "dH is the larger of both Hausdorff distances (upper end of its interval), RMS of both root \
         mean square distances, in % of the diagonal."
            .to_owned(),
        "`it` counts iterations with all vertices, `cut` faces that cut others.".to_owned(),
    ];
    if bench.quick {
        text.push("Sizes are a tenth of those of the paper, so there are no ratios.".to_owned());
    }
    Ok(Section { name, title: title.to_owned(), text, table, rows, charts })
}

/// The slow methods, which the paper does not have in Table 1, take a quarter of an hour at its sizes.
fn presets(bench: &Bench, table: u8) -> Vec<Preset> {
    let slow = |preset: &Preset| matches!(preset, Preset::Rpf | Preset::Rvc);
    bench.presets.iter().copied().filter(|preset| bench.named || table != 1 || !slow(preset)).collect()
}

/// A size, and the paper's row for it.
struct Wanted<'a> {
    vertices: usize,
    beside: Option<&'a Published>,
}

/// The sizes of a method on one model: those of its own rows in the paper, or else those of the paper's
/// method.
fn wanted<'a>(bench: &Bench, preset: Preset, rows: &[&'a Published]) -> Vec<Wanted<'a>> {
    let labelled = |preset: Preset| -> Vec<&'a Published> {
        rows.iter().copied().filter(|row| preset.is_labelled(&row.method)).collect()
    };
    let mut found = labelled(preset);
    let own = !found.is_empty();
    if !own {
        found = labelled(Preset::Rtf);
    }
    // One size is enough for methods that the paper does not have, and for a quick run.
    if bench.quick || !(own || preset == Preset::Default) {
        found.truncate(1);
    }
    let compared = own || preset == Preset::Default;
    let pair = |row: &'a Published| Wanted {
        vertices: bench.scaled(row.vertices),
        beside: Some(row).filter(|_| compared),
    };
    found.into_iter().map(pair).collect()
}

/// Quality against time, a series for each method.
fn chart(name: &str, model: &Model, ours: &[Row], theirs: &[&Published]) -> Chart {
    let mut series: Vec<Series> = Vec::new();
    let mut add = |name: &str, point: Option<[f64; 2]>| {
        let Some(point) = point else { return };
        match series.iter_mut().find(|s| s.name == name) {
            Some(known) => known.points.push(point),
            None => series.push(Series { name: name.to_owned(), points: vec![point] }),
        }
    };
    for row in ours {
        add(&row.method, row.seconds.zip(row.figures.as_ref()).map(|(t, f)| [t, f.q_avg]));
    }
    for row in theirs {
        let name = format!("paper: {}", row.method.trim_end_matches(['1', '2']));
        add(&name, row.seconds.zip(row.q_avg).map(|(t, q)| [t, q]));
    }
    Chart {
        file: format!("{name}-{}", model.name),
        title: format!("{}: quality against time", model.title),
        labels: ["seconds", "mean quality of triangles"],
        logarithmic: [true, false],
        series,
    }
}
