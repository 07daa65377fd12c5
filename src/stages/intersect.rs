//! Triangles of a mesh that may intersect others, by a walk over boxes for each.

use crate::gpu::kernels::intersect::pairs;
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::mesh::intersections::intersecting_among;
use crate::stages::project::bvh::Bvh;
use crate::{Result, TriMesh};
use glam::{UVec2, UVec4};
use rayon::prelude::*;

/// Minimum capacity of the list of pairs. In meshes from the pipeline, next to none are found.
const LEAST_PAIRS: usize = 4096;
/// The list has room for a pair for every this many triangles.
const TRIANGLES_PER_PAIR: usize = 8;

/// The pairs of a mesh's triangles that may intersect: all that do, and few others.
pub struct IntersectingPairs {
    pipeline: Pipeline<pairs::Shader>,
    tree: Bvh,
    corners: Buffer<u32>,
    wedges: Buffer<UVec4>,
    pairs: Buffer<UVec2>,
    counters: Buffer<u32>,
    rounding: f32,
}

impl IntersectingPairs {
    /// Bytes on the device for each triangle of a closed mesh: corners, positions, tree and pairs.
    pub const BYTES: usize = 12 + 8 + 11 + 1;
    /// Bytes of the largest buffer for each triangle.
    pub const LARGEST_BYTES: usize = 12;
    /// Coordinates may be off by this at most: the boxes of the tree have a margin of three times as much,
    /// which f32 needs a part of.
    pub const MOST_ROUNDING: f64 = 2e-7;

    /// Uploads a mesh in the unit-diagonal frame with at least one triangle, of which no coordinate is off by
    /// more than `rounding`, at most [`IntersectingPairs::MOST_ROUNDING`]. It is fastest if triangles with
    /// near numbers are near each other. `workgroup` overrides the kernels' own.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, mesh: &TriMesh, rounding: f64, workgroup: Option<u32>) -> Result<Self> {
        let mut constants = pairs::Constants::default();
        constants.workgroup = workgroup.unwrap_or(constants.workgroup);
        let wedges: Vec<UVec4> = (mesh.vertices.par_iter())
            .map(|p| UVec4::from_array(p.as_vec3().extend(0.0).to_array().map(f32::to_bits)))
            .collect();
        let largest = mesh.vertices.par_iter().map(|p| p.abs().max_element()).reduce(|| 0.0, f64::max);
        let triangles = mesh.triangles.len();
        Ok(Self {
            pipeline: Pipeline::new(device, constants)?,
            tree: Bvh::new(device, triangles, workgroup)?,
            corners: Buffer::from_slice(device, "intersect.corners", mesh.triangles.as_flattened())?,
            wedges: Buffer::from_slice(device, "intersect.wedges", &wedges)?,
            pairs: Buffer::new(device, "intersect.pairs", LEAST_PAIRS.max(triangles / TRIANGLES_PER_PAIR))?,
            counters: Buffer::zeros(device, "intersect.counters", 1)?,
            rounding: (largest * f64::from(f32::EPSILON) + 2.0 * rounding) as f32,
        })
    }

    /// Records the search.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(&self, recorder: &mut Recorder) -> Result<()> {
        let Self { tree, corners, wedges, pairs, counters, rounding, .. } = self;
        tree.record_over(recorder, corners, wedges)?;
        recorder.fill(counters, 0)?;
        let triangle_count = corners.len() as u32 / 3;
        let push = pairs::Push {
            triangle_count,
            levels: tree.level_count(),
            most: pairs.len() as u32,
            rounding: *rounding,
        };
        let bindings = pairs::Bindings { corners, wedges, nodes: &tree.nodes, pairs, counters };
        recorder.dispatch(&self.pipeline, Threads(triangle_count as usize), &push, &bindings)
    }

    /// The pairs that are found by what was recorded, which this submits: the smaller number first, in any
    /// order; none if they are too many for the list.
    ///
    /// # Errors
    /// As [`Recorder::submit`].
    pub fn found(&self, device: &Device, mut recorder: Recorder) -> Result<Option<Vec<[u32; 2]>>> {
        let count = recorder.download(&self.counters)?;
        // Next to always, these are all.
        let first = recorder.download_first(&self.pairs, LEAST_PAIRS)?;
        let done = recorder.submit()?;
        let count = done.first(&count)? as usize;
        if count > self.pairs.len() {
            return Ok(None);
        }
        let mut pairs = done.read(&first)?;
        if count > pairs.len() {
            pairs = self.pairs.window(0, count)?.to_vec(device)?;
        }
        pairs.truncate(count);
        Ok(Some(pairs.into_iter().map(|pair| pair.to_array()).collect()))
    }

    /// The triangles that intersect others, in ascending order, as
    /// [`crate::mesh::intersections::intersecting_faces`] has it; none as in [`IntersectingPairs::found`].
    /// `mesh` is the mesh as it is to be checked, in any units.
    ///
    /// # Errors
    /// As [`Recorder::submit`].
    pub fn triangles(&self, device: &Device, recorder: Recorder, mesh: &TriMesh) -> Result<Option<Vec<u32>>> {
        Ok(self.found(device, recorder)?.map(|pairs| intersecting_among(mesh, &pairs)))
    }
}
