//! Other programs on the same inputs in the same run: on the paper's models, and on CAD parts.

use crate::contest::{Contest, contest};
use crate::models::{Model, part};
use crate::runs::Bench;
use crate::section::Section;
use anyhow::Result;

/// Models and counts.
const TASKS: [(&str, usize); 3] = [("rocker-arm", 5800), ("kitten", 10_000), ("bunny", 25_000)];

/// Parts that bench/peers/parts.py makes.
const PARTS: [&str; 6] = ["assembly", "casting", "crank-case", "gear", "heat-sink", "thin-walls"];

/// Vertices of every part.
const PART_VERTICES: usize = 10_000;

/// Degrees from which an edge is a feature, for all programs and for measuring.
const FEATURE_ANGLE: f64 = 40.0;

/// The settings of rtfmesh that are compared.
const OURS: [(&str, &[&str]); 3] =
    [("rtfmesh draft", &["--quality", "draft"]), ("rtfmesh", &[]), ("rtfmesh best", &["--quality", "best"])];

/// Those on CAD parts.
const OURS_ON_PARTS: [(&str, &[&str]); 1] = [("rtfmesh", &["--feature-angle", "40"])];

/// All programs that are available, in turns, on the paper's models; missing ones are listed.
///
/// # Errors
/// Those of reading models and of files. A program that fails gets a row that says so.
pub fn section(bench: &mut Bench, device: Option<&str>) -> Result<Section> {
    let tasks = if bench.quick { &TASKS[1..2] } else { &TASKS[..] };
    let mut models = Vec::new();
    for (name, vertices) in tasks {
        models.extend(bench.models(&[name])?.into_iter().map(|model| (model, *vertices)));
    }
    contest(
        bench,
        &Contest { name: "peers", title: "Other programs", models, ours: &OURS, features: None },
        device,
    )
}

/// The same on parts with sharp edges and thin walls, where every program keeps features if it can.
///
/// # Errors
/// As [`section`].
pub fn cad(bench: &mut Bench, device: Option<&str>) -> Result<Section> {
    let mut models = bench.models(&["fandisk"])?;
    for name in if bench.quick { &PARTS[..1] } else { &PARTS } {
        models.extend(part(name)?);
    }
    let models: Vec<(Model, usize)> = models.into_iter().map(|model| (model, PART_VERTICES)).collect();
    let (title, features) = ("Other programs on CAD parts", Some(FEATURE_ANGLE));
    let mut section =
        contest(bench, &Contest { name: "cad", title, models, ours: &OURS_ON_PARTS, features }, device)?;
    section.text.push(format!(
        "Features are edges of {FEATURE_ANGLE} degrees or more. rtfmesh, CGAL (protected edges, split to the \
         edge length first), gpytoolbox (detected edges), MMG and MeshLab (by their angle) keep them; \
         pyacvd, geogram and vorpalite have no such option. The `feature` columns are of \
         `measure --features`, the larger of both ways; a dash: the result has none."
    ));
    Ok(section)
}
