//! `polish/{wanted, advance, claim, win, flip}`.

use super::fixture::{read, uneven};
use crate::reference::polish::{Edge, edges, flip_gain, half_edges, hashed, may_flip, neighbours};
use crate::support::shapes::{mesh, plane, sphere, tetrahedron, union};
use crate::support::{assert_valid, device, rounded};
use glam::DVec3;
use rtfmesh::TriMesh;
use rtfmesh::gpu::Recorder;
use rtfmesh::stages::polish::flip::{Flips, PASSES};
use rtfmesh::stages::polish::mesh::DeviceMesh;
use std::collections::HashSet;

/// The least gain of a flip.
const MIN_GAIN: f64 = 1e-3;

/// A mesh after so many sweeps, with the number of flips.
fn flipped(mesh: &TriMesh, weight: f32, sweeps: &[(u32, u32)], workgroup: u32) -> (TriMesh, usize) {
    let on_device = DeviceMesh::new(device(), mesh).unwrap();
    let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
    let flips = Flips::new(device(), vertices, triangles, Some(workgroup)).unwrap();
    let mut recorder = Recorder::new(device()).unwrap();
    for sweep in sweeps {
        flips.record(&mut recorder, &on_device, weight, *sweep).unwrap();
    }
    let count = flips.download_flips(&mut recorder).unwrap();
    let count = recorder.submit().unwrap().first(&count).unwrap();
    assert_valid(device());
    (read(&on_device), count as usize)
}

fn edge_key(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

fn all_edges(mesh: &TriMesh) -> HashSet<(u32, u32)> {
    half_edges(mesh).into_keys().map(|(a, b)| edge_key(a, b)).collect()
}

/// The edges whose flip pays, by the definition.
fn paying(mesh: &TriMesh, weight: f64) -> Vec<Edge> {
    let around = neighbours(mesh);
    let valences: Vec<usize> = around.iter().map(HashSet::len).collect();
    let gain = |edge: &Edge| flip_gain(mesh, edge, &valences, weight);
    let edges: Vec<Edge> = edges(mesh).into_iter().filter(|edge| may_flip(mesh, edge, &around)).collect();
    assert!(edges.iter().all(|edge| (gain(edge) - MIN_GAIN).abs() > 2e-5), "too close to call");
    edges.into_iter().filter(|edge| gain(edge) > MIN_GAIN).collect()
}

#[test]
fn a_pass_flips_the_edges_that_have_their_vertices_to_themselves() {
    for (seed, weight, jitter) in [(1, 1.0, 0.4), (2, 0.0, 0.4), (3, 1.0, 0.8), (4, 0.25, 0.2)] {
        let before = uneven(40, 20, jitter, seed);
        let paying = paying(&before, weight);
        for sweep in [0, 7] {
            let priority = |edge: &Edge| hashed(edge.half_edge + sweep * PASSES);
            let mut largest = vec![0; before.vertices.len()];
            for edge in &paying {
                edge.around.iter().for_each(|v| {
                    largest[*v as usize] = largest[*v as usize].max(priority(edge));
                });
            }
            let wins = |edge: &&Edge| edge.around.iter().all(|v| largest[*v as usize] == priority(edge));
            let winners: Vec<&Edge> = paying.iter().filter(wins).collect();
            let mut wanted = all_edges(&before);
            for Edge { around: [a, b, c, d], .. } in &winners {
                assert!(wanted.remove(&edge_key(*a, *b)) && wanted.insert(edge_key(*c, *d)));
            }
            assert!(3 * winners.len() > paying.len() / 3 && winners.len() > 20, "{}", winners.len());
            for workgroup in [16, 64] {
                let (after, count) = flipped(&before, weight as f32, &[(sweep, 1)], workgroup);
                assert_eq!(count, winners.len(), "seed {seed}");
                assert_eq!(all_edges(&after), wanted, "seed {seed}");
                assert_eq!(after.vertices, before.vertices);
            }
        }
    }
}

#[test]
fn sweeps_end_where_no_flip_pays() {
    let before = uneven(40, 20, 0.3, 5);
    let sweeps: Vec<(u32, u32)> = (0..8).map(|sweep| (sweep, PASSES)).collect();
    let (after, count) = flipped(&before, 0.0, &sweeps, 64);
    assert!(count > 100, "{count} flips");
    assert_eq!(paying(&after, 0.0).len(), 0);
    assert_eq!(flipped(&before, 0.0, &sweeps, 16), (after, count), "another workgroup");
}

#[test]
fn meshes_of_any_size_are_flipped_as_far_as_they_may() {
    // Of a tetrahedron no edge may be flipped, and of an open square none at its boundary.
    let none = TriMesh::default();
    let cases = [none, tetrahedron(), plane(1, 0.0), plane(5, 0.0), uneven(3, 3, 0.1, 1)];
    for before in cases {
        let before = TriMesh { vertices: rounded(&before.vertices), ..before };
        for workgroup in [1, 16, 17, 18, 19] {
            let (after, count) = flipped(&before, 1.0, &[(0, PASSES)], workgroup);
            let changed = all_edges(&after).difference(&all_edges(&before)).count();
            assert!(changed <= count && (count > 0 || after == before), "{changed} of {count}");
            assert_eq!(after.triangles.len(), before.triangles.len());
        }
    }
    // A workgroup more or less than the number of triangles, and one each.
    for parts in [1, 15, 16, 17] {
        let many = (1..parts).fold(tetrahedron(), |all, _| union(&all, &tetrahedron()));
        assert_eq!(flipped(&many, 1.0, &[(0, PASSES)], 16), (many, 0));
    }
}

#[test]
fn flat_and_folded_triangles_do_no_harm() {
    // All vertices in one place, all in a line, and very large and small ones.
    let round = sphere(0.4, 2);
    let maps: [&dyn Fn(DVec3) -> DVec3; 5] = [
        &|_| DVec3::splat(0.25),
        &|p| DVec3::new(p.x, 0.0, 0.0),
        &|p| DVec3::new(p.x, p.y, 0.0),
        &|p| p * 1e-12,
        &|p| p * 1e12,
    ];
    for map in maps {
        let before = crate::support::shapes::moved(&round, map);
        let (after, _) = flipped(&before, 1.0, &[(0, PASSES), (1, PASSES)], 64);
        assert_eq!(after.triangles.len(), before.triangles.len());
    }
    // Two triangles with all three sides in common have no edge to flip: it would join what is joined.
    let pillow = mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1, 2], [0, 2, 1]]);
    assert_eq!(flipped(&pillow, 1.0, &[(0, PASSES)], 64), (pillow, 0));
}
