//! One result with its measures.

use crate::markdown::{DASH, number, ratio, significant};
use crate::paper::Published;
use rtfmesh::measure::{Energy, Measures};
use rtfmesh::mesh::topology::Topology;
use serde::Serialize;
use std::collections::BTreeMap;

/// A run on a model, or an input.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Row {
    /// Name of the model in tables.
    pub model: String,
    /// The method: a preset, a peer or `input`.
    pub method: String,
    /// Vertices asked for.
    pub wanted: usize,
    /// Iterations with all vertices, if the method has any.
    pub iterations: Option<u32>,
    /// Measures of the result.
    pub figures: Option<Figures>,
    /// Median time of a run without reading, writing, opening the device and measuring.
    pub seconds: Option<f64>,
    /// Runs that the median is of.
    pub runs: usize,
    /// Device milliseconds of all iterations by kind of work: `search`, `normals`, `face`, `projection`,
    /// `other`.
    pub stages: BTreeMap<&'static str, f64>,
    /// Wall milliseconds by phase of the first run.
    pub phases: BTreeMap<&'static str, f64>,
    /// A remark; the reason if there are no figures.
    pub note: String,
}

/// Measures of a mesh for the tables.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Figures {
    /// Vertices in use.
    pub vertices: usize,
    /// Triangles.
    pub faces: usize,
    /// Smallest quality.
    pub q_min: f64,
    /// Mean quality.
    pub q_avg: f64,
    /// Smallest angle in degrees.
    pub theta_min: f64,
    /// Mean of the smallest angles in degrees.
    pub theta_min_avg: f64,
    /// Share of triangles with an angle below 30 degrees.
    pub below_30: f64,
    /// Share of triangles with an angle above 90 degrees.
    pub above_90: f64,
    /// The larger of both Hausdorff distances, its upper end, in percent of the input's diagonal.
    pub hausdorff: Option<f64>,
    /// The larger of both root mean square distances in percent of the input's diagonal.
    pub rms: Option<f64>,
    /// Largest and root mean square distance of features, each the larger of both ways, in percent of the
    /// input's diagonal; only where features are compared.
    pub features: Option<[f64; 2]>,
    /// Excess of the energy over that of a layout of hexagons on a plane of the same area, as a share.
    pub energy_excess: Option<f64>,
    /// Share of inner vertices with six edges.
    pub valence_6: Option<f64>,
    /// Share of inner vertices with fewer than five or more than seven edges.
    pub irregular: Option<f64>,
    /// `same` as the input's, or what differs.
    pub topology: String,
    /// Faces that cut others.
    pub self_intersecting: Option<usize>,
}

impl Figures {
    /// The figures of a result, with its energy on the input; an input is compared with itself.
    pub fn of(measures: &Measures, input: &Topology, energy: Option<Energy>) -> Self {
        let (q, v, d) = (&measures.quality, &measures.valence, &measures.distances);
        Self {
            vertices: measures.vertices,
            faces: measures.faces,
            q_min: q.min_quality,
            q_avg: q.mean_quality,
            theta_min: q.min_angle,
            theta_min_avg: q.mean_min_angle,
            below_30: q.fraction_below_30,
            above_90: q.fraction_above_90,
            hausdorff: d.as_ref().map(|d| d.hausdorff),
            rms: d.as_ref().map(|d| d.rms),
            features: None,
            energy_excess: energy.map(|energy| energy.excess),
            valence_6: v.fraction_6,
            irregular: v.fraction_outside_5_to_7,
            topology: compared(&measures.topology, input),
            self_intersecting: measures.self_intersecting_faces,
        }
    }
}

/// How a result's topology differs from the input's, in words.
fn compared(got: &Topology, want: &Topology) -> String {
    let facts = [
        ("components", got.components as i64, want.components as i64),
        ("Euler", got.euler, want.euler),
        ("boundary loops", got.boundary_loops as i64, want.boundary_loops as i64),
        ("non-manifold edges", got.nonmanifold_edges as i64, want.nonmanifold_edges as i64),
        ("non-manifold vertices", got.nonmanifold_vertices as i64, want.nonmanifold_vertices as i64),
    ];
    let differs: Vec<String> = facts
        .iter()
        .filter(|(_, got, want)| got != want)
        .map(|(name, got, want)| format!("{name} {got}, not {want}"))
        .collect();
    if differs.is_empty() { "same".to_owned() } else { differs.join("; ") }
}

/// The columns of the paper's Table 2 and additional ones, after model and method.
pub const COLUMNS: [&str; 16] = [
    "it",
    "#V",
    "#F",
    "Qmin",
    "Qavg",
    "θmin",
    "θmin,avg",
    "θ<30°",
    "θ>90°",
    "dH %",
    "RMS %",
    "energy %",
    "val 6",
    "cut",
    "topology",
    "T s",
];

impl Row {
    /// A row for a run that failed.
    pub fn refused(model: &str, method: &str, wanted: usize, note: String) -> Self {
        Self { model: model.to_owned(), method: method.to_owned(), wanted, note, ..Self::default() }
    }

    /// The cells for [`COLUMNS`], then the note.
    pub fn cells(&self) -> Vec<String> {
        let count = |n: Option<usize>| n.map_or(DASH.to_owned(), |n| n.to_string());
        let it = count(self.iterations.map(|n| n as usize));
        let Some(f) = &self.figures else {
            let mut cells = vec![it];
            cells.resize(COLUMNS.len(), DASH.to_owned());
            cells.push(self.note.clone());
            return cells;
        };
        vec![
            it,
            f.vertices.to_string(),
            f.faces.to_string(),
            number(Some(f.q_min), 3),
            number(Some(f.q_avg), 3),
            number(Some(f.theta_min), 2),
            number(Some(f.theta_min_avg), 2),
            number(Some(f.below_30), 3),
            number(Some(f.above_90), 3),
            number(f.hausdorff, 3),
            number(f.rms, 4),
            number(f.energy_excess.map(|share| 100.0 * share), 2),
            number(f.valence_6, 3),
            count(f.self_intersecting),
            f.topology.clone(),
            significant(self.seconds),
            self.note.clone(),
        ]
    }

    /// The ratios to the paper's figures, for [`COLUMNS`]. None of `dH`, which is something else in the paper
    /// (see bench/README.md).
    pub fn ratios(&self, paper: &Published) -> Vec<String> {
        let ours = |value: fn(&Figures) -> f64| self.figures.as_ref().map(value);
        let mut cells = vec![DASH.to_owned(); 3];
        cells.extend([
            ratio(ours(|f| f.q_min), paper.q_min),
            ratio(ours(|f| f.q_avg), paper.q_avg),
            ratio(ours(|f| f.theta_min), paper.theta_min),
            ratio(ours(|f| f.theta_min_avg), paper.theta_min_avg),
            ratio(ours(|f| f.below_30), paper.below_30),
            ratio(ours(|f| f.above_90), paper.above_90),
        ]);
        cells.extend(vec![DASH.to_owned(); 6]);
        cells.push(ratio(self.seconds, paper.seconds));
        cells
    }
}

/// The paper's row, for [`COLUMNS`]; its outputs have 160 iterations at most.
pub fn published(row: &Published) -> Vec<String> {
    let mut cells = vec![DASH.to_owned(), row.vertices.to_string(), row.faces.to_string()];
    let decimals = [(row.q_min, 3), (row.q_avg, 3), (row.theta_min, 2), (row.theta_min_avg, 2)];
    cells.extend(decimals.map(|(value, digits)| number(value, digits)));
    cells.extend([row.below_30, row.above_90, row.hausdorff].map(|value| number(value, 3)));
    cells.extend(vec![DASH.to_owned(); 5]);
    cells.push(significant(row.seconds));
    cells
}
