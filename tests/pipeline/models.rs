//! Whole runs on the built-in models.

use crate::support::shapes::{cube, moved, prism, regular, union};
use crate::support::{assert_valid, device, faults};
use rtfmesh::glam::DVec3;
use rtfmesh::gpu::{Device, DeviceOptions};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::options::Centroid;
use rtfmesh::{Error, Options, Remeshed, TriMesh, remesh};

fn short(vertices: usize) -> Options {
    Options::rtf(vertices).iterations(30)
}

fn run(mesh: &TriMesh, options: &Options) -> Remeshed {
    let result = remesh(device(), mesh, options).unwrap();
    assert_valid(device());
    result
}

/// The run has no warnings, and the result is a closed manifold with the input's topology, the exact count,
/// triangles of at least this mean quality, which is returned, and angles of at least so many degrees.
fn assert_sound(name: &str, options: &Options, least_quality: f64, least_angle: f64) -> f64 {
    let input = sample(name).unwrap();
    let result = run(&input, options);
    let summary = &result.summary;
    assert_eq!(faults(summary), Vec::<String>::new(), "{name}");
    let (got, want) = (topology(&result.mesh), topology(&input));
    assert!(got.is_closed_manifold(), "{name}: {got:?}");
    assert_eq!(result.mesh.vertices.len(), options.vertices, "{name}");
    assert_eq!(
        (got.vertices, got.components, got.euler),
        (options.vertices, want.components, want.euler),
        "{name}"
    );
    let quality = &summary.output.quality;
    assert!(quality.mean_quality > least_quality && quality.min_angle > least_angle, "{name}: {quality:?}");
    assert!(summary.output.relative_volume.unwrap() > 0.0, "{name} was turned inside out");
    quality.mean_quality
}

#[test]
fn closed_models_keep_their_topology_and_get_the_exact_count() {
    // Genus 3 needs enough sites for its thin parts.
    for (name, n) in [("torus", 500), ("bumpy-sphere", 400), ("genus3", 1500), ("two-components", 400)] {
        assert_sound(name, &Options::rtf(n).iterations(40).centroid(Centroid::Area), 0.88, 25.0);
    }
}

#[test]
fn the_paper_s_preset_as_it_is_and_with_eq_7_as_it_is_written() {
    let by_corners = |n| Options::rtf(n).centroid(Centroid::Corners);
    assert_eq!(Options::rtf(70).all_at_once.centroid, Centroid::WeightedCorners);
    assert_sound("bumpy-sphere", &Options::rtf(400), 0.89, 30.0);
    let weighted = assert_sound("torus", &Options::rtf(400), 0.89, 28.0);
    // Corners that are close together count twice, which costs quality.
    assert!(assert_sound("torus", &by_corners(400), 0.85, 20.0) < weighted - 0.01);
}

#[test]
fn an_inside_out_model_stays_inside_out() {
    let mut input = sample("torus").unwrap();
    input.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let result = run(&input, &short(800).centroid(Centroid::Area));
    assert!(result.summary.output.relative_volume.unwrap() < 0.0);
}

#[test]
fn reruns_give_the_same_bytes_and_seeds_do_not() {
    let input = sample("torus").unwrap();
    let first = run(&input, &short(500));
    assert_eq!(first.mesh, run(&input, &short(500)).mesh);
    assert_ne!(first.mesh, run(&input, &short(500).seed(2)).mesh);
}

#[test]
fn full_barriers_change_nothing() {
    let input = sample("torus").unwrap();
    let careful = Device::open(&DeviceOptions::from_env().full_barriers(true)).unwrap();
    let want = remesh(&careful, &input, &short(400)).unwrap().mesh;
    assert_eq!(run(&input, &short(400)).mesh, want);
}

#[test]
fn place_and_scale_do_not_matter() {
    let input = sample("torus").unwrap();
    let plain = run(&input, &short(400)).summary.output;
    for (scale, shift) in [(1e30, 0.0), (1e-30, 0.0), (1.0, 1e6)] {
        let mut moved = input.clone();
        moved.vertices.iter_mut().for_each(|v| *v = *v * scale + glam::DVec3::splat(shift));
        let result = run(&moved, &short(400));
        let got = &result.summary.output;
        assert_eq!(got.topology, plain.topology, "{scale} {shift}");
        assert!((got.quality.mean_quality - plain.quality.mean_quality).abs() < 0.02, "{scale} {shift}");
        assert!(got.distances.unwrap().hausdorff < 3.0, "{scale} {shift}");
    }
}

#[test]
fn open_and_dirty_surfaces_end_with_a_word_about_it() {
    let mut torn = sample("torus").unwrap();
    torn.triangles.truncate(2500);
    torn.triangles.push([0, 1, 900]);
    for mesh in [sample("open-hemisphere").unwrap(), torn] {
        let result = run(&mesh, &short(300));
        assert!(
            result.summary.warnings.iter().any(|w| w.contains("closed")),
            "{:?}",
            result.summary.warnings
        );
    }
}

#[test]
fn few_sites_do_not_crash() {
    for name in ["tetrahedron", "box", "thin-plate"] {
        for n in [4, 5, 17] {
            match remesh(device(), &sample(name).unwrap(), &short(n)) {
                Ok(result) => assert_eq!(result.mesh.vertices.len(), n),
                Err(error) => assert!(error.to_string().contains("ask for more vertices"), "{error}"),
            }
            assert_valid(device());
        }
    }
}

#[test]
fn zero_iterations_connect_the_seeds() {
    let result = run(&sample("torus").unwrap(), &Options::rtf(300).iterations(0));
    assert_eq!((result.summary.iterations, result.summary.converged), (0, false));
    assert_eq!(result.mesh.vertices.len(), 300);
}

#[test]
fn a_loose_tolerance_ends_the_run_early() {
    let result = run(&sample("torus").unwrap(), &Options::rtf(300).tolerance(0.1));
    assert!(result.summary.converged && result.summary.iterations < 160, "{}", result.summary.iterations);
    assert!(result.summary.steps.last().is_some_and(|s| *s < 0.1));
}

#[test]
fn options_out_of_range_are_named() {
    let wrong = [
        (Options::rtf(3), "3 vertices"),
        (Options::rtf(100).k_normal(2), "`k_normal` 2"),
        (Options::rtf(100).k_clip(49), "`k_clip` 49"),
        (Options::rtf(100).k_project(0), "`k_project` 0"),
        (Options::rtf(100).tolerance(f64::NAN), "`tolerance`"),
    ];
    for (options, what) in wrong {
        let error = remesh(device(), &sample("box").unwrap(), &options).err().unwrap();
        assert!(matches!(&error, Error::Usage { problem, .. } if problem.contains(what)), "{error}");
    }
}

#[test]
fn more_sites_than_memory_are_refused_before_anything_is_made() {
    let error = remesh(device(), &sample("box").unwrap(), &Options::rtf(500_000_000)).err().unwrap();
    assert!(matches!(&error, Error::OutOfMemory { remedy, .. } if remedy.contains("at most")), "{error}");
}

#[test]
fn the_summary_tells_where_the_time_went() {
    // A device of its own: others count their dispatches on the shared one.
    let open = |timings| Device::open(&DeviceOptions::from_env().timings(timings)).unwrap();
    let device = open(true);
    let options = Options::rtf(200).iterations(7);
    let run = |device| remesh(device, &sample("torus").unwrap(), &options).unwrap();
    let result = run(&device);
    let calls = |name: &str| result.summary.timings.stages.iter().find(|s| s.name == name).map(|s| s.calls);
    assert_eq!(calls("step.step"), Some(7));
    assert_eq!(calls("face.cell"), Some(8), "once more for the connection");
    assert_eq!(calls("neighbours.knn"), Some(15));
    let has_clock = device.info().limits.timestamp_ns > 0.0;
    let timed = |s: &rtfmesh::gpu::StageTime| s.milliseconds.is_some_and(|ms| ms >= 0.0) == has_clock;
    assert!(result.summary.timings.stages.iter().all(timed));
    let untimed = run(&open(false));
    assert_eq!(untimed.mesh, result.mesh);
    // How many copies there are depends on the length of submissions, which is measured.
    let stages = |of: &Remeshed| -> Vec<_> {
        let kernels = of.summary.timings.stages.iter().filter(|s| !s.name.starts_with("copy."));
        kernels.map(|s| (s.name.clone(), s.calls)).collect()
    };
    assert_eq!(stages(&untimed), stages(&result));
    assert!(untimed.summary.timings.stages.iter().all(|s| s.milliseconds.is_none()), "nobody asked");
    assert!(result.summary.timings.peak_device_bytes > 0);
    assert_eq!(result.summary.steps.len(), 7);
}

#[test]
fn a_thin_pin_beside_a_large_part_has_no_needles() {
    let block = moved(&cube(), |p| 30.0 * p);
    let outline: Vec<[f64; 2]> = regular(48).into_iter().map(|p| p.map(|x| 0.5 * x)).collect();
    let pin = prism(&outline, 10.0);
    let input = union(&block, &moved(&pin, |p| p - 20.0 * DVec3::X));
    for vertices in [500, 1500] {
        let result = run(&input, &Options::new(vertices));
        let quality = &result.summary.output.quality;
        assert_eq!(result.mesh.vertices.len(), vertices);
        // 16 and 17 degrees if what counts as sharp on the pin depends on the edges of the block.
        assert!(quality.min_angle > 30.0, "{vertices}: {quality:?}");
    }
}
