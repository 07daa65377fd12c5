//! Tables for people.

use crate::grammar::counted;
use comfy_table::Table;
use comfy_table::presets::NOTHING;
use rtfmesh::device::SelfTest;
use rtfmesh::report::figures;
use rtfmesh::{DeviceInfo, Preview, Summary};

pub(super) fn two_columns(rows: Vec<(&str, String)>) -> String {
    let mut table = Table::new();
    table.load_style(NOTHING);
    for (name, value) in rows {
        table.add_row([name.to_owned(), value]);
    }
    table.trim_fmt() + "\n"
}

/// A finished run in a few lines.
pub fn outcome(s: &Summary) -> String {
    two_columns(figures::outcome(s))
}

/// Kernels and copies that take a smaller share of the device's time are not listed.
const LEAST_SHARE: f64 = 0.01;

/// A finished run in full: the measures, then where the time went.
pub fn run(s: &Summary, device: &DeviceInfo) -> String {
    let mut rows = figures::measures(&s.output);
    rows.extend(figures::course(s, device));
    let stages = &s.timings.stages;
    let all: f64 = stages.iter().filter_map(|stage| stage.milliseconds).sum();
    for stage in stages {
        if let Some(ms) = stage.milliseconds.filter(|ms| *ms >= LEAST_SHARE * all) {
            rows.push(("device time", format!("{:26} {ms:9.2} ms in {} calls", stage.name, stage.calls)));
        }
    }
    rows.extend(figures::cost(s));
    two_columns(rows)
}

/// The plan of a run.
pub fn preview(p: &Preview) -> String {
    let r = &p.repaired;
    let vertices = if p.vertices_may_change { "vertices, about; spacing" } else { "vertices, spacing" };
    let mut rows = vec![
        ("input vertices, faces", format!("{}, {}", p.input[0], p.input[1])),
        (
            "welded, unused vertices",
            format!("{}, {}", r.duplicate_vertices_welded, r.unreferenced_vertices_removed),
        ),
        (
            "triangles without area, duplicates",
            format!("{}, {}", r.degenerate_faces_removed, r.repeated_faces()),
        ),
        (vertices, format!("{}, {:.6}", p.vertices, p.spacing)),
        ("curves, corners, patches", format!("{}, {}, {}", p.curves, p.corners, p.patches.len())),
    ];
    if let Some(kept) = &p.kept {
        let text = format!("{}, {}, {}", kept.triangles, kept.vertices, kept.joining_edges);
        rows.push(("kept triangles, their vertices, edges of the join", text));
    }
    for level in &p.levels {
        let inside = level.vertices - level.on_curves;
        let text = format!("{:8} vertices, spacing {:.6}", level.vertices, level.spacing);
        let on = format!("{} on curves, {inside} inside", level.on_curves);
        rows.push(("level", if p.curves > 0 { format!("{text}, {on}") } else { text }));
    }
    if p.collapses {
        rows.push(("method", "local operations: too few vertices between the features".to_owned()));
    }
    if !p.curve_vertices.is_empty() {
        let total: usize = p.curve_vertices.iter().sum();
        let corners = counted(p.corners, ["corner", "corners"]);
        let text = format!("{total} and {corners}: {}", first_of(&p.curve_vertices));
        rows.push(("on curves", text));
    }
    if p.patches.len() > 1 && !p.collapses {
        rows.push(("inside each patch, about", first_of(&p.patches)));
    }
    let mebibytes = p.device_bytes as f64 / f64::from(1 << 20);
    rows.push(("device memory, about", format!("{mebibytes:.1} MiB")));
    two_columns(rows)
}

/// The first of many counts.
fn first_of(counts: &[usize]) -> String {
    const MOST: usize = 12;
    let first: Vec<String> = counts.iter().take(MOST).map(usize::to_string).collect();
    first.join("  ") + if counts.len() > MOST { "  ..." } else { "" }
}

/// A device's name, with what tells it from others of that name.
fn place(device: &DeviceInfo) -> String {
    let pci = device.pci.as_ref().map_or(String::new(), |pci| format!("\npci:{pci}"));
    format!("{}\nuuid:{}{pci}", device.name, device.uuid)
}

/// The devices of this machine.
pub fn devices(list: &[DeviceInfo]) -> String {
    let mut table = Table::new();
    table.load_style(NOTHING);
    table.set_header(["", "device", "kind", "driver", "Vulkan", "limits", "usable"]);
    for d in list {
        let l = &d.limits;
        let limits = format!(
            "{} MiB per buffer\n{} KiB shared memory\n{} buffers per kernel\n{} invocations per workgroup\n\
             {:.1} GiB memory\n{}",
            l.storage_buffer_bytes >> 20,
            l.shared_memory_bytes >> 10,
            l.storage_buffers,
            l.workgroup_invocations,
            l.memory_bytes as f64 / f64::from(1 << 30),
            if l.timestamp_ns > 0.0 { "timestamps" } else { "no timestamps" },
        );
        let usable = match &d.self_test {
            _ if !d.missing.is_empty() => format!("no: needs {}", d.missing.join(", ")),
            SelfTest::Passed => "yes".to_owned(),
            other => format!("only by name: self-test {other}"),
        };
        let row =
            [d.index.to_string(), place(d), d.kind.to_owned(), d.driver.trim().to_owned(), d.api.clone()];
        table.add_row(row.into_iter().chain([limits, usable]));
    }
    table.trim_fmt() + "\n"
}
