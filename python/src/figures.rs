//! Measures, features and pictures of meshes.

use crate::errors::one_of;
use crate::mesh::{Arrays, mesh};
use crate::run::feature_lines;
use crate::work::{watched_work, work};
use numpy::{PyArray1, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyString;
use rtfmesh::TriMesh;
use rtfmesh::cli::call::{Wanted, curve_lines, inspect_json, measure_json};
use rtfmesh::io::Loaded;
use rtfmesh::picture::{Panel, PictureOptions, View, distance_colours, png, quality_colours, rgba};
use std::path::PathBuf;

/// The measures as JSON.
#[pyfunction]
pub fn measure(
    py: Python<'_>,
    given: Arrays<'_>,
    against: Option<Arrays<'_>>,
    accuracy: Option<f64>,
    energy: bool,
    feature_angle: Option<f64>,
) -> PyResult<String> {
    let (own, reference) = (mesh(&given)?, against.as_ref().map(mesh).transpose()?);
    let wanted = Wanted { accuracy, energy, feature_angle };
    watched_work(py, |progress| measure_json(&own, reference.as_ref(), &wanted, progress))
}

/// The topology, repairs and features as JSON.
#[pyfunction]
pub fn inspect(
    py: Python<'_>,
    given: Arrays<'_>,
    vertices: Option<usize>,
    feature_angle: f64,
    features: Option<PyReadonlyArray3<'_, f64>>,
    features_file: Option<PathBuf>,
) -> PyResult<String> {
    let loaded = Loaded { mesh: mesh(&given)?, ..Loaded::default() };
    let lines = features.as_ref().map(feature_lines).transpose()?;
    work(py, || {
        let lines = match &features_file {
            Some(path) => Some(rtfmesh::FeatureLines::read(path)?),
            None => lines,
        };
        inspect_json(&loaded, vertices, feature_angle, lines.as_ref())
    })
}

#[derive(Clone, Copy, PartialEq)]
enum Colouring {
    Plain,
    Quality,
    Distance,
}

/// What is drawn, and how.
#[derive(FromPyObject)]
pub struct Drawing<'py> {
    color: Bound<'py, PyString>,
    against: Option<Arrays<'py>>,
    curves: bool,
    edges: bool,
    size: [u32; 2],
    azimuth: f64,
    elevation: f64,
    zoom: f64,
    z_up: bool,
    /// Whether the bytes are to be a PNG's.
    png: bool,
}

/// The bytes of a PNG, or those of the pixels (height x width x 4).
#[pyfunction]
pub fn render<'py>(
    py: Python<'py>,
    meshes: Vec<Arrays<'py>>,
    drawing: Drawing<'py>,
) -> PyResult<Bound<'py, PyArray1<u8>>> {
    const COLOURINGS: [(&str, Colouring); 3] =
        [("plain", Colouring::Plain), ("quality", Colouring::Quality), ("distance", Colouring::Distance)];
    let colouring = one_of(&drawing.color, "color", &COLOURINGS)?;
    let meshes = meshes.iter().map(mesh).collect::<PyResult<Vec<TriMesh>>>()?;
    let reference = drawing.against.as_ref().map(mesh).transpose()?;
    let Drawing { curves, edges, size, azimuth, elevation, zoom, z_up, png: as_png, .. } = drawing;
    let options = PictureOptions { size, view: View { azimuth, elevation, zoom, z_up }, edges };
    let bytes = work(py, move || {
        let colours = match (colouring, &reference) {
            (Colouring::Quality, _) => meshes.iter().map(quality_colours).collect(),
            (Colouring::Distance, Some(reference)) => {
                distance_colours(&meshes, reference)?.into_iter().map(|found| found.colours).collect()
            }
            _ => vec![Vec::new(); meshes.len()],
        };
        let lines = |mesh| if curves { curve_lines(mesh) } else { Ok(Vec::new()) };
        let lines = meshes.iter().map(lines).collect::<rtfmesh::Result<Vec<_>>>()?;
        let panels = meshes.iter().zip(&colours).zip(&lines);
        let panels: Vec<Panel> = panels
            .map(|((mesh, colours), lines)| Panel { mesh, colours, lines, discs: None, outlines: false })
            .collect();
        if as_png { png(&panels, &options) } else { rgba(&panels, &options) }
    })?;
    Ok(PyArray1::from_vec(py, bytes))
}
