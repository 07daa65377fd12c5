//! `polish/{relax, land, folded, spread, accept}`.

use super::fixture::{Ground, read, uneven};
use crate::reference::polish::{goal, neighbours, onto_surface, undo_bad_moves, vertex_normal};
use crate::support::shapes::{plane, sphere, tetrahedron};
use crate::support::{assert_valid, device, rounded};
use glam::DVec3;
use rtfmesh::TriMesh;
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::stages::polish::mesh::DeviceMesh;
use rtfmesh::stages::polish::relax::Relaxation;

impl Ground {
    /// The mesh after one step, and how many moves were undone.
    fn relaxed(&self, mesh: &TriMesh, lengths: Option<&[f64]>, workgroup: u32) -> (TriMesh, usize) {
        let device = device();
        let on_device = DeviceMesh::new(device, mesh).unwrap();
        if let Some(lengths) = lengths {
            let positions = mesh.vertices.iter().zip(lengths);
            let positions: Vec<_> = positions.map(|(p, l)| p.as_vec3().extend(*l as f32)).collect();
            let mut recorder = Recorder::new(device).unwrap();
            recorder.upload(&on_device.positions, &positions).unwrap();
            recorder.submit().unwrap();
        }
        let under: Vec<u32> = mesh.vertices.iter().map(|p| self.under(*p)).collect();
        let under = Buffer::from_slice(device, "test.under", &under).unwrap();
        let relaxation = Relaxation::new(device, mesh.vertices.len(), Some(workgroup)).unwrap();
        let mut recorder = Recorder::new(device).unwrap();
        relaxation.record(&mut recorder, &on_device, &self.records, &under).unwrap();
        let undone = relaxation.download_undone(&mut recorder).unwrap();
        let undone = recorder.submit().unwrap().first(&undone).unwrap();
        assert_valid(device);
        (read(&on_device), undone as usize)
    }
}

/// One step of all vertices of a closed mesh, by the definition, with the number of undone moves.
fn wanted(mesh: &TriMesh, surface: &TriMesh, lengths: &[f64]) -> (Vec<DVec3>, usize) {
    let around = neighbours(mesh);
    let normals: Vec<DVec3> = (0..mesh.vertices.len() as u32).map(|v| vertex_normal(mesh, v)).collect();
    let to = |v: u32| onto_surface(surface, goal(mesh, v, &around[v as usize], lengths));
    let mut moved: Vec<DVec3> = (0..mesh.vertices.len() as u32).map(to).collect();
    let undone = undo_bad_moves(mesh, &normals, &mut moved);
    (moved, undone)
}

#[test]
fn vertices_move_towards_the_mean_of_their_neighbours_over_the_surface() {
    let ground = uneven(60, 30, 0.0, 1);
    let on = Ground::new(&ground);
    for (jitter, has_lengths) in [(0.1, false), (0.15, true)] {
        let mesh = uneven(24, 12, jitter, 2);
        let mesh = TriMesh { vertices: rounded(&mesh.vertices), ..mesh };
        let lengths: Vec<f64> =
            mesh.vertices.iter().map(|p| if has_lengths { 1.0 + p.x } else { 1.0 }).collect();
        let (want, undone) = wanted(&mesh, &ground, &lengths);
        assert_eq!(undone, 0);
        for workgroup in [16, 64] {
            let (got, count) = on.relaxed(&mesh, has_lengths.then_some(&lengths), workgroup);
            assert_eq!(count, 0);
            // Where triangles make a valley, a walk can end on the farther side.
            let off = got.vertices.iter().zip(&want).filter(|(a, b)| a.distance(**b) > 2e-6).count();
            assert!(100 * off <= 3 * want.len(), "{off} of {} are elsewhere", want.len());
            assert_eq!(got.triangles, mesh.triangles);
        }
    }
}

#[test]
fn moves_that_fold_or_flatten_triangles_are_undone() {
    let ground = uneven(60, 30, 0.0, 1);
    let on = Ground::new(&ground);
    let mut total = 0;
    for seed in 3..7 {
        let mesh = uneven(24, 12, 1.2, seed);
        let (want, undone) = wanted(&mesh, &ground, &vec![1.0; mesh.vertices.len()]);
        let (got, count) = on.relaxed(&mesh, None, 64);
        total += undone;
        // A triangle may be as good as spoiled, and projections from afar are not walks. Where a vertex faces
        // another side of the surface, it does not move, and there is nothing to undo.
        let differ = got.vertices.iter().zip(&want).filter(|(a, b)| a.distance(**b) > 1e-5).count();
        let counted = (undone / 2..=undone + 12).contains(&count);
        assert!(differ <= 12 && counted, "{differ} differ, {count} undone for {undone}");
    }
    assert!(total > 100, "{total} moves undone");
}

#[test]
fn boundaries_stay_and_sizes_do_not_matter() {
    let flat = Ground::new(&plane(3, 0.0));
    for n in [1, 2, 3, 4, 5, 7] {
        let mesh = plane(n, 0.0);
        let mesh = TriMesh { vertices: rounded(&mesh.vertices), ..mesh };
        let open = |p: &DVec3| [p.x, p.y].iter().any(|x| *x == 0.0 || *x == 1.0);
        for workgroup in [1, 15, 16, 17] {
            let (got, _) = flat.relaxed(&mesh, None, workgroup);
            let kept = got.vertices.iter().zip(&mesh.vertices);
            assert!(kept.clone().filter(|(_, p)| open(p)).all(|(a, b)| a == b), "{n}");
            assert!(kept.clone().all(|(a, b)| a.distance(*b) < 1e-6), "{n}");
        }
    }
    let empty = TriMesh::default();
    assert_eq!(flat.relaxed(&empty, None, 64), (empty, 0));
}

#[test]
fn what_has_no_normal_stays() {
    let round = sphere(0.4, 2);
    let on = Ground::new(&round);
    // All vertices in one place, or in a line.
    for map in [|_| DVec3::splat(0.25), |p: DVec3| DVec3::new(p.x, 0.0, 0.0)] {
        let mesh = crate::support::shapes::moved(&round, map);
        let mesh = TriMesh { vertices: rounded(&mesh.vertices), ..mesh };
        let (got, _) = on.relaxed(&mesh, None, 64);
        assert_eq!(got, mesh);
    }
    // The surface is a point for such a mesh, and the mesh is one for such a surface.
    let point = Ground::new(&crate::support::shapes::moved(&tetrahedron(), |p| p * 1e-7));
    let (got, _) = point.relaxed(&round, None, 64);
    assert!(got.vertices.iter().all(|p| p.is_finite()));
}
