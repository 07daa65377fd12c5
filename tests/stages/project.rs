//! `project/walk`, and `project/closest` with its tree of boxes, against a look at every triangle.

use crate::reference::surface::{distance_facing, normal_at, onto_triangle};
use crate::support::{assert_valid, cloud, device, rng, rounded, upload};
use glam::{DVec3, Vec4};
use rand::RngExt;
use rtfmesh::TriMesh;
use rtfmesh::gpu::Buffer;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::unit_frame::UnitFrame;
use rtfmesh::sites::surface::Surface;
use rtfmesh::stages::project::bvh::Bvh;
use rtfmesh::stages::project::closest::ClosestPoints;
use rtfmesh::stages::project::walk::Walk;
use rtfmesh::stages::records::TriangleRecords;

/// What f32 does to distances in a frame of diagonal 1.
const ROUNDING: f64 = 1e-6;

/// A surface with all that the searches need, and its triangles as the device sees them.
struct Model {
    surface: Surface,
    records: TriangleRecords,
    corners: Vec<[DVec3; 3]>,
}

/// Where targets came to lie: points and distances, normals, triangles.
#[derive(Debug, Clone, PartialEq)]
struct Landed {
    projected: Vec<Vec4>,
    normals: Vec<Vec4>,
    under: Vec<u32>,
}

impl Model {
    fn new(mesh: &TriMesh) -> Self {
        let surface = Surface::new(device(), mesh, &UnitFrame::of(mesh).unwrap()).unwrap();
        let records = TriangleRecords::new(device(), &surface, None).unwrap();
        let vertices = rounded(&surface.vertices);
        let corners = surface.triangles.iter().map(|t| t.map(|v| vertices[v as usize])).collect();
        Self { surface, records, corners }
    }

    fn of(name: &str) -> Self {
        Self::new(&sample(name).unwrap())
    }

    /// Walks from the triangles `from`, and then searches the whole surface.
    fn project(&self, targets: &[DVec3], from: &[u32], workgroup: u32) -> [Landed; 2] {
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
        let mut recorder = device.recorder().unwrap();
        walk.record(&mut recorder, &targets, &self.records, &under).unwrap();
        recorder.submit().unwrap();
        let walked = landed();
        let mut recorder = device.recorder().unwrap();
        bvh.record(&mut recorder, &self.records).unwrap();
        closest.record(&mut recorder, &targets, &self.records, &bvh, &walk, &under).unwrap();
        recorder.submit().unwrap();
        assert_valid(device);
        [walked, landed()]
    }

    /// Random points of random triangles, each moved by up to `far`, and the triangles.
    fn near(&self, count: usize, far: f64, seed: u64) -> (Vec<DVec3>, Vec<u32>) {
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
    fn assert_consistent(&self, targets: &[DVec3], landed: &Landed) {
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
    fn assert_downhill(&self, targets: &[DVec3], landed: &Landed) {
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
    fn assert_closest(&self, targets: &[DVec3], walked: &Landed, landed: &Landed) {
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

    fn assert_projects(&self, targets: &[DVec3], from: &[u32]) {
        let [walked, landed] = self.project(targets, from, 64);
        self.assert_consistent(targets, &walked);
        self.assert_consistent(targets, &landed);
        self.assert_downhill(targets, &walked);
        self.assert_closest(targets, &walked, &landed);
    }
}

#[test]
fn projections_are_the_closest_points() {
    for name in ["torus", "genus3", "box", "thin-plate", "open-hemisphere", "two-components", "tetrahedron"] {
        let model = Model::of(name);
        for far in [1e-4, 0.01, 0.2] {
            let (targets, from) = model.near(150, far, 1);
            model.assert_projects(&targets, &from);
        }
        // From anywhere to anywhere.
        let (_, from) = model.near(150, 0.0, 2);
        model.assert_projects(&rounded(&cloud(150, 0.9, 3)), &from);
    }
}

#[test]
fn sizes_do_not_change_results() {
    let model = Model::of("torus");
    let (targets, from) = model.near(200, 0.05, 4);
    let whole = model.project(&targets, &from, 64);
    for count in [0, 1, 15, 16, 17, 63, 64, 65] {
        for workgroup in [16, 64] {
            let some = model.project(&targets[..count], &from[..count], workgroup);
            for (some, whole) in some.iter().zip(&whole) {
                assert_eq!(some.projected, whole.projected[..count]);
                assert_eq!(some.normals, whole.normals[..count]);
                assert_eq!(some.under, whole.under[..count]);
            }
        }
    }
}

/// Triangles between `rim + 1` points on an arc and its centre.
fn fan(rim: usize, angle: f64) -> TriMesh {
    let at = |k: usize| DVec3::new((angle * k as f64).cos(), (angle * k as f64).sin(), 0.1 * (k % 2) as f64);
    TriMesh {
        vertices: std::iter::once(DVec3::ZERO).chain((0..=rim).map(at)).collect(),
        triangles: (1..=rim as u32).map(|k| [0, k, k + 1]).collect(),
    }
}

#[test]
fn trees_of_every_size() {
    for triangles in [1, 2, 3, 4, 5, 15, 16, 17, 63, 64, 65, 257] {
        let model = Model::new(&fan(triangles, 6.0 / triangles as f64));
        let (_, from) = model.near(60, 0.0, 5);
        model.assert_projects(&rounded(&cloud(60, 1.0, 6)), &from);
    }
}

#[test]
fn a_step_is_found_by_walking_alone() {
    for name in ["torus", "genus3", "open-hemisphere"] {
        let model = Model::of(name);
        let (targets, from) = model.near(400, 2e-3, 7);
        let [walked, landed] = model.project(&targets, &from, 64);
        let excess = |i: usize| f64::from(walked.projected[i].w - landed.projected[i].w);
        let count = (0..targets.len()).filter(|i| excess(*i) > ROUNDING).count();
        let worst = (0..targets.len()).map(excess).fold(0.0, f64::max);
        // Where the triangles make a valley, its two sides can both be downhill.
        assert!(count <= 8 && worst < 2e-4, "{name}: {count} of 400 walks end up to {worst} too far away");
    }
}

#[test]
fn a_plate_keeps_its_sides() {
    let model = Model::of("thin-plate");
    // Far from the rim, and up to five thicknesses beyond the other side.
    let inside = |t: &u32| model.corners[*t as usize].iter().all(|p| p.truncate().abs().max_element() < 0.25);
    let up = |t: &u32| model.surface.normals[*t as usize].z;
    let from: Vec<u32> = (0..model.corners.len() as u32).filter(|t| inside(t) && up(t).abs() > 0.9).collect();
    assert!(from.len() > 50);
    let shifts = cloud(from.len(), 0.1, 8);
    let targets: Vec<DVec3> = from
        .iter()
        .zip(shifts)
        .map(|(t, off)| {
            let [a, b, c] = model.corners[*t as usize];
            (a + b + c) / 3.0 + off.with_z(-up(t) * off.z.abs())
        })
        .collect();
    let targets = rounded(&targets);
    for landed in model.project(&targets, &from, 64) {
        assert!(landed.under.iter().zip(&from).all(|(to, from)| up(to) * up(from) > 0.0));
        assert!(landed.normals.iter().zip(&from).all(|(n, t)| f64::from(n.z) * up(t) > 0.9));
    }
}

#[test]
fn slivers_and_large_triangles_among_tiny_ones() {
    // Needles of 1e-4 to 1.
    let model = Model::new(&fan(300, 1e-4));
    let (targets, from) = model.near(200, 0.1, 9);
    let [walked, landed] = model.project(&targets, &from, 64);
    model.assert_closest(&targets, &walked, &landed);
    assert!(walked.normals.iter().chain(&landed.normals).all(|n| (n.length() - 1.0).abs() < 1e-5));

    // A bent sheet of tiny triangles beside two large ones that overlap it.
    let mut mesh = TriMesh {
        vertices: [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
            .map(|(x, y)| DVec3::new(x, y, 0.01))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let side = 24;
    for k in 0..side * side {
        let (x, y) = (f64::from(k % side), f64::from(k / side));
        mesh.vertices.push(DVec3::new(0.5 + 0.002 * x, 0.3 + 0.003 * y, 0.02 * (0.4 * x).sin()));
        if k % side + 1 < side && k / side + 1 < side {
            let v = 4 + k;
            mesh.triangles.extend([[v, v + 1, v + side + 1], [v, v + side + 1, v + side]]);
        }
    }
    let model = Model::new(&mesh);
    for far in [0.003, 0.1] {
        let (targets, from) = model.near(200, far, 10);
        model.assert_projects(&targets, &from);
    }
}

#[test]
fn normals_do_not_vanish_where_the_mesh_folds() {
    // Two leaves on one another, sharing the vertices of their outline: the normals of the vertices cancel.
    let mut mesh = fan(6, 1.0);
    let back: Vec<[u32; 3]> = mesh.triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    mesh.triangles.extend(back);
    let model = Model::new(&mesh);
    let (targets, from) = model.near(100, 0.05, 11);
    for landed in model.project(&targets, &from, 64) {
        for (n, t) in landed.normals.iter().zip(&landed.under) {
            let own = model.surface.normals[*t as usize];
            assert!((n.length() - 1.0).abs() < 1e-5 && n.truncate().as_dvec3().dot(own) > 0.05, "{n}");
        }
    }
    // Across a fold nothing is connected but by the outline, and a walk stays on its leaf.
    let [walked, _] = model.project(&targets, &from, 64);
    let leaf = |t: u32| t / 6;
    assert!(walked.under.iter().zip(&from).all(|(to, from)| leaf(*to) == leaf(*from)));
}
