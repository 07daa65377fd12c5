//! One device, many meshes.

use crate::shapes::{moved, sphere};
use crate::support::{assert_valid, device};
use glam::DVec3;
use rtfmesh::mesh::samples::sample;
use rtfmesh::{Device, Error, MeasureDepth, Options, Remeshed, Remesher, remesh};

fn options(vertices: usize) -> Options {
    Options { measures: MeasureDepth::Basic, ..Options::new(vertices) }
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
    let alone = remesh(device(), &torus, &options(300), &mut |_| {}).unwrap().mesh;
    for mesh in [&torus, &ball, &torus] {
        let result = remesher.remesh(mesh).unwrap();
        assert_eq!(result.mesh.vertices.len(), 300);
        assert!(mesh == &ball || result.mesh == alone);
    }
    assert_valid(device());
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
