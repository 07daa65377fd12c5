//! Other programs on the same inputs in the same run.

use crate::contestant::{Contestant, Task, facts, python};
use crate::markdown::{Table, number, significant};
use crate::models::Model;
use crate::plots::{Chart, Series};
use crate::row::{Figures, Row};
use crate::runs::{Bench, median};
use crate::search::TOLERANCE;
use crate::section::Section;
use anyhow::Result;
use rtfmesh::io;
use rtfmesh::measure::{energy, measure};
use rtfmesh::mesh::topology::topology;
use std::path::Path;

/// Models and counts.
const TASKS: [(&str, usize); 3] = [("rocker-arm", 5800), ("kitten", 10_000), ("bunny", 25_000)];

/// The settings of rtfmesh that are compared.
const OURS: [(&str, &[&str]); 3] =
    [("rtfmesh draft", &["--quality", "draft"]), ("rtfmesh", &[]), ("rtfmesh best", &["--quality", "best"])];

/// A program with its times.
struct Entry {
    contestant: Contestant,
    edge: Option<f64>,
    searched: usize,
    calls: Vec<f64>,
    processes: Vec<f64>,
    failed: Option<String>,
}

/// All programs that are available, in turns; missing ones are listed.
///
/// # Errors
/// Those of reading models and of files. A program that fails gets a row that says so.
pub fn section(bench: &mut Bench, device: Option<&str>) -> Result<Section> {
    let folder = tempfile::tempdir()?;
    let mut table = Table::new([
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
        "energy %",
        "val 6",
        "cut",
        "topology",
        "call s",
        "process s",
        "runs",
        "searched",
        "note",
    ]);
    let (entrants, missing) = entrants(folder.path(), device);
    let (mut rows, mut charts) = (Vec::new(), Vec::new());
    let tasks = if bench.quick { &TASKS[1..2] } else { &TASKS[..] };
    for (name, vertices) in tasks {
        for model in bench.models(&[name])? {
            let mut series = Vec::new();
            let vertices = bench.scaled(*vertices);
            let task =
                Task { input: folder.path().join("input.ply"), folder: folder.path().to_owned(), vertices };
            io::write(&task.input, &model.mesh)?;
            for mut entry in compete(&entrants, &task, &model.title, bench.runs) {
                let row = judged(&mut entry, &model, &task);
                let process = median(&mut entry.processes);
                table.push(cells(&row, process, entry.searched));
                let point = row.seconds.zip(row.figures.as_ref()).map(|(s, f)| [s, f.q_avg]);
                series.push(Series { name: row.method.clone(), points: point.into_iter().collect() });
                rows.push(row);
            }
            charts.push(Chart {
                file: format!("peers-{}", model.name),
                title: format!("{}, {vertices} vertices: quality against time inside the call", model.title),
                labels: ["seconds", "mean quality of triangles"],
                logarithmic: [true, false],
                series,
            });
        }
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
    Ok(Section { name: "peers", title: "Other programs".to_owned(), text, table, rows, charts })
}

/// The programs that can run, and a line of text for each that cannot.
fn entrants(folder: &Path, device: Option<&str>) -> (Vec<Contestant>, Vec<String>) {
    let ours = |(name, arguments): (&str, &[&str])| Contestant::ours(name, arguments, device);
    let mut entrants: Vec<Contestant> = OURS.into_iter().map(ours).collect();
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
    let measured = io::read(&entry.contestant.result(task)).and_then(|loaded| {
        let measures = measure(&loaded.mesh, Some(&model.mesh))?;
        Ok((measures, energy(&model.mesh, &loaded.mesh.vertices)?))
    });
    let figures = match measured {
        Ok((measures, energy)) => Figures::of(&measures, &topology(&model.mesh), Some(energy)),
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

fn cells(row: &Row, process: Option<f64>, searched: usize) -> Vec<String> {
    let figures = row.figures.as_ref();
    let figure = |of: fn(&Figures) -> f64, digits| number(figures.map(of), digits);
    let maybe = |of: fn(&Figures) -> Option<f64>, digits| number(figures.and_then(of), digits);
    vec![
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
        maybe(|f| f.energy_excess.map(|share| 100.0 * share), 2),
        maybe(|f| f.valence_6, 3),
        maybe(|f| f.self_intersecting.map(|n| n as f64), 0),
        figures.map_or(String::new(), |f| f.topology.clone()),
        significant(row.seconds),
        significant(process),
        row.runs.to_string(),
        searched.to_string(),
        row.note.clone(),
    ]
}
