//! Tables as Markdown.

use serde::Serialize;

/// Cells in rows of the same length.
#[derive(Debug, Default, Serialize)]
pub struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows.
    pub fn new<'a>(header: impl IntoIterator<Item = &'a str>) -> Self {
        Self { header: header.into_iter().map(str::to_owned).collect(), rows: Vec::new() }
    }

    /// Adds a row; short rows are padded, and cells beyond the header are dropped.
    pub fn push(&mut self, mut row: Vec<String>) {
        row.resize(self.header.len(), String::new());
        self.rows.push(row);
    }

    /// With columns padded to one width, so that the text is readable as it is. Numbers are aligned on the
    /// right.
    pub fn to_markdown(&self) -> String {
        let cells: Vec<Vec<String>> = std::iter::once(&self.header)
            .chain(&self.rows)
            .map(|row| row.iter().map(escaped).collect())
            .collect();
        let columns = self.header.len();
        let width = |c: usize| cells.iter().map(|row| row[c].chars().count()).max().unwrap_or(0).max(3);
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let right: Vec<bool> =
            (0..columns).map(|c| self.rows.iter().any(|row| is_number(&row[c])) && self.numeric(c)).collect();
        let mut text = String::new();
        for (number, row) in cells.iter().enumerate() {
            text.push('|');
            for (c, cell) in row.iter().enumerate() {
                let room = " ".repeat(widths[c] - cell.chars().count());
                text += &if right[c] { format!(" {room}{cell} |") } else { format!(" {cell}{room} |") };
            }
            text.push('\n');
            if number == 0 {
                text.push('|');
                for (c, width) in widths.iter().enumerate() {
                    text += &"-".repeat(width + 1);
                    text += if right[c] { ":|" } else { "-|" };
                }
                text.push('\n');
            }
        }
        text
    }

    fn numeric(&self, column: usize) -> bool {
        self.rows
            .iter()
            .map(|row| &row[column])
            .all(|cell| cell.is_empty() || cell == DASH || is_number(cell))
    }
}

/// Stands where there is no figure.
pub const DASH: &str = "–";

fn is_number(cell: &str) -> bool {
    cell.trim_start_matches('×').trim_end_matches(" %").parse::<f64>().is_ok()
}

fn escaped(cell: impl AsRef<str>) -> String {
    cell.as_ref().replace('|', "\\|").replace('\n', " ")
}

/// A number with so many decimals; a dash for none and for NaN.
pub fn number(value: Option<f64>, decimals: usize) -> String {
    match value {
        Some(value) if value.is_finite() => format!("{value:.decimals$}"),
        _ => DASH.to_owned(),
    }
}

/// A number with three significant digits, for values of any size.
pub fn significant(value: Option<f64>) -> String {
    let decimals =
        |v: f64| if v == 0.0 { 0 } else { (2 - v.abs().log10().floor() as i32).clamp(0, 6) as usize };
    number(value, value.map_or(0, decimals))
}

/// The ratio of `ours` to `theirs`.
pub fn ratio(ours: Option<f64>, theirs: Option<f64>) -> String {
    match (ours, theirs) {
        (Some(ours), Some(theirs)) if theirs > 0.0 => format!("×{}", significant(Some(ours / theirs))),
        _ => DASH.to_owned(),
    }
}
