//! Whole runs in which triangles of the input stay as they are.

use crate::support::shapes::{plane, sphere};
use crate::support::{assert_valid, device, faults};
use glam::DVec3;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::{
    CorrespondenceRequest, Error, FeatureLines, Length, Options, Refinement, Region, Remeshed, Shortage,
    TriMesh, WarningCode, preview, remesh,
};
use std::collections::HashSet;

fn bits(p: DVec3) -> [u64; 3] {
    p.to_array().map(f64::to_bits)
}

/// The corners of a triangle by their bits, from the least on.
fn corners(mesh: &TriMesh, t: usize) -> [[u64; 3]; 3] {
    let [a, b, c] = mesh.corners(t).map(bits);
    [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap()
}

/// The triangles with centres that are `wanted`.
fn select(mesh: &TriMesh, wanted: impl Fn(DVec3) -> bool) -> Vec<u32> {
    let centre = |t: &u32| mesh.corners(*t as usize).into_iter().sum::<DVec3>() / 3.0;
    (0..mesh.triangles.len() as u32).filter(|t| wanted(centre(t))).collect()
}

/// A run that keeps these triangles, checked: they are there, the rest joins them, and nothing crosses.
fn run(mesh: &TriMesh, keep: &[u32], options: &Options) -> Remeshed {
    let options = options.clone().keep(keep.to_vec());
    let result = remesh(device(), mesh, &options).unwrap();
    assert_valid(device());
    let there: HashSet<_> = (0..result.mesh.triangles.len()).map(|t| corners(&result.mesh, t)).collect();
    assert!(keep.iter().all(|t| there.contains(&corners(mesh, *t as usize))));
    let (got, want) = (topology(&result.mesh), topology(mesh));
    assert_eq!(
        (got.components, got.euler, got.boundary_loops, got.nonmanifold_vertices, got.duplicate_faces),
        (want.components, want.euler, want.boundary_loops, want.nonmanifold_vertices, 0)
    );
    assert_eq!((got.nonmanifold_edges > 0, got.genus), (want.nonmanifold_edges > 0, want.genus));
    assert!(got.inconsistent_edges <= got.nonmanifold_edges);
    assert_eq!(result.summary.output.self_intersecting_faces, Some(0));
    assert_eq!(result.summary.input, want);
    assert!(result.summary.remarks.iter().any(|text| text.contains("kept as they are")));
    result
}

#[test]
fn a_third_stays_and_the_rest_joins_it() {
    for (name, wanted) in [
        ("bumpy-sphere", (|p| p.x < -0.3) as fn(DVec3) -> bool),
        // Several parts, and a part with a hole.
        ("torus", |p: DVec3| p.x.abs() > 0.6),
        ("open-hemisphere", |p: DVec3| p.x < -0.2),
    ] {
        let mesh = sample(name).unwrap();
        let keep = select(&mesh, wanted);
        let own: HashSet<u32> = keep.iter().flat_map(|t| mesh.triangles[*t as usize]).collect();
        let count = own.len() + 1500;
        let options = Options::new(count).correspondence(CorrespondenceRequest::ALL);
        let result = run(&mesh, &keep, &options);
        assert_eq!(result.mesh.vertices.len(), count, "{name}");
        assert_eq!(faults(&result.summary), Vec::<String>::new(), "{name}");
        // Where kept triangles lie is known exactly.
        let on = result.correspondence.unwrap();
        let first = result.mesh.triangles.len() - keep.len();
        for (t, origin) in (first..).zip(&keep) {
            assert_eq!(on.faces[t].triangle, *origin);
            for v in result.mesh.triangles[t] {
                let place = on.vertices[v as usize].position(&mesh);
                assert!(place.distance(result.mesh.vertices[v as usize]) < 1e-15);
            }
        }
        let plan = preview(&mesh, &options.keep(keep.clone())).unwrap();
        let kept = plan.kept.unwrap();
        assert!((kept.triangles, kept.vertices) == (keep.len(), own.len()) && kept.joining_edges > 9);
        assert_eq!((plan.vertices, plan.input), (count, [mesh.vertices.len(), mesh.triangles.len()]));
    }
}

#[test]
fn bodies_that_share_a_wall_keep_it() {
    let mesh = bodies();
    assert!(topology(&mesh).nonmanifold_edges > 0);
    // Across all three sheets, and one of them alone.
    for wanted in [(|p| p.y < 0.4) as fn(DVec3) -> bool, |p| p.x < 0.99] {
        let result = run(&mesh, &select(&mesh, wanted), &Options::new(1500));
        assert_eq!(result.mesh.vertices.len(), 1500);
        assert!(result.summary.output.quality.min_angle > 20.0);
    }
}

/// Two cubes of triangles, side by side, with one wall between them.
fn bodies() -> TriMesh {
    let n = 10;
    let mut places = std::collections::BTreeMap::new();
    let mut mesh = TriMesh::default();
    let mut square = |corners: [[i32; 3]; 4]| {
        let [a, b, c, d] = corners.map(|at| {
            *places.entry(at).or_insert_with(|| {
                mesh.vertices.push(DVec3::from(at.map(f64::from)) / f64::from(n));
                mesh.vertices.len() as u32 - 1
            })
        });
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    };
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        // The sides at the smaller and at the larger end of an axis.
        let ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
        square(ring.map(|(y, z)| [0, z, y]));
        square(ring.map(|(y, z)| [n, y, z]));
        square(ring.map(|(y, z)| [2 * n, y, z]));
        for from in [0, n] {
            square(ring.map(|(x, z)| [from + x, 0, z]));
            square(ring.map(|(z, x)| [from + x, n, z]));
            square(ring.map(|(y, x)| [from + x, y, 0]));
            square(ring.map(|(x, y)| [from + x, y, n]));
        }
    }
    mesh
}

#[test]
fn islands_points_lines_and_finer_parts_are_kept_with_them() {
    let mesh = sample("bumpy-sphere").unwrap();
    // Scattered triangles, some of which touch at vertices only.
    let centre = |t: u32| mesh.corners(t as usize).into_iter().sum::<DVec3>() / 3.0;
    let keep: Vec<u32> = (0..mesh.triangles.len() as u32)
        .filter(|t| centre(*t).x < -0.5 && (t % 7 == 0 || centre(*t).x < -0.8))
        .collect();
    let point = mesh.corners(select(&mesh, |p| p.x > 0.7)[0] as usize).into_iter().sum::<DVec3>() / 3.0;
    let sphere = Region::Sphere { centre: DVec3::Y, radius: 0.3 };
    let finer = Refinement { region: sphere, length: Length::OfDiagonal(0.012) };
    let options = Options::new(9000).points(vec![point]).refine(vec![finer]);
    let result = run(&mesh, &keep, &options);
    assert!(result.mesh.vertices.iter().any(|p| bits(*p) == bits(point)));
    // Lines on both sides of the border.
    let [a, b, c] = mesh.corners(0);
    let line = rtfmesh::mesh::features::FeatureLine { line: 1, points: vec![a, b, c] };
    let lines = FeatureLines::new(vec![line]);
    for keep in [select(&mesh, |p| p.x < -0.5), vec![0]] {
        let mut options = Options::new(4000);
        options.coarse_to_fine.features = Some(lines.clone());
        let result = run(&mesh, &keep, &options);
        let has = |end: DVec3| result.mesh.vertices.iter().any(|v| v.distance(end) < 1e-12);
        assert!(has(a) && has(c));
    }
}

#[test]
fn finer_parts_go_together_with_long_edges_that_are_kept() {
    let mesh = sphere(1.0, 3);
    let keep = select(&mesh, |p| p.x < -0.3);
    let rest = select(&mesh, |p| p.x >= -0.3);
    let triangles = rest.iter().map(|t| mesh.triangles[*t as usize]).collect();
    let rest = TriMesh { vertices: mesh.vertices.clone(), triangles };
    // Away from the edges that are kept, and at them.
    for (centre, length) in [(DVec3::X, 0.09), (DVec3::new(-0.3, 0.95, 0.0), 0.08)] {
        let finer =
            Refinement { region: Region::Sphere { centre, radius: 0.3 }, length: Length::Units(length) };
        let options = Options::new(1200).refine(vec![finer]);
        let result = run(&mesh, &keep, &options);
        assert_eq!(faults(&result.summary), Vec::<String>::new());
        assert_eq!(result.mesh.vertices.len(), 1200);
        let quality = result.summary.output.quality;
        assert!(quality.min_angle > 25.0 && quality.mean_quality > 0.9, "{quality:?}");
        let result = remesh(device(), &rest, &options.keep_boundary(true)).unwrap();
        assert_eq!(faults(&result.summary), Vec::<String>::new());
        assert!(result.summary.output.quality.min_angle > 25.0, "{:?}", result.summary.output.quality);
    }
}

#[test]
fn points_and_finer_parts_where_triangles_are_kept() {
    let mesh = sample("bumpy-sphere").unwrap();
    let keep = select(&mesh, |p| p.x < -0.3);
    let own = mesh.corners(select(&mesh, |p| p.x < -0.8)[0] as usize);
    let other = mesh.corners(select(&mesh, |p| p.x > 0.7)[0] as usize).into_iter().sum::<DVec3>() / 3.0;
    let sphere = Region::Sphere { centre: DVec3::NEG_X, radius: 0.2 };
    let finer = Refinement { region: sphere, length: Length::OfDiagonal(0.01) };
    let options = Options::new(2500).refine(vec![finer]);
    let result = run(&mesh, &keep, &options.clone().points(vec![own[0], other]));
    assert!(result.mesh.vertices.iter().any(|p| bits(*p) == bits(other)));
    let said = result.summary.warnings.join("; ");
    assert_eq!(said, "`refine` sphere:-1,0,0,0.2 has no effect: all of the surface there is kept");
    let inside = own.into_iter().sum::<DVec3>() / 3.0;
    let refused = preview(&mesh, &options.keep(keep).points(vec![inside])).unwrap_err().to_string();
    assert!(refused.contains("would lie in a triangle of `keep`"), "{refused}");
}

#[test]
fn slender_triangles_that_are_kept_are_no_reason_for_a_warning() {
    let mut mesh = sample("bumpy-sphere").unwrap();
    let keep = select(&mesh, |p| p.x < -0.3);
    // Half of them thin: a vertex is close to the opposite side of a triangle around it.
    let chosen: HashSet<u32> = keep.iter().step_by(9).flat_map(|t| mesh.triangles[*t as usize]).collect();
    let rest: HashSet<u32> =
        select(&mesh, |p| p.x >= -0.3).into_iter().flat_map(|t| mesh.triangles[t as usize]).collect();
    let before = mesh.clone();
    for t in keep.iter().step_by(9) {
        let [a, b, c] = mesh.triangles[*t as usize];
        let is_free = |v: u32| chosen.contains(&v) && !rest.contains(&v);
        if is_free(a) && [b, c].iter().all(|v| mesh.vertices[*v as usize] == before.vertices[*v as usize]) {
            let [p, q, r] = [a, b, c].map(|v| before.vertices[v as usize]);
            mesh.vertices[a as usize] = p.lerp(q.midpoint(r), 0.8);
        }
    }
    let result = run(&mesh, &keep, &Options::new(2500));
    assert!(
        !result.summary.warning_codes.contains(&WarningCode::SmallAngles),
        "{:?}",
        result.summary.warnings
    );
    let small = result.summary.small_angles.unwrap();
    assert!(small.kept > 20 && small.left - small.kept < 5, "{small:?}");
}

#[test]
fn faces_are_counted_with_those_that_stay() {
    let mesh = sample("torus").unwrap();
    let keep = select(&mesh, |p| p.x < -0.4);
    let faces = keep.len() + 2000 - keep.len() % 2;
    let result = run(&mesh, &keep, &Options::new(0).faces(faces));
    assert_eq!(result.mesh.triangles.len(), faces);
}

#[test]
fn those_that_repair_changes_are_not_said_to_be_as_they_were() {
    let mut mesh = sample("bumpy-sphere").unwrap();
    let mut keep = select(&mesh, |p| p.x < -0.3);
    let count = keep.len();
    // One turned over, one twice, and one without an area.
    mesh.triangles[keep[0] as usize].swap(0, 1);
    let [a, b, c] = mesh.triangles[keep[1] as usize];
    keep.extend([0, 1].map(|k| mesh.triangles.len() as u32 + k));
    mesh.triangles.extend([[b, c, a], [a, a, b]]);
    let options = Options::new(count + 1500).keep(keep);
    let said = remesh(device(), &mesh, &options).unwrap().summary.remarks.join("; ");
    let as_before = format!("{} triangles of the input are kept as they are; 3 others are not", count - 1);
    assert!(said.contains(&as_before), "{said}");
}

#[test]
fn vertices_are_added_for_what_is_kept() {
    let mesh = sample("bumpy-sphere").unwrap();
    let keep = select(&mesh, |p| p.x < -0.3);
    let mut options = Options::new(100);
    options.shortage = Shortage::AddVertices;
    let result = run(&mesh, &keep, &options);
    let own: HashSet<u32> = keep.iter().flat_map(|t| mesh.triangles[*t as usize]).collect();
    assert!((own.len()..2 * own.len()).contains(&result.mesh.vertices.len()));
    assert_eq!(faults(&result.summary), Vec::<String>::new());
}

#[test]
fn a_number_of_vertices_that_is_refused_comes_with_one_that_works() {
    // Small holes in what is kept.
    let mesh = sphere(1.0, 3);
    let around: HashSet<u32> = [40, 300, 500].into_iter().collect();
    let is_near = |t: usize| mesh.triangles[t].iter().any(|v| around.contains(v));
    let keep: Vec<u32> = (0..mesh.triangles.len()).filter(|t| !is_near(*t)).map(|t| t as u32).collect();
    for count in [100, mesh.vertices.len() - 2, mesh.vertices.len() + 60, 4000] {
        let options = Options::new(count).keep(keep.clone());
        let refused = preview(&mesh, &options).unwrap_err();
        let Error::Usage { problem, remedy, .. } = refused else { panic!("{refused:?}") };
        let number = remedy.split(|c: char| !c.is_ascii_digit()).find_map(|word| word.parse().ok());
        let number: usize = number.unwrap_or_else(|| panic!("{problem}; {remedy}"));
        let result = run(&mesh, &keep, &Options::new(number));
        assert_eq!(result.mesh.vertices.len(), number, "{problem}; {remedy}");
    }
    // Every other square of a sheet, so that hardly any vertex is free.
    let sheet = plane(20, 0.0);
    let keep: Vec<u32> = (0..800).filter(|t| (t / 2 + t / 40) % 2 == 0).collect();
    let refused = preview(&sheet, &Options::new(2500).keep(keep)).unwrap_err().to_string();
    assert!(refused.contains("no small parts are left between kept ones"), "{refused}");
}

#[test]
fn what_cannot_be_kept_is_refused_before_the_run() {
    let mesh = sample("bumpy-sphere").unwrap();
    let keep = select(&mesh, |p| p.x < -0.3);
    let all: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    let but_one = all[1..].to_vec();
    for (options, words) in [
        (Options::new(100).keep(keep.clone()), "alone have"),
        (Options::new(500).keep(all), "all triangles are kept"),
        (Options::new(9000).keep(but_one), "no vertices of their own"),
        (Options::new(500).keep(vec![u32::MAX - 1]), "names triangle"),
        (Options::new(9000).keep(keep.clone()).local(true), "does not go together"),
        (Options::new(9000).keep(keep).smooth_boundary(0.1), "`smooth_boundary` moves"),
    ] {
        let refused = preview(&mesh, &options);
        let Err(Error::Usage { problem, .. }) = refused else { panic!("{words}: {refused:?}") };
        assert!(problem.contains(words), "{problem}");
    }
}
