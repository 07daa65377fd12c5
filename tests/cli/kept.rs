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
fn selections_stay_in_files() {
    let place = Place::new();
    // A sheet in two groups.
    let n = 20;
    let mut text = String::new();
    for k in 0..(n + 1) * (n + 1) {
        let [x, y] = [k % (n + 1), k / (n + 1)].map(|i| f64::from(i) / f64::from(n));
        text += &format!("v {x} {y} {}\n", 0.1 * x * y);
    }
    for (group, rows) in [("low", 0..8), ("high", 8..n)] {
        text += &format!("g {group}\n");
        for (j, i) in rows.flat_map(|j| (0..n).map(move |i| (j, i))) {
            let a = j * (n + 1) + i + 1;
            let [b, c, d] = [a + 1, a + n + 2, a + n + 1];
            text += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
        }
    }
    std::fs::write(place.path("in.obj"), text).unwrap();
    let low = |name: &str| {
        let mesh = read(place.path(name)).unwrap().mesh;
        let corners = |t: usize| mesh.corners(t).map(|p| p.to_array().map(|x| (x as f32).to_bits()));
        (0..mesh.triangles.len())
            .filter(|t| mesh.corners(*t).iter().all(|p| p.y < 0.401))
            .map(corners)
            .collect::<HashSet<_>>()
    };
    place.run("remesh in.obj out.ply -n 700 --quality draft --keep label:low");
    assert!(low("in.obj").len() == 320 && low("in.obj") == low("out.ply"));
    place.run("remesh in.obj only.ply -n 700 --quality draft --only label:high");
    assert_eq!(place.bytes("out.ply"), place.bytes("only.ply"));
    place.run("batch in.obj --out many -n 700 --quality draft --keep label:low");
    assert_eq!(place.bytes("out.ply"), place.bytes("many/in.ply"));
    let (_, told) = place.run("remesh in.obj length.ply --edge-length 0.04 --keep label:low");
    assert!(told.contains("320 triangles of the input are kept as they are"), "{told}");
    let (plan, _) = place.run("remesh in.obj --dry-run -n 700 --keep label:low");
    assert!(plan.contains("edges of the join") && plan.contains("320, 189, 20"), "{plan}");
    let count = read(place.path("length.ply")).unwrap().mesh.vertices.len();
    assert!((550..750).contains(&count), "{count}");
    for (arguments, words) in [
        ("-n 100 --keep label:low", "alone have 189 vertices"),
        ("-n 700 --keep low", "give label:NAME or selection:NAME"),
        ("-n 700 --keep label:none", "use one of these: low, high"),
        ("-n 700 --keep selection:none", "no numeric attribute"),
        ("-n 700 --keep label:low --only label:high", "cannot be used with"),
        ("-n 700 --keep label:low --preset rtf", "--preset default"),
        ("-n 700 --keep label:low --max-deviation 1%", "cannot be used with"),
    ] {
        let done = place.program(&format!("remesh in.obj none.ply {arguments}")).assert().failure();
        let text = String::from_utf8(done.get_output().stderr.clone()).unwrap();
        assert!(text.contains(words), "{arguments}: {text}");
    }
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
