//! Whole runs whose stages are chosen one by one.

use crate::support::{assert_valid, device};
use glam::DVec3;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::options::{Centroid, Face, Neighbours, Normals, Projection, Seeding};
use rtfmesh::{Error, Options, Remeshed, TriMesh, preview, remesh};

const N: usize = 400;

fn run(mesh: &TriMesh, options: &Options) -> Remeshed {
    let result = remesh(device(), mesh, options).unwrap();
    assert_valid(device());
    result
}

fn short() -> Options {
    Options::rtf(N).iterations(20)
}

fn assert_sound(input: &TriMesh, options: &Options) -> Remeshed {
    let result = run(input, options);
    let (got, want) = (topology(&result.mesh), topology(input));
    assert!(got.is_closed_manifold(), "{options:?}: {got:?}");
    assert_eq!((got.vertices, got.components, got.euler), (N, want.components, want.euler), "{options:?}");
    let measures = &result.summary.output;
    assert!(measures.quality.mean_quality > 0.8, "{options:?}: {}", measures.quality.mean_quality);
    let distances = measures.distances.as_ref().unwrap();
    assert!(distances.hausdorff_to_reference < 3.0, "{options:?}: {distances:?}");
    assert!(preview(input, options).unwrap().device_bytes > 0);
    result
}

#[test]
fn stages_go_together_as_they_are_chosen() {
    let input = sample("bumpy-sphere").unwrap();
    use Normals as P;
    use Projection as Q;
    let pairs = [
        (P::Fit, Q::Walk),
        (P::Fit, Q::Exact),
        (P::Surface, Q::Walk),
        (P::Surface, Q::Exact),
        (P::Cloud, Q::NearestVertices),
        (P::Cloud, Q::Exact),
    ];
    let paper = run(&input, &short());
    for (normals, projection) in pairs {
        let result = assert_sound(&input, &short().normals(normals).projection(projection));
        assert_ne!(result.mesh, paper.mesh, "{normals:?}, {projection:?} do nothing");
    }
    for seeding in [Seeding::Stratified, Seeding::Poisson] {
        assert_sound(&input, &short().seeding(seeding));
    }
    let all = short()
        .face(Face::Power)
        .normals(P::Surface)
        .projection(Q::Exact)
        .seeding(Seeding::Poisson)
        .neighbours(Neighbours::Lists)
        .centroid(Centroid::Area);
    assert_sound(&input, &all);
}

#[test]
fn lists_find_what_brute_force_does() {
    let input = sample("torus").unwrap();
    let lists = short().neighbours(Neighbours::Lists);
    assert_eq!(run(&input, &lists).mesh, run(&input, &short()).mesh);
}

#[test]
fn presets_are_what_they_are_made_of() {
    let input = sample("torus").unwrap();
    let exact = short().face(Face::Exact);
    assert_eq!(run(&input, &exact).mesh, run(&input, &Options::rvd(N).iterations(20)).mesh);
    // Disks that move are none; they begin farther from each other than random points.
    let moved = run(&input, &Options::mps(N).iterations(3)).summary;
    assert!(moved.disks.is_none() && moved.exact.is_some());
    let random = run(&input, &Options::rvd(N).iterations(3)).summary;
    assert!(moved.energy.unwrap().energy < random.energy.unwrap().energy);
}

#[test]
fn what_does_not_go_together_is_refused() {
    let input = sample("torus").unwrap();
    let wrong = [
        short().projection(Projection::Plane),
        short().normals(Normals::Surface),
        short().neighbours(Neighbours::Lists).k_clip(33),
        short().polish_rounds(3),
        Options::new(N).face(Face::Power),
    ];
    for options in wrong {
        let refused = remesh(device(), &input, &options);
        assert!(matches!(refused, Err(Error::Usage { .. })), "{options:?}");
    }
}

/// A flat drum, each end a fan from one corner: the middle of the ends is under triangles from rim to rim.
fn drum(sides: u32) -> TriMesh {
    let at = |k: u32, z: f64| {
        let angle = f64::from(k) * std::f64::consts::TAU / f64::from(sides);
        DVec3::new(angle.cos(), angle.sin(), z)
    };
    let vertices = [0.0, 0.3].into_iter().flat_map(|z| (0..sides).map(move |k| at(k, z))).collect();
    let around = (0..sides).flat_map(|k| {
        let next = (k + 1) % sides;
        [[k, next, next + sides], [k, next + sides, k + sides]]
    });
    let ends = (2..sides).flat_map(|k| [[0, k, k - 1], [sides, sides + k - 1, sides + k]]);
    TriMesh { vertices, triangles: around.chain(ends).collect() }
}

#[test]
fn sites_find_triangles_that_have_no_vertex_near_them() {
    let input = drum(100);
    for options in [short(), short().face(Face::Power), short().normals(Normals::Cloud)] {
        let result = assert_sound(&input, &options);
        let quality = &result.summary.output.quality;
        assert!(quality.min_angle > 15.0, "{options:?}: {}", quality.min_angle);
    }
}
