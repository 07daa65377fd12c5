//! What is measured of a result: its figures, and where it lies on the input.

use crate::measure::{Crossing, Measures, Reference, measure_some};
use crate::mesh::correspondence::{
    Correspondence, CorrespondenceRequest, SurfaceSearch, find_correspondence_by,
};
use crate::mesh::intersections::intersecting_faces;
use crate::mesh::repair::Repaired;
use crate::options::{MeasureDepth, Method, Options};
use crate::pipeline::deviation::measured::ACCURACY;
use crate::pipeline::kept::Kept;
use crate::pipeline::rounding::Rounding;
use crate::sites::restricted_voronoi::{Energy, energy};
use crate::{ProgressToken, Result, TriMesh};

/// A result to be measured.
pub(crate) struct Measuring<'a> {
    pub request: MeasureRequest,
    pub result: &'a TriMesh,
    /// The repaired input, and for each of its triangles the one that it is a part of, if it was divided.
    pub reference: (&'a TriMesh, Option<&'a Vec<u32>>),
    /// What rounding changed of the result, to be told of its intersections.
    pub rounding: Option<&'a mut Rounding>,
    /// Number of faces of the result that intersected others before rounding, if it is known.
    pub intersecting_faces: Option<usize>,
    /// Number of faces of the reference that intersect others, if it is known.
    pub input_intersections: Option<usize>,
}

/// How much is measured of a result, and how closely.
#[derive(Clone, Copy)]
pub(crate) struct MeasureRequest {
    depth: MeasureDepth,
    /// Relative width of the distances' intervals.
    accuracy: f64,
    /// Whether the energy is measured, too, if distances are.
    energy: bool,
    /// Whether faces that intersect others are found where the run does not know them.
    intersections: bool,
}

impl MeasureRequest {
    /// As the options have it, or as much as tells whether a largest deviation is reached, if they name one.
    pub fn new(options: &Options) -> Self {
        let Options { measures: depth, accuracy, .. } = *options;
        let energy = options.has_exact_faces() && options.iterations > 0;
        // The default method answers for what it makes.
        let intersections = depth >= MeasureDepth::Intersections || options.method == Method::CoarseToFine;
        let (depth, accuracy) = match options.coarse_to_fine.sizing.deviation() {
            Some(_) => (MeasureDepth::Full, accuracy.min(ACCURACY)),
            None => (depth, accuracy),
        };
        Self { depth, accuracy, energy, intersections }
    }
}

/// Figures of a result.
pub(crate) struct Measured {
    pub output: Measures,
    /// Only with exact faces and a reference.
    pub energy: Option<Energy>,
    /// Number of faces of the reference that intersect others, if it is known.
    pub input_intersections: Option<usize>,
}

impl Measuring<'_> {
    /// # Errors
    /// Those of [`measure_some`] and [`energy`].
    pub fn measure(self, progress: &ProgressToken) -> Result<Measured> {
        let Self { result, request, reference: (input, origin), .. } = self;
        let reference = (request.depth >= MeasureDepth::Full).then_some(input);
        let intersections = match (self.intersecting_faces, &self.rounding) {
            (Some(count), None) => Crossing::Known(count),
            (Some(_), Some(_)) => Crossing::Find,
            (None, _) if request.intersections => Crossing::Find,
            (None, _) => Crossing::Skip,
        };
        let energy = reference.filter(|_| request.energy).map(|input| energy(input, &result.vertices));
        let energy = energy.transpose()?;
        let of = |mesh| Reference { mesh, accuracy: request.accuracy };
        let output = measure_some(result, reference.map(of), intersections, progress)?;
        if let Some(rounding) = self.rounding {
            rounding.compare(output.self_intersecting_faces, self.intersecting_faces, progress)?;
        }
        // Those of the result are a fault if the input has none.
        let is_asked_for = reference.is_some() || output.self_intersecting_faces > Some(0);
        let input_intersections = match (self.input_intersections, origin) {
            (None, _) if !is_asked_for => None,
            (Some(count), None) => Some(count),
            (_, origin) => {
                let mut faces = intersecting_faces(input, progress)?;
                if let Some(origin) = origin {
                    faces.iter_mut().for_each(|t| *t = origin[*t as usize]);
                    faces.sort_unstable();
                    faces.dedup();
                }
                Some(faces.len())
            }
        };
        Ok(Measured { output, energy, input_intersections })
    }
}

/// Where the result lies on the input as it was given, which `repaired` was made from, if the options ask for
/// it.
///
/// # Errors
/// Those of [`find_correspondence_by`].
pub(crate) fn correspondence_of(
    result: &TriMesh,
    input: &TriMesh,
    (repaired, kept): (&Repaired, Option<&Kept>),
    options: &Options,
    search: Option<SurfaceSearch>,
    progress: &ProgressToken,
) -> Result<Option<Correspondence>> {
    let request = options.correspondence;
    let find = || find_correspondence_by(search, input, repaired, result, request, progress);
    let mut found = (request != CorrespondenceRequest::NONE).then(find).transpose()?;
    if let (Some(found), Some(kept)) = (&mut found, kept) {
        kept.set_places(found, input, result);
    }
    Ok(found)
}
