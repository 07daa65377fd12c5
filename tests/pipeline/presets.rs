//! Whole runs of the presets that stand for methods the paper compares with: mps, rpf, rvc.

use super::shortage::cube_with_a_pin;
use crate::support::shapes::{moved, sphere, union};
use crate::support::{assert_valid, device, faults};
use glam::DVec3;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::{Error, MeasureDepth, Options, Remeshed, Shortage, TriMesh, preview, remesh};

fn run(mesh: &TriMesh, options: &Options) -> Remeshed {
    let result = remesh(device(), mesh, options).unwrap();
    assert_valid(device());
    result
}

/// The run has no warnings, and the result has the input's topology and the exact count; a rerun gives the
/// same bytes.
fn assert_sound(name: &str, options: &Options) -> Remeshed {
    let input = sample(name).unwrap();
    let result = run(&input, options);
    assert_eq!(faults(&result.summary), Vec::<String>::new(), "{name} {:?}", options.method);
    let (got, want) = (topology(&result.mesh), topology(&input));
    assert_eq!(got.vertices, options.vertices, "{name}");
    assert_eq!(
        (got.components, got.euler, got.boundary_loops, got.nonmanifold_edges, got.nonmanifold_vertices),
        (want.components, want.euler, want.boundary_loops, 0, 0),
        "{name}"
    );
    assert_eq!(run(&input, options).mesh, result.mesh, "{name}");
    assert_eq!(preview(&input, options).unwrap().levels.len(), 1);
    result
}

#[test]
fn disks_are_connected_where_they_are() {
    for (name, n) in
        [("torus", 600), ("two-components", 500), ("sphere", 300), ("box", 400), ("open-hemisphere", 300)]
    {
        let result = assert_sound(name, &Options::mps(n));
        let disks = result.summary.disks.unwrap();
        // In the file's units; vertices do not move.
        let vertices = &result.mesh.vertices;
        let apart = |i: usize| {
            vertices[i + 1..].iter().map(|q| q.distance(vertices[i])).fold(f64::INFINITY, f64::min)
        };
        let least = (0..n).map(apart).fold(f64::INFINITY, f64::min);
        assert!(least >= disks.radius * (1.0 - 1e-9), "{name}: {least}, {disks:?}");
        assert_eq!((result.summary.iterations, result.summary.converged), (0, false), "{name}");
    }
    // All angles of a maximal sampling are above 30 degrees but for the surface's bends.
    let angle = run(&sample("torus").unwrap(), &Options::mps(2000)).summary.output.quality.min_angle;
    assert!(angle > 25.0, "{angle}");
}

#[test]
fn power_faces_relax_as_tangent_faces_do() {
    for (name, n) in [("torus", 500), ("bumpy-sphere", 400), ("two-components", 400)] {
        let short = |base: Options| base.iterations(30);
        let power = assert_sound(name, &short(Options::rpf(n)));
        let tangent = run(&sample(name).unwrap(), &short(Options::rtf(n)));
        assert_ne!(power.mesh, tangent.mesh, "{name}: shadows do nothing");
        let q = |result: &Remeshed| result.summary.output.quality.mean_quality;
        assert!((q(&power) - q(&tangent)).abs() < 0.03, "{name}: {}, {}", q(&power), q(&tangent));
        assert!(power.summary.flags.hidden < n / 100, "{name}: {:?}", power.summary.flags);
    }
}

#[test]
fn cells_connect_where_fans_have_the_topology_but_fold() {
    let options = Options::rpf(150).iterations(20).seed(2);
    let result = run(&sample("genus3").unwrap(), &options).summary;
    assert_eq!(faults(&result), Vec::<String>::new());
    assert!(result.connected.cells.is_some(), "{:?}", result.connected);
    // 23.7 degrees by the fans.
    assert!(result.output.quality.min_angle > 25.5, "{}", result.output.quality.min_angle);
}

#[test]
fn planes_of_a_cloud_hold_the_sites() {
    for (name, n) in [("torus", 500), ("bumpy-sphere", 400), ("two-components", 400)] {
        let result = assert_sound(name, &Options::rvc(n).iterations(40));
        let output = &result.summary.output;
        assert!(output.quality.mean_quality > 0.83, "{name}: {}", output.quality.mean_quality);
        let distances = output.distances.as_ref().unwrap();
        assert!(distances.hausdorff_to_reference < 3.0, "{name}: {distances:?}");
    }
}

#[test]
fn the_offset_has_a_range() {
    let input = sample("torus").unwrap();
    for offset in [-0.1, 21.0, f64::NAN] {
        let wrong = remesh(device(), &input, &Options::rpf(100).offset(offset));
        assert!(matches!(wrong, Err(Error::Usage { .. })), "{offset}");
    }
}

type Preset = fn(usize) -> Options;

/// The presets warn of the fault, with its place, though nothing is measured for it, and refuse it if asked
/// to.
fn assert_fault(input: &TriMesh, vertices: usize, fault: &str, presets: &[Preset]) {
    for preset in presets {
        let options = preset(vertices).measures(MeasureDepth::Basic);
        let options = options.clone().iterations(options.iterations.min(15));
        let warnings = run(input, &options).summary.warnings;
        let is_said = |text: &String| text.contains(fault) && text.contains("near (");
        assert!(warnings.iter().any(is_said), "{options:?}: {warnings:?}");
        match remesh(device(), input, &options.shortage(Shortage::Refuse)) {
            Err(Error::Input { problem, .. }) => assert!(is_said(&problem), "{problem}"),
            other => panic!("{:?}", other.map(|result| result.summary.warnings)),
        }
    }
}

#[test]
fn presets_find_the_faults_that_the_default_finds() {
    let all: &[Preset] =
        &[Options::rtf, Options::rpf, Options::rvc, Options::rvd, Options::cvd, Options::mps];
    let lost = "components, handles or boundary loops of the surface are lost";
    assert_fault(&sample("genus3").unwrap(), 20, lost, all);
    // So thin that no random point is on it.
    let pin = cube_with_a_pin(1000.0);
    assert_fault(&pin, 400, "a part of the surface is left out", &[Options::rpf, Options::rvd, Options::cvd]);
    // Edges of a ball cut through the ball inside it; beside them two balls run through each other, so that
    // it is not enough to count.
    let ball = |radius| sphere(radius, 4);
    let beside = union(&ball(0.5), &moved(&ball(0.5), |v| v + 0.6 * DVec3::X));
    let shell = union(&ball(1.0), &moved(&ball(0.98), |v| -v));
    let input = union(&shell, &moved(&beside, |v| v + 4.0 * DVec3::X));
    assert_fault(&input, 250, "intersect others", &[Options::rtf, Options::rpf, Options::mps]);
}

#[test]
fn planes_of_a_cloud_stay_on_their_sheet() {
    // Walls closer together than the 16 nearest vertices reach: one plane would fit both.
    for inner in [0.9, 0.85] {
        let shell = union(&sphere(1.0, 4), &moved(&sphere(inner, 4), |v| -v));
        let result = run(&shell, &Options::rvc(600).iterations(40));
        assert_eq!(result.summary.warnings, Vec::<String>::new(), "{inner}");
        let got = &result.summary.output.topology;
        assert_eq!((got.vertices, got.components, got.euler), (600, 2, 4), "{inner}");
    }
    // Beyond the rim a plane goes on, and the surface does not.
    let input = sample("open-hemisphere").unwrap();
    for n in [200, 500] {
        let got = run(&input, &Options::rvc(n).iterations(40)).summary.output.topology;
        assert_eq!((got.vertices, got.components, got.euler, got.boundary_loops), (n, 1, 1, 1));
    }
}
