//! Surfaces, and what `project/walk` and `project/closest` must make of them, by a look at every triangle.

use crate::reference::closest::{distance_facing, normal_at, onto_triangle};
use crate::support::{assert_valid, cloud, device, rng, rounded, upload};
use glam::{DVec3, Vec4};
use rand::RngExt;
use rtfmesh::TriMesh;
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::unit_frame::UnitFrame;
use rtfmesh::sites::surface::Surface;
use rtfmesh::stages::project::bvh::Bvh;
use rtfmesh::stages::project::closest::ClosestPoints;
use rtfmesh::stages::project::walk::Walk;
use rtfmesh::stages::records::TriangleRecords;

/// What f32 does to distances in a frame of diagonal 1.
pub const ROUNDING: f64 = 1e-6;

/// A surface with all that the searches need, and its triangles as the device sees them.
pub struct Model {
    pub surface: Surface,
    pub records: TriangleRecords,
    pub corners: Vec<[DVec3; 3]>,
}

/// Where targets came to lie: points and distances, normals, triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct Landed {
    pub projected: Vec<Vec4>,
    pub normals: Vec<Vec4>,
    pub under: Vec<u32>,
}

impl Model {
    pub fn new(mesh: &TriMesh) -> Self {
        let surface = Surface::new(mesh, &UnitFrame::of(mesh).unwrap());
        let records = TriangleRecords::new(device(), &surface, None).unwrap();
        let vertices = rounded(&surface.vertices);
        let corners = surface.triangles.iter().map(|t| t.map(|v| vertices[v as usize])).collect();
        Self { surface, records, corners }
    }

    pub fn of(name: &str) -> Self {
        Self::new(&sample(name).unwrap())
    }

    /// Walks from the triangles `from`, and then searches the whole surface.
    pub fn project(&self, targets: &[DVec3], from: &[u32], workgroup: u32) -> [Landed; 2] {
        let device = device();
        let (n, group) = (targets.len(), Some(workgroup));
        let walk = Walk::new(device, n, group).unwrap();
        let bvh = Bvh::new(device, self.records.len(), group).unwrap();
        let closest = ClosestPoints::new(device, group).unwrap();
        let targets = upload("test.targets", targets);
        let under = Buffer::from_slice(device, "test.site_triangle", from).unwrap();
        let landed = || Landed {
            projected: walk.projected.to_vec(device).unwrap(),
            normals: walk.normals.to_vec(device).unwrap(),
            under: under.to_vec(device).unwrap(),
        };
        let mut recorder = Recorder::new(device).unwrap();
        walk.record(&mut recorder, &targets, &self.records, &under).unwrap();
        recorder.submit().unwrap();
        let walked = landed();
        let mut recorder = Recorder::new(device).unwrap();
        bvh.record(&mut recorder, &self.records).unwrap();
        closest.record(&mut recorder, &targets, &self.records, &bvh, (&walk).into(), &under).unwrap();
        recorder.submit().unwrap();
        assert_valid(device);
        [walked, landed()]
    }

    /// Random points of random triangles, each moved by up to `far`, and the triangles.
    pub fn near(&self, count: usize, far: f64, seed: u64) -> (Vec<DVec3>, Vec<u32>) {
        let mut rng = rng(seed);
        let from: Vec<u32> = (0..count).map(|_| rng.random_range(0..self.corners.len() as u32)).collect();
        let targets = from.iter().zip(cloud(count, 2.0 * far, seed)).map(|(t, off)| {
            let [a, b, c] = self.corners[*t as usize];
            let (v, w) = (0.5 * rng.random::<f64>(), 0.5 * rng.random::<f64>());
            a + (b - a) * v + (c - a) * w + off
        });
        (rounded(&targets.collect::<Vec<_>>()), from)
    }

    /// The results lie on the triangles that they name, with the distance and the normal that they say.
    pub fn assert_consistent(&self, targets: &[DVec3], landed: &Landed) {
        for (i, at) in targets.iter().enumerate() {
            let t = landed.under[i] as usize;
            let (to, normal) = (landed.projected[i].truncate().as_dvec3(), landed.normals[i].as_dvec4());
            let off = onto_triangle(to, self.corners[t]).distance(to);
            assert!(off < ROUNDING, "target {i} is {off} off triangle {t}");
            let distance = f64::from(landed.projected[i].w);
            assert!((to.distance(*at) - distance).abs() < ROUNDING, "target {i}: says {distance}");
            let want = normal_at(to, t, &self.corners);
            assert!(normal.truncate().distance(want) < 1e-3, "target {i}: {normal} instead of {want}");
            assert!(normal.truncate().dot(self.surface.normals[t]) > 0.05 && normal.w == 0.0);
        }
    }

    /// No triangle that meets the one under the point, at the point, is nearer.
    pub fn assert_downhill(&self, targets: &[DVec3], landed: &Landed) {
        for (i, at) in targets.iter().enumerate() {
            let own = self.corners[landed.under[i] as usize];
            let to = landed.projected[i].truncate().as_dvec3();
            for other in self.corners.iter().filter(|t| t.iter().any(|p| own.contains(p))) {
                let here = onto_triangle(to, *other).distance(to) < 1e-7;
                let nearer = to.distance(*at) - onto_triangle(*at, *other).distance(*at);
                assert!(!here || nearer < ROUNDING, "target {i} could be nearer by {nearer}");
            }
        }
    }

    /// The search gave the closest of the triangles that face as the walk's result did, or the walk's result.
    pub fn assert_closest(&self, targets: &[DVec3], walked: &Landed, landed: &Landed) {
        for (i, at) in targets.iter().enumerate() {
            let side = walked.normals[i].truncate().as_dvec3();
            let before = f64::from(walked.projected[i].w);
            // A triangle at a right angle may count or not.
            let distance =
                |least| distance_facing(*at, &self.corners, &self.surface.normals, side, least).min(before);
            let (low, high) = (distance(-1e-3) - ROUNDING, distance(1e-3) + ROUNDING);
            let got = f64::from(landed.projected[i].w);
            assert!(low <= got && got <= high, "target {i}: {got} instead of {low} to {high}");
        }
    }

    pub fn assert_projects(&self, targets: &[DVec3], from: &[u32]) {
        let [walked, landed] = self.project(targets, from, 64);
        self.assert_consistent(targets, &walked);
        self.assert_consistent(targets, &landed);
        self.assert_downhill(targets, &walked);
        self.assert_closest(targets, &walked, &landed);
    }
}

/// Triangles between `rim + 1` points on an arc and its centre.
pub fn fan(rim: usize, angle: f64) -> TriMesh {
    let at = |k: usize| DVec3::new((angle * k as f64).cos(), (angle * k as f64).sin(), 0.1 * (k % 2) as f64);
    TriMesh {
        vertices: std::iter::once(DVec3::ZERO).chain((0..=rim).map(at)).collect(),
        triangles: (1..=rim as u32).map(|k| [0, k, k + 1]).collect(),
    }
}
