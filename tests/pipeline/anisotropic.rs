//! Whole runs with edges that are longer one way than the other.

use super::deviation::run;
use glam::DVec3;
use rtfmesh::mesh::distance::distances;
use rtfmesh::mesh::samples::sample;
use rtfmesh::{Error, Length, Options, ProgressToken, Shortage, Sizing, TriMesh, WarningCode};

fn stretched(vertices: usize, aspect: f64) -> Options {
    Options::new(vertices).sizing(Sizing::Anisotropic { aspect, deviation: None })
}

/// A closed cylinder of radius 0.5 and height 4 about the z axis.
fn cylinder() -> TriMesh {
    let around = 96;
    let at = |i: u32, z: f64| {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(around);
        DVec3::new(0.5 * angle.cos(), 0.5 * angle.sin(), z)
    };
    let mut vertices: Vec<DVec3> = [0.0, 4.0].iter().flat_map(|z| (0..around).map(|i| at(i, *z))).collect();
    vertices.extend([DVec3::ZERO, 4.0 * DVec3::Z]);
    let side = |i: u32| {
        let [a, b] = [i, (i + 1) % around];
        let [c, d] = [a, b].map(|v| v + around);
        [[a, b, d], [a, d, c], [b, a, 2 * around], [c, d, 2 * around + 1]]
    };
    TriMesh { vertices, triangles: (0..around).flat_map(side).collect() }
}

fn hausdorff(mesh: &TriMesh, input: &TriMesh) -> f64 {
    distances(mesh, input, &ProgressToken::default()).unwrap().hausdorff
}

#[test]
fn triangles_of_a_cylinder_are_long_along_its_axis() {
    let input = cylinder();
    let result = run(&input, &stretched(400, 8.0));
    assert_eq!(result.mesh.vertices.len(), 400);
    assert_eq!(result.summary.warnings, Vec::<String>::new());
    let metric = result.summary.metric.unwrap();
    assert!(metric.mean_aspect > 2.5 && metric.mean_quality > 0.8 && metric.min_angle > 10.0, "{metric:?}");
    // Edges on its side, by what they span of the height and of the circumference.
    let (mut along, mut around) = (0.0, 0.0);
    for [a, b, c] in &result.mesh.triangles {
        for [v, w] in [[a, b], [b, c], [c, a]] {
            let [p, q] = [v, w].map(|v| result.mesh.vertices[*v as usize]);
            let middle = 0.5 * (p + q);
            if middle.truncate().length() > 0.45 && (0.5..3.5).contains(&middle.z) {
                along += (p.z - q.z).abs();
                around += p.truncate().distance(q.truncate());
            }
        }
    }
    assert!(along > 3.0 * around, "{along} along, {around} around");
    // Even edges are farther away, by several times.
    let even = run(&input, &Options::new(400).sizing(Sizing::Uniform));
    let [stretched, even] = [&result, &even].map(|result| hausdorff(&result.mesh, &input));
    assert!(stretched < 0.5 * even, "{stretched} and {even}");
}

#[test]
fn an_aspect_of_1_makes_even_triangles() {
    let input = sample("genus3").unwrap();
    let result = run(&input, &stretched(1500, 1.0));
    assert_eq!(result.mesh.vertices.len(), 1500);
    let (metric, quality) = (result.summary.metric.unwrap(), result.summary.output.quality);
    assert!((metric.mean_aspect - 1.0).abs() < 1e-9);
    // Both differ by what lengths change over a triangle.
    assert!((metric.mean_quality - quality.mean_quality).abs() < 0.02, "{metric:?} {quality:?}");
    assert!(metric.mean_quality > 0.85 && metric.min_angle > 10.0, "{metric:?}");
    assert!(run(&input, &Options::new(1500)).summary.metric.is_none());
}

#[test]
fn a_largest_deviation_is_kept_with_fewer_vertices() {
    let input = cylinder();
    let most = Length::OfDiagonal(0.002);
    let within = Sizing::Anisotropic { aspect: 20.0, deviation: Some(most) };
    let result = run(&input, &Options::new(0).sizing(within));
    let found = result.summary.deviation.unwrap();
    assert!(found.is_reached && hausdorff(&result.mesh, &input) <= 0.202, "{found:?}");
    let even = run(&input, &Options::new(0).sizing(Sizing::Deviation(most)));
    let [few, many] = [&result, &even].map(|result| result.mesh.vertices.len());
    assert!(10 * few < 7 * many, "{few} and {many}");
    // Vertices are inserted where they may not leave the surface, too.
    let within = Sizing::Anisotropic { aspect: 20.0, deviation: Some(most) };
    let result = run(&input, &Options::new(0).sizing(within).fit(false));
    assert!(result.summary.deviation.unwrap().is_reached);
}

#[test]
fn sharp_edges_give_way_to_the_number_of_vertices() {
    // A box has eight corners.
    let result = run(&sample("box").unwrap(), &stretched(6, 8.0));
    assert_eq!(result.mesh.vertices.len(), 6);
    assert!(result.summary.warning_codes.contains(&WarningCode::SharpEdges), "{:?}", result.summary.warnings);
    assert_eq!(result.summary.features.unwrap().sharp_length, 0.0);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let input = sample("torus").unwrap();
    let made = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&input, &stretched(500, 4.0)).mesh)
    };
    assert_eq!(made(1), made(3));
}

#[test]
fn what_does_not_go_together_is_refused() {
    let of = |options: Options| match options.validate() {
        Err(Error::Usage { problem, field, .. }) => (field.unwrap_or_default().to_owned(), problem),
        other => panic!("{other:?}"),
    };
    for aspect in [0.5, 101.0, f64::NAN] {
        let (field, problem) = of(stretched(100, aspect));
        assert!(field == "sizing" && problem.contains("`aspect`"), "{problem}");
    }
    for (options, name) in [
        (stretched(100, 8.0).points(vec![DVec3::ZERO]), "points"),
        (stretched(100, 8.0).keep(vec![0]), "keep"),
        (stretched(100, 8.0).keep_boundary(true), "keep_boundary"),
        (stretched(100, 8.0).local(true), "local"),
        (stretched(100, 8.0).shortage(Shortage::AddVertices), "shortage"),
    ] {
        let (field, problem) = of(options);
        assert!(field == name && problem.contains("anisotropic"), "{problem}");
    }
}
