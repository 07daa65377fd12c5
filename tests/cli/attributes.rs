//! Vertex and face attributes carried from input file to output file by the program.

use crate::support::place::Place;
use predicates::prelude::*;
use rtfmesh::TriMesh;
use rtfmesh::io::{Writer, read};
use rtfmesh::mesh::attributes::{Attribute, Attributes, CornerUv, Kind, Role};
use rtfmesh::mesh::samples::sample;

/// A box as `in.ply` with colours, texture coordinates and a label on each triangle.
fn place() -> (Place, TriMesh) {
    let place = Place::new();
    let mesh = sample("box").unwrap();
    let colours = mesh.vertices.iter().flat_map(|v| v.to_array().map(|x| if x > 0.5 { 255.0 } else { 0.0 }));
    let side = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        let normal = (b - a).cross(c - a).to_array();
        let axis = if normal[0] != 0.0 {
            0
        } else if normal[1] != 0.0 {
            1
        } else {
            2
        };
        2.0 * f64::from(axis) + f64::from(u8::from(normal[axis as usize] > 0.0))
    };
    let uv = mesh.triangles.as_flattened().iter().map(|v| {
        let p = mesh.vertices[*v as usize];
        [0.5 * p.x + 0.25 * p.z, 0.5 * p.y]
    });
    let attributes = Attributes {
        vertex: vec![Attribute::new("colour", Role::Colour, Kind::U8, 3, colours.collect())],
        face: vec![Attribute::new("part", Role::Label, Kind::U8, 1, (0..12).map(side).collect())],
        uv: Some(CornerUv { kind: Kind::F32, values: uv.collect() }),
        ..Default::default()
    };
    Writer::new().attributes(&attributes).write(place.path("in.ply"), &mesh).unwrap();
    (place, mesh)
}

#[test]
fn attributes_are_carried_over_and_what_is_dropped_is_noted() {
    let (place, _) = place();
    for (name, words) in [
        ("out.ply", ""),
        ("out.obj", "OBJ cannot hold these: part of each face (1 x u8)"),
        ("out.glb", "GLB cannot hold these: part"),
        ("out.off", "OFF cannot hold these: part of each face (1 x u8), texture coordinates"),
        ("out.mesh", "MEDIT cannot hold these: colour"),
    ] {
        let (_, notes) = place.run(&format!("remesh in.ply {name} -n 300 --iterations 2 --quality draft"));
        assert!(
            notes.contains(words) && notes.contains("cannot hold") != words.is_empty(),
            "{name}: {notes}"
        );
        let loaded = read(place.path(name)).unwrap();
        let found = loaded.attributes;
        assert_eq!(found.vertex_role(Role::Colour).is_some(), name != "out.mesh", "{name}");
        if let Some(colour) = found.vertex_role(Role::Colour) {
            for (v, place) in loaded.mesh.vertices.iter().enumerate() {
                let shades = colour.unit_colour(v);
                let near = place.to_array().iter().zip(shades).all(|(x, shade)| (x - shade).abs() < 0.02);
                assert!(near, "{name}: {place} {shades:?}");
            }
        }
        let label = if name == "out.ply" { found.face_named("part") } else { found.face_named("reference") };
        if let Some(label) = label {
            for t in 0..loaded.mesh.triangles.len() {
                let [a, b, c] = loaded.mesh.corners(t);
                let normal = (b - a).cross(c - a).normalize().to_array()[label.at(t)[0] as usize / 2];
                assert!(normal.abs() > 0.99, "{name}");
            }
        }
    }
    let (_, notes) = place.run("remesh in.ply out.ply -n 300 --iterations 2 --no-attributes");
    assert!(read(place.path("out.ply")).unwrap().attributes.is_empty(), "{notes}");
    // STL has nothing to hold them in, and nothing is looked for.
    let (_, notes) = place.run("remesh in.ply out.stl -n 300 --iterations 2");
    assert!(!notes.contains("source"), "{notes}");
}

#[test]
fn seams_and_borders_are_kept_if_asked() {
    let (place, mesh) = place();
    place.run(
        "remesh in.ply out.ply -n 300 --iterations 2 --keep-labels --feature-angle 180 --report r.json -q",
    );
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(place.path("r.json")).unwrap()).unwrap();
    assert_eq!((&report["features"]["curves"], &report["features"]["corners"]), (&12.into(), &8.into()));
    assert_eq!(report["options"]["coarse_to_fine"]["label_borders"], 24);
    let found = read(place.path("out.ply")).unwrap();
    let [low, high] = found.mesh.bounds().unwrap();
    let [low_before, high_before] = mesh.bounds().unwrap();
    assert!(low.distance(low_before).max(high.distance(high_before)) < 1e-12);
    let (text, notes) = place.run("remesh in.ply out.ply -n 300 --keep-uv --keep-labels --dry-run");
    assert!(text.contains("12, 8, 6") && notes.is_empty(), "{text}{notes}");
    let (_, notes) = place.run("remesh in.ply bare.stl -n 300 --iterations 2");
    assert!(notes.contains("smallest angle"));
    let (_, notes) =
        place.run("remesh bare.stl out.ply -n 200 --iterations 2 --keep-uv --keep-labels --report bare.json");
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(place.path("bare.json")).unwrap()).unwrap();
    let reported = report["notes"].to_string();
    for words in ["--keep-uv has no effect", "--keep-labels has no effect"] {
        assert!(notes.contains(&format!("note: bare.stl: {words}")), "{notes}");
        assert!(reported.contains(words), "{reported}");
    }
    for arguments in [
        "--keep-uv --preset rtf",
        "--keep-labels --preset cvd",
        "--keep-uv --no-attributes",
        "--keep-labels --no-attributes",
    ] {
        let refused = place.program(&format!("remesh in.ply out.ply -n 300 {arguments}")).assert().code(2);
        refused.stderr(predicate::str::contains("--keep-"));
    }
}

#[test]
fn borders_of_named_values_alone_are_kept() {
    let (place, _) = place();
    let curves = |arguments: &str| {
        place.run(&format!("remesh in.ply out.ply -n 300 --iterations 2 --feature-angle 180 -q {arguments}"));
        let report = std::fs::read(place.path("r.json")).unwrap();
        let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
        report["options"]["coarse_to_fine"]["label_borders"].clone()
    };
    for (names, borders) in [("", 24), ("=part", 24), ("=part,part", 24)] {
        assert_eq!(curves(&format!("--keep-labels{names} --report r.json")), borders, "{names}");
    }
    let refused = place.program("remesh in.ply out.ply -n 300 --keep-labels=part,side").assert().code(2);
    refused.stderr(predicate::str::contains("--keep-labels names side, and the faces have part"));
    let refused = place.program("remesh in.ply out.ply -n 300 --smooth-labels 2").assert().code(2);
    refused.stderr(predicate::str::contains("--keep-labels"));
}

#[test]
fn numbers_of_triangles_are_no_labels_unless_named() {
    let (place, mesh) = place();
    let own = |name: &str, of: fn(usize) -> f64| {
        let values = (0..mesh.triangles.len()).map(of).collect();
        Attribute::new(name, Role::Label, Kind::U32, 1, values)
    };
    let face = vec![own("half", |t| (t / 6) as f64), own("id", |t| t as f64)];
    let attributes = Attributes { face, ..Default::default() };
    Writer::new().attributes(&attributes).write(place.path("ids.ply"), &mesh).unwrap();
    let line = "remesh ids.ply out.ply -n 300 --iterations 2 --feature-angle 180 --report r.json";
    let run = |labels: &str| {
        let (_, notes) = place.run(&format!("{line} {labels}"));
        let report: serde_json::Value =
            serde_json::from_slice(&std::fs::read(place.path("r.json")).unwrap()).unwrap();
        (report["options"]["coarse_to_fine"]["label_borders"].as_u64().unwrap(), notes)
    };
    let (all, notes) = run("--keep-labels");
    let said = "keeps the borders of labels; id counts only if it is named: --keep-labels=id";
    assert!(notes.contains(said), "{notes}");
    let (half, quiet) = run("--keep-labels=half");
    assert!(!quiet.contains("keep-labels"), "{quiet}");
    // Every edge, those across the sides of the box among them.
    assert_eq!((all, run("--keep-labels=id").0), (half, 36));
    assert!(half < 24, "{half}");
}

#[test]
fn batches_carry_over_and_inspect_lists() {
    let (place, _) = place();
    place.run("batch in.ply --out done -n 300 --iterations 2 --format obj --keep-labels -q");
    let found = read(place.path("done/in.obj")).unwrap().attributes;
    assert!(found.vertex_role(Role::Colour).is_some() && found.uv.is_some());
    let log = std::fs::read_to_string(place.path("done/batch.jsonl")).unwrap();
    assert!(log.contains("OBJ cannot hold these: part of each face"), "{log}");
    let (text, _) = place.run("inspect in.ply");
    for row in
        ["colour of each vertex (3 x u8)", "part of each face (1 x u8)", "texture coordinates of each corner"]
    {
        assert!(text.contains(row), "'{row}' is missing: {text}");
    }
    let (json, _) = place.run("inspect in.ply --json");
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["attributes"][1], "part of each face (1 x u8)");
}

#[test]
fn solids_that_touch_keep_their_labels_and_a_warning_says_that_they_share_a_wall() {
    let place = Place::new();
    let model = sample("box").unwrap();
    let [low, high] = model.bounds().unwrap();
    let mut text = String::new();
    // The second is the first one's mirror image in their common side, so that its triangles are there twice.
    for (name, mirror) in [("left", false), ("right", true)] {
        text += &format!("solid {name}\n");
        for t in 0..model.triangles.len() {
            let mut corners = model.corners(t);
            if mirror {
                corners.reverse();
                corners.iter_mut().for_each(|p| p.x = 2.0 * high.x - p.x);
            }
            text += "facet normal 0 0 0\nouter loop\n";
            corners.iter().for_each(|p| text += &format!("vertex {} {} {}\n", p.x, p.y, p.z));
            text += "endloop\nendfacet\n";
        }
        text += "endsolid\n";
    }
    assert!(low.x < high.x);
    std::fs::write(place.path("two.stl"), text).unwrap();
    let (_, told) = place.run("remesh two.stl out.stl -n 200 --quality draft --keep-labels");
    assert!(told.contains("bodies of the input touch: 2 faces were merged"), "{told}");
    let out = read(place.path("out.stl")).unwrap();
    let label = out.attributes.face_named("group").unwrap();
    assert_eq!(label.names, ["left", "right"]);
    // Labels end where the solids do.
    for (t, label) in label.values.iter().enumerate() {
        let middle = out.mesh.corners(t).iter().map(|p| p.x).sum::<f64>() / 3.0;
        let side = if middle > high.x + 1e-6 { 1.0 } else { 0.0 };
        assert_eq!(*label, side, "triangle {t} at x = {middle}");
    }
}

#[test]
fn attributes_that_stl_cannot_hold_are_noted() {
    let place = Place::new();
    std::fs::write(
        place.path("a.off"),
        "OFF\n4 4 0\n0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n0 0 1 9 9 9\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"
            .replacen("OFF", "COFF", 1),
    )
    .unwrap();
    let (_, told) = place.run("remesh a.off out.stl -n 100 --quality draft --iterations 2");
    assert!(told.contains("STL cannot hold these: colour of each vertex"), "{told}");
    let (_, told) = place.run("remesh a.off out.stl -n 100 --quality draft --iterations 2 --no-attributes");
    assert!(!told.contains("cannot hold"), "{told}");
}
