//! Remeshing.

use crate::attributes::{self, Given, New, new};
use crate::device::Device;
use crate::errors::exception;
use crate::mesh::{Arrays, NewArrays, Places, arrays, mesh, places, positions};
use crate::work::{INTERVAL, own_work};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use rtfmesh::cli::call::{Call, Input, Points, Source, Values};
use rtfmesh::glam::{DAffine3, DMat4, DVec3};
use rtfmesh::io::{Loaded, Volume};
use rtfmesh::mesh::features::FeatureLine;
use rtfmesh::{CellKind, CellMesh, CorrespondenceRequest, Error, FeatureLines, Flow, Progress, TriMesh};
use std::time::Instant;

/// Normals (P x 3), whether to close all holes, what the points show.
type GivenPoints<'py> = (Option<PyReadonlyArray2<'py, f64>>, bool, String);

/// Values, those along the first axis side by side; nodes along the axes; from their indices to places,
/// 4 x 4; the values on the surfaces, or none for labels; the side of the object; whether to close it at the
/// border.
type GivenValues<'py> =
    (PyReadonlyArray1<'py, f32>, [usize; 3], [[f64; 4]; 4], Vec<f64>, Option<String>, bool, bool);

/// All that is asked for but for the mesh itself.
#[derive(FromPyObject)]
pub struct Request<'py> {
    attributes: Given<'py>,
    /// Where there are no faces.
    points: Option<GivenPoints<'py>>,
    /// Where there is no mesh at all.
    values: Option<GivenValues<'py>>,
    sizing: Option<PyReadonlyArray1<'py, f64>>,
    /// Lines of two points each (L x 2 x 3).
    features: Option<PyReadonlyArray3<'py, f64>>,
    /// Points that become vertices (K x 3).
    fixed_points: Option<PyReadonlyArray2<'py, f64>>,
    /// Faces that stay as they are.
    keep: Option<PyReadonlyArray1<'py, u32>>,
    /// Of vertices, and of faces.
    correspondence: (bool, bool),
    /// Whether the report has distances.
    distances: bool,
    /// Whether there are cells.
    cells: bool,
    /// Called with phase, attempt, fraction, iteration, iterations and step; returns whether to finish early
    /// or to stop.
    progress: Option<Py<PyAny>>,
}

/// The kind of cells, all corners, and for each polygon its corners, their beginning, and its vertex.
type Cells<'py> = (
    &'static str,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u32>>,
);

/// Mesh, attributes, places of the vertices and of the faces, report as JSON, cells.
type Outcome<'py> = (NewArrays<'py>, New<'py>, Places<'py>, Places<'py>, String, Option<Cells<'py>>);

/// Remeshes with the command line's options.
#[pyfunction]
pub fn remesh<'py>(
    py: Python<'py>,
    device: &Device,
    given: Arrays<'py>,
    options: Vec<String>,
    request: Request<'py>,
) -> PyResult<Outcome<'py>> {
    let call = Call::parse_words(&options).map_err(|error| exception(py, &error))?;
    let (vertices, faces) = request.correspondence;
    let loaded = Loaded {
        mesh: mesh(&given)?,
        attributes: attributes::given(&request.attributes)?,
        ..Loaded::default()
    };
    let input = Input {
        loaded,
        source: match (&request.points, &request.values) {
            (Some(points), _) => Source::Points(given_points(py, points)?),
            (None, Some(values)) => Source::Values(Box::new(given_values(py, values)?)),
            (None, None) => Source::Mesh,
        },
        sizing: request.sizing.as_ref().map(|sizing| sizing.as_slice().map(<[f64]>::to_vec)).transpose()?,
        features: request.features.as_ref().map(feature_lines).transpose()?,
        fixed_points: request.fixed_points.as_ref().map(positions).transpose()?.unwrap_or_default(),
        keep: request
            .keep
            .as_ref()
            .map(|keep| keep.as_slice().map(<[u32]>::to_vec))
            .transpose()?
            .unwrap_or_default(),
        correspondence: CorrespondenceRequest { vertices, faces },
        distances: request.distances,
        cells: request.cells,
    };
    let mut watch = Watch::new(request.progress);
    let (done, watch) = own_work(py, move |token| {
        let flow = |now| if token.is_cancelled() { Flow::Cancel } else { watch.flow(now) };
        let done = call.remesh(&device.0, &input, flow);
        // Freed here, since large meshes take a while.
        drop(input);
        Ok((done, watch))
    })?;
    let output = match (done, watch.raised) {
        (Ok(_) | Err(Error::Cancelled), Some(raised)) => return Err(raised),
        (done, _) => done.map_err(|error| exception(py, &error))?,
    };
    let found = output.correspondence.unwrap_or_default();
    Ok((
        arrays(py, output.mesh)?,
        new(py, output.attributes),
        places(py, &found.vertices)?,
        places(py, &found.faces)?,
        output.report,
        output.cells.map(|found| cells(py, found)).transpose()?,
    ))
}

/// # Errors
/// Those of numpy.
fn cells(py: Python<'_>, found: CellMesh) -> PyResult<Cells<'_>> {
    let CellMesh { kind, vertices, corners, starts, cells } = found;
    let kind = match kind {
        CellKind::Tangent => "tangent",
        CellKind::Exact => "exact",
    };
    let (positions, _) = arrays(py, TriMesh { vertices, triangles: Vec::new() })?;
    let [corners, starts, cells] = [corners, starts, cells].map(|list| PyArray1::from_vec(py, list));
    Ok((kind, positions, corners, starts, cells))
}

/// What is known of points.
///
/// # Errors
/// `InputError` for a kind that is none.
fn given_points(py: Python<'_>, given: &GivenPoints<'_>) -> PyResult<Points> {
    let (normals, closed, kind) = given;
    let normals = normals.as_ref().map(positions).transpose()?.unwrap_or_default();
    Points::new(normals, *closed, kind).map_err(|error| exception(py, &error))
}

/// A volume, and which surface in it is wanted.
///
/// # Errors
/// `InputError` for a side that there is not.
fn given_values(py: Python<'_>, given: &GivenValues<'_>) -> PyResult<Values> {
    let (values, size, rows, iso, inside, closed, keep_specks) = given;
    let frame = DMat4::from_cols_array_2d(rows).transpose();
    let volume = Volume {
        size: *size,
        values: values.as_slice()?.to_vec(),
        frame: DAffine3::from_mat4(frame),
        notes: Vec::new(),
    };
    Values::new(volume, iso.clone(), inside.as_deref(), *closed, *keep_specks)
        .map_err(|error| exception(py, &error))
}

/// Tells Python of a run, and the run of signals such as Ctrl-C.
struct Watch {
    callback: Option<Py<PyAny>>,
    last: Instant,
    /// What a signal's handler or the callback raised.
    raised: Option<PyErr>,
}

impl Watch {
    fn new(callback: Option<Py<PyAny>>) -> Self {
        Self { callback, last: Instant::now(), raised: None }
    }

    fn flow(&mut self, now: Progress) -> Flow {
        if self.last.elapsed() < INTERVAL {
            return Flow::Continue;
        }
        let flow = Python::attach(|py| self.ask(py, now));
        self.last = Instant::now();
        flow.unwrap_or_else(|raised| {
            self.raised = Some(raised);
            Flow::Cancel
        })
    }

    fn ask(&self, py: Python<'_>, now: Progress) -> PyResult<Flow> {
        py.check_signals()?;
        let Some(callback) = &self.callback else { return Ok(Flow::Continue) };
        let Progress { phase, attempt, fraction, iteration, iterations, step, .. } = now;
        let told = (phase.name(), attempt, fraction, iteration, iterations, step);
        let answer: Option<bool> = callback.call1(py, told)?.extract(py)?;
        Ok(match answer {
            None => Flow::Continue,
            Some(true) => Flow::Finish,
            Some(false) => Flow::Cancel,
        })
    }
}

/// Lines of two points each.
///
/// # Errors
/// `ValueError` for arrays that are not contiguous.
pub fn feature_lines(points: &PyReadonlyArray3<'_, f64>) -> PyResult<FeatureLines> {
    let (coordinates, _) = points.as_slice()?.as_chunks::<3>();
    let positions: Vec<DVec3> = coordinates.iter().map(|point| DVec3::from_array(*point)).collect();
    let lines = (1..).zip(positions.chunks(2));
    Ok(FeatureLines::new(lines.map(|(line, points)| FeatureLine { line, points: points.to_vec() }).collect()))
}

/// Checks options as far as that is possible without a mesh and without files.
#[pyfunction]
pub fn check(py: Python<'_>, options: Vec<String>) -> PyResult<()> {
    Call::parse_words(&options).and_then(|call| call.check()).map_err(|error| exception(py, &error))
}

/// Name, what its value is, all values it may have, and what it does, of each option that `remesh` takes.
#[pyfunction]
pub fn options() -> Vec<(String, Option<String>, Vec<String>, String)> {
    let all = Call::options().into_iter();
    all.map(|option| (option.name, option.value, option.choices, option.help)).collect()
}
