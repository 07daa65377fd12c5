//! The files of a run: all results as JSON, the tables as Markdown, and the plots.

use crate::plots;
use crate::section::Section;
use anyhow::{Context as _, Result};
use rtfmesh::DeviceInfo;
use serde::Serialize;
use std::path::Path;
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

/// All results of one run of the program.
#[derive(Serialize)]
pub struct Report {
    device: String,
    driver: String,
    api: String,
    /// Logical cores that the program may use.
    cores: usize,
    processor: String,
    /// Date and time in UTC.
    date: String,
    /// Commit of the source tree, with `+` if there are changes.
    commit: String,
    quick: bool,
    runs: usize,
    minutes: f64,
    sections: Vec<Section>,
}

impl Report {
    /// Results without sections.
    pub fn new(device: &DeviceInfo, quick: bool, runs: usize) -> Self {
        let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        Self {
            device: device.name.clone(),
            driver: device.driver.trim().to_owned(),
            api: device.api.clone(),
            cores: std::thread::available_parallelism().map_or(1, |n| n.get()),
            processor: processor(),
            date: crate::date::utc(seconds),
            commit: commit(),
            quick,
            runs,
            minutes: 0.0,
            sections: Vec::new(),
        }
    }

    /// Adds a section and writes all files again, so that a run that is stopped leaves what it has.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn add(&mut self, section: Section, minutes: f64, folder: &Path) -> Result<()> {
        for chart in &section.charts {
            plots::write(chart, folder)?;
        }
        self.sections.push(section);
        self.minutes = minutes;
        let json = serde_json::to_string_pretty(self)? + "\n";
        for (name, text) in [("tables.json", json), ("tables.md", self.to_markdown())] {
            let path = folder.join(name);
            std::fs::write(&path, text).with_context(|| format!("writing {}", path.display()))?;
        }
        Ok(())
    }

    fn to_markdown(&self) -> String {
        let Self { device, driver, api, cores, processor, date, commit, runs, minutes, .. } = self;
        let size = if self.quick {
            "Quick run: a tenth of the sizes, 1,000 vertices at least, fewer iterations and methods. "
        } else {
            ""
        };
        let mut text = format!(
            "# Tables\n\n{size}{device} ({driver}, Vulkan {api}), {cores} cores ({processor}), {date}, \
             commit {commit}. Times are medians of {runs} runs, of fewer where a run takes long. \
             {minutes:.1} minutes so far.\n"
        );
        for section in &self.sections {
            text += &format!("\n{}", section.to_markdown());
        }
        text
    }
}

fn commit() -> String {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let changed = git(&["status", "--porcelain", "--untracked-files=no"]).is_some_and(|s| !s.is_empty());
    git(&["rev-parse", "--short=12", "HEAD"])
        .map_or("unknown".to_owned(), |id| id + if changed { "+" } else { "" })
}

fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    name.map_or("unknown".to_owned(), |(_, name)| name.trim().to_owned())
}
