//! A table or figure of the evaluation.

use crate::markdown::Table;
use crate::plots::Chart;
use crate::row::Row;
use serde::Serialize;

/// What one subcommand makes.
#[derive(Serialize)]
pub struct Section {
    /// The subcommand.
    pub name: &'static str,
    /// Heading.
    pub title: String,
    /// Explanations above the table, a line each.
    pub text: Vec<String>,
    /// The table.
    pub table: Table,
    /// The results behind it.
    pub rows: Vec<Row>,
    /// Plots, drawn into files.
    pub charts: Vec<Chart>,
}

impl Section {
    /// The section as Markdown; plots are linked by file name.
    pub fn to_markdown(&self) -> String {
        let mut text = format!("## {}\n\n", self.title);
        for line in &self.text {
            text += &format!("{line}\n");
        }
        text += &format!("\n{}\n", self.table.to_markdown());
        for chart in &self.charts {
            text += &format!("![{}]({}.png)\n", chart.title, chart.file);
        }
        text
    }
}
