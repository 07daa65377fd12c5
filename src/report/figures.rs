//! The figures of a mesh and of a run as text, in rows of a name and a value.

use crate::cloud::{DistanceStatistics, PointDistances};
use crate::gpu::DeviceInfo;
use crate::grammar::counted;
use crate::measure::Measures;
use crate::mesh::cell_mesh::CellKind;
use crate::mesh::feature_distance::{FeatureDistance, FeatureDistances};
use crate::mesh::features::Discarded;
use crate::pipeline::{MetricQuality, ShorterEdges, Summary};
use crate::sites::restricted_voronoi::Energy;

/// A name, the same in every run, and its value as text.
pub type Row = (&'static str, String);

/// What matters of a run.
pub fn outcome(s: &Summary) -> Vec<Row> {
    let m = &s.output;
    let mut rows = vec![
        ("vertices, triangles", format!("{}, {}", m.vertices, m.faces)),
        ("smallest angle", format!("{:.1}°", m.quality.min_angle)),
        ("mean quality", format!("{:.3} (1: all equilateral)", m.quality.mean_quality)),
    ];
    if let Some(d) = &m.distances {
        let text = format!("RMS {:.4} %, at most {:.4} % of the diagonal", d.rms, d.hausdorff);
        rows.push(("deviation from the input", text));
    }
    rows.push(("time", seconds(s.timings.wall_milliseconds)));
    rows
}

/// The measures of one mesh.
pub fn measures(m: &Measures) -> Vec<Row> {
    let (q, t, v) = (&m.quality, &m.topology, &m.valence);
    let percent = |share: f64| format!("{:.3} %", 100.0 * share);
    let maybe = |share: Option<f64>| share.map_or_else(|| "-".to_owned(), percent);
    let mut rows = vec![
        ("vertices, faces", format!("{}, {}", m.vertices, m.faces)),
        ("quality: minimum, mean", format!("{:.4}, {:.4}", q.min_quality, q.mean_quality)),
        ("smallest angle: minimum, mean", format!("{:.2}°, {:.2}°", q.min_angle, q.mean_min_angle)),
        (
            "triangles with angles < 30°, > 90°",
            format!("{}, {}", percent(q.fraction_below_30), percent(q.fraction_above_90)),
        ),
        (
            "valence 6, outside 5 to 7",
            format!("{}, {}", maybe(v.fraction_6), maybe(v.fraction_outside_5_to_7)),
        ),
        ("valences", v.histogram.iter().map(|(d, n)| format!("{d}: {n}")).collect::<Vec<_>>().join("  ")),
        ("components, boundary loops", format!("{}, {}", t.components, t.boundary_loops)),
        ("Euler characteristic, genus", {
            format!("{}, {}", t.euler, t.genus.map_or_else(|| "-".to_owned(), |g| g.to_string()))
        }),
        ("non-manifold edges, vertices", format!("{}, {}", t.nonmanifold_edges, t.nonmanifold_vertices)),
        ("inconsistent edges, duplicate faces", format!("{}, {}", t.inconsistent_edges, t.duplicate_faces)),
    ];
    if let Some(count) = m.self_intersecting_faces {
        rows.push(("self-intersecting triangles", count.to_string()));
    }
    if let Some(d) = &m.distances {
        let [to, from] = [
            [d.hausdorff_to_reference_lower, d.hausdorff_to_reference],
            [d.hausdorff_from_reference_lower, d.hausdorff_from_reference],
        ]
        .map(|[lower, upper]| format!("{lower:.4} to {upper:.4} %"));
        let note = if d.hausdorff_close { "" } else { " (wider than requested)" };
        rows.push(("Hausdorff to, from reference", format!("{to}, {from}{note}")));
        let rms = format!("{:.4} %, {:.4} %", d.rms_to_reference, d.rms_from_reference);
        rows.push(("RMS to, from reference (sampled)", rms));
    }
    rows
}

/// How a run ended, the features it found, and its device.
pub fn course(s: &Summary, device: &DeviceInfo) -> Vec<Row> {
    let mut rows: Vec<Row> = s.energy.as_ref().map(energy).into_iter().collect();
    if let Some(disks) = &s.disks {
        let text = format!("{:.6}, {:.6} (input's units)", disks.radius, disks.covered);
        rows.push(("disk radius, covering radius", text));
    } else {
        let end = if s.converged { "converged" } else { "limit reached" };
        let last = s.steps.last().unwrap_or(&0.0);
        rows.push(("iterations", format!("{} ({end}), last step {last:.5}", s.iterations)));
    }
    if let Some([least, largest]) = s.edge_lengths {
        rows.push(("requested edge lengths", format!("{least:.6} to {largest:.6} (input's units)")));
    }
    if let Some(metric) = s.metric {
        let MetricQuality { mean_quality, min_angle, mean_aspect } = metric;
        rows.push(("in the metric: mean quality", format!("{mean_quality:.3}")));
        rows.push(("in the metric: smallest angle", format!("{min_angle:.1}°")));
        rows.push(("mean aspect of the metric", format!("{mean_aspect:.2}")));
    }
    if let Some(shorter) = &s.shorter_edges {
        let ShorterEdges { places, shortest, vertices } = shorter;
        let places = counted(places.len(), ["place", "places"]);
        let vertices = counted(*vertices, ["vertex", "vertices"]);
        let text = format!("at {places}, down to {:.0} %: {vertices}", 100.0 * shortest);
        rows.push(("shorter edges around missed places", text));
    }
    if let Some(found) = s.features.filter(|found| found.curves + found.corners > 0) {
        rows.push((
            "curves, corners, patches",
            format!("{}, {}, {}", found.curves, found.corners, found.patches),
        ));
        rows.push(("vertices on curves", found.curve_sites.to_string()));
    }
    rows.extend(s.features.iter().flat_map(|found| discarded_rows(&found.discarded)));
    if let Some(found) = s.cells {
        let kind = match found.kind {
            CellKind::Tangent => "tangent faces",
            CellKind::Exact => "exact cells",
        };
        let polygons = counted(found.polygons, ["polygon", "polygons"]);
        let text = format!("{} in {polygons}, {:.6} % of the area", found.cells, 100.0 * found.area);
        rows.push((kind, text));
    }
    if let Some(found) = s.deviation {
        let reached = if found.is_reached { "reached" } else { "not reached" };
        rows.push((
            "requested maximum deviation",
            format!("{:.4} %: {reached}, {}", found.asked, counted(found.runs, ["run", "runs"])),
        ));
    }
    if let Some(small) = s.small_angles.filter(|small| small.left + small.edits > 0) {
        let edits = counted(small.edits, ["edit", "edits"]);
        let vertices = counted(small.vertices, ["vertex", "vertices"]);
        let text = format!("{edits}, {vertices} from elsewhere");
        rows.push(("small angles mended", text));
        let kept = if small.kept > 0 { format!(", {} kept", small.kept) } else { String::new() };
        let text = format!(
            "{}: {} at sharp corners, {} between close features{kept}",
            small.left, small.at_corners, small.between_curves
        );
        rows.push(("small angles remaining", text));
    }
    rows.push(("device", format!("{} ({})", device.name, device.driver.trim())));
    rows
}

/// What became of sharp edges that are not features; empty if there are none.
pub fn discarded_rows(discarded: &Discarded) -> Vec<Row> {
    if *discarded == Discarded::default() {
        return Vec::new();
    }
    let text = |count: usize, length: f64| format!("{count}, length {length:.6}");
    vec![
        ("discarded short or rough chains", text(discarded.short_chains, discarded.short_length)),
        ("discarded dangling chains", text(discarded.dangling_chains, discarded.dangling_length)),
        ("discarded at narrow strips", text(discarded.strips, discarded.strip_length)),
        ("discarded between narrow facets", text(discarded.facet_edges, discarded.facet_length)),
    ]
}

/// How far features of two meshes are from each other.
pub fn features(features: &FeatureDistances) -> Vec<Row> {
    let both = |number: fn(&FeatureDistance) -> f64| {
        let text = |found: Option<FeatureDistance>| {
            found.map_or_else(|| "-".to_owned(), |found| format!("{:.4} %", number(&found)))
        };
        format!("{}, {}", text(features.to_reference), text(features.from_reference))
    };
    vec![
        ("features: length, reference's length", {
            format!("{:.2} %, {:.2} %", features.length, features.reference_length)
        }),
        ("features: maximum distance to, from", both(|found| found.largest)),
        ("features: RMS to, from", both(|found| found.rms)),
    ]
}

/// How far a mesh and points are from each other.
pub fn point_distances(d: &PointDistances) -> Vec<Row> {
    let text = |d: &DistanceStatistics| format!("{:.4} %, {:.4} %, {:.4} %", d.rms, d.mean, d.largest);
    vec![
        ("points, diagonal of their box", format!("{}, {:.6}", d.points, d.diagonal)),
        ("points to mesh: RMS, mean, maximum", text(&d.from_points)),
        ("mesh to nearest points (sampled)", text(&d.to_points)),
        ("spacing of the points", format!("{:.4} %", d.spacing)),
    ]
}

/// How evenly points are spread over a mesh.
pub fn energy(energy: &Energy) -> Row {
    let Energy { energy, excess } = energy;
    ("energy, excess over hexagons", format!("{energy:.4e}, {:.2} %", 100.0 * excess))
}

/// The time and memory that a run took.
pub fn cost(s: &Summary) -> Vec<Row> {
    let mebibytes = s.timings.peak_device_bytes as f64 / f64::from(1 << 20);
    let waiting = s.timings.waiting_milliseconds;
    let host = seconds(s.timings.wall_milliseconds - waiting);
    vec![
        ("wall time", seconds(s.timings.wall_milliseconds)),
        ("waiting for the device, host code", format!("{}, {host}", seconds(waiting))),
        ("peak device memory", format!("{mebibytes:.1} MiB")),
    ]
}

/// Milliseconds as seconds.
pub fn seconds(milliseconds: f64) -> String {
    format!("{:.2} s", milliseconds * 1e-3)
}
