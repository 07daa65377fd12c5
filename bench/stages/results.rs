//! The results: rows, table, and the file that later runs compare with.

use crate::context::Model;
use anyhow::{Context as _, Result};
use comfy_table::presets::NOTHING;
use comfy_table::{CellAlignment, Table};
use rtfmesh::DeviceInfo;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// All results of one run of the program.
#[derive(Serialize, Deserialize)]
pub struct Report {
    /// Name of the device.
    pub device: String,
    /// Driver and version.
    pub driver: String,
    /// Vulkan version of the device.
    pub api: String,
    /// Timed runs of each kernel.
    pub runs: u32,
    /// One for each kernel, mesh and size.
    pub rows: Vec<Row>,
}

/// One kernel on one mesh at one size.
#[derive(Serialize, Deserialize)]
pub struct Row {
    /// Built-in model or file.
    pub mesh: String,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Sites on it.
    pub sites: usize,
    /// Dotted name.
    pub kernel: String,
    /// Dispatches in a run.
    pub calls: u64,
    /// Device time of a run, all dispatches together.
    pub median_milliseconds: f64,
    /// The fastest run.
    pub min_milliseconds: f64,
    /// The median divided by the number of sites.
    pub microseconds_per_site: f64,
    /// Bytes that the kernel must read and write at least, each once.
    pub bytes: u64,
    /// These bytes divided by the median.
    pub gigabytes_per_second: f64,
    /// A remark; the reason if there are no figures.
    pub note: String,
}

impl Row {
    /// A row without figures.
    pub fn refused(kernel: &str, model: &Model, sites: usize, note: String) -> Self {
        Self {
            mesh: model.name.clone(),
            triangles: model.surface.triangles.len(),
            sites,
            kernel: kernel.to_owned(),
            calls: 0,
            median_milliseconds: 0.0,
            min_milliseconds: 0.0,
            microseconds_per_site: 0.0,
            bytes: 0,
            gigabytes_per_second: 0.0,
            note,
        }
    }

    fn same(&self, other: &Self) -> bool {
        (&self.mesh, self.sites, &self.kernel) == (&other.mesh, other.sites, &other.kernel)
    }
}

impl Report {
    /// A report without rows.
    pub fn new(device: &DeviceInfo, runs: u32) -> Self {
        Self {
            device: device.name.clone(),
            driver: device.driver.trim().to_owned(),
            api: device.api.clone(),
            runs,
            rows: Vec::new(),
        }
    }

    /// One line about the device.
    pub fn heading(&self) -> String {
        format!("{} ({}, Vulkan {}), {} runs each", self.device, self.driver, self.api, self.runs)
    }

    /// Reads what an earlier run wrote.
    pub fn read(path: &Path) -> Result<Self> {
        let name = path.display();
        let text = std::fs::read_to_string(path).with_context(|| format!("reading {name}"))?;
        serde_json::from_str(&text).with_context(|| format!("{name} was not written by --json"))
    }

    /// Writes the file for a later run.
    pub fn write(&self, path: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self)? + "\n";
        std::fs::write(path, text).with_context(|| format!("writing {}", path.display()))
    }
}

/// The rows as a table; with an earlier report also the ratio of medians.
pub fn table(rows: &[Row], earlier: Option<&Report>) -> String {
    let mut table = Table::new();
    table.load_style(NOTHING);
    let mut header = vec!["mesh", "sites", "kernel", "calls", "ms", "min", "µs/site", "GB/s", ""];
    if earlier.is_some() {
        header.insert(8, "new/old");
    }
    let last = header.len() - 1;
    table.set_header(header);
    for place in (1..last).filter(|c| *c != 2) {
        if let Some(column) = table.column_mut(place) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    for row in rows {
        let known = row.calls > 0;
        let number = |value: f64, digits: usize| {
            if known && value > 0.0 { format!("{value:.digits$}") } else { "-".to_owned() }
        };
        let mut cells = vec![
            row.mesh.clone(),
            row.sites.to_string(),
            row.kernel.clone(),
            if known { row.calls.to_string() } else { "-".to_owned() },
            number(row.median_milliseconds, 3),
            number(row.min_milliseconds, 3),
            number(row.microseconds_per_site, 4),
            number(row.gigabytes_per_second, 2),
            row.note.clone(),
        ];
        if let Some(earlier) = earlier {
            let old =
                earlier.rows.iter().find(|old| old.same(row)).map_or(0.0, |old| old.median_milliseconds);
            cells.insert(8, number(if old > 0.0 { row.median_milliseconds / old } else { 0.0 }, 2));
        }
        table.add_row(cells);
    }
    table.trim_fmt()
}
