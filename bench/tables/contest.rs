//! Programs that remesh the same inputs in turns, and what they make of them.

use crate::contestant::{Contestant, Task, facts, python};
use crate::markdown::{Table, number, significant};
use crate::models::Model;
use crate::plots::{Chart, Series};
use crate::row::{Figures, Row};
use crate::runs::{Bench, median};
use crate::search::TOLERANCE;
use crate::section::Section;
use anyhow::Result;
use rtfmesh::ProgressToken;
use rtfmesh::io;
use rtfmesh::measure::{energy, measure};
use rtfmesh::mesh::feature_distance::{FeatureDistances, feature_distances};
use rtfmesh::mesh::topology::topology;
use std::path::Path;

/// Columns of the table; those of features are for parts alone.
const COLUMNS: [&str; 21] = [
    "model",
    "program",
    "#V",
    "Qmin",
    "Qavg",
    "θmin",
    "θ<30°",
    "θ>90°",
    "dH %",
    "RMS %",
    "feature dH %",
    "feature RMS %",
    "energy %",
    "val 6",
    "cut",
    "topology",
    "call s",
    "process s",
    "runs",
    "searched",
    "note",
];

/// A program with its times.
struct Entry {
    contestant: Contestant,
    edge: Option<f64>,
    searched: usize,
    calls: Vec<f64>,
    processes: Vec<f64>,
    failed: Option<String>,
}

/// What is compared.
pub struct Contest {
    /// Name and title of the section.
    pub name: &'static str,
    pub title: &'static str,
    /// Inputs and the vertices wanted.
    pub models: Vec<(Model, usize)>,
    /// Names and arguments of rtfmesh's entries.
    pub ours: &'static [(&'static str, &'static [&'static str])],
    /// Degrees from which an edge is a feature, if features are to be kept and measured.
    pub features: Option<f64>,
}

/// All programs that are available, in turns; missing ones are listed.
///
/// # Errors
/// Those of files. A program that fails gets a row that says so.
pub fn contest(bench: &Bench, contest: &Contest, device: Option<&str>) -> Result<Section> {
    let folder = tempfile::tempdir()?;
    let features = contest.features.is_some();
    let mut table = Table::new(COLUMNS.into_iter().filter(|name| features || !name.starts_with("feature")));
    let (entrants, missing) = entrants(folder.path(), contest.ours, device);
    let (mut rows, mut charts) = (Vec::new(), Vec::new());
    for (model, vertices) in &contest.models {
        let mut series = Vec::new();
        let vertices = bench.scaled(*vertices);
        let task = Task {
            input: folder.path().join("input.ply"),
            folder: folder.path().to_owned(),
            vertices,
            features: contest.features,
        };
        io::write(&task.input, &model.mesh)?;
        for mut entry in compete(&entrants, &task, &model.title, bench.runs) {
            let row = judged(&mut entry, model, &task);
            let process = median(&mut entry.processes);
            table.push(cells(&row, process, entry.searched, features));
            let point = row.seconds.zip(row.figures.as_ref()).map(|(s, f)| [s, f.q_avg]);
            series.push(Series { name: row.method.clone(), points: point.into_iter().collect() });
            rows.push(row);
        }
        charts.push(Chart {
            file: format!("{}-{}", contest.name, model.name),
            title: format!("{}, {vertices} vertices: quality against time inside the call", model.title),
            labels: ["seconds", "mean quality of triangles"],
            logarithmic: [true, false],
            series,
        });
    }
    let mut text = vec![
        "Same input file, same count within 2 %, in turns; all measured by rtfmesh. `call` is the time \
         inside the call, without reading, writing, imports and opening the device; `process` is the whole \
         process from its start."
            .to_owned(),
        "`searched`: untimed runs to find the edge length for the count, for programs that take no count."
            .to_owned(),
    ];
    text.extend(missing);
    Ok(Section { name: contest.name, title: contest.title.to_owned(), text, table, rows, charts })
}

/// The programs that can run, and a line of text for each that cannot.
fn entrants(folder: &Path, ours: &[(&str, &[&str])], device: Option<&str>) -> (Vec<Contestant>, Vec<String>) {
    let ours = ours.iter().map(|(name, arguments)| Contestant::ours(name, arguments, device));
    let mut entrants: Vec<Contestant> = ours.collect();
    let python = python();
    let known = match facts(&python, folder) {
        Ok(known) => known,
        Err(error) => {
            let line = format!(
                "Missing: all others, because {} cannot run bench/peers/run_peer.py: {error:#}.",
                python.display()
            );
            println!("{line}");
            return (entrants, vec![line]);
        }
    };
    let mut missing = Vec::new();
    for (name, fact) in known {
        if let Some(reason) = &fact.missing {
            missing.push(format!("Missing: {name}, {reason}."));
            println!("peers: {name} is missing, {reason}");
        } else {
            entrants.push(Contestant::peer(&name, &fact, &python));
        }
    }
    (entrants, missing)
}

/// Finds edge lengths, then runs all in turns; a program that fails is not run again.
fn compete(entrants: &[Contestant], task: &Task, model: &str, runs: usize) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    for contestant in entrants.iter().cloned() {
        println!("{model}: {}, {} vertices", contestant.name, task.vertices);
        let (edge, searched, failed) = match contestant.edge(task) {
            Ok((edge, searched)) => (edge, searched, None),
            Err(error) => (None, 0, Some(format!("{error:#}"))),
        };
        let (calls, processes) = (Vec::new(), Vec::new());
        entries.push(Entry { contestant, edge, searched, calls, processes, failed });
    }
    for _ in 0..runs {
        for entry in entries.iter_mut().filter(|entry| entry.failed.is_none()) {
            match entry.contestant.round(task, entry.edge) {
                Ok(round) => {
                    entry.calls.push(round.call);
                    entry.processes.push(round.process);
                }
                Err(error) => entry.failed = Some(format!("{error:#}")),
            }
        }
    }
    entries
}

/// The result of the last run.
fn judged(entry: &mut Entry, model: &Model, task: &Task) -> Row {
    let name = entry.contestant.name.clone();
    if let Some(failed) = &entry.failed {
        return Row::refused(&model.title, &name, task.vertices, failed.clone());
    }
    let measured = io::read(entry.contestant.result(task)).and_then(|loaded| {
        let measures = measure(&loaded.mesh, Some(&model.mesh))?;
        let features = task
            .features
            .map(|angle| feature_distances(&loaded.mesh, &model.mesh, angle, &ProgressToken::default()));
        Ok((measures, energy(&model.mesh, &loaded.mesh.vertices)?, features.transpose()?))
    });
    let figures = match measured {
        Ok((measures, energy, features)) => Figures {
            features: features.and_then(|f| larger_distances(&f)),
            ..Figures::of(&measures, &topology(&model.mesh), Some(energy))
        },
        Err(error) => return Row::refused(&model.title, &name, task.vertices, error.to_string()),
    };
    let off = figures.vertices as f64 / task.vertices as f64 - 1.0;
    let note =
        if off.abs() > TOLERANCE { format!("count is off by {:.1} %", 100.0 * off) } else { String::new() };
    Row {
        model: model.title.clone(),
        method: name,
        wanted: task.vertices,
        figures: Some(figures),
        runs: entry.calls.len(),
        seconds: median(&mut entry.calls),
        phases: median(&mut entry.processes).map(|s| ("process", 1e3 * s)).into_iter().collect(),
        note,
        ..Row::default()
    }
}

/// Largest and root mean square distance, each the larger of both ways; `None` if a mesh has no features.
fn larger_distances(features: &FeatureDistances) -> Option<[f64; 2]> {
    let (to, from) = (features.to_reference.as_ref()?, features.from_reference.as_ref()?);
    Some([to.largest.max(from.largest), to.rms.max(from.rms)])
}

fn cells(row: &Row, process: Option<f64>, searched: usize, features: bool) -> Vec<String> {
    let figures = row.figures.as_ref();
    let figure = |of: fn(&Figures) -> f64, digits| number(figures.map(of), digits);
    let maybe = |of: fn(&Figures) -> Option<f64>, digits| number(figures.and_then(of), digits);
    let mut cells = vec![
        row.model.clone(),
        row.method.clone(),
        figure(|f| f.vertices as f64, 0),
        figure(|f| f.q_min, 3),
        figure(|f| f.q_avg, 3),
        figure(|f| f.theta_min, 2),
        figure(|f| f.below_30, 3),
        figure(|f| f.above_90, 3),
        maybe(|f| f.hausdorff, 3),
        maybe(|f| f.rms, 4),
    ];
    if features {
        cells.extend([maybe(|f| f.features.map(|f| f[0]), 3), maybe(|f| f.features.map(|f| f[1]), 4)]);
    }
    cells.extend([
        maybe(|f| f.energy_excess.map(|share| 100.0 * share), 2),
        maybe(|f| f.valence_6, 3),
        maybe(|f| f.self_intersecting.map(|n| n as f64), 0),
        figures.map_or(String::new(), |f| f.topology.clone()),
        significant(row.seconds),
        significant(process),
        row.runs.to_string(),
        searched.to_string(),
        row.note.clone(),
    ]);
    cells
}
