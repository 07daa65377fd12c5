//! Tables for people.

use comfy_table::Table;
use comfy_table::presets::NOTHING;
use rtfmesh::measure::Measures;
use rtfmesh::mesh::voronoi::Energy;
use rtfmesh::{DeviceInfo, Preview, Summary};

pub(super) fn two_columns(rows: Vec<(&str, String)>) -> String {
    let mut table = Table::new();
    table.load_style(NOTHING);
    for (name, value) in rows {
        table.add_row([name.to_owned(), value]);
    }
    table.trim_fmt() + "\n"
}

/// The measures of one mesh.
pub fn measures(m: &Measures, energy: Option<&Energy>) -> String {
    let mut rows = measure_rows(m);
    rows.extend(energy.map(energy_row));
    two_columns(rows)
}

fn energy_row(energy: &Energy) -> (&'static str, String) {
    let Energy { energy, excess } = energy;
    ("energy, above hexagons", format!("{energy:.4e}, {:.2} %", 100.0 * excess))
}

fn measure_rows(m: &Measures) -> Vec<(&'static str, String)> {
    let (q, t, v) = (&m.quality, &m.topology, &m.valence);
    let percent = |share: f64| format!("{:.3} %", 100.0 * share);
    let maybe = |share: Option<f64>| share.map_or_else(|| "-".to_owned(), percent);
    let mut rows = vec![
        ("vertices, faces", format!("{}, {}", m.vertices, m.faces)),
        ("Q min, average", format!("{:.4}, {:.4}", q.q_min, q.q_avg)),
        ("smallest angle: min, average", format!("{:.2}°, {:.2}°", q.theta_min, q.theta_min_avg)),
        (
            "faces with an angle < 30°, > 90°",
            format!("{}, {}", percent(q.share_below_30), percent(q.share_above_90)),
        ),
        ("valence 6, outside 5 to 7", format!("{}, {}", maybe(v.share_6), maybe(v.share_outside_5_to_7))),
        ("valences", v.histogram.iter().map(|(d, n)| format!("{d}: {n}")).collect::<Vec<_>>().join("  ")),
        ("components, boundary loops", format!("{}, {}", t.components, t.boundary_loops)),
        ("Euler characteristic, genus", {
            format!("{}, {}", t.euler, t.genus.map_or_else(|| "-".to_owned(), |g| g.to_string()))
        }),
        ("non-manifold edges, vertices", format!("{}, {}", t.nonmanifold_edges, t.nonmanifold_vertices)),
        ("inconsistent edges, duplicate faces", format!("{}, {}", t.inconsistent_edges, t.duplicate_faces)),
    ];
    if let Some(count) = m.self_intersecting_faces {
        rows.push(("self-intersecting faces", count.to_string()));
    }
    if let Some(d) = &m.distances {
        let pair = |to: f64, from: f64| format!("{to:.4} %, {from:.4} %");
        rows.push((
            "Hausdorff to, from reference",
            pair(d.hausdorff_to_reference, d.hausdorff_from_reference),
        ));
        rows.push(("RMS to, from reference", pair(d.rms_to_reference, d.rms_from_reference)));
    }
    rows
}

/// A finished run: the measures, then where the time went.
pub fn run(s: &Summary, device: &DeviceInfo) -> String {
    let mut rows = measure_rows(&s.output);
    rows.extend(s.energy.as_ref().map(energy_row));
    if let Some(disks) = &s.disks {
        rows.push((
            "apart by, covered within",
            format!("{:.6}, {:.6} (input's units)", disks.radius, disks.covered),
        ));
    } else {
        let end = if s.converged { "converged" } else { "limit reached" };
        rows.push((
            "iterations",
            format!("{} ({end}), last step {:.5}", s.iterations, s.steps.last().unwrap_or(&0.0)),
        ));
    }
    if let Some(found) = s.skeleton.filter(|found| found.curves + found.corners > 0) {
        rows.push((
            "curves, corners, patches",
            format!("{}, {}, {}", found.curves, found.corners, found.patches),
        ));
        rows.push(("vertices on curves", found.curve_sites.to_string()));
    }
    rows.push(("device", format!("{} ({})", device.name, device.driver.trim())));
    let seconds = |ms: f64| format!("{:.2} s", ms * 1e-3);
    for stage in s.timings.stages.iter().filter(|t| t.milliseconds.is_some_and(|ms| ms >= 5.0)) {
        let text = format!("{} in {} calls", seconds(stage.milliseconds.unwrap_or(0.0)), stage.calls);
        rows.push(("device time", format!("{:26} {text}", stage.name)));
    }
    rows.push(("wall time", seconds(s.timings.wall_milliseconds)));
    rows.push((
        "peak device memory",
        format!("{:.1} MiB", s.timings.peak_device_bytes as f64 / f64::from(1 << 20)),
    ));
    two_columns(rows)
}

/// A run that was not made.
pub fn preview(p: &Preview) -> String {
    /// More patches than these say nothing to people.
    const MOST_PATCHES: usize = 12;
    let r = &p.repaired;
    let mut rows = vec![
        ("input vertices, faces", format!("{}, {}", p.input[0], p.input[1])),
        (
            "welded, unused vertices",
            format!("{}, {}", r.duplicate_vertices_welded, r.unreferenced_vertices_dropped),
        ),
        (
            "faces without area, duplicate faces",
            format!("{}, {}", r.degenerate_faces_dropped, r.duplicate_faces_dropped),
        ),
        ("vertices, spacing", format!("{}, {:.6}", p.vertices, p.spacing)),
        ("curves, corners, patches", format!("{}, {}, {}", p.curves, p.corners, p.patches.len())),
    ];
    for level in &p.levels {
        let inside = level.vertices - level.on_curves;
        let text = format!("{:8} vertices, spacing {:.6}", level.vertices, level.spacing);
        let on = format!("{} on curves, {inside} inside", level.on_curves);
        rows.push(("level", if p.curves > 0 { format!("{text}, {on}") } else { text }));
    }
    if p.collapses {
        rows.push((
            "method",
            "collapsed edges: too few vertices for cells beside the sharp and open edges".to_owned(),
        ));
    }
    if p.patches.len() > 1 && !p.collapses {
        let mut counts: Vec<String> = p.patches.iter().take(MOST_PATCHES).map(usize::to_string).collect();
        if p.patches.len() > MOST_PATCHES {
            counts.push("...".to_owned());
        }
        rows.push(("inside each patch, about", counts.join("  ")));
    }
    let mebibytes = p.device_bytes as f64 / f64::from(1 << 20);
    rows.push(("device memory, about", format!("{mebibytes:.1} MiB")));
    two_columns(rows)
}

/// The devices of this machine.
pub fn devices(list: &[DeviceInfo]) -> String {
    let mut table = Table::new();
    table.load_style(NOTHING);
    table.set_header(["", "device", "kind", "driver", "Vulkan", "limits that matter", "usable"]);
    for d in list {
        let l = &d.limits;
        let limits = format!(
            "{} MiB a buffer\n{} KiB shared memory\n{} buffers a kernel\n{} invocations a workgroup\n{:.1} GiB memory\n{}",
            l.storage_buffer_bytes >> 20,
            l.shared_memory_bytes >> 10,
            l.storage_buffers,
            l.workgroup_invocations,
            l.memory_bytes as f64 / f64::from(1 << 30),
            if l.timestamp_ns > 0.0 { "timestamps" } else { "no timestamps" },
        );
        let usable = if d.missing.is_empty() {
            "yes".to_owned()
        } else {
            format!("no: needs {}", d.missing.join(", "))
        };
        let row = [
            d.index.to_string(),
            d.name.clone(),
            d.kind.to_owned(),
            d.driver.trim().to_owned(),
            d.api.clone(),
        ];
        table.add_row(row.into_iter().chain([limits, usable]));
    }
    table.trim_fmt() + "\n"
}
