//! `project/best_fit` against the closed form.

use crate::reference::best_fit::{Projected, best_fit};
use crate::reference::knn::nearest;
use crate::support::{assert_valid, cloud, device, rounded, slots, upload};
use glam::{DVec3, Vec4};
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::unit_frame::UnitFrame;
use rtfmesh::sites::surface::{Surface, SurfaceBuffers};
use rtfmesh::stages::project::best_fit::{BestFit, vertex_normals};

/// Short enough that it matters for some sites of a cloud.
const LONGEST: f64 = 0.3;

#[test]
fn sites_are_pulled_to_the_planes_of_their_vertices() {
    let device = device();
    for (name, k, count, workgroup) in [
        ("torus", 16, 300, 64),
        ("torus", 16, 63, 16),
        ("sphere", 8, 65, 64),
        ("box", 16, 17, 16),
        ("torus", 3, 0, 64),
    ] {
        let mesh = sample(name).unwrap();
        let surface = Surface::new(&mesh, &UnitFrame::of(&mesh).unwrap());
        let (targets, vertices) = (rounded(&cloud(count, 0.5, 9)), rounded(&surface.vertices));
        let near = nearest(&targets, &vertices, k, false);
        let neighbours = Buffer::from_slice(device, "test.neighbours", &slots(&near, k)).unwrap();
        let fit = BestFit::new(device, &surface, count, (k as u32, LONGEST), Some(workgroup)).unwrap();
        let mut recorder = Recorder::new(device).unwrap();
        let buffer = upload("test.targets", &targets);
        fit.record(&mut recorder, &buffer, &neighbours, &SurfaceBuffers::new(device, &surface).unwrap())
            .unwrap();
        recorder.submit().unwrap();
        assert_valid(device);
        let (projected, normals): (Vec<Vec4>, Vec<Vec4>) =
            (fit.projected.to_vec(device).unwrap(), fit.normals.to_vec(device).unwrap());
        let (flags, outward) = (fit.flags.to_vec(device).unwrap(), vertex_normals(&surface));
        for (i, at) in targets.iter().enumerate() {
            let of = |list: &[DVec3]| near[i].iter().map(|v| list[*v as usize]).collect::<Vec<_>>();
            let want = best_fit(*at, &of(&vertices), &of(&outward), LONGEST / 3_f64.sqrt());
            let Some(Projected { to, normal: n, fits }) = want else { continue };
            assert_eq!(flags[i] & 128 == 0, fits, "{name} {i}");
            let (got, normal) = (projected[i].truncate().as_dvec3(), normals[i].truncate().as_dvec3());
            assert!(normal.distance(n) < 1e-3, "{name} {i}: {normal} instead of {n}");
            assert!(got.distance(to) < 1e-3 * at.distance(to) + 1e-6, "{name} {i}: {got} instead of {to}");
            assert!((f64::from(projected[i].w) - got.distance(*at)).abs() < 1e-6, "{name} {i}");
        }
    }
}
