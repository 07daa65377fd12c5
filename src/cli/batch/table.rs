//! What the log has of a batch as a CSV table, for spreadsheets and data frames.

use super::inputs::Job;
use super::log::{Status, unusable};
use rtfmesh::io::write_bytes;
use rtfmesh::{Error, Result};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::HashMap;
use std::path::Path;

/// A row, from the line of the log with the same names, without `options`, which are not a single value.
#[derive(Serialize, Deserialize)]
struct Row {
    #[serde(serialize_with = "cell")]
    input: String,
    #[serde(serialize_with = "cell")]
    output: String,
    status: Status,
    vertices: Option<usize>,
    mean_quality: Option<f64>,
    min_angle: Option<f64>,
    rms: Option<f64>,
    hausdorff: Option<f64>,
    seconds: f64,
    #[serde(serialize_with = "cell_or_none")]
    error: Option<String>,
    #[serde(deserialize_with = "join_list", serialize_with = "cell")]
    warnings: String,
    #[serde(deserialize_with = "join_list", serialize_with = "cell")]
    notes: String,
    asked: String,
}

fn join_list<'de, D: Deserializer<'de>>(list: D) -> std::result::Result<String, D::Error> {
    Ok(Vec::<String>::deserialize(list)?.join("; "))
}

/// Text that spreadsheets take for text: where it begins as a formula does, an apostrophe comes first.
fn text_cell(text: &str) -> String {
    let is_formula = text.trim_start().starts_with(['=', '+', '-', '@']) || text.starts_with(['\t', '\r']);
    if is_formula { format!("'{text}") } else { text.to_owned() }
}

fn cell<S: Serializer>(text: &str, to: S) -> std::result::Result<S::Ok, S::Error> {
    to.serialize_str(&text_cell(text))
}

fn cell_or_none<S: Serializer>(text: &Option<String>, to: S) -> std::result::Result<S::Ok, S::Error> {
    text.as_deref().map(text_cell).serialize(to)
}

/// Writes a row for each job, in their order: how it ended last. What was skipped has the figures of the run
/// that made it.
///
/// # Errors
/// [`Error::Output`] if the log cannot be read or the table not be written.
pub fn write(path: &Path, jobs: &[Job], log: &Path) -> Result<()> {
    let bytes = std::fs::read(log).map_err(|error| unusable(log, error))?;
    let mut last = HashMap::new();
    for line in String::from_utf8_lossy(&bytes).lines() {
        match serde_json::from_str(line) {
            Ok(Row { status: Status::Skipped, .. }) | Err(_) => {}
            Ok(row) => {
                last.insert((row.input.clone(), row.output.clone()), row);
            }
        }
    }
    let internal = |error: String| Error::Internal(format!("writing a table: {error}"));
    let mut table = csv::Writer::from_writer(Vec::new());
    for job in jobs {
        let key = (job.input.display().to_string(), job.output.display().to_string());
        if let Some(row) = last.get(&key) {
            table.serialize(row).map_err(|error| internal(error.to_string()))?;
        }
    }
    write_bytes(path, &table.into_inner().map_err(|error| internal(error.to_string()))?)
}
