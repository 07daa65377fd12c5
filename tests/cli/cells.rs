//! `--cells`: the cells of a result's vertices in a file.

use crate::support::place::Place;
use rtfmesh::TriMesh;
use rtfmesh::io::{Loaded, read};
use std::collections::HashSet;

/// A file of cells as triangles, with the numbers of the cells.
fn cells(place: &Place, name: &str, label: &str) -> (TriMesh, Vec<usize>) {
    let Loaded { mesh, attributes, .. } = read(place.path(name)).unwrap();
    let cell = attributes.face_named(label).unwrap();
    (mesh, cell.values.iter().map(|value| *value as usize).collect())
}

#[test]
fn exact_cells_tile_the_surface() {
    for model in ["torus", "box", "open-hemisphere"] {
        let place = Place::with(model);
        place.run("remesh in.ply out.ply -n 300 --quality draft --cells cells.ply");
        place.run("remesh in.ply out.ply -n 300 --quality draft --cells cells.obj --cell-color valence");
        let input = read(place.path("in.ply")).unwrap().mesh;
        let result = read(place.path("out.ply")).unwrap().mesh;
        for (name, label) in [("cells.ply", "cell"), ("cells.obj", "group")] {
            let (mesh, cells) = cells(&place, name, label);
            assert!((mesh.area() / input.area() - 1.0).abs() < 1e-9, "{model} {name}");
            assert_eq!(cells.iter().collect::<HashSet<_>>().len(), 300, "{model} {name}");
            // Each triangle is closer to its own vertex than to any other.
            for (t, cell) in cells.iter().enumerate() {
                let middle = mesh.corners(t).iter().sum::<rtfmesh::glam::DVec3>() / 3.0;
                let distance = |v: usize| result.vertices[v].distance(middle);
                let nearest = (0..300).min_by(|a, b| distance(*a).total_cmp(&distance(*b))).unwrap();
                assert!(distance(*cell) < distance(nearest) + 1e-6, "{model} {name}: {t}");
            }
        }
    }
}

#[test]
fn tangent_faces_are_one_for_each_vertex() {
    let place = Place::with("torus");
    let (_, told) =
        place.run("remesh in.ply out.ply -n 1500 --preset rtf --iterations 20 --cells cells.ply --verbose");
    assert!(told.contains("1500 in 1500 polygons"), "{told}");
    let (mesh, cells) = cells(&place, "cells.ply", "cell");
    let area = read(place.path("in.ply")).unwrap().mesh.area();
    assert!((mesh.area() / area - 1.0).abs() < 0.01, "{} {area}", mesh.area());
    assert_eq!(cells.iter().collect::<HashSet<_>>().len(), 1500);
    place.run("render cells.ply cells.png --cells");
    assert!(!place.bytes("cells.png").is_empty());
}

#[test]
fn a_batch_writes_cells_beside_its_results() {
    let place = Place::with("torus");
    place.run("remesh in.ply out.ply -n 300 --cells cells.ply");
    place.run("batch in.ply --out many --format ply.gz -n 300 --cells ply");
    assert_eq!(place.bytes("many/in.cells.ply"), place.bytes("cells.ply"));
    std::fs::copy(place.path("in.ply"), place.path("in.cells.ply")).unwrap();
    let done = place.program("batch in.ply in.cells.ply --out many -n 300 --cells ply").assert().code(2);
    let told = String::from_utf8(done.get_output().stderr.clone()).unwrap();
    assert!(told.contains("would overwrite a mesh"), "{told}");
}

#[test]
fn cells_replace_nothing_and_have_their_own_formats() {
    let place = Place::with("box");
    for (name, says) in [("c.stl", "name the file .obj or .ply"), ("in.ply", "would overwrite")] {
        let arguments = format!("remesh in.ply out.ply -n 100 --cells {name}");
        let done = place.program(&arguments).assert().failure();
        let told = String::from_utf8(done.get_output().stderr.clone()).unwrap();
        assert!(told.contains(says), "{told}");
    }
    place.program("remesh in.ply out.ply -n 100 --cell-color area").assert().code(2);
}
