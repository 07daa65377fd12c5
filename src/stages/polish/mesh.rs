//! A mesh with its half-edges on the device.

use crate::gpu::{Buffer, Device, Download, Recorder, Submitted};
use crate::mesh::chunks::{CHUNK, par_clone};
use crate::mesh::half_edge_mesh::{HalfEdgeMesh, VertexKind};
use crate::{Result, TriMesh};
use glam::{DVec3, Vec4};
use rayon::prelude::*;

/// In [`DeviceMesh::states`]: the vertex does not move, and no edge at it is flipped.
pub const FIXED: u32 = 0x8000_0000;

/// A mesh on the device; half-edge `3 * t + k` runs from corner `k` of triangle `t` to the next.
pub struct DeviceMesh {
    /// In the unit-diagonal frame; w = the relative target edge length there, 1 if all are equal.
    pub positions: Buffer<Vec4>,
    /// The vertex that each half-edge leaves.
    pub corners: Buffer<u32>,
    /// The half-edge against each, [`crate::mesh::NONE`] where there is not exactly one.
    pub twins: Buffer<u32>,
    /// A half-edge that leaves each vertex: at a boundary the one from which all others are reached,
    /// [`crate::mesh::NONE`] where triangles are not one fan.
    pub firsts: Buffer<u32>,
    /// Number of edges at each vertex, and [`FIXED`].
    pub states: Buffer<u32>,
}

impl DeviceMesh {
    /// Uploads a mesh whose vertices all may move but those on boundaries and where triangles are not one
    /// fan. Panics if an index is out of range.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] if it does not fit.
    pub fn new(device: &Device, mesh: &TriMesh) -> Result<Self> {
        let half_edges = HalfEdgeMesh::new(mesh.triangles.clone(), mesh.vertices.len(), &[]);
        Self::of(device, &half_edges, &mesh.vertices, (&[], &[]))
    }

    /// Like [`DeviceMesh::new`], for half-edges that are known; `fixed` and `lengths` as in
    /// [`crate::polish::ConstrainedMesh`].
    pub(crate) fn of(
        device: &Device,
        half_edges: &HalfEdgeMesh,
        points: &[DVec3],
        (fixed, lengths): (&[bool], &[f64]),
    ) -> Result<Self> {
        let state = |v: u32| {
            let moves =
                half_edges.kind(v) == VertexKind::Inner && !fixed.get(v as usize).copied().unwrap_or(false);
            half_edges.valence(v) | if moves { 0 } else { FIXED }
        };
        let positions = packed(points, lengths);
        let vertices = (0..points.len() as u32).into_par_iter().with_min_len(CHUNK);
        let states: Vec<u32> = vertices.map(state).collect();
        let corners = half_edges.triangles.as_flattened();
        Ok(Self {
            positions: Buffer::from_slice(device, "polish.mesh.positions", &positions)?,
            corners: Buffer::from_slice(device, "polish.mesh.corners", corners)?,
            twins: Buffer::from_slice(device, "polish.mesh.twins", half_edges.twins())?,
            firsts: Buffer::from_slice(device, "polish.mesh.firsts", &half_edges.firsts())?,
            states: Buffer::from_slice(device, "polish.mesh.states", &states)?,
        })
    }

    /// Uploads where the vertices are now; `lengths` as in [`crate::polish::ConstrainedMesh`].
    pub(crate) fn write(&self, device: &Device, points: &[DVec3], lengths: &[f64]) -> Result<()> {
        self.positions.write(device, &packed(points, lengths))
    }

    /// Number of vertices.
    pub fn vertices(&self) -> usize {
        self.positions.len()
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.corners.len() / 3
    }

    /// Records a copy of the half-edges, for [`HalfEdgeCopy::read`].
    ///
    /// # Errors
    /// As [`Recorder::download`].
    pub(crate) fn download_half_edges(&self, recorder: &mut Recorder) -> Result<HalfEdgeCopy> {
        let [states, corners, twins, firsts] =
            [&self.states, &self.corners, &self.twins, &self.firsts].map(|list| recorder.download(list));
        Ok(HalfEdgeCopy { states: states?, corners: corners?, twins: twins?, firsts: firsts? })
    }

    /// Records a copy of the positions, for [`read_positions`].
    ///
    /// # Errors
    /// As [`Recorder::download`].
    pub(crate) fn download_positions(&self, recorder: &mut Recorder) -> Result<Download<Vec4>> {
        recorder.download(&self.positions)
    }
}

/// The half-edges of a mesh on their way to the host.
pub(crate) struct HalfEdgeCopy {
    states: Download<u32>,
    corners: Download<u32>,
    twins: Download<u32>,
    firsts: Download<u32>,
}

impl HalfEdgeCopy {
    /// Reads what flips have made of the mesh into `half_edges`.
    ///
    /// # Errors
    /// As [`Submitted::read`].
    pub fn read(&self, done: &Submitted, half_edges: &mut HalfEdgeMesh) -> Result<()> {
        let (states, corners) = (done.view(&self.states)?, done.view(&self.corners)?);
        let (twins, firsts) = (done.view(&self.twins)?, done.view(&self.firsts)?);
        let valences = states.par_iter().with_min_len(CHUNK).map(|state| state & !FIXED).collect();
        half_edges.replace(par_clone(corners.as_chunks().0), par_clone(twins), firsts, valences);
        Ok(())
    }
}

/// Reads the positions of the vertices that are not `fixed` into `points`.
///
/// # Errors
/// As [`Submitted::read`].
pub(crate) fn read_positions(
    done: &Submitted,
    positions: &Download<Vec4>,
    fixed: &[bool],
    points: &mut [DVec3],
) -> Result<()> {
    let positions = done.view(positions)?;
    points.par_iter_mut().zip(positions).enumerate().for_each(|(v, (point, position))| {
        if !fixed.get(v).copied().unwrap_or(false) {
            *point = position.truncate().as_dvec3();
        }
    });
    Ok(())
}

/// Positions in the device's form, with the target edge lengths.
fn packed(points: &[DVec3], lengths: &[f64]) -> Vec<Vec4> {
    let position = |(v, p): (usize, &DVec3)| {
        let length = lengths.get(v).copied().unwrap_or(1.0);
        p.as_vec3().extend(length as f32)
    };
    points.par_iter().enumerate().map(position).collect()
}
