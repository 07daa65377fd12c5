//! Whole runs of the default pipeline on the built-in models.

use crate::support::shapes::{globe, moved, prism, regular, sphere, union};
use crate::support::{assert_valid, device};
use glam::DVec3;
use rtfmesh::gpu::{Device, DeviceOptions};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::{Error, MeasureDepth, Options, Remeshed, Sizing, TriMesh, WarningCode, remesh};

fn run(mesh: &TriMesh, options: &Options) -> Remeshed {
    let result = remesh(device(), mesh, options).unwrap();
    assert_valid(device());
    result
}

#[test]
fn closed_models_come_back_with_the_exact_count_and_good_triangles() {
    // Counts that four to the number of levels does not divide.
    for (name, n) in [("torus", 2001), ("bumpy-sphere", 1502), ("genus3", 3003), ("two-components", 1600)] {
        let input = sample(name).unwrap();
        // Folded slivers of the ring model look like creases.
        let feature_angle = if name == "genus3" { 180.0 } else { 40.0 };
        let result = run(&input, &Options::new(n).feature_angle(feature_angle));
        assert_eq!(result.summary.warnings, Vec::<String>::new(), "{name}");
        let (got, want) = (topology(&result.mesh), topology(&input));
        assert!(got.is_closed_manifold(), "{name}: {got:?}");
        assert_eq!((got.vertices, got.components, got.euler), (n, want.components, want.euler), "{name}");
        assert_eq!(result.mesh.vertices.len(), n, "{name}");
        let output = &result.summary.output;
        assert!(
            output.quality.mean_quality > 0.94 && output.quality.min_angle > 33.0,
            "{name}: {:?}",
            output.quality
        );
        assert!(output.valence.fraction_6.unwrap() > 0.85, "{name}: {:?}", output.valence);
        assert_eq!(output.self_intersecting_faces, Some(0), "{name}");
        assert!(output.relative_volume.unwrap() > 0.0, "{name} was turned inside out");
    }
}

#[test]
fn reruns_give_the_same_bytes_and_barriers_do_not_matter() {
    let input = sample("genus3").unwrap();
    let options = Options::new(1300).iterations(8).coarse_iterations(8).first_iterations(10);
    let first = run(&input, &options).mesh;
    assert_eq!(first, run(&input, &options).mesh);
    let careful = Device::open(&DeviceOptions::from_env().full_barriers(true)).unwrap();
    assert_eq!(first, remesh(&careful, &input, &options).unwrap().mesh);
    assert_ne!(first, run(&input, &options.seed(2)).mesh);
}

/// Polish and fit of whole meshes, which a CPU leaves to host code where they are small.
#[test]
fn the_device_polishes_and_fits_as_the_host_does() {
    let open = |options: DeviceOptions| Device::open(&options.validation(true)).unwrap();
    let host = open(DeviceOptions::from_env().polish(false));
    let polishing = open(DeviceOptions::from_env().polish(true).timings(true));
    // With curves, the device fits and the host polishes.
    for (name, n, polishes) in [("torus", 1500, true), ("bumpy-sphere", 1200, true), ("box", 800, false)] {
        let input = sample(name).unwrap();
        let options = Options::new(n).iterations(10).coarse_iterations(10).first_iterations(30);
        let want = remesh(&host, &input, &options).unwrap();
        let got = remesh(&polishing, &input, &options).unwrap();
        let calls = |kernel: &str| {
            let stages = &got.summary.timings.stages;
            stages.iter().filter(|stage| stage.name == kernel).map(|stage| stage.calls).sum::<u64>()
        };
        assert_eq!(calls("polish.relax") > 0, polishes, "{name}");
        assert!(calls("fit.apply") > 0 && calls("intersect.pairs") > 0, "{name}");
        assert_eq!(topology(&got.mesh), topology(&want.mesh), "{name}");
        let [got_quality, want_quality] = [&got, &want].map(|result| &result.summary.output.quality);
        assert!(
            (got_quality.mean_quality - want_quality.mean_quality).abs() < 0.004,
            "{name}: {got_quality:?}"
        );
        assert!(got_quality.min_angle > want_quality.min_angle - 3.0, "{name}: {got_quality:?}");
        let progress = rtfmesh::ProgressToken::default();
        let rms = |result: &Remeshed| {
            let surface = rtfmesh::mesh::distance::distances(&result.mesh, &input, &progress).unwrap();
            surface.rms_to_reference.max(surface.rms_from_reference)
        };
        assert!(rms(&got) < 1.1 * rms(&want) + 1e-4, "{name}: {} for {}", rms(&got), rms(&want));
        assert_eq!(got.mesh, remesh(&polishing, &input, &options).unwrap().mesh, "{name}, once more");
    }
    // Nothing to do is no fault.
    let unpolished = Options::new(400).iterations(4).polish_rounds(0);
    assert_eq!(remesh(&polishing, &sample("torus").unwrap(), &unpolished).unwrap().mesh.vertices.len(), 400);
    assert_valid(&host);
    assert_valid(&polishing);
    // Faces that intersect others, as in the input.
    let mut crossing = sample("sphere").unwrap();
    let (first, far) = (crossing.vertices.len() as u32, 0.7 * crossing.vertices[0].length());
    crossing.vertices.extend(crossing.vertices.clone().into_iter().map(|p| p + far * DVec3::X));
    crossing.triangles.extend(crossing.triangles.clone().into_iter().map(|t| t.map(|v| v + first)));
    let got = remesh(&polishing, &crossing, &Options::new(800)).unwrap();
    let progress = rtfmesh::ProgressToken::default();
    let faces = rtfmesh::mesh::intersections::intersecting_faces(&got.mesh, &progress).unwrap();
    assert!(faces.len() > 20);
    assert_eq!(got.summary.output.self_intersecting_faces, Some(faces.len()));
    // A mesh that does not fit into its buffers is left to the host.
    let input = sample("torus").unwrap();
    let small = open(DeviceOptions::from_env().polish(true).buffer_bytes(60_000));
    let options = Options::new(3000).iterations(5).coarse_iterations(5).first_iterations(5);
    let want = remesh(&host, &input, &options).unwrap();
    assert_eq!(remesh(&small, &input, &options).unwrap().mesh, want.mesh);
    assert_valid(&small);
}

/// As for millions of vertices on a device whose buffers are no larger than they must be.
#[test]
fn lists_in_several_buffers_give_the_same_bytes() {
    // Their own devices, since calls are counted for each. The host polishes, since a mesh does not fit into
    // the small buffers.
    let open = |options: DeviceOptions| Device::open(&options.validation(true).polish(false)).unwrap();
    let large = open(DeviceOptions::from_env());
    let options = Options::new(3600).iterations(12).coarse_iterations(8).first_iterations(10);
    let graded = options.clone().sizing(Sizing::Curvature { gradation: 1.0 });
    // A list takes 80 bytes, so that there are five blocks of them or more at last. A position takes 16 bytes
    // with marks of curves, and 12 where there are none and 16 are too many.
    for (name, options, bytes) in
        [("torus", &options, 56_000), ("torus", &graded, 56_000), ("box", &graded, 58_000)]
    {
        let small = open(DeviceOptions::from_env().buffer_bytes(bytes));
        assert_eq!(small.info().limits.storage_buffer_bytes, bytes);
        let input = sample(name).unwrap();
        let result = remesh(&small, &input, options).unwrap();
        assert_valid(&small);
        let whole = remesh(&large, &input, options).unwrap();
        assert_eq!(result.mesh, whole.mesh, "{name}");
        assert_eq!(result.summary.flags, whole.summary.flags, "{name}");
        assert_eq!(result.summary.steps, whole.summary.steps, "{name}");
        let calls = |run: &Remeshed| {
            let stages = &run.summary.timings.stages;
            stages.iter().find(|stage| stage.name == "face.planar").unwrap().calls
        };
        assert!(calls(&result) > 2 * calls(&whole), "{name}");
    }
    let small = open(DeviceOptions::from_env().buffer_bytes(36_000));
    for (name, most) in [("torus", 3000), ("box", 2250)] {
        let options = Options::new(most + 1);
        let error = remesh(&small, &sample(name).unwrap(), &options).unwrap_err().to_string();
        assert!(error.contains("36000") && error.contains(&format!("at most {most}")), "{error}");
        assert!(small.peak_bytes() < 30_000, "{name}: it began");
    }
}

/// As for millions of vertices on a GPU whose system does not wait for long.
#[test]
fn divided_dispatches_give_the_same_bytes() {
    let open = |options: DeviceOptions| Device::open(&options.validation(true).polish(true)).unwrap();
    let whole = open(DeviceOptions::from_env());
    let divided = open(DeviceOptions::from_env().dispatch_threads(700));
    let options = Options::new(2500).iterations(12).coarse_iterations(8).first_iterations(10);
    let few = |preset: fn(usize) -> Options| preset(800).iterations(3);
    for (name, options) in [
        ("genus3", options.clone()),
        ("box", options.sizing(Sizing::Curvature { gradation: 1.0 })),
        ("torus", few(Options::rtf)),
        ("torus", few(Options::rpf)),
        ("torus", few(Options::cvd)),
    ] {
        let input = sample(name).unwrap();
        let result = remesh(&divided, &input, &options).unwrap();
        assert_valid(&divided);
        let expected = remesh(&whole, &input, &options).unwrap();
        assert_eq!(result.mesh, expected.mesh, "{name}");
        let lists = |run: &Remeshed| {
            let stages = &run.summary.timings.stages;
            stages.iter().find(|stage| stage.name == "neighbours.lists").map(|stage| stage.calls)
        };
        // The presets, which have tori here, need the lists of a run in one buffer.
        assert!(name == "torus" || lists(&result) > lists(&expected), "{name}");
    }
}

#[test]
fn an_inside_out_model_stays_inside_out() {
    let mut input = sample("torus").unwrap();
    input.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    assert!(run(&input, &Options::new(700)).summary.output.relative_volume.unwrap() < 0.0);
}

#[test]
fn place_and_scale_do_not_matter() {
    let input = sample("torus").unwrap();
    for (scale, shift) in [(1e30, 0.0), (1e-30, 0.0), (1.0, 1e6)] {
        let mut moved = input.clone();
        moved.vertices.iter_mut().for_each(|v| *v = *v * scale + glam::DVec3::splat(shift));
        let result = run(&moved, &Options::new(800));
        assert_eq!(result.summary.warnings, Vec::<String>::new(), "{scale} {shift}");
        assert!(result.summary.output.distances.unwrap().hausdorff < 2.0, "{scale} {shift}");
    }
}

#[test]
fn fitting_brings_the_faces_closer_and_without_it_vertices_stay_on_the_surface() {
    let input = sample("bumpy-sphere").unwrap();
    let fitted = run(&input, &Options::new(900)).summary.output.distances.unwrap();
    let plain = run(&input, &Options::new(900).fit(false));
    assert!(fitted.rms < 0.8 * plain.summary.output.distances.unwrap().rms);
    are_on(&plain.mesh, &input);
}

#[test]
fn without_fitting_vertices_between_creases_stay_on_the_surface() {
    // Its rims are curves, the edges along it are ridges between them.
    let tube = prism(&regular(16), 1.5);
    let plain = run(&tube, &Options::new(900).fit(false));
    assert_eq!(plain.summary.features.unwrap().curves, 2);
    are_on(&plain.mesh, &tube);
}

fn are_on(mesh: &TriMesh, surface: &TriMesh) {
    let surface = rtfmesh::mesh::bvh::Bvh::new(surface);
    for v in &mesh.vertices {
        assert!(surface.closest(*v).unwrap().distance_sq.sqrt() < 1e-6, "{v} is off the surface");
    }
}

#[test]
fn few_sites_open_and_dirty_surfaces_do_not_crash() {
    let mut torn = sample("torus").unwrap();
    torn.triangles.truncate(2500);
    torn.triangles.push([0, 1, 900]);
    assert_eq!(run(&torn, &Options::new(400)).mesh.vertices.len(), 400);
    for name in ["tetrahedron", "box", "thin-plate", "sphere"] {
        for n in [4, 5, 17, 64] {
            match remesh(device(), &sample(name).unwrap(), &Options::new(n)) {
                Ok(result) => assert_eq!(result.mesh.vertices.len(), n),
                Err(error) => assert!(error.to_string().contains("ask for "), "{error}"),
            }
            assert_valid(device());
        }
    }
}

#[test]
fn no_iterations_and_loose_tolerances() {
    let input = sample("torus").unwrap();
    let still = Options::new(700).iterations(0).coarse_iterations(0).first_iterations(0).polish_rounds(0);
    let result = run(&input, &still);
    assert_eq!((result.summary.iterations, result.summary.converged), (0, false));
    let loose = run(&input, &Options::new(700).tolerance(0.2));
    assert!(loose.summary.converged);
}

#[test]
fn more_sites_than_memory_are_refused_before_anything_is_made() {
    let options = Options::new(500_000_000);
    let error = remesh(device(), &sample("box").unwrap(), &options).err().unwrap();
    assert!(matches!(&error, Error::OutOfMemory { remedy, .. } if remedy.contains("at most")), "{error}");
}

#[test]
fn a_small_part_that_a_coarse_one_cuts_is_told_however_little_is_measured() {
    // Bubbles just below the surface of a ball, which has too few vertices to stay above them.
    let bubble = |at: DVec3| moved(&sphere(0.08, 3), |p| 0.915 * at + DVec3::new(-p.x, p.y, p.z));
    let places = globe(5, 4).vertices;
    let mesh = places.into_iter().fold(sphere(1.0, 6), |mesh, at| union(&mesh, &bubble(at)));
    let mut cut = 0;
    for vertices in [230, 245, 260] {
        let summary = run(&mesh, &Options::new(vertices).measures(MeasureDepth::Basic)).summary;
        let crossing = summary.output.self_intersecting_faces.unwrap();
        let expected = format!("{crossing} self-intersecting faces (the input has none)");
        let is_told = summary.warnings.iter().any(|text| text.starts_with(&expected));
        // Which of them are cut depends on the device.
        assert_eq!(is_told, crossing > 0, "{:?}", summary.warnings);
        assert_eq!(summary.warning_codes.contains(&WarningCode::Intersections), is_told);
        assert_eq!(summary.input_self_intersecting_faces, is_told.then_some(0));
        cut += crossing;
    }
    assert!(cut > 0);
}
