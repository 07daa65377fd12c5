//! `fit/{own, own_edges, own_inward, blocks, blocks_inward}`, and the solver: `fit/{apply, scalars, descend,
//! turn}`.

use super::inward::points;
use crate::reference::fit::{Term, equations, product};
use crate::stages::polish::fixture::{Ground, uneven};
use crate::support::shapes::plane;
use crate::support::{assert_valid, device, rounded};
use glam::{DMat3, DVec3, Vec2, Vec4};
use rtfmesh::TriMesh;
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::stages::fit::equations::Equations;
use rtfmesh::stages::fit::inward::InwardSamples;
use rtfmesh::stages::fit::mesh::FitMesh;
use rtfmesh::stages::fit::samples::FaceSamples;
use rtfmesh::stages::polish::mesh::{DeviceMesh, FIXED};

/// The equations of a mesh on a surface as the device makes them, and by the definition from its samples.
struct Both {
    matrix: Vec<Vec<DMat3>>,
    right: Vec<DVec3>,
    own: Vec<Vec4>,
    heads: Vec<Vec4>,
    tails: Vec<Vec2>,
    got_right: Vec<Vec4>,
    moves: Vec<Vec4>,
    /// Both ends of each edge.
    ends: Vec<[usize; 2]>,
    fixed: Vec<bool>,
}

fn both(mesh: &TriMesh, surface: &TriMesh, workgroup: u32, steps: u32) -> Both {
    let device = device();
    let ground = Ground::new(surface);
    let on_device = DeviceMesh::new(device, mesh).unwrap();
    let fit = FitMesh::new(device, &on_device, Some(workgroup)).unwrap();
    let samples = FaceSamples::new(device, (&fit, &ground.records), Some(workgroup), None).unwrap();
    let under: Vec<u32> = mesh.vertices.iter().map(|p| ground.under(*p)).collect();
    let under = Buffer::from_slice(device, "test.under", &under).unwrap();
    let points = points(surface, mesh, 5);
    let inward = InwardSamples::new(device, &points, mesh.triangles.len(), Some(workgroup)).unwrap();
    let solver = Equations::new(device, mesh.vertices.len(), fit.edges.len(), Some(workgroup)).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    fit.record(&mut recorder).unwrap();
    samples.record_tree(&mut recorder, &ground.records).unwrap();
    samples.record(&mut recorder, &fit, &ground.records, &under, 0.0).unwrap();
    inward.record(&mut recorder, &fit).unwrap();
    solver.record(&mut recorder, &fit, &samples, &inward).unwrap();
    let got_right = recorder.download(&solver.residual).unwrap();
    solver.record_solve(&mut recorder, &fit, steps).unwrap();
    let downloads = recorder.submit().unwrap();
    assert_valid(device);
    let fixed: Vec<bool> =
        on_device.states.to_vec(device).unwrap().iter().map(|state| state & FIXED != 0).collect();
    let corner = |h: u32| mesh.triangles[h as usize / 3][h as usize % 3] as usize;
    let next = |h: u32| if h % 3 == 2 { h - 2 } else { h + 1 };
    let ends: Vec<[usize; 2]> =
        fit.edges.to_vec(device).unwrap().iter().map(|h| [corner(*h), corner(next(*h))]).collect();
    let mut terms = Vec::new();
    let mut add = |sample: Vec4, of: Vec<(usize, f64)>| {
        let direction = sample.truncate().as_dvec3();
        terms.push(Term { direction, distance: f64::from(sample.w), of });
    };
    for (v, sample) in samples.corners.to_vec(device).unwrap().into_iter().enumerate() {
        add(sample, vec![(v, 1.0)]);
    }
    for (triangle, sample) in mesh.triangles.iter().zip(samples.faces.to_vec(device).unwrap()) {
        add(sample, triangle.map(|v| (v as usize, 1.0 / 3.0)).to_vec());
    }
    for (ends, sample) in ends.iter().zip(samples.edges.to_vec(device).unwrap()) {
        add(sample, ends.map(|v| (v, 0.5)).to_vec());
    }
    let at = inward.under().to_vec(device).unwrap();
    let weights = inward.weights.to_vec(device).unwrap();
    for (i, sample) in inward.samples.to_vec(device).unwrap().into_iter().enumerate() {
        let [a, b, c] = mesh.triangles[at[i] as usize].map(|v| v as usize);
        let w = weights[i].as_dvec2();
        add(sample, vec![(a, 1.0 - w.x - w.y), (b, w.x), (c, w.y)]);
    }
    let (matrix, right) = equations(mesh, &terms, &fixed);
    Both {
        matrix,
        right,
        own: solver.own.to_vec(device).unwrap(),
        heads: solver.block_heads.to_vec(device).unwrap(),
        tails: solver.block_tails.to_vec(device).unwrap(),
        got_right: downloads.read(&got_right).unwrap(),
        moves: solver.moves.to_vec(device).unwrap(),
        ends,
        fixed,
    }
}

/// A symmetric block from the order that the device keeps it in.
fn block(head: Vec4, tail: Vec2) -> DMat3 {
    let ([xx, yy, zz, yz], [zx, xy]) = (head.as_dvec4().to_array(), tail.as_dvec2().to_array());
    DMat3::from_cols_array(&[xx, xy, zx, xy, yy, yz, zx, yz, zz])
}

fn largest(m: DMat3) -> f64 {
    m.to_cols_array().into_iter().fold(0.0, |a, b| a.max(b.abs()))
}

/// A closed mesh on a torus, and an open one on a plane, where boundaries do not move.
fn cases() -> [(TriMesh, TriMesh); 2] {
    let bumpy = |mesh: TriMesh| {
        let up = |p: &DVec3| *p + DVec3::Z * 0.02 * (9.0 * p.x).sin();
        TriMesh { vertices: rounded(&mesh.vertices.iter().map(up).collect::<Vec<_>>()), ..mesh }
    };
    [(uneven(12, 7, 0.05, 2), uneven(30, 16, 0.0, 1)), (bumpy(plane(5, 0.0)), plane(8, 0.0))]
}

#[test]
fn the_equations_are_those_of_the_sum_of_squares() {
    for (mesh, surface) in cases() {
        for workgroup in [16, 64] {
            let both = both(&mesh, &surface, workgroup, 0);
            let scale = both.matrix.iter().flatten().map(|m| largest(*m)).fold(0.0, f64::max);
            for v in (0..mesh.vertices.len()).filter(|v| !both.fixed[*v]) {
                let own = block(both.own[2 * v], both.own[2 * v + 1].truncate().truncate());
                assert!(largest(own - both.matrix[v][v]) < 1e-5 * scale, "vertex {v}");
                let right = both.got_right[v].truncate().as_dvec3();
                assert!(right.distance(both.right[v]) < 1e-5 * scale, "vertex {v}");
            }
            for (e, [v, w]) in both.ends.iter().enumerate() {
                let beside = block(both.heads[e], both.tails[e]);
                let wanted = if both.fixed[*v] { both.matrix[*w][*v] } else { both.matrix[*v][*w] };
                let is_wanted = !both.fixed[*v] || !both.fixed[*w];
                assert!(!is_wanted || largest(beside - wanted) < 1e-5 * scale, "edge {e}");
            }
            assert!(both.moves.iter().all(|step| *step == Vec4::ZERO), "no step, no move");
        }
    }
}

#[test]
fn the_solver_ends_at_the_solution() {
    for (mesh, surface) in cases() {
        for workgroup in [15, 16, 64] {
            let Both { matrix, right, moves, fixed, .. } = both(&mesh, &surface, workgroup, 60);
            let moves: Vec<DVec3> = moves.iter().map(|step| step.truncate().as_dvec3()).collect();
            let norm = |x: &[DVec3]| x.iter().map(|x| x.length_squared()).sum::<f64>().sqrt();
            let left: Vec<DVec3> =
                product(&matrix, &moves).iter().zip(&right).map(|(a, b)| *a - *b).collect();
            assert!(norm(&left) < 1e-4 * norm(&right), "{} of {}", norm(&left), norm(&right));
            assert!(moves.iter().zip(&fixed).all(|(step, fixed)| !fixed || *step == DVec3::ZERO));
        }
    }
}
