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
/// Iterations that the time is the mean of.
const ITERATIONS: u32 = 5;

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
                let iterations = if preset == Preset::Default { own.iterations } else { ITERATIONS };
                let options = own.iterations(iterations).tolerance(0.0).measures(MeasureDepth::Basic);
                let row = bench.row(&model, preset.name(), &options)?;
                let seconds = per_iteration(&row);
                points.extend(seconds.map(|s| [row.wanted as f64, s]));
                let per_vertex = seconds.map(|s| 1e6 * s / row.wanted as f64);
                table.push(vec![
                    row.model.clone(),
                    row.wanted.to_string(),
                    row.method.clone(),
                    number(row.iterations.map(f64::from), 0),
                    significant(seconds),
                    significant(per_vertex),
                    if row.figures.is_none() { row.note.clone() } else { String::new() },
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
        format!("Wall time: the mean of the first {ITERATIONS} iterations from random points."),
        "For `default`, that of its last level, which starts from relaxed points, with their placement."
            .to_owned(),
    ];
    Ok(Section { name: "fig12", title, text, table, rows, charts })
}

/// Seconds of the phase that iterates with all vertices, a share for each iteration.
fn per_iteration(row: &Row) -> Option<f64> {
    let phase = row.phases.get("iterate").or_else(|| row.phases.get(rtfmesh::Phase::LastLevel.name()))?;
    Some(1e-3 * phase / f64::from(row.iterations?))
}
