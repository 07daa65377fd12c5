//! Closed meshes with uneven triangles, and what the device makes of them.

use crate::reference::closest::onto_triangle;
use crate::support::shapes::{moved, torus};
use crate::support::{device, rng, rounded};
use glam::DVec3;
use rand::RngExt;
use rtfmesh::TriMesh;
use rtfmesh::mesh::NONE;
use rtfmesh::mesh::unit_frame::UnitFrame;
use rtfmesh::sites::surface::Surface;
use rtfmesh::stages::polish::mesh::{DeviceMesh, FIXED};
use rtfmesh::stages::records::TriangleRecords;

/// A torus in the unit-diagonal frame whose vertices are off by up to `jitter` edges, rounded to f32. Where
/// there is jitter, some diagonals of its grid run the other way, so that vertices have 4 to 8 edges.
pub fn uneven(n: u32, m: u32, jitter: f64, seed: u64) -> TriMesh {
    let even = torus(n, m);
    let mesh = moved(&even, |p| 0.125 * p);
    let edge =
        mesh.vertices[mesh.triangles[0][0] as usize].distance(mesh.vertices[mesh.triangles[0][1] as usize]);
    let mut rng = rng(seed);
    let mut off = || jitter * edge * (2.0 * rng.random::<f64>() - 1.0);
    let vertices: Vec<DVec3> = mesh.vertices.iter().map(|p| *p + DVec3::new(off(), off(), off())).collect();
    let mut triangles = mesh.triangles;
    for pair in triangles.as_chunks_mut::<2>().0 {
        let [[p, q, r], [_, _, s]] = *pair;
        if jitter > 0.0 && rng.random_bool(0.2) {
            *pair = [[q, r, s], [q, s, p]];
        }
    }
    TriMesh { vertices: rounded(&vertices), triangles }
}

/// The mesh as it is on the device, after checking that its half-edges are right.
pub fn read(mesh: &DeviceMesh) -> TriMesh {
    let device = device();
    let positions = mesh.positions.to_vec(device).unwrap();
    let corners = mesh.corners.to_vec(device).unwrap();
    let (twins, firsts) = (mesh.twins.to_vec(device).unwrap(), mesh.firsts.to_vec(device).unwrap());
    let states = mesh.states.to_vec(device).unwrap();
    let next = |h: u32| if h % 3 == 2 { h - 2 } else { h + 1 };
    let at = |list: &[u32], i: u32| list[i as usize];
    for (h, twin) in (0u32..).zip(&twins).filter(|(_, twin)| **twin != NONE) {
        assert_eq!(at(&twins, *twin), h, "half-edge {h}");
        assert_eq!(at(&corners, h), at(&corners, next(*twin)), "half-edge {h}");
        assert_ne!(at(&corners, h), at(&corners, next(h)), "half-edge {h}");
    }
    for (v, first) in (0u32..).zip(&firsts).filter(|(_, first)| **first != NONE) {
        assert_eq!(at(&corners, *first), v, "the first half-edge of vertex {v}");
        let (mut h, mut triangles) = (*first, 0);
        while h != NONE && (triangles == 0 || h != *first) {
            triangles += 1;
            h = at(&twins, next(next(h)));
        }
        let edges = triangles + u32::from(h == NONE);
        assert_eq!(at(&states, v) & !FIXED, edges, "the edges of vertex {v}");
    }
    TriMesh {
        vertices: positions.iter().map(|p| p.truncate().as_dvec3()).collect(),
        triangles: corners.as_chunks().0.to_vec(),
    }
}

/// A surface, and for a point of it the triangle there.
pub struct Ground {
    pub surface: Surface,
    pub records: TriangleRecords,
}

impl Ground {
    /// Of a mesh that is in the unit-diagonal frame nearly already.
    pub fn new(mesh: &TriMesh) -> Self {
        let frame = UnitFrame { centre: DVec3::ZERO, scale: 1.0 };
        let surface = Surface::new(mesh, &frame);
        let records = TriangleRecords::new(device(), &surface, None).unwrap();
        Self { surface, records }
    }

    /// The triangle of the surface that is closest to a point.
    pub fn under(&self, p: DVec3) -> u32 {
        let corners = |t: &[u32; 3]| t.map(|v| self.surface.vertices[v as usize]);
        let distance = |t: &[u32; 3]| onto_triangle(p, corners(t)).distance_squared(p);
        let triangles = self.surface.triangles.iter().map(distance).enumerate();
        triangles.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(t, _)| t as u32)
    }
}
