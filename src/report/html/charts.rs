//! Charts as coordinates for an SVG: bars, lines, dots and labels.

use askama::Template;

use crate::TriMesh;
use crate::mesh::quality::{TriangleQuality, scale_of};
use std::collections::BTreeMap;

/// Size of a chart; left, top, right and bottom of its plot area.
const SIZE: [f64; 2] = [400.0, 200.0];
const AREA: [f64; 4] = [40.0, 10.0, 384.0, 174.0];
/// Degrees per bar.
const BIN: usize = 5;
/// Valences up to the first have one bar, as have those from the last on.
const VALENCES: [u32; 2] = [3, 9];
/// Share of the width of a group that its bars take.
const FILLED: f64 = 0.8;

/// One chart, drawn by chart.html.
#[derive(Template)]
#[template(path = "chart.html")]
pub(super) struct Chart {
    pub size: [f64; 2],
    pub area: [f64; 4],
    pub bars: Vec<Bar>,
    /// Path of a curve; may be empty.
    pub line: String,
    pub dots: Vec<Mark>,
    /// Labels below the plot area.
    pub below: Vec<Mark>,
    /// Labels on the left, each with a grid line.
    pub beside: Vec<Mark>,
}

/// A bar of the input (0) or the output (1).
pub(super) struct Bar {
    pub series: usize,
    pub x: f64,
    pub y: f64,
    pub width: f64,
    pub height: f64,
    pub text: String,
}

/// A text at a point.
pub(super) struct Mark {
    pub x: f64,
    pub y: f64,
    pub text: String,
}

/// The shares of the angles of all faces, by 5 degrees.
pub(super) fn angles(meshes: [&TriMesh; 2]) -> Chart {
    let shares = meshes.map(|mesh| {
        let scale = scale_of(mesh);
        let mut counts = vec![0usize; 180 / BIN];
        for t in 0..mesh.triangles.len() {
            for angle in TriangleQuality::new(mesh.corners(t).map(|p| p * scale)).angles {
                counts[(angle as usize / BIN).min(180 / BIN - 1)] += 1;
            }
        }
        shares(&counts)
    });
    let name = |k: usize| format!("{}° to {}°", BIN * k, BIN * (k + 1));
    let mut chart = bar_chart(&shares, name);
    chart.below = (0..=6)
        .map(|k| Mark { x: x_of(f64::from(k) / 6.0), y: SIZE[1] - 8.0, text: format!("{}°", 30 * k) })
        .collect();
    chart
}

/// The shares of the valences of inner vertices.
pub(super) fn valences(histograms: [&BTreeMap<u32, usize>; 2]) -> Chart {
    let [first, last] = VALENCES;
    let shares = histograms.map(|histogram| {
        let mut counts = vec![0usize; (last - first + 1) as usize];
        for (valence, count) in histogram {
            counts[((*valence).clamp(first, last) - first) as usize] += count;
        }
        shares(&counts)
    });
    let name = |k: usize| match first + k as u32 {
        k if k == first => format!("≤ {k}"),
        k if k == last => format!("≥ {k}"),
        k => k.to_string(),
    };
    let mut chart = bar_chart(&shares, |k| format!("valence {}", name(k)));
    let count = shares[0].len();
    chart.below = (0..count)
        .map(|k| Mark { x: x_of((k as f64 + 0.5) / count as f64), y: SIZE[1] - 8.0, text: name(k) })
        .collect();
    chart
}

/// The steps of the iterations on a logarithmic scale; `None` with fewer than two that are above 0.
pub(super) fn convergence(steps: &[f64]) -> Option<Chart> {
    let logs: Vec<(usize, f64)> =
        (1..).zip(steps).filter(|(_, s)| **s > 0.0 && s.is_finite()).map(|(k, s)| (k, s.log10())).collect();
    if logs.len() < 2 {
        return None;
    }
    let low = logs.iter().map(|(_, l)| l.floor()).fold(f64::INFINITY, f64::min);
    let high = logs.iter().map(|(_, l)| l.ceil()).fold(low + 1.0, f64::max);
    let last = steps.len();
    let x = |k: usize| x_of((k as f64 - 0.5) / last as f64);
    let y = |log: f64| y_of((log - low) / (high - low));
    let dots: Vec<Mark> = logs
        .iter()
        .map(|(k, log)| Mark { x: x(*k), y: y(*log), text: format!("iteration {k}: {:.2e}", steps[k - 1]) })
        .collect();
    let mut line = String::new();
    for dot in &dots {
        let pen = if line.is_empty() { 'M' } else { 'L' };
        line += &format!("{pen}{:.1} {:.1}", dot.x, dot.y);
    }
    let decades = (low as i32..=high as i32).map(|decade| Mark {
        x: AREA[0] - 5.0,
        y: y(f64::from(decade)),
        text: format!("1e{decade}"),
    });
    let every = last.div_ceil(8);
    let below = (1..=last).filter(|k| (k - 1) % every == 0);
    Some(Chart {
        line,
        dots: if last <= 60 { dots } else { Vec::new() },
        below: below.map(|k| Mark { x: x(k), y: SIZE[1] - 8.0, text: k.to_string() }).collect(),
        beside: decades.collect(),
        ..empty_chart()
    })
}

fn empty_chart() -> Chart {
    let line = String::new();
    Chart {
        size: SIZE,
        area: AREA,
        bars: Vec::new(),
        line,
        dots: Vec::new(),
        below: Vec::new(),
        beside: Vec::new(),
    }
}

/// Pairs of bars side by side for shares, 0..=1, with a scale in per cent.
fn bar_chart(shares: &[Vec<f64>; 2], name: impl Fn(usize) -> String) -> Chart {
    let largest = shares.iter().flatten().copied().fold(0.0, f64::max);
    let step = [0.01, 0.02, 0.05, 0.1, 0.2].into_iter().find(|step| largest / step <= 5.0).unwrap_or(0.25);
    let top = step * (largest / step).ceil().max(1.0);
    let group = 1.0 / shares[0].len() as f64;
    let mut bars = Vec::new();
    for (series, of) in shares.iter().enumerate() {
        for (k, share) in of.iter().enumerate().filter(|(_, share)| **share > 0.0) {
            let left = (k as f64 + 0.5 * (1.0 - FILLED) + 0.5 * FILLED * series as f64) * group;
            bars.push(Bar {
                series,
                x: x_of(left),
                y: y_of(share / top),
                width: x_of(left + 0.5 * FILLED * group) - x_of(left),
                height: AREA[3] - y_of(share / top),
                text: format!("{}, {}: {:.2} %", ["input", "output"][series], name(k), 100.0 * share),
            });
        }
    }
    let lines = (top / step).round() as u32;
    let beside = (0..=lines).map(|k| {
        let share = f64::from(k) / f64::from(lines);
        Mark { x: AREA[0] - 5.0, y: y_of(share), text: format!("{:.0} %", 100.0 * top * share) }
    });
    Chart { bars, beside: beside.collect(), ..empty_chart() }
}

fn shares(counts: &[usize]) -> Vec<f64> {
    let whole = counts.iter().sum::<usize>().max(1);
    counts.iter().map(|count| *count as f64 / whole as f64).collect()
}

/// From left to right, 0..=1.
fn x_of(share: f64) -> f64 {
    AREA[0] + share * (AREA[2] - AREA[0])
}

/// From the bottom up, 0..=1.
fn y_of(share: f64) -> f64 {
    AREA[3] - share * (AREA[3] - AREA[1])
}
