//! Edge lengths that vary over the surface, on the command line.

use crate::support::place::Place;
use rtfmesh::io::{Writer, read};
use rtfmesh::mesh::attributes::{Attribute, Attributes, Kind, Role};
use rtfmesh::mesh::samples::sample;

/// A torus as `in.ply` whose vertices have a number `wish` and a colour.
fn place() -> Place {
    let place = Place::new();
    let mesh = sample("torus").unwrap();
    let wishes = mesh.vertices.iter().map(|p| if p.x > 0.0 { 3.0 } else { 1.0 }).collect();
    let colours = vec![7.0; 3 * mesh.vertices.len()];
    let attributes = Attributes {
        vertex: vec![
            Attribute::new("wish", Role::Other, Kind::F32, 1, wishes),
            Attribute::new("colour", Role::Colour, Kind::U8, 3, colours),
        ],
        ..Default::default()
    };
    Writer::new().attributes(&attributes).write(place.path("in.ply"), &mesh).unwrap();
    place
}

#[test]
fn a_number_of_the_vertices_says_how_long_edges_are() {
    let place = place();
    place.run(
        "remesh in.ply out.ply -n 1200 --sizing property:wish --growth 1 --quality draft --report out.json",
    );
    let mesh = read(place.path("out.ply")).unwrap().mesh;
    assert_eq!(mesh.vertices.len(), 1200);
    let long_side = mesh.vertices.iter().filter(|p| p.x > 0.0).count();
    assert!((100..350).contains(&long_side), "{long_side} of 1200 where edges are three times as long");
    let report = std::fs::read_to_string(place.path("out.json")).unwrap();
    assert!(report.contains("\"sizing\"") && report.contains("\"edge_lengths\""), "{report}");
}

#[test]
fn drafts_have_edges_of_one_length_unless_others_are_asked_for() {
    let place = place();
    for (options, sizing) in
        [("", "automatic"), ("--quality draft", "uniform"), ("--quality draft --sizing auto", "automatic")]
    {
        place.run(&format!("remesh in.ply out.ply -n 200 --iterations 2 {options} --report out.json"));
        let report = std::fs::read_to_string(place.path("out.json")).unwrap();
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        assert_eq!(report["options"]["coarse_to_fine"]["sizing"], sizing, "{options}");
    }
}

#[test]
fn curvature_and_batch_work_likewise() {
    let place = place();
    place.run("sample bumpy-sphere bumps.ply");
    place.run(
        "remesh bumps.ply one.ply -n 700 --sizing curvature --gradation 1 --max-edge 20% --quality draft",
    );
    place.run("batch bumps.ply in.ply --out many -n 700 --sizing curvature --quality draft --max-edge 20%");
    let [one, many] = ["one.ply", "many/bumps.ply"].map(|name| std::fs::read(place.path(name)).unwrap());
    assert_eq!(one, many);
    let (plan, _) = place.run("remesh in.ply --dry-run -n 700 --sizing property:wish");
    assert!(plan.contains("vertices"), "{plan}");
}

#[test]
fn a_largest_deviation_takes_as_many_vertices_as_it_needs() {
    let place = place();
    place.run("sample torus torus.ply");
    let (_, text) = place.run("remesh torus.ply out.ply --max-deviation 1% --report out.json -v");
    assert!(text.contains("requested maximum deviation") && text.contains("1.0000 %: reached"), "{text}");
    let count = read(place.path("out.ply")).unwrap().mesh.vertices.len();
    assert!((100..800).contains(&count), "{count}");
    let report = std::fs::read_to_string(place.path("out.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["deviation"]["is_reached"], true);
    assert!(report["deviation"]["reached"].as_f64().unwrap() <= 1.0);
    assert_eq!(report["deviation"]["reached"], report["output"]["distances"]["hausdorff"]);
    // In the input's units, and with a number of vertices.
    place.run("remesh torus.ply other.ply --max-deviation 0.5 -n 300");
    assert_eq!(read(place.path("other.ply")).unwrap().mesh.vertices.len(), 300);
    place.run("batch torus.ply --out many --max-deviation 1%");
    assert_eq!(read(place.path("many/torus.ply")).unwrap().mesh.vertices.len(), count);
}

#[test]
fn edges_may_be_longer_one_way_than_the_other() {
    let place = place();
    place.run("sample torus torus.ply");
    let stretched = "-n 400 --sizing anisotropic --aspect 3";
    let (_, text) = place.run(&format!("remesh torus.ply out.ply {stretched} --report out.json -v"));
    assert!(text.contains("in the metric: mean quality"), "{text}");
    assert_eq!(read(place.path("out.ply")).unwrap().mesh.vertices.len(), 400);
    let report = std::fs::read_to_string(place.path("out.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let aspect = report["metric"]["mean_aspect"].as_f64().unwrap();
    assert!((1.1..3.0).contains(&aspect) && report["small_angles"].is_null(), "{report}");
    place.run(&format!("batch torus.ply --out many {stretched}"));
    let [one, many] = ["out.ply", "many/torus.ply"].map(|name| std::fs::read(place.path(name)).unwrap());
    assert_eq!(one, many);
    place.run("remesh torus.ply close.ply --sizing anisotropic --max-deviation 1% --report close.json");
    let report = std::fs::read_to_string(place.path("close.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["deviation"]["is_reached"], true, "{report}");
}

/// A cube as `cube.obj` with groups `top` and `rest`.
fn grouped(place: &Place) {
    let corners =
        [0, 1].map(|z| [0, 1].map(|y| [0, 1].map(|x| format!("v {x} {y} {z}\n")).concat()).concat());
    let rest = "f 1 3 4 2\nf 1 2 6 5\nf 2 4 8 6\nf 4 3 7 8\nf 3 1 5 7\n";
    let text = format!("{}g top\nf 5 6 8 7\ng rest\n{rest}", corners.concat());
    std::fs::write(place.path("cube.obj"), text).unwrap();
}

#[test]
fn labels_and_places_have_edges_of_their_length() {
    let place = place();
    grouped(&place);
    let where_top = "--refine label:top=0.04";
    place.run(&format!("remesh cube.obj out.ply -n 2500 {where_top} --quality draft"));
    let mesh = read(place.path("out.ply")).unwrap().mesh;
    assert_eq!(mesh.vertices.len(), 2500);
    let on_top = mesh.vertices.iter().filter(|p| p.z > 0.9999).count();
    // 1 / (0.866 * 0.04²) is 722, and half of the border more.
    assert!((680..860).contains(&on_top), "{on_top}");
    place.run(&format!("batch cube.obj --out many -n 2500 {where_top} --quality draft"));
    let [one, many] = ["out.ply", "many/cube.ply"].map(|name| std::fs::read(place.path(name)).unwrap());
    assert_eq!(one, many);
    // The other edges are as long as asked for.
    place.run("remesh cube.obj even.ply --edge-length 0.1 --quality draft");
    place.run("remesh cube.obj more.ply --edge-length 0.1 --refine sphere:0,0,0,0.3=0.03 --quality draft");
    let count = |name| read(place.path(name)).unwrap().mesh.vertices.len();
    // Three quarters of an eighth of a ball's section at a corner, and what grows around it.
    assert!(count("even.ply") == 693 && (900..1400).contains(&count("more.ply")), "{}", count("more.ply"));
    let (_, text) = place.run("remesh in.ply out.ply -n 300 --refine sphere:99,0,0,1=0.1 --quality draft");
    assert!(text.contains("--refine sphere:99,0,0,1 has no effect"), "{text}");
}

#[test]
fn errors_say_what_to_do() {
    let place = place();
    grouped(&place);
    place.run("sample torus plain.obj");
    for (arguments, words) in [
        ("in.ply out.ply --sizing property:none", "no numeric attribute 'none'"),
        ("in.ply out.ply --sizing property:none", "use one of these: wish"),
        ("in.ply out.ply --sizing property:colour", "no numeric attribute 'colour'"),
        ("plain.obj out.ply --sizing property:wish", "a PLY property"),
        ("in.ply out.ply --sizing property:", "property:NAME"),
        ("in.ply out.ply --sizing often", "property:NAME"),
        ("in.ply out.ply --gradation 1", "--gradation needs --sizing curvature"),
        ("in.ply out.ply --sizing property:wish --gradation 1", "--gradation needs"),
        ("in.ply out.ply --min-edge 1%", "--min-edge needs"),
        ("in.ply out.ply --sizing curvature --gradation 9", "use 0 to 3"),
        ("in.ply out.ply --sizing curvature --min-edge 90%", "the mean edge length of the result"),
        ("in.ply out.ply --sizing curvature --preset rpf", "--preset default"),
        ("in.ply out.ply --max-deviation 1% --sizing curvature", "use --sizing anisotropic"),
        ("in.ply out.ply --sizing curvature --aspect 3", "--aspect needs --sizing anisotropic"),
        ("in.ply out.ply --sizing anisotropic --aspect 0.5", "use 1 to 100"),
        ("in.ply out.ply --sizing anisotropic --gradation 1", "--gradation needs"),
        ("in.ply out.ply --sizing anisotropic --keep-boundary", "--keep-boundary does not go together"),
        ("in.ply out.ply --sizing anisotropic --only label:top", "--only does not go together"),
        ("in.ply out.ply --sizing anisotropic --min-angle 20", "--min-angle does not go together"),
        ("in.ply out.ply --sizing anisotropic --vertices-at-least", "--vertices-at-least does not"),
        ("in.ply out.ply --sizing anisotropic --refine sphere:0,0,0,9=1", "--refine does not go together"),
        ("in.ply out.ply --sizing anisotropic --min-edge 90%", "the mean edge length of the result"),
        ("in.ply --sizing anisotropic --dry-run", "no plan in advance"),
        ("in.ply out.ply --sizing anisotropic --preset rtf", "--preset default"),
        ("in.ply out.ply --max-deviation 0", "out of range"),
        ("in.ply out.ply --max-deviation 1% --preset rtf", "--preset default"),
        ("in.ply --max-deviation 1% --dry-run", "several runs"),
        ("cube.obj out.ply --refine label:none=0.1", "use one of these: top, rest"),
        ("in.ply out.ply --refine label:none=0.1", "whose triangles have labels"),
        ("in.ply out.ply --refine sphere:0,0,0=0.1", "give sphere:X,Y,Z,R=LENGTH"),
        ("in.ply out.ply --refine sphere:0,0,0,0=0.1", "give a centre, and a radius above 0"),
        ("in.ply out.ply --refine sphere:0,0,0,9=0.01", "--refine"),
        ("in.ply out.ply --refine sphere:0,0,0,9=0.1 --max-deviation 1%", "cannot be used with"),
        ("in.ply out.ply --refine sphere:0,0,0,9=0.1 --preset rtf", "--preset default"),
    ] {
        let done = place.program(&format!("remesh {arguments} -n 500")).assert().failure();
        let text = String::from_utf8(done.get_output().stderr.clone()).unwrap();
        assert!(text.contains(words), "{arguments}: {text}");
        assert!(!place.path("out.ply").exists());
    }
    // Without a number of vertices, no message has one.
    for (arguments, words) in [
        ("--edge-length 10% --refine sphere:0,0,0,9=1e-5", "are too short: they need millions of vertices"),
        ("--edge-length 10% --refine sphere:0,0,0,9=5% --min-edge 9%", "the mean edge length of the result"),
    ] {
        let done = place.program(&format!("remesh in.ply out.ply {arguments}")).assert().failure();
        let text = String::from_utf8(done.get_output().stderr.clone()).unwrap();
        assert!(text.contains(words) && !text.contains("1048576"), "{arguments}: {text}");
    }
}
