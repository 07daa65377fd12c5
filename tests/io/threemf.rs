//! 3MF: parts, components, units, materials, and packages that are refused.

use std::io::{Cursor, Write};
use std::path::Path;

use crate::support::files::{encode_with, read_bytes, read_bytes_with_materials};
use glam::DVec3;
use rtfmesh::TriMesh;
use rtfmesh::io::{Encoding, Format, Loaded, Writer};
use rtfmesh::mesh::attributes::{Attribute, Attributes, Kind, Role};
use rtfmesh::mesh::samples::sample;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use crate::support::place::Place;
use crate::support::shapes::{moved, union};

const MESH: &str = "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/>\
                    <vertex x=\"0\" y=\"2\" z=\"0\"/></vertices>\
                    <triangles><triangle v1=\"0\" v2=\"1\" v3=\"2\"/></triangles></mesh>";

/// A ZIP file of these files.
fn package(files: &[(&str, &str)]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, text) in files {
        zip.start_file(*name, SimpleFileOptions::default()).unwrap();
        zip.write_all(text.as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

fn model(unit: &str, resources: &str, build: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?><model unit=\"{unit}\"><metadata name=\"Title\">&lt;x&gt;</metadata>\
         <resources>{resources}</resources><build>{build}</build></model>"
    )
}

fn one(unit: &str, resources: &str, build: &str) -> Vec<u8> {
    package(&[("3D/3dmodel.model", &model(unit, resources, build))])
}

fn problem(bytes: &[u8]) -> String {
    read_bytes(bytes, None).unwrap_err().to_string()
}

#[test]
fn objects_of_the_build_are_parts_in_millimetres() {
    let resources = format!(
        "<object id=\"1\" name=\"leaf\">{MESH}</object><object id=\"2\">{MESH}</object>\
         <object id=\"4\"><components><component objectid=\"1\" transform=\"0 1 0 -1 0 0 0 0 1 10 20 30\"/>\
         <component objectid=\"2\" transform=\"-1 0 0 0 1 0 0 0 1 0 0 0\"/></components></object>\
         <object id=\"5\" name=\"unused\">{MESH}</object>"
    );
    let build = "<item objectid=\"4\"/><item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 0 0 5\"/>";
    let Loaded { mesh, attributes, notes, .. } = read_bytes(&one("inch", &resources, build), None).unwrap();
    assert_eq!(mesh.vertices.len(), 9);
    // x to y, y to -x, then moved.
    let at = |v: usize| mesh.vertices[v] / 25.4;
    assert!(at(1).distance(DVec3::new(10.0, 21.0, 30.0)) < 1e-12, "{}", at(1));
    assert!(at(2).distance(DVec3::new(8.0, 20.0, 30.0)) < 1e-12, "{}", at(2));
    assert!(at(6).distance(DVec3::new(0.0, 0.0, 5.0)) < 1e-12, "{}", at(6));
    // What is mirrored is turned.
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 5, 4], [6, 7, 8]]);
    let part = attributes.face_named("object").unwrap();
    assert_eq!(
        (part.role, part.names.as_slice()),
        (Role::Label, &["leaf", "object_2", "leaf 2"].map(str::to_owned)[..])
    );
    assert_eq!(part.values, [0.0, 1.0, 2.0]);
    assert_eq!(notes, ["lengths were converted from inch to millimetres"]);
    // A single part is no information, and a model without a build is all of it.
    let single = one("millimeter", &format!("<object id=\"7\">{MESH}</object>"), "");
    let Loaded { mesh, attributes, .. } = read_bytes(&single, None).unwrap();
    assert_eq!((mesh.vertices[2].y, attributes.is_empty()), (2.0, true));
}

#[test]
fn models_may_be_in_several_files() {
    let root = model(
        "millimeter",
        "<object id=\"2\" name=\"plate\"><components>\
         <component p:path=\"/3D/Objects/a.model\" objectid=\"1\"/>\
         <component p:path=\"/3D/Objects/a.model\" objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 0 0 9\"/>\
         </components></object>",
        "<item objectid=\"2\"/>",
    );
    let other = model("centimeter", &format!("<object id=\"1\">{MESH}</object>"), "");
    let rels = "<Relationships><Relationship Target=\"/3D/root.model\" Id=\"r\" \
                Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>";
    let files = [("_rels/.rels", rels), ("3D/root.model", &root), ("3D/Objects/a.model", &other)];
    let Loaded { mesh, attributes, .. } = read_bytes(&package(&files), None).unwrap();
    assert_eq!((mesh.vertices[1].x, mesh.vertices[4]), (10.0, DVec3::new(10.0, 0.0, 9.0)));
    assert_eq!(attributes.face_named("object").unwrap().names, ["plate", "plate 2"]);
    assert!(problem(&package(&files[..2])).contains("no model '3D/Objects/a.model'"));
}

/// Two boxes apart, with names of parts and materials.
fn boxes() -> (TriMesh, Attributes) {
    let cube = sample("box").unwrap();
    let mesh = union(&cube, &moved(&cube, |v| v + DVec3::new(5.0, 0.1, 1.0 / 3.0)));
    let label = |name: &str, values: Vec<f64>, names: &[&str]| Attribute {
        names: names.iter().map(|name| (*name).to_owned()).collect(),
        ..Attribute::new(name, Role::Label, Kind::U32, 1, values)
    };
    let half = |t: usize| f64::from(u8::from(t >= 12));
    let face = vec![
        label("object", (0..24).map(half).collect(), &["lid <1>", "base & \"foot\""]),
        label("material", (0..24).map(|t| f64::from(u8::from(t % 2 == 1))).collect(), &["PLA", "ABS", ""]),
    ];
    (mesh, Attributes { face, ..Attributes::default() })
}

#[test]
fn parts_and_materials_come_back() {
    let (mesh, attributes) = boxes();
    let encoding = Encoding { format: Format::ThreeMf, gzip: false };
    let bytes = encode_with(Path::new("x"), &mesh, &attributes, encoding).unwrap();
    assert_eq!(bytes, encode_with(Path::new("x"), &mesh, &attributes, encoding).unwrap());
    let loaded = read_bytes(&bytes, None).unwrap();
    assert_eq!((loaded.mesh.triangles.len(), loaded.notes.len()), (24, 0));
    let corners = |mesh: &TriMesh| (0..24).map(|t| mesh.corners(t)).collect::<Vec<_>>();
    assert_eq!(corners(&loaded.mesh), corners(&mesh));
    let [object, material] = loaded.attributes.face.as_slice() else { panic!("{:?}", loaded.attributes) };
    assert_eq!(object, &attributes.face[0]);
    assert_eq!((&material.names, &material.values), (&attributes.face[1].names, &attributes.face[1].values));
    assert_eq!(rtfmesh::io::lost_attributes_note(&attributes, Format::ThreeMf), None);
}

#[test]
fn colours_of_materials_come_along() {
    let resources = format!(
        "<basematerials id=\"9\"><base name=\"red\" displaycolor=\"#FF0000\"/><base name=\"clear\" \
         displaycolor=\"#80808040\"/></basematerials><object id=\"1\" pid=\"9\" pindex=\"0\">{}</object>",
        MESH.replace("</triangles>", "<triangle v1=\"0\" v2=\"2\" v3=\"1\" pid=\"9\" p1=\"1\"/></triangles>")
    );
    let loaded =
        read_bytes_with_materials(&one("millimeter", &resources, "<item objectid=\"1\"/>"), None).unwrap();
    let material = loaded.attributes.face_named("material").unwrap();
    assert_eq!(
        (&material.names[..2], &material.values),
        (&["red".to_owned(), "clear".to_owned()][..], &vec![0.0, 1.0])
    );
    let encode = |format| {
        let encoding = Encoding { format, gzip: false };
        encode_with(Path::new("x"), &loaded.mesh, &loaded.attributes, encoding).unwrap()
    };
    let json = crate::support::painted::split(&encode(Format::Glb)).0;
    let factor = |k: usize| json["materials"][k]["pbrMetallicRoughness"]["baseColorFactor"].clone();
    assert_eq!(factor(0), serde_json::json!([1.0, 0.0, 0.0, 1.0]));
    // sRGB to linear.
    assert!((factor(1)[0].as_f64().unwrap() - 0.2158).abs() < 1e-3);
    let again = read_bytes_with_materials(&encode(Format::ThreeMf), None).unwrap();
    assert_eq!(again.attributes.materials, loaded.attributes.materials);
}

#[test]
fn textures_and_groups_of_colours_that_are_ignored_are_told() {
    let painted = MESH.replace("v3=\"2\"", "v3=\"2\" pid=\"9\" p1=\"0\"");
    let told = |extra: &str| {
        let resources = format!("{extra}<object id=\"1\">{painted}</object>");
        read_bytes(&one("millimeter", &resources, "<item objectid=\"1\"/>"), None).unwrap().notes
    };
    let picture = "<m:texture2d id=\"8\" path=\"/3D/a.png\" contenttype=\"image/png\"/>\
                   <m:texture2dgroup id=\"9\" texid=\"8\"><m:tex2coord u=\"0\" v=\"0\"/></m:texture2dgroup>";
    assert_eq!(told(picture), ["1 texture was ignored"]);
    let colours = "<m:colorgroup id=\"9\"><m:color color=\"#ff0000\"/></m:colorgroup>";
    assert_eq!(told(colours), ["1 group of colours was ignored"]);
    assert!(told("").is_empty());
}

#[test]
fn packages_that_are_refused() {
    let object = |mesh: &str| format!("<object id=\"1\">{mesh}</object>");
    let item = "<item objectid=\"1\"/>";
    for (unit, resources, build, words) in [
        ("mile", object(MESH), item, "unknown unit 'mile'"),
        ("inch", object(MESH), "<item objectid=\"3\"/>", "no object 3"),
        ("inch", object(MESH), "<item/>", "has no 'objectid'"),
        ("inch", object(MESH), "<item objectid=\"1\" transform=\"1 2 3\"/>", "does not have 12 numbers"),
        (
            "inch",
            object(MESH),
            "<item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 0 0 0 0\"/>",
            "flat or not finite",
        ),
        ("inch", object(&MESH.replace("v3=\"2\"", "v3=\"3\"")), item, "no vertex 3"),
        ("inch", object(&MESH.replace("x=\"1\"", "x=\"nan\"")), item, "not a finite number"),
        ("inch", object(&MESH.replace("</triangles>", "")), item, "not valid XML"),
        ("inch", object("<components><component objectid=\"1\"/></components>"), item, "nested too deep"),
        ("inch", object(""), item, "no object 1"),
        ("inch", String::new(), "", "no vertices"),
    ] {
        let error = problem(&one(unit, &resources, build));
        assert!(error.contains(words), "{words}: {error}");
    }
    let whole = one("inch", &object(MESH), item);
    assert!(problem(&package(&[("a.txt", "a")])).contains("no model '3D/3dmodel.model'"));
    for length in 4..whole.len() {
        let _ = read_bytes(&whole[..length], None);
    }
    for at in 0..whole.len() {
        for value in [0, 0xff, b'9'] {
            let mut copy = whole.clone();
            copy[at] = value;
            let _ = read_bytes(&copy, None);
        }
    }
}

#[test]
fn little_that_stands_for_much_is_refused() {
    // Blanks of many gigabytes would fit into some megabytes.
    let blanks = " ".repeat(256 << 20);
    let bomb = one("inch", &format!("<object id=\"1\">{MESH}</object>{blanks}"), "<item objectid=\"1\"/>");
    assert!(problem(&bomb).contains("expand to far more"), "{}", bomb.len());
    // Each object is the one before, ten times.
    let mut resources = format!("<object id=\"0\">{MESH}</object>");
    for id in 1..30 {
        let parts = format!("<component objectid=\"{}\"/>", id - 1).repeat(10);
        resources += &format!("<object id=\"{id}\"><components>{parts}</components></object>");
    }
    let error = problem(&one("inch", &resources, "<item objectid=\"29\"/>"));
    assert!(error.contains("too many") || error.contains("too often"), "{error}");
}

#[test]
fn the_program_keeps_parts() {
    let place = Place::new();
    let (mesh, attributes) = boxes();
    let encoding = Encoding { format: Format::ThreeMf, gzip: false };
    Writer::new().attributes(&attributes).encoding(encoding).write(place.path("in.3mf"), &mesh).unwrap();
    place.run("remesh in.3mf out.3mf -n 200 --iterations 2 --quality draft -q");
    let result = rtfmesh::io::read(place.path("out.3mf")).unwrap();
    let part = result.attributes.face_named("object").unwrap();
    assert_eq!(part.names, attributes.face[0].names);
    for (t, value) in part.values.iter().enumerate() {
        assert_eq!(result.mesh.corners(t)[0].x > 3.0, *value == 1.0, "triangle {t}");
    }
}

#[test]
fn parts_beside_the_model_are_left_out() {
    let object = |id: u32, kind: &str| format!("<object id=\"{id}\" type=\"{kind}\">{MESH}</object>");
    let resources = format!("{}{}{}", object(1, "model"), object(2, "support"), object(3, "other"));
    let items = [1, 2, 3].map(|id| format!("<item objectid=\"{id}\"/>")).concat();
    let build = format!("{items}<item objectid=\"1\" printable=\"0\"/>");
    let loaded = read_bytes(&one("millimeter", &resources, &build), None).unwrap();
    assert_eq!(loaded.mesh.triangles.len(), 1);
    let notes =
        ["2 parts that are not of the model were ignored", "1 item that is not to be printed was ignored"];
    assert_eq!(loaded.notes, notes);
}

#[test]
fn a_triangle_without_a_group_of_materials_takes_that_of_its_object() {
    let two = MESH.replace("</triangles>", "<triangle v1=\"2\" v2=\"1\" v3=\"0\" p1=\"1\"/></triangles>");
    let resources = format!(
        "<basematerials id=\"7\"><base name=\"a\"/><base name=\"b\"/></basematerials>\
         <object id=\"1\" pid=\"7\" pindex=\"0\">{two}</object>"
    );
    let loaded = read_bytes(&one("millimeter", &resources, "<item objectid=\"1\"/>"), None).unwrap();
    let material = loaded.attributes.face_named("material").unwrap();
    let names: Vec<&str> = (0..2).map(|t| material.names[material.at(t)[0] as usize].as_str()).collect();
    assert_eq!(names, ["a", "b"]);
}
