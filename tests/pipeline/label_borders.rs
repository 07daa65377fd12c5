//! Borders of labels that follow the triangles to and fro are made smooth, and others are not.

use rtfmesh::glam::DVec3;
use rtfmesh::mesh::attributes::{Attribute, Attributes, Kind, Role, label_boundaries, transfer};
use rtfmesh::mesh::quality::quality;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::{Topology, topology};
use rtfmesh::{CorrespondenceRequest, Error, Options, Remeshed, Shortage, TriMesh, remesh};

use crate::support::shapes::{plane, sphere};
use crate::support::{device, faults};

/// Directions in which the middles of regions of a sphere are.
const MIDDLES: [[f64; 3]; 5] =
    [[0.3, 0.2, 0.9], [-0.8, 0.5, 0.2], [0.7, -0.6, -0.1], [-0.3, -0.7, 0.6], [0.1, 0.4, -0.9]];

/// The label of a point of a surface.
type LabelAt = dyn Fn(DVec3) -> usize;

/// The middle that a point is nearest to.
fn nearest(p: DVec3) -> usize {
    let along = |k: &usize| p.dot(DVec3::from_array(MIDDLES[*k]).normalize());
    (0..MIDDLES.len()).max_by(|a, b| along(a).total_cmp(&along(b))).unwrap()
}

fn labelled(mesh: &TriMesh, label: impl Fn(DVec3) -> usize) -> Attributes {
    let centre = |t: usize| mesh.corners(t).iter().sum::<DVec3>() / 3.0;
    let values = (0..mesh.triangles.len()).map(|t| label(centre(t)) as f64).collect();
    Attributes {
        face: vec![Attribute::new("region", Role::Label, Kind::U8, 1, values)],
        ..Default::default()
    }
}

fn run(mesh: &TriMesh, labels: &Attributes, options: Options) -> Result<(Remeshed, Attributes), Error> {
    let options = options.correspondence(CorrespondenceRequest::ALL);
    let found = remesh(device(), mesh, &options.label_borders(label_boundaries(mesh, labels)))?;
    let carried = transfer(labels, mesh, found.correspondence.as_ref().unwrap(), &found.mesh);
    Ok((found, carried))
}

/// The share of the area of each region.
fn shares(mesh: &TriMesh, labels: &Attributes) -> Vec<f64> {
    let last = labels.face[0].values.iter().fold(0.0_f64, |a, b| a.max(*b));
    let mut areas = vec![0.0; last as usize + 1];
    (0..mesh.triangles.len()).for_each(|t| areas[labels.face[0].at(t)[0] as usize] += mesh.triangle_area(t));
    let whole: f64 = areas.iter().sum();
    areas.iter().map(|area| area / whole).collect()
}

#[test]
fn ragged_borders_become_smooth_and_regions_keep_their_areas() {
    let input = sphere(1.0, 5);
    let labels = labelled(&input, nearest);
    let (smooth, carried) = run(&input, &labels, Options::new(1000)).unwrap();
    let mean = quality(&smooth.mesh).unwrap().mean_quality;
    assert!(mean > 0.92, "{mean}");
    for (own, expected) in shares(&smooth.mesh, &carried).iter().zip(shares(&input, &labels)) {
        assert!((own / expected - 1.0).abs() < 0.01, "{own} {expected}");
    }
    // As they are, they leave no room for the rest.
    let ragged = run(&input, &labels, Options::new(5).smooth_labels(0.0));
    let error = ragged.err().map(|error| error.to_string()).unwrap_or_default();
    assert!(error.contains("borders of labels, sharp edges and boundaries need"), "{error}");
}

#[test]
fn straight_borders_stay_where_they_are() {
    let input = plane(12, 0.0);
    let label = |v: DVec3| usize::from(v.x > if v.y > 0.5 { 0.25 } else { 0.75 });
    let labels = labelled(&input, label);
    let (found, carried) = run(&input, &labels, Options::new(500)).unwrap();
    for t in 0..found.mesh.triangles.len() {
        let centre = found.mesh.corners(t).iter().sum::<DVec3>() / 3.0;
        assert_eq!(carried.face[0].at(t), [label(centre) as f64], "{centre}");
    }
}

#[test]
fn small_regions_of_an_uneven_surface_keep_their_areas() {
    // Middles along a spiral.
    let middle = |k: u32| {
        let (z, turn) = (1.0 - (2.0 * f64::from(k) + 1.0) / 32.0, 2.4 * f64::from(k));
        DVec3::new((1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin(), z)
    };
    let middles: Vec<DVec3> = (0..32).map(middle).collect();
    let along = |p: DVec3, k: usize| p.normalize().dot(middles[k]);
    let region = |p: DVec3| (0..32).max_by(|a, b| along(p, *a).total_cmp(&along(p, *b))).unwrap();
    let mut input = sphere(1.0, 6);
    for p in &mut input.vertices {
        *p *= 1.0 + 0.1 * (5.0 * p.x).sin() * (4.0 * p.y + 1.0).cos();
    }
    let labels = labelled(&input, region);
    let (found, carried) = run(&input, &labels, Options::new(1500)).unwrap();
    let mean = quality(&found.mesh).unwrap().mean_quality;
    assert!(mean > 0.88, "{mean}");
    for (own, expected) in shares(&found.mesh, &carried).iter().zip(shares(&input, &labels)) {
        assert!((own / expected - 1.0).abs() < 0.006, "{own} {expected}");
    }
}

#[test]
fn more_vertices_never_fail_where_fewer_work() {
    let side = |p: DVec3| {
        let k = (0..3).max_by(|a, b| p[*a].abs().total_cmp(&p[*b].abs())).unwrap();
        4 * k + 2 * usize::from(p[k] > 0.0) + usize::from(p.x > 0.0)
    };
    let left = |p: DVec3| usize::from(p.x > 0.0);
    let models: [(&str, &LabelAt); 3] = [("sphere", &nearest), ("box", &side), ("genus3", &left)];
    for (name, label) in models {
        let input = sample(name).unwrap();
        let labels = labelled(&input, label);
        let regions = shares(&input, &labels).iter().filter(|share| **share > 0.0).count();
        let mut are_made = Vec::new();
        for count in [14, 30, 57, 76, 129] {
            let made = run(&input, &labels, Options::new(count));
            are_made.push((count, made.is_ok()));
            match made {
                Ok((found, carried)) => {
                    let at = format!("{name}, {count}");
                    assert_eq!(found.mesh.vertices.len(), count, "{at}");
                    let counts = |mesh: &TriMesh| {
                        let Topology { components, euler, boundary_loops, nonmanifold_edges, .. } =
                            topology(mesh);
                        (components, euler, boundary_loops, nonmanifold_edges)
                    };
                    assert_eq!(counts(&found.mesh), counts(&input), "{at}");
                    assert_eq!(faults(&found.summary), Vec::<String>::new(), "{at}");
                    let kept = shares(&found.mesh, &carried).iter().filter(|share| **share > 0.0).count();
                    assert_eq!(kept, regions, "{at}");
                }
                Err(error) => {
                    let text = error.to_string();
                    assert!(text.contains("borders of labels") && text.contains("ask for "), "{text}");
                }
            }
        }
        // Where vertices may be added, the same number is no error.
        let added = run(&input, &labels, Options::new(14).shortage(Shortage::AddVertices)).unwrap();
        assert!(added.0.mesh.vertices.len() >= 14 && faults(&added.0.summary).is_empty(), "{name}");
        assert!(are_made.iter().map(|(_, made)| made).is_sorted(), "{name}: {are_made:?}");
        assert!(are_made.iter().any(|(count, made)| *made && *count <= 57), "{name}: {are_made:?}");
    }
}
