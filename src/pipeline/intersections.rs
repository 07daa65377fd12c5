//! Faces that intersect others, in the input and in a result.

use crate::gpu::Device;
use crate::gpu::Recorder;
use crate::mesh::bvh::Bvh;
use crate::mesh::chunks::{CHUNK, par_clone};
use crate::mesh::intersections::{intersecting_faces, intersecting_faces_by};
use crate::mesh::submesh::extract;
use crate::mesh::unit_frame::UnitFrame;
use crate::stages::intersect::IntersectingPairs;
use crate::{ProgressToken, Result, TriMesh};
use rayon::prelude::*;
use std::sync::OnceLock;

/// The faces of the repaired input that intersect others, found when they are first asked for.
#[derive(Default)]
pub(crate) struct InputIntersections {
    known: OnceLock<Known>,
}

struct Known {
    count: usize,
    /// Over these faces, in the unit-diagonal frame.
    bvh: Bvh,
}

/// The faces of a mesh in the unit-diagonal frame that intersect others once it is in the input's units, to
/// which rounding may fold thin parts.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn intersecting_in_units(
    mesh: &TriMesh,
    frame: &UnitFrame,
    progress: &ProgressToken,
) -> Result<Vec<u32>> {
    intersecting_faces(&in_units(mesh, frame), progress)
}

/// Like [`intersecting_in_units`], with the device to find pairs of faces if it polishes meshes of that size,
/// and if it has the memory; `tree` is a hierarchy over the same triangles, if there is one.
///
/// # Errors
/// Those of the device, and [`crate::Error::Cancelled`].
pub(crate) fn intersecting_on_device(
    device: &Device,
    (mesh, tree): (&TriMesh, Option<Bvh>),
    frame: &UnitFrame,
    progress: &ProgressToken,
) -> Result<Vec<u32>> {
    let faces = mesh.triangles.len();
    let fits = (IntersectingPairs::LARGEST_BYTES * faces) as u64 <= device.info().limits.storage_buffer_bytes
        && (IntersectingPairs::BYTES * faces) as u64 <= device.available_bytes();
    // Far from the origin, units round more than the device's search allows for.
    let rounding = f64::EPSILON * (1.0 + frame.centre.abs().max_element() / frame.scale);
    let is_searched = device.polishes(mesh.vertices.len()) && rounding <= IntersectingPairs::MOST_ROUNDING;
    if faces == 0 || !is_searched || !fits {
        return intersecting_faces_by(&in_units(mesh, frame), tree, progress);
    }
    let pairs = IntersectingPairs::new(device, mesh, rounding, None)?;
    let mut recorder = Recorder::new(device)?;
    pairs.record(&mut recorder)?;
    let mesh = in_units(mesh, frame);
    let found = pairs.triangles(device, recorder, &mesh)?;
    progress.poll()?;
    found.map_or_else(|| intersecting_faces(&mesh, progress), Ok)
}

fn in_units(mesh: &TriMesh, frame: &UnitFrame) -> TriMesh {
    let vertices = mesh.vertices.par_iter().with_min_len(CHUNK).map(|p| frame.to_input_units(*p)).collect();
    TriMesh { vertices, triangles: par_clone(&mesh.triangles) }
}

/// Faces of a result that intersect others.
pub(crate) struct Intersections {
    pub count: usize,
    /// The faces that are not where faces of the input intersect others.
    pub new: Vec<u32>,
}

impl InputIntersections {
    /// How many they are, if they have been asked for.
    pub fn count(&self) -> Option<usize> {
        self.known.get().map(|known| known.count)
    }

    /// Compares `mesh`, which is in the unit-diagonal frame and has edges of about `spacing`, and of which
    /// some faces intersect others, with the input.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn compare(
        &self,
        input: &TriMesh,
        frame: &UnitFrame,
        (mesh, spacing, intersecting): (&TriMesh, f64, Vec<u32>),
        progress: &ProgressToken,
    ) -> Result<Intersections> {
        let (count, mut new) = (intersecting.len(), intersecting);
        if count > 0 {
            let known = self.known(input, frame, progress)?;
            // The more faces a result has, the more of them run through others at the same place.
            new.retain(|t| {
                let [a, b, c] = mesh.corners(*t as usize);
                let nearest = known.bvh.closest((a + b + c) / 3.0);
                nearest.is_none_or(|nearest| nearest.distance_sq > spacing * spacing)
            });
        }
        Ok(Intersections { count, new })
    }

    fn known(&self, input: &TriMesh, frame: &UnitFrame, progress: &ProgressToken) -> Result<&Known> {
        if let Some(known) = self.known.get() {
            return Ok(known);
        }
        let faces = intersecting_faces(input, progress)?;
        let mut crossing = extract(input, &faces);
        crossing.vertices.iter_mut().for_each(|p| *p = frame.to_unit(*p));
        // Not inside, since a thread that waits for others may take up work that waits for this.
        let found = Known { count: faces.len(), bvh: Bvh::new(&crossing) };
        Ok(self.known.get_or_init(|| found))
    }
}
