//! What the fit knows of the mesh: its edges, and areas and normals in a round.

use crate::Result;
use crate::gpu::kernels::fit::{faces, vertices};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::mesh::chunks::{begins, par_concat, par_map_chunks_of};
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::half_edges::next;
use crate::stages::polish::mesh::{DeviceMesh, FIXED};
use crate::stages::records::TriangleRecords;
use bytemuck::allocation::zeroed_vec;
use glam::{UVec2, UVec4, Vec4};
use rayon::prelude::*;

/// A mesh for the fit.
pub struct FitMesh<'a> {
    vertices: Pipeline<vertices::Shader>,
    faces: Pipeline<faces::Shader>,
    /// Its vertices move in [`FitMesh::record`]'s next rounds.
    pub mesh: &'a DeviceMesh,
    /// A half-edge of each edge.
    pub edges: Buffer<u32>,
    /// Where the links of each vertex begin, and the end of the last.
    pub starts: Buffer<u32>,
    /// The other vertex and the edge, for each edge at each vertex that moves.
    pub links: Buffer<UVec2>,
    /// Unit normals of the vertices, 0 if they do not move; w = a third of the area around.
    pub frames: Buffer<Vec4>,
    /// The same normals, for searches to change; w = 0.
    pub sides: Buffer<Vec4>,
    /// Areas of the triangles.
    pub areas: Buffer<f32>,
    /// The mesh as a surface, to walk on.
    pub ground: TriangleRecords,
}

/// Half-edges or vertices that one thread looks at at a time.
const CHUNK: usize = 1 << 14;

/// The edges of a mesh, and the links of its vertices.
struct Links {
    edges: Vec<u32>,
    starts: Vec<u32>,
    links: Vec<UVec2>,
}

impl Links {
    fn new(half_edges: &HalfEdgeMesh, moves: &[bool]) -> Self {
        // The first half-edge of each edge stands for it.
        let first = |h: u32| h.min(half_edges.twins()[h as usize]);
        let count = half_edges.twins().len();
        let edges = par_map_chunks_of(CHUNK, count, |range| {
            (range.start as u32..range.end as u32).filter(|h| first(*h) == *h).collect::<Vec<u32>>()
        });
        let mut numbers: Vec<u32> = zeroed_vec(count);
        let parts = numbers.par_chunks_mut(CHUNK).zip(&edges).zip(begins(&edges));
        parts.for_each(|((numbers, edges), begin)| {
            (begin..).zip(edges).for_each(|(number, h)| numbers[*h as usize % CHUNK] = number);
        });
        let mut starts = vec![0; moves.len() + 1];
        for (v, moves) in moves.iter().enumerate() {
            starts[v + 1] = starts[v] + if *moves { half_edges.valence(v as u32) } else { 0 };
        }
        // All half-edges that leave a vertex inside the mesh: one for each of its edges.
        let link = |h: u32| UVec2::new(half_edges.origin(next(h)), numbers[first(h) as usize]);
        let links = par_map_chunks_of(CHUNK, moves.len(), |range| {
            let mut links: Vec<UVec2> = Vec::with_capacity(6 * range.len());
            range.filter(|v| moves[*v]).for_each(|v| links.extend(half_edges.ring(v as u32).map(link)));
            links
        });
        Self { edges: par_concat(&edges), starts, links: par_concat(&links) }
    }
}

impl<'a> FitMesh<'a> {
    /// Of a mesh on the device, whose half-edges are found again.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, mesh: &'a DeviceMesh, workgroup: Option<u32>) -> Result<Self> {
        let corners = mesh.corners.to_vec(device)?;
        let half_edges = HalfEdgeMesh::new(corners.as_chunks().0.to_vec(), mesh.vertices(), &[]);
        let moves = mesh.states.to_vec(device)?.iter().map(|state| state & FIXED == 0).collect();
        Self::of(device, mesh, &half_edges, moves, workgroup)
    }

    /// Like [`FitMesh::new`], for half-edges that are known, and whether each vertex moves.
    pub(crate) fn of(
        device: &Device,
        mesh: &'a DeviceMesh,
        half_edges: &HalfEdgeMesh,
        moves: Vec<bool>,
        workgroup: Option<u32>,
    ) -> Result<Self> {
        let Links { edges, starts, links } = Links::new(half_edges, &moves);
        let workgroup = workgroup.unwrap_or(vertices::Constants::default().workgroup);
        let (vertices, triangles) = (mesh.vertices(), mesh.triangles());
        Ok(Self {
            vertices: Pipeline::new(device, vertices::Constants { workgroup })?,
            faces: Pipeline::new(device, faces::Constants { workgroup })?,
            mesh,
            edges: Buffer::from_slice(device, "fit.mesh.edges", &edges)?,
            starts: Buffer::from_slice(device, "fit.mesh.starts", &starts)?,
            links: Buffer::from_slice(device, "fit.mesh.links", &links)?,
            frames: Buffer::new(device, "fit.mesh.frames", vertices)?,
            sides: Buffer::new(device, "fit.mesh.sides", vertices)?,
            areas: Buffer::new(device, "fit.mesh.areas", triangles)?,
            ground: TriangleRecords {
                corners: mesh.corners.window(0, mesh.corners.len())?,
                twins: mesh.twins.window(0, mesh.twins.len())?,
                wedges: Buffer::<UVec4>::new(device, "fit.mesh.wedges", vertices)?,
                normals: Buffer::new(device, "fit.mesh.triangle_normals", triangles)?,
            },
        })
    }

    /// Records what follows from where the vertices are now.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(&self, recorder: &mut Recorder) -> Result<()> {
        let DeviceMesh { positions, corners, twins, firsts, states } = self.mesh;
        let (frames, sides, wedges) = (&self.frames, &self.sides, &self.ground.wedges);
        let push = vertices::Push { vertex_count: self.mesh.vertices() as u32 };
        let bindings =
            vertices::Bindings { positions, corners, twins, firsts, states, frames, wedges, sides };
        recorder.dispatch(&self.vertices, Threads(self.mesh.vertices()), &push, &bindings)?;
        let push = faces::Push { triangle_count: self.mesh.triangles() as u32 };
        let (areas, triangle_normals) = (&self.areas, &self.ground.normals);
        let bindings = faces::Bindings { positions, corners, areas, triangle_normals };
        recorder.dispatch(&self.faces, Threads(self.mesh.triangles()), &push, &bindings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::half_edge_mesh::VertexKind;
    use crate::mesh::half_edges::edge_key;
    use std::collections::HashMap;

    #[test]
    fn links_of_many_triangles_are_those_of_a_plain_loop() {
        // A square of 129 by 129 cells, with more vertices and far more half-edges than one thread's.
        let side = 130;
        let corners = (0..side - 1).flat_map(|y| (0..side - 1).map(move |x| side * y + x));
        let cell = |v: u32| [[v, v + 1, v + side], [v + side, v + 1, v + side + 1]];
        let triangles: Vec<[u32; 3]> = corners.flat_map(cell).collect();
        let vertices = (side * side) as usize;
        let half_edges = HalfEdgeMesh::new(triangles, vertices, &[]);
        assert!(vertices > CHUNK && half_edges.twins().len() > 5 * CHUNK);
        let ends = |h: u32| edge_key(half_edges.origin(h), half_edges.origin(next(h)));
        let mut numbers = HashMap::new();
        let mut edges = Vec::new();
        for h in 0..half_edges.half_edge_count() {
            numbers.entry(ends(h)).or_insert_with(|| {
                edges.push(h);
                edges.len() as u32 - 1
            });
        }
        let moves = |v: &u32| half_edges.kind(*v) == VertexKind::Inner && !v.is_multiple_of(7);
        let (mut starts, mut links) = (vec![0], Vec::new());
        for v in 0..vertices as u32 {
            let ring = half_edges.ring(v).filter(|_| moves(&v));
            links.extend(ring.map(|h| UVec2::new(half_edges.origin(next(h)), numbers[&ends(h)])));
            starts.push(links.len() as u32);
        }
        let moves: Vec<bool> = (0..vertices as u32).map(|v| moves(&v)).collect();
        let found = Links::new(&half_edges, &moves);
        assert!(found.edges == edges, "edges");
        assert!(found.starts == starts, "starts");
        assert!(found.links == links, "links");
    }
}
