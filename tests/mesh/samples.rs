//! The built-in models: topology, orientation and size, counted without the library's own tools.

use std::collections::{HashMap, HashSet};

use glam::DVec3;
use rtfmesh::mesh::samples::{names, sample};
use rtfmesh::{Error, TriMesh};

struct Counts {
    euler: i64,
    /// Edges with one face.
    boundary: usize,
    components: usize,
}

/// Counts after checking that each edge has at most two faces, which run along it in opposite directions, and
/// that the faces around each vertex form one fan.
fn counted(name: &str, mesh: &TriMesh) -> Counts {
    let mut directed: HashMap<(u32, u32), u32> = HashMap::new();
    for &[a, b, c] in &mesh.triangles {
        for (edge, opposite) in [((a, b), c), ((b, c), a), ((c, a), b)] {
            assert_ne!(edge.0, edge.1, "{name}");
            assert_eq!(directed.insert(edge, opposite), None, "{name}: {edge:?} runs twice the same way");
        }
    }
    let boundary = directed.keys().filter(|(a, b)| !directed.contains_key(&(*b, *a))).count();
    let edges = (directed.len() + boundary) / 2;
    let mut faces_at = vec![0; mesh.vertices.len()];
    mesh.triangles.as_flattened().iter().for_each(|vertex| faces_at[*vertex as usize] += 1);
    let open = directed.keys().filter(|(a, b)| !directed.contains_key(&(*b, *a)));
    let on_boundary: HashSet<u32> = open.map(|(_, end)| *end).collect();
    for &(start, end) in directed.keys() {
        // On a boundary the fan is walked from its first edge alone, or it would be cut short.
        if on_boundary.contains(&start) && directed.contains_key(&(end, start)) {
            continue;
        }
        let (mut turned, mut next) = (0, end);
        while let Some(following) = directed.get(&(start, next)) {
            turned += 1;
            next = *following;
            if next == end {
                break;
            }
        }
        assert_eq!(turned, faces_at[start as usize], "{name}: vertex {start} has more than one fan");
    }
    let mut label: Vec<usize> = (0..mesh.vertices.len()).collect();
    fn root(label: &mut [usize], mut at: usize) -> usize {
        while label[at] != at {
            label[at] = label[label[at]];
            at = label[at];
        }
        at
    }
    for &(a, b) in directed.keys() {
        let (a, b) = (root(&mut label, a as usize), root(&mut label, b as usize));
        label[a] = b;
    }
    let components = (0..label.len()).filter(|at| label[*at] == *at).count();
    let euler = mesh.vertices.len() as i64 - edges as i64 + mesh.triangles.len() as i64;
    Counts { euler, boundary, components }
}

fn area_and_volume(mesh: &TriMesh) -> (f64, f64) {
    (0..mesh.triangles.len()).map(|t| mesh.corners(t)).fold((0.0, 0.0), |(area, volume), [a, b, c]| {
        let cross: DVec3 = (b - a).cross(c - a);
        assert!(cross.length() > 0.0);
        (area + cross.length() / 2.0, volume + a.dot(b.cross(c)) / 6.0)
    })
}

/// The number of edges in the one boundary loop.
fn boundary_loop(mesh: &TriMesh) -> usize {
    let edges: Vec<(u32, u32)> =
        mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
    let known: HashSet<(u32, u32)> = edges.iter().copied().collect();
    let next: HashMap<u32, u32> = edges.into_iter().filter(|(a, b)| !known.contains(&(*b, *a))).collect();
    let start = *next.keys().next().unwrap();
    let mut at = start;
    for length in 1..=next.len() {
        at = next[&at];
        if at == start {
            return length;
        }
    }
    panic!("the boundary is no loop");
}

#[test]
fn topology_and_orientation() {
    // Euler characteristic, components, boundary edges, and the range of the triangle count.
    let expected = [
        ("torus", 0, 1, 0, 2_000..4_000),
        ("genus3", -4, 1, 0, 8_000..13_000),
        ("bumpy-sphere", 2, 1, 0, 5_120..5_121),
        ("sphere", 2, 1, 0, 5_120..5_121),
        ("box", 2, 1, 0, 12..13),
        ("thin-plate", 2, 1, 0, 672..673),
        ("tetrahedron", 2, 1, 0, 4..5),
        ("open-hemisphere", 1, 1, 64, 1_984..1_985),
        ("two-components", 2, 2, 0, 2_816..2_817),
    ];
    assert_eq!(names().iter().map(|(name, _)| *name).collect::<Vec<_>>(), expected.clone().map(|row| row.0));
    for (name, euler, components, boundary, triangles) in expected {
        let mesh = sample(name).unwrap();
        let counts = counted(name, &mesh);
        assert_eq!(
            (counts.euler, counts.components, counts.boundary),
            (euler, components, boundary),
            "{name}"
        );
        assert!(triangles.contains(&mesh.triangles.len()), "{name}: {} triangles", mesh.triangles.len());
        assert!(area_and_volume(&mesh).1 > 0.0, "{name} faces inward");
        let mut positions: Vec<[u64; 3]> =
            mesh.vertices.iter().map(|vertex| vertex.to_array().map(f64::to_bits)).collect();
        positions.sort_unstable();
        positions.dedup();
        assert_eq!(positions.len(), mesh.vertices.len(), "{name}: two vertices at one place");
        assert_eq!(sample(name).unwrap(), mesh, "{name} is not the same each time");
    }
}

#[test]
fn measures_with_known_answers() {
    use std::f64::consts::PI;
    let close = |name: &str, area: f64, volume: f64, tolerance: f64| {
        let (found_area, found_volume) = area_and_volume(&sample(name).unwrap());
        assert!((found_area / area - 1.0).abs() < tolerance, "{name}: area {found_area}, not {area}");
        assert!(
            (found_volume / volume - 1.0).abs() < tolerance,
            "{name}: volume {found_volume}, not {volume}"
        );
    };
    close("box", 6.0, 1.0, 1e-14);
    close("thin-plate", 2.04, 0.01, 1e-12);
    close("sphere", 4.0 * PI, 4.0 / 3.0 * PI, 0.005);
    close("open-hemisphere", 2.0 * PI, 2.0 / 3.0 * PI, 0.005);
    close("torus", 4.0 * PI * PI * 0.35, 2.0 * PI * PI * 0.35 * 0.35, 0.03);
    close("tetrahedron", 8.0 / 3.0_f64.sqrt(), 8.0 / 9.0 / 3.0_f64.sqrt(), 1e-14);
}

#[test]
fn the_torus_and_the_blob_are_uneven() {
    for name in ["torus", "genus3"] {
        let mesh = sample(name).unwrap();
        let mut areas: Vec<f64> = (0..mesh.triangles.len())
            .map(|t| mesh.corners(t))
            .map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0)
            .collect();
        areas.sort_by(f64::total_cmp);
        let spread = areas[areas.len() * 9 / 10] / areas[areas.len() / 10];
        assert!(spread > 3.0, "{name}: {spread}");
    }
    // Every vertex of the torus lies on it, and no triangle is folded over.
    let torus = sample("torus").unwrap();
    for (t, vertex) in torus.vertices.iter().enumerate() {
        assert!(((vertex.truncate().length() - 1.0).hypot(vertex.z) - 0.35).abs() < 1e-12, "vertex {t}");
    }
    for t in 0..torus.triangles.len() {
        let [a, b, c] = torus.corners(t);
        let middle = (a + b + c) / 3.0;
        let outward = middle - middle.with_z(0.0).normalize();
        assert!((b - a).cross(c - a).dot(outward) > 0.0, "triangle {t} is folded over");
    }
}

#[test]
fn the_hemisphere_has_one_flat_boundary() {
    let mesh = sample("open-hemisphere").unwrap();
    assert_eq!(boundary_loop(&mesh), 64);
    assert_eq!(mesh.vertices.iter().filter(|vertex| vertex.z == 0.0).count(), 64);
}

#[test]
fn unknown_names_are_answered_with_the_list() {
    let Err(Error::Usage { problem, remedy, .. }) = sample("teapot") else { panic!("there is no teapot") };
    assert_eq!(problem, "there is no built-in model 'teapot'");
    for (name, description) in names() {
        assert!(remedy.contains(name) && !description.is_empty());
    }
}
