//! Files as other programs write them, where these go their own ways.

use glam::DVec3;
use rtfmesh::WarningCode;
use rtfmesh::cloud::PointCloud;
use rtfmesh::io::{Loaded, Reader, Writer, target_encoding};
use rtfmesh::mesh::attributes::{Attribute, Attributes, Kind, Role};
use rtfmesh::mesh::samples::sample;
use serde_json::json;
use std::path::Path;

fn load(name: &str, content: impl AsRef<[u8]>) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    Reader::new().read_any(path).unwrap().mesh_or_points().unwrap()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn colours(loaded: &Loaded) -> Vec<[f64; 4]> {
    let colour = loaded.attributes.vertex_role(Role::Colour).unwrap();
    (0..loaded.mesh.vertices.len()).map(|v| colour.unit_colour(v)).collect()
}

#[test]
fn names_may_have_signs_that_begin_comments() {
    let text = format!(
        "# a comment\n{SQUARE}usemtl Material #25\ng part#1 # a comment\nf 1 2 3#\n\
         usemtl Material #26\ng part#2\nf 1 3 4 # a comment\n"
    );
    let loaded = load("a.obj", text.replace("3#", "3 #"));
    let names = |name: &str| loaded.attributes.face_named(name).unwrap().names.clone();
    assert_eq!(names("material"), ["Material #25", "Material #26"]);
    assert_eq!(names("group"), ["part#1", "part#2"]);
    let facet = "facet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    let stl = load("a.stl", format!("solid part #1\n{facet}endsolid\nsolid part #2\n{facet}endsolid\n"));
    assert_eq!(stl.attributes.face[0].names, ["part #1", "part #2"]);
}

#[test]
fn names_of_any_kind_are_written_so_that_the_file_stays_whole() {
    let mesh = sample("box").unwrap();
    let count = mesh.triangles.len();
    let values = (0..count).map(|t| (t % 3) as f64).collect();
    let names = ["a\nf 1 2 3", "b\\", "c #3"].map(str::to_owned).to_vec();
    let material = Attribute { names, ..Attribute::new("material", Role::Label, Kind::U32, 1, values) };
    let attributes = Attributes { face: vec![material], ..Attributes::default() };
    for (name, found) in [("a.obj", ["a f 1 2 3", "b", "c #3"]), ("a.3mf", ["a f 1 2 3", "b\\", "c #3"])] {
        let writer =
            Writer::new().attributes(&attributes).encoding(target_encoding(Path::new(name)).unwrap());
        let loaded = load(name, writer.encode(name, &mesh).unwrap());
        assert_eq!(loaded.mesh.triangles.len(), count, "{name}");
        let label = loaded.attributes.face_named("material").unwrap();
        let own: Vec<&str> = (0..3).map(|t| label.names[label.at(t)[0] as usize].as_str()).collect();
        assert_eq!(own, found, "{name}");
    }
}

#[test]
fn text_files_of_old_and_of_windows_programs() {
    let obj = format!("{SQUARE}f 1 2 3\nf 1 3 4\n");
    let facet = "facet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    let stl = format!("solid a\n{facet}endsolid\n");
    for (name, text, triangles) in [("a.obj", obj, 2), ("a.stl", stl, 1)] {
        for end in ["\r", "\r\n"] {
            assert_eq!(load(name, text.replace('\n', end)).mesh.triangles.len(), triangles, "{name} {end:?}");
        }
        assert_eq!(load(name, format!("\u{feff}{text}")).mesh.triangles.len(), triangles, "{name}");
    }
}

#[test]
fn colours_of_meshlab_and_of_programs_that_count_to_255() {
    let faces = "3 0 1 2\n3 0 2 3\n";
    let vertices =
        |extra: &str| ["0 0 0", "1 0 0", "1 1 0", "0 1 0"].map(|at| format!("{at} {extra}\n")).concat();
    let want = [1.0, 0.2, 0.0];
    for (text, note) in [
        (format!("NCOFF\n4 2 0\n{}{faces}", vertices("255 51 0 255 0 0 1")), "normals of the vertices"),
        (format!("CNOFF\n4 2 0\n{}{faces}", vertices("0 0 1 255 51 0 255")), "normals of the vertices"),
        (format!("NCSTOFF\n4 2 0\n{}{faces}", vertices("255 51 0 255 0 0 1 .5 .5")), "texture coordinates"),
    ] {
        let loaded = load("a.off", &text);
        let found = colours(&loaded);
        assert!(found.iter().all(|own| own[..3] == want), "{text}: {found:?}");
        assert!(loaded.notes.iter().any(|own| own.starts_with(note)), "{:?}", loaded.notes);
    }
    let obj =
        SQUARE.replace(" 0\nv", " 0 255 51 0\nv").trim_end().to_owned() + " 0 0 255\nf 1 2 3\nf 1 3 4\n";
    let found = colours(&load("a.obj", &obj));
    assert_eq!((found[0], found[3]), ([1.0, 0.2, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]), "{obj}");
    let ply = |names: [&str; 3]| {
        let [r, g, b] = names.map(|name| format!("property uchar {name}\n"));
        format!(
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
             {r}{g}{b}element face 2\nproperty list int int vertex_indices\nend_header\n{}{faces}",
            vertices("255 51 0")
        )
    };
    for names in [["diffuse_red", "diffuse_green", "diffuse_blue"], ["r", "g", "b"]] {
        assert!(colours(&load("a.ply", ply(names))).iter().all(|own| own[..3] == want), "{names:?}");
    }
}

#[test]
fn points_of_meshlab_cloudcompare_numpy_paraview_and_scanners() {
    let normals = load("a.obj", "vn 0 0 1\nv 0 0 0\nvn 0 1 0\nv 1 0 0\n");
    assert!(normals.attributes.face.is_empty());
    assert_eq!(PointCloud::from(normals).normals, [DVec3::Z, DVec3::Y]);
    for (text, names) in [
        ("//X Y Z Rf Gf Bf\n1 2 3 1 .5 0\n4 5 6 1 1 1\n", "colour"),
        ("# x y z intensity r g b\n1 2 3 7 255 0 0\n4 5 6 8 0 255 0\n", "colour intensity"),
        ("2\n1 2 3 7 255 0 0\n4 5 6 8 0 255 0\n", "colour value_4"),
        ("\"Points:0\",\"Points:1\",\"Points:2\",heat\n1,2,3,4\n4,5,6,7\n", "heat"),
        ("# anything\n1 2 3 # the first\n4 5 6\n", ""),
    ] {
        let loaded = load("a.txt", text);
        assert_eq!(loaded.mesh.vertices, [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0)], "{text}");
        let found: Vec<&str> = loaded.attributes.vertex.iter().map(|own| own.name.as_str()).collect();
        assert_eq!(found.join(" "), names, "{text}");
    }
    // Commas are decimal points if something else separates the numbers.
    let point = DVec3::new(1.5, 2.5, 3.0);
    for text in ["1,5;2,5;3,0\n4;5,5;6\n", "1,5 2,5 3,0\n4 5,5 6\n", "x;y;z\n1,5;2,5;3,0\n4;5,5;6\n"] {
        assert_eq!(load("a.csv", text).mesh.vertices, [point, DVec3::new(4.0, 5.5, 6.0)], "{text}");
    }
    for text in ["1.5,2.5,3\n", "1.5, 2.5, 3\n", "1.5;2.5;3\n", "1.5,2.5,3 \n"] {
        assert_eq!(load("a.csv", text).mesh.vertices, [point], "{text}");
    }
    assert_eq!(load("a.csv", "1,2,3\n4,5,6\n").mesh.vertices[0], DVec3::new(1.0, 2.0, 3.0));
}

#[test]
fn copies_of_meshes_by_an_extension_of_gltf_are_told() {
    let glb = Writer::new().encode("a.glb", &sample("box").unwrap()).unwrap();
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let mut scene: serde_json::Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    scene["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    let mut text = serde_json::to_vec(&scene).unwrap();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut changed = glb[..12].to_vec();
    changed.extend((text.len() as u32).to_le_bytes());
    changed.extend(b"JSON");
    changed.extend(&text);
    changed.extend(&glb[20 + length..]);
    let size = changed.len() as u32;
    changed[8..12].copy_from_slice(&size.to_le_bytes());
    let loaded = load("a.glb", changed);
    assert!(
        matches!(loaded.warnings.as_slice(), [(WarningCode::LeftOut, text)] if text.contains("one copy"))
    );
}
