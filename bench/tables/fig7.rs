//! Fig. 7: how many cells are far from hexagons.

use crate::markdown::{Table, number};
use crate::preset::Preset;
use crate::runs::Bench;
use crate::section::Section;
use anyhow::Result;

/// Shares of vertices with fewer than five or more than seven edges.
///
/// # Errors
/// Those of the device and of reading models.
pub fn section(bench: &mut Bench) -> Result<Section> {
    let presets = [Preset::Rtf, Preset::Default];
    let mut table = Table::new(["model", "#V", "paper %", "rtf %", "default %", "rtf it", "note"]);
    let wanted: Vec<(String, usize, f64)> =
        bench.paper.irregular.iter().map(|row| (row.model.clone(), row.vertices, row.share)).collect();
    let mut rows = Vec::new();
    for (name, vertices, share) in wanted {
        for model in bench.models(&[&name])? {
            let mut cells = vec![model.title.clone(), bench.scaled(vertices).to_string()];
            // The paper's figure only applies to its own size and model.
            let share = Some(share).filter(|_| model.original && !bench.quick);
            cells.push(number(share.map(|s| 100.0 * s), 2));
            let mut found = Vec::new();
            for preset in presets {
                found.push(bench.preset(&model, preset, bench.scaled(vertices))?);
            }
            let irregular = |f: &crate::row::Figures| f.irregular.map(|s| 100.0 * s);
            cells.extend(found.iter().map(|row| number(row.figures.as_ref().and_then(irregular), 2)));
            cells.push(number(found[0].iterations.map(f64::from), 0));
            cells.push(
                found
                    .iter()
                    .map(|row| row.note.as_str())
                    .filter(|n| !n.is_empty())
                    .collect::<Vec<_>>()
                    .join("; "),
            );
            table.push(cells);
            rows.extend(found);
        }
    }
    let title = "Fig. 7: vertices with fewer than 5 or more than 7 edges".to_owned();
    let text =
        vec!["A vertex has as many edges as its cell has corners. Boundaries do not count.".to_owned()];
    Ok(Section { name: "fig7", title, text, table, rows, charts: Vec::new() })
}
