//! Fig. 14: where the paper's method fails.

use crate::preset::Preset;
use crate::runs::{Bench, table_of_rows};
use crate::section::Section;
use anyhow::Result;

/// The paper does not say how many.
const VERTICES: usize = 5000;

/// Thin limbs, sharp edges and sheets close together: rtf beside the default.
///
/// # Errors
/// Those of the device and of reading models.
pub fn section(bench: &mut Bench) -> Result<Section> {
    let mut table = table_of_rows(&["model", "method"]);
    let mut rows = Vec::new();
    for model in bench.models(&["homer", "fandisk", "close-hemispheres"])? {
        for preset in [Preset::Rtf, Preset::Default] {
            let row = bench.preset(&model, preset, bench.scaled(VERTICES))?;
            table.push([vec![row.model.clone(), row.method.clone()], row.cells()].concat());
            rows.push(row);
        }
    }
    let title = "Fig. 14: limits of the paper's method".to_owned();
    let text = vec![format!("{} vertices; the paper does not say how many.", bench.scaled(VERTICES))];
    Ok(Section { name: "fig14", title, text, table, rows, charts: Vec::new() })
}
