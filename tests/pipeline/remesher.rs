//! Many meshes remeshed on one device.

use crate::support::shapes::{moved, sphere};
use crate::support::{assert_valid, device};
use glam::DVec3;
use rtfmesh::mesh::repair::repair_with;
use rtfmesh::mesh::samples::sample;
use rtfmesh::{
    Device, Error, MeasureDepth, Options, Remeshed, Remesher, Size, Sizing, TriMesh, preview,
    preview_repaired, remesh, remesh_repaired,
};

fn options(vertices: usize) -> Options {
    Options::new(vertices).measures(MeasureDepth::Basic)
}

#[test]
fn types_may_go_to_other_threads() {
    fn is_shared<T: Send + Sync>() {}
    is_shared::<Device>();
    is_shared::<Remesher>();
    is_shared::<Remeshed>();
    is_shared::<Error>();
}

#[test]
fn options_are_checked_before_the_first_mesh() {
    let wrong = Remesher::new(device(), Options::new(3)).err().unwrap();
    assert!(matches!(wrong, Error::Usage { .. }), "{wrong}");
}

#[test]
fn a_mesh_comes_out_the_same_whatever_came_before() {
    let remesher = Remesher::new(device(), options(300)).unwrap();
    let (torus, ball) = (sample("torus").unwrap(), sphere(1.0, 3));
    let alone = remesh(device(), &torus, &options(300)).unwrap().mesh;
    for mesh in [&torus, &ball, &torus] {
        let result = remesher.remesh(mesh).unwrap();
        assert_eq!(result.mesh.vertices.len(), 300);
        assert!(mesh == &ball || result.mesh == alone);
    }
    assert_valid(device());
}

#[test]
fn the_size_may_depend_on_the_mesh() {
    let remesher = Remesher::new(device(), options(300)).unwrap().with_size(Size::Ratio(0.5)).unwrap();
    for mesh in [sphere(1.0, 3), sample("torus").unwrap()] {
        let result = remesher.remesh(&mesh).unwrap();
        assert_eq!(result.mesh.vertices.len(), (mesh.vertices.len() as f64 / 2.0).round() as usize);
    }
    let wrong = remesher.with_size(Size::EdgeLength(-1.0)).err().unwrap();
    assert!(matches!(wrong, Error::Usage { .. }), "{wrong}");
}

#[test]
fn threads_may_share_one() {
    let remesher = Remesher::new(device(), options(300)).unwrap();
    let balls: Vec<_> = (1..4).map(|k| moved(&sphere(1.0, 3), |v| v + DVec3::X * f64::from(k))).collect();
    let one = |ball| remesher.remesh(ball).unwrap().mesh;
    let together: Vec<_> = std::thread::scope(|scope| {
        let running: Vec<_> = balls.iter().map(|ball| scope.spawn(move || one(ball))).collect();
        running.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert_eq!(together, balls.iter().map(one).collect::<Vec<_>>());
    assert_valid(device());
}

#[test]
fn memory_is_given_back() {
    let remesher = Remesher::new(device(), options(300)).unwrap();
    let ball = sphere(1.0, 3);
    let peaks: Vec<u64> =
        (0..3).map(|_| remesher.remesh(&ball).unwrap().summary.timings.peak_device_bytes).collect();
    assert!(peaks.windows(2).all(|pair| pair[1] <= pair[0].max(1 << 20)), "{peaks:?}");
}

/// Every triangle has corners of its own, some none at all, and a vertex wants an edge length.
#[test]
fn a_mesh_that_is_repaired_already_comes_out_the_same() {
    let torus = sample("torus").unwrap();
    let soup = TriMesh {
        vertices: torus.triangles.as_flattened().iter().map(|v| torus.vertices[*v as usize]).collect(),
        triangles: (0..=torus.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
    };
    let soup = TriMesh { vertices: [soup.vertices, vec![DVec3::ONE; 3]].concat(), ..soup };
    let lengths = soup.vertices.iter().map(|p| if p.x > 0.0 { 2.0 } else { 1.0 }).collect();
    let sized = options(300).sizing(Sizing::Given(lengths));
    for options in [options(300), options(300).weld(1e-4), sized] {
        let repaired = repair_with(&soup, &options.repairs()).unwrap();
        assert_eq!(Size::AsInput.vertices(&repaired.mesh).unwrap(), torus.vertices.len());
        assert_eq!(repaired.counts.degenerate_faces_removed, 1);
        let plain = remesh(device(), &soup, &options).unwrap();
        let spared = remesh_repaired(device(), &soup, Some(repaired.clone()), &options, |_| {}).unwrap();
        assert_eq!((spared.mesh, spared.summary.repaired), (plain.mesh, plain.summary.repaired));
        let seen = preview_repaired(&soup, Some(repaired.clone()), &options).unwrap();
        assert_eq!(seen.patches, preview(&soup, &options).unwrap().patches);
        let of_another = |done| matches!(done, Some(Error::Usage { .. }));
        let other = TriMesh { triangles: soup.triangles[..5].to_vec(), ..soup.clone() };
        let refused = remesh_repaired(device(), &other, Some(repaired.clone()), &options, |_| {});
        assert!(of_another(refused.err()));
        assert!(of_another(preview_repaired(&other, Some(repaired), &options).err()));
    }
    assert_valid(device());
}
