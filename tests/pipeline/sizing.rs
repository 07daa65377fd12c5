//! Whole runs with edge lengths that vary over the surface.

use crate::support::{assert_valid, device, faults};
use glam::DVec3;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::options::Centroid;
use rtfmesh::{Error, Length, Options, Refinement, Region, Remeshed, Sizing, TriMesh, preview, remesh};

fn run(mesh: &TriMesh, options: &Options) -> Remeshed {
    let result = remesh(device(), mesh, options).unwrap();
    assert_valid(device());
    assert_eq!(faults(&result.summary), Vec::<String>::new());
    let (got, want) = (topology(&result.mesh), topology(mesh));
    assert_eq!(got.vertices, options.vertices);
    assert_eq!(
        (got.components, got.euler, got.boundary_loops),
        (want.components, want.euler, want.boundary_loops)
    );
    assert_eq!(result.summary.output.self_intersecting_faces, Some(0));
    result
}

/// Every edge once: its middle and its length.
fn edges(mesh: &TriMesh) -> Vec<(DVec3, f64)> {
    let mut pairs: Vec<[u32; 2]> = (mesh.triangles.iter())
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    let ends = pairs.into_iter().map(|pair| pair.map(|v| mesh.vertices[v as usize]));
    ends.map(|[a, b]| (0.5 * (a + b), a.distance(b))).collect()
}

/// Means of the edges' lengths over what `wished` says, over the mean of all, in parts of the mesh by that
/// wish.
fn shares(mesh: &TriMesh, wished: impl Fn(DVec3) -> f64, parts: usize) -> Vec<f64> {
    let mut list: Vec<(f64, f64)> =
        edges(mesh).into_iter().map(|(at, length)| (wished(at), length / wished(at))).collect();
    list.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mean = |part: &[(f64, f64)]| part.iter().map(|(_, share)| share).sum::<f64>() / part.len() as f64;
    let all = mean(&list);
    list.chunks(list.len().div_ceil(parts)).map(|part| mean(part) / all).collect()
}

#[test]
fn edges_are_as_long_as_requested() {
    let input = sample("torus").unwrap();
    // Four times longer on one side than on the other.
    let wished = |p: DVec3| 2.5 + 1.5 * (p.x / 1.3).clamp(-1.0, 1.0);
    let sizing = Sizing::Given(input.vertices.iter().map(|p| wished(*p)).collect());
    let result = run(&input, &Options::new(3000).sizing(sizing).growth(1.0));
    let quality = &result.summary.output.quality;
    assert!(quality.mean_quality > 0.93 && quality.min_angle > 33.0, "{quality:?}");
    let shares = shares(&result.mesh, wished, 6);
    assert!(shares.iter().all(|share| (share - 1.0).abs() < 0.08), "{shares:?}");
}

#[test]
fn regions_have_edges_of_their_length_and_the_rest_gets_the_other_vertices() {
    // A box of twelve triangles, which are larger than the regions.
    let input = sample("box").unwrap();
    let length = Length::Units(0.015);
    let sphere = Region::Sphere { centre: DVec3::new(0.3, 0.6, 1.0), radius: 0.15 };
    let corner = Region::Box { low: DVec3::splat(-0.1), high: DVec3::splat(0.2) };
    let refine = [(sphere, length), (corner, Length::OfDiagonal(0.03 / 3f64.sqrt()))];
    let refine = refine.map(|(region, length)| Refinement { region, length });
    let result = run(&input, &Options::new(3000).refine(refine.to_vec()));
    let quality = &result.summary.output.quality;
    assert!(quality.mean_quality > 0.93 && quality.min_angle > 30.0, "{quality:?}");
    let all = edges(&result.mesh);
    let mean = |is_in: &dyn Fn(DVec3) -> bool| {
        let list: Vec<f64> = all.iter().filter(|(at, _)| is_in(*at)).map(|(_, length)| *length).collect();
        list.iter().sum::<f64>() / list.len() as f64
    };
    let in_sphere = mean(&|p| p.distance(DVec3::new(0.3, 0.6, 1.0)) < 0.14);
    assert!((in_sphere / 0.015 - 1.0).abs() < 0.1, "{in_sphere}");
    let in_corner = mean(&|p| p.max_element() < 0.19);
    assert!((in_corner / 0.03 - 1.0).abs() < 0.1, "{in_corner}");
    // A quarter more for each unit of distance, and no more.
    let around = mean(&|p| (0.34..0.36).contains(&p.distance(DVec3::new(0.3, 0.6, 1.0))) && p.z > 0.999);
    assert!((0.03..0.075).contains(&around), "{around}");
    assert_eq!((result.summary.input.vertices, result.summary.input.faces), (8, 12));
}

#[test]
fn lengths_of_regions_for_another_number_of_vertices_are_refused() {
    let input = sample("torus").unwrap();
    let all = Region::Box { low: DVec3::splat(-9.0), high: DVec3::splat(9.0) };
    let refine = |units: f64| vec![Refinement { region: all.clone(), length: Length::Units(units) }];
    for (units, words) in [(0.06, "alone need about"), (0.3, "leave room for about"), (1e-7, "far more")] {
        let refused = preview(&input, &Options::new(3000).refine(refine(units)));
        let Err(Error::Usage { problem, field, .. }) = refused else { panic!("{units}: {refused:?}") };
        assert!(problem.contains(words) && field == Some("refine"), "{problem}");
    }
    let empty = Region::Sphere { centre: DVec3::ZERO, radius: 0.0 };
    let length = Length::Units(1.0);
    for bad in [
        Options::new(300).refine(refine(0.0)),
        Options::new(300).refine(vec![Refinement { region: empty, length }]),
        Options::new(300).refine(refine(0.1)).sizing(Sizing::Deviation(length)),
    ] {
        assert!(matches!(bad.validate(), Err(Error::Usage { field: Some("refine"), .. })), "{bad:?}");
    }
}

#[test]
fn sharp_edges_follow() {
    let input = sample("box").unwrap();
    let wished = |p: DVec3| 1.0 + 2.0 * p.z;
    let sizing = Sizing::Given(input.vertices.iter().map(|p| wished(*p)).collect());
    let result = run(&input, &Options::new(2500).sizing(sizing).growth(1.0));
    let features = result.summary.features.unwrap();
    assert_eq!((features.curves, features.corners), (12, 8));
    let shares = shares(&result.mesh, wished, 6);
    assert!(shares.iter().all(|share| (share - 1.0).abs() < 0.1), "{shares:?}");
    let on_edge = |v: &&DVec3| v.x.abs() < 1e-9 && v.y.abs() < 1e-9;
    let mut heights: Vec<f64> = result.mesh.vertices.iter().filter(on_edge).map(|v| v.z).collect();
    heights.sort_by(f64::total_cmp);
    let gaps: Vec<f64> = heights.windows(2).map(|pair| pair[1] - pair[0]).collect();
    // A third of the vertices at either end: edges are 1.2 there, and 2.4.
    let mean = |gaps: &[f64]| gaps.iter().sum::<f64>() / gaps.len() as f64;
    let third = gaps.len() / 3;
    let ratio = mean(&gaps[gaps.len() - third..]) / mean(&gaps[..third]);
    assert!((1.7..2.9).contains(&ratio), "{gaps:?}");
}

#[test]
fn curvature_brings_the_faces_closer_to_the_surface() {
    // An egg five times as long as it is thick.
    let mut input = sample("sphere").unwrap();
    input.vertices.iter_mut().for_each(|p| *p *= DVec3::new(1.0, 0.2, 0.2));
    let uniform = Options::new(1000).feature_angle(180.0);
    let distances = |options: &Options| {
        let output = run(&input, options).summary.output;
        assert!(output.quality.min_angle > 20.0, "{:?}", output.quality);
        output.distances.unwrap()
    };
    let by_curvature = uniform.clone().sizing(Sizing::Curvature { gradation: 1.0 });
    let (plain, better) = (distances(&uniform), distances(&by_curvature));
    assert!(better.hausdorff < 0.6 * plain.hausdorff && better.rms < plain.rms, "{better:?} and {plain:?}");
}

#[test]
fn lengths_keep_to_bounds() {
    let input = sample("sphere").unwrap();
    // All wish to be near one pole.
    let wished = |p: DVec3| if p.z > 0.8 { 0.01 } else { 1.0 };
    let sizing = Sizing::Given(input.vertices.iter().map(|p| wished(*p)).collect());
    let free = Options::new(1000).sizing(sizing).growth(0.5);
    // Means where edges are short, and on the other side.
    let lengths = |result: &Remeshed| {
        let all = edges(&result.mesh);
        let mean = |wanted: &dyn Fn(f64) -> bool| {
            let list: Vec<f64> =
                all.iter().filter(|(at, _)| wanted(at.z)).map(|(_, length)| *length).collect();
            list.iter().sum::<f64>() / list.len() as f64
        };
        [mean(&|z| z > 0.85), mean(&|z| z < 0.0)]
    };
    let free_run = run(&input, &free);
    let spacing = free_run.summary.spacing;
    let [low, high] = lengths(&free_run);
    assert!(low < 0.4 * spacing && high > 1.5 * spacing, "{low} {high} {spacing}");
    let (least, largest) = (0.7 * spacing, 1.25 * spacing);
    let (min_edge, max_edge) = (Some(Length::Units(least)), Some(Length::OfDiagonal(largest / 12f64.sqrt())));
    let bounded = free.min_edge(min_edge).max_edge(max_edge);
    let bounded = run(&input, &bounded);
    let [low, high] = lengths(&bounded);
    assert!(
        (0.9..1.2).contains(&(low / least)) && (0.8..1.05).contains(&(high / largest)),
        "{low} {high} {spacing}"
    );
    let wanted = bounded.summary.edge_lengths.unwrap();
    assert!(wanted[0] > 0.95 * least && wanted[1] < 1.05 * largest, "{wanted:?}");
}

#[test]
fn equal_sizes_and_reruns_give_the_same_mesh() {
    let input = sample("bumpy-sphere").unwrap();
    let sizing = Sizing::Curvature { gradation: 2.0 };
    let options = Options::new(900).sizing(sizing).iterations(8);
    assert_eq!(run(&input, &options).mesh, run(&input, &options).mesh);
    // Numbers that are all the same say nothing.
    let sizing = Sizing::Given(vec![3.0; input.vertices.len()]);
    let quality = run(&input, &Options::new(900).sizing(sizing)).summary.output.quality;
    assert!(quality.mean_quality > 0.94, "{quality:?}");
}

#[test]
fn what_cannot_be_is_refused() {
    let input = sample("box").unwrap();
    let count = input.vertices.len();
    let given = |values: Vec<f64>| Options::new(300).sizing(Sizing::Given(values));
    let with = |v: usize, value: f64| {
        let mut values = vec![1.0; count];
        values[v] = value;
        given(values)
    };
    let curvature = |gradation: f64| Options::new(300).sizing(Sizing::Curvature { gradation });
    let bounded = |length: Length| curvature(1.0).max_edge(Some(length));
    let crossed = bounded(Length::OfDiagonal(0.02)).min_edge(Some(Length::OfDiagonal(0.05)));
    for (options, words) in [
        (crossed, "is more than `max_edge`"),
        (given(vec![1.0; count - 1]), "7 edge lengths for 8 vertices"),
        (with(3, 0.0), "vertex 3"),
        (with(5, f64::NAN), "vertex 5"),
        (with(7, f64::INFINITY), "vertex 7"),
        (curvature(-1.0), "`gradation`"),
        (curvature(f64::NAN), "`gradation`"),
        (bounded(Length::Units(0.001)), "`max_edge` 0.0010 is less than"),
        (bounded(Length::Units(-1.0)), "`max_edge`"),
        (curvature(1.0).growth(0.0), "`growth`"),
        (Options::rvd(300).sizing(Sizing::Curvature { gradation: 1.0 }), "another method"),
    ] {
        let error = remesh(device(), &input, &options).unwrap_err();
        assert!(matches!(error, Error::Usage { .. } | Error::Input { .. }), "{error:?}");
        assert!(error.to_string().contains(words), "{error}");
    }
}

#[test]
fn weighted_tangent_faces_follow_lengths_from_one_to_four() {
    let mesh = sample("sphere").unwrap();
    let wished = |p: DVec3| 2.5 + 1.5 * p.z / mesh.vertices[0].length();
    let given: Vec<f64> = mesh.vertices.iter().map(|p| wished(*p)).collect();
    let options = Options::rtf(800).iterations(40).centroid(Centroid::Area).growth(1.0);
    let result = run(&mesh, &options.sizing(Sizing::Given(given)));
    let (lengths, wishes): (Vec<f64>, Vec<f64>) =
        edges(&result.mesh).into_iter().map(|(middle, length)| (length, wished(middle))).unzip();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (l, w) = (mean(&lengths), mean(&wishes));
    let product = |a: &[f64], m: f64, b: &[f64], n: f64| -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - m) * (b - n)).sum()
    };
    let both = product(&lengths, l, &wishes, w);
    let correlation = both / (product(&lengths, l, &lengths, l) * product(&wishes, w, &wishes, w)).sqrt();
    assert!(correlation > 0.95, "{correlation}");
    assert!(result.summary.output.quality.mean_quality > 0.87, "{:?}", result.summary.output.quality);
}
