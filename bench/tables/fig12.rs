//! Fig. 12: one iteration of every method.

use crate::markdown::{Table, number, significant};
use crate::plots::{Chart, Series};
use crate::preset::Preset;
use crate::row::Row;
use crate::runs::Bench;
use crate::section::Section;
use anyhow::Result;
use rtfmesh::MeasureDepth;

const SIZES: [usize; 3] = [10_000, 20_000, 30_000];
/// Iterations of two runs. The time of one is their difference, so that neither the first iterations, from
/// random points, nor connecting counts.
const ITERATIONS: [u32; 2] = [5, 25];

/// On kitten and botijo; a quick run leaves out the latter and the largest size.
///
/// # Errors
/// Those of the device and of reading models.
pub fn section(bench: &mut Bench) -> Result<Section> {
    let mut table = Table::new(["model", "#V", "method", "it", "s/iteration", "µs/vertex", "note"]);
    let names: &[&str] = if bench.quick { &["kitten"] } else { &["kitten", "botijo"] };
    let sizes = if bench.quick { &SIZES[..2] } else { &SIZES };
    let (mut rows, mut charts) = (Vec::new(), Vec::new());
    for model in bench.models(names)? {
        let mut all = Vec::new();
        for preset in bench.presets.clone() {
            // Poisson disks have no iterations.
            if preset == Preset::Mps {
                continue;
            }
            let mut points = Vec::new();
            for vertices in sizes {
                let own = preset.options(bench.scaled(*vertices));
                let own = own.tolerance(0.0).measures(MeasureDepth::Basic);
                let [few, row] =
                    ITERATIONS.map(|count| bench.row(&model, preset.name(), &own.clone().iterations(count)));
                let (few, row) = (few?, row?);
                let seconds = per_iteration(&few, &row);
                points.extend(seconds.map(|s| [row.wanted as f64, s]));
                let per_vertex = seconds.map(|s| 1e6 * s / row.wanted as f64);
                table.push(vec![
                    row.model.clone(),
                    row.wanted.to_string(),
                    row.method.clone(),
                    number(row.iterations.map(f64::from), 0),
                    significant(seconds),
                    significant(per_vertex),
                    note(&row, seconds),
                ]);
                rows.push(row);
            }
            all.push(Series { name: preset.name().to_owned(), points });
        }
        charts.push(Chart {
            file: format!("fig12-{}", model.name),
            title: format!("{}: one iteration", model.title),
            labels: ["vertices", "seconds"],
            logarithmic: [false, true],
            series: all,
        });
    }
    let title = "Fig. 12: one iteration of every method".to_owned();
    let text = vec![
        format!(
            "Wall time: what a run of {} iterations takes more than one of {}, divided by the difference.",
            ITERATIONS[1], ITERATIONS[0]
        ),
        "For `default`, iterations of its last level.".to_owned(),
    ];
    Ok(Section { name: "fig12", title, text, table, rows, charts })
}

/// Seconds of an iteration by a run of few and one of more; `None` if noise or a new start hides it.
fn per_iteration(few: &Row, more: &Row) -> Option<f64> {
    let phase = |row: &Row| {
        let of = |name: &str| row.phases.get(name).copied();
        of("iterate").or_else(|| of(rtfmesh::Phase::LastLevel.name()))
    };
    let seconds = 1e-3 * (phase(more)? - phase(few)?);
    let iterations = more.iterations?.checked_sub(few.iterations?).filter(|count| *count > 0)?;
    Some(seconds / f64::from(iterations)).filter(|seconds| *seconds > 0.0)
}

fn note(row: &Row, seconds: Option<f64>) -> String {
    match (&row.figures, seconds) {
        (None, _) => row.note.clone(),
        (Some(_), None) => "the runs differ too little".to_owned(),
        _ => String::new(),
    }
}
