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
    /// What there is to know before reading the table, a line each.
    pub text: Vec<String>,
    /// For people.
    pub table: Table,
    /// The results behind it.
    pub rows: Vec<Row>,
    /// Plots, drawn into files.
    pub charts: Vec<Chart>,
}

impl Section {
    /// As Markdown; plots are named by file.
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
