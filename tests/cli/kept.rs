//! Points, boundaries and numbers of triangles on the command line.

use crate::support::place::Place;
use rtfmesh::io::read;
use std::collections::HashSet;

/// The positions of a mesh's vertices as 32-bit numbers.
fn places(place: &Place, name: &str) -> HashSet<[u32; 3]> {
    let mesh = read(place.path(name)).unwrap().mesh;
    mesh.vertices.iter().map(|p| p.to_array().map(|x| (x as f32).to_bits())).collect()
}

#[test]
fn points_of_a_file_are_vertices_of_the_written_mesh() {
    let place = Place::with("bumpy-sphere");
    let input = read(place.path("in.ply")).unwrap().mesh;
    let points: Vec<_> =
        (0..9).map(|k| input.corners(97 * k).into_iter().sum::<rtfmesh::glam::DVec3>() / 3.0).collect();
    let lines: Vec<String> = points.iter().map(|p| format!("{} {} {}", p.x, p.y, p.z)).collect();
    std::fs::write(place.path("points.xyz"), lines.join("\n")).unwrap();
    let options = "-n 900 --quality draft --points points.xyz";
    place.run(&format!("remesh in.ply out.ply {options}"));
    let there = places(&place, "out.ply");
    assert!(there.len() == 900);
    assert!(points.iter().all(|p| there.contains(&p.to_array().map(|x| (x as f32).to_bits()))));
    place.run(&format!("batch in.ply --out many {options}"));
    assert_eq!(place.bytes("out.ply"), place.bytes("many/in.ply"));
    let (plan, _) = place.run(&format!("remesh in.ply --dry-run {options}"));
    assert!(plan.contains("corners") || plan.contains("vertices"), "{plan}");
}

#[test]
fn boundaries_stay_in_files() {
    let place = Place::with("open-hemisphere");
    place.run("remesh in.ply out.ply -n 900 --quality draft --keep-boundary");
    let input = read(place.path("in.ply")).unwrap().mesh;
    let there = places(&place, "out.ply");
    let mut sides: Vec<[u32; 2]> =
        input.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    let all: HashSet<[u32; 2]> = sides.iter().copied().collect();
    sides.retain(|[a, b]| !all.contains(&[*b, *a]));
    assert!(sides.len() > 20);
    for v in sides.into_iter().flatten() {
        let at = input.vertices[v as usize].to_array().map(|x| (x as f32).to_bits());
        assert!(there.contains(&at), "vertex {v}");
    }
    place.run("batch in.ply --out many -n 900 --quality draft --keep-boundary");
    assert_eq!(place.bytes("out.ply"), place.bytes("many/in.ply"));
}

#[test]
fn triangles_are_counted() {
    let place = Place::with("torus");
    let (_, text) = place.run("remesh in.ply out.ply --faces 1k --quality draft");
    assert!(text.contains("500, 1000"), "{text}");
    let (_, text) = place.run("remesh in.ply out.ply --faces 1001 --quality draft");
    assert!(text.contains("closed surfaces have an even number of triangles"), "{text}");
}

#[test]
fn errors_say_what_to_do() {
    let place = Place::with("open-hemisphere");
    std::fs::write(place.path("points.xyz"), "0 0 1\n").unwrap();
    for (arguments, words) in [
        ("out.ply -n 500 --points none.xyz", "none.xyz"),
        ("out.ply -n 500 --points points.xyz --local", "cannot be used with"),
        ("out.ply -n 500 --points points.xyz --max-deviation 1%", "does not go together"),
        ("out.ply -n 500 --points points.xyz --preset rtf", "--preset default"),
        ("points.xyz --format ply -n 500 --points points.xyz", "would be overwritten"),
        ("out.ply -n 500 --keep-boundary --smooth-boundary 0.1", "cannot be used with"),
        ("out.ply -n 60 --keep-boundary", "leaves too few of 60"),
        ("out.ply -n 500 --faces 1000", "cannot be used with"),
        ("out.ply --faces 2", "at least 4 triangles"),
    ] {
        let done = place.program(&format!("remesh in.ply {arguments}")).assert().failure();
        let text = String::from_utf8(done.get_output().stderr.clone()).unwrap();
        assert!(text.contains(words), "{arguments}: {text}");
        assert!(!place.path("out.ply").exists());
    }
}
