//! Material libraries of OBJ files: read with their pictures for GLB, and named by OBJ files elsewhere.

use std::path::Path;

use crate::support::files::encode_with;
use rtfmesh::io::{Encoding, Format, Loaded, Reader, Writer, read};
use rtfmesh::mesh::attributes::Materials;
use serde_json::Value;

use crate::support::painted::{checker, split};
use crate::support::place::Place;
use crate::support::store_glb;

/// A square of two materials and texture coordinates.
const SQUARE: &str = "mtllib looks/some.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
                      usemtl oak wood\nf 1/1 2/2 3/3\nusemtl glass\nf 1/1 3/3 4/4\n";

/// The square with this library in a folder of its own, and a picture there.
fn place(library: &str) -> Place {
    let place = Place::new();
    std::fs::create_dir(place.path("looks")).unwrap();
    std::fs::write(place.path("in.obj"), SQUARE).unwrap();
    std::fs::write(place.path("looks/some.mtl"), library).unwrap();
    std::fs::write(place.path("looks/oak.png"), checker(0)).unwrap();
    place
}

fn loaded(library: &str) -> Loaded {
    Reader::new().materials(true).read(place(library).path("in.obj")).unwrap()
}

/// The JSON of the mesh as GLB.
fn glb(loaded: &Loaded) -> Value {
    let encoding = Encoding { format: Format::Glb, gzip: false };
    let bytes = encode_with(Path::new("x"), &loaded.mesh, &loaded.attributes, encoding).unwrap();
    store_glb(&bytes);
    gltf::Gltf::from_slice(&bytes).unwrap();
    split(&bytes).0
}

#[test]
fn colours_and_pictures_come_along_to_glb() {
    let library = "# by hand\nnewmtl oak wood\nKd 0 0 0\nmap_Kd -blendu on -s 1 1 1 -clamp on oak.png\n\
                   newmtl glass\nKd 0.25 0.5 1 \nd 0.5\nKe 0 0 0.125\nPr 0.25\nPm 1\nNs 3\n";
    let loaded = loaded(library);
    assert_eq!(loaded.notes, ["files that it refers to were read: looks/some.mtl, looks/oak.png"]);
    let materials = loaded.attributes.materials.as_ref().unwrap();
    assert_eq!((materials.used_count(), materials.images().len()), (2, 1));
    assert_eq!(&*materials.images()[0].bytes, checker(0));
    let json = glb(&loaded);
    let [oak, glass] = json["materials"].as_array().unwrap().as_slice() else { panic!("{json}") };
    assert_eq!((&oak["name"], &glass["name"]), (&"oak wood".into(), &"glass".into()));
    let of_oak = &oak["pbrMetallicRoughness"];
    // White, since the picture takes the colour's place.
    assert_eq!(of_oak["baseColorFactor"], serde_json::json!([1.0, 1.0, 1.0, 1.0]));
    assert_eq!(of_oak["baseColorTexture"]["index"], 0);
    assert_eq!(json["samplers"][0]["wrapS"], 33071);
    let of_glass = &glass["pbrMetallicRoughness"];
    assert_eq!(of_glass["baseColorFactor"], serde_json::json!([0.25, 0.5, 1.0, 0.5]));
    assert_eq!((&of_glass["metallicFactor"], &of_glass["roughnessFactor"]), (&1.0.into(), &0.25.into()));
    assert_eq!((&glass["alphaMode"], &glass["emissiveFactor"][2]), (&"BLEND".into(), &0.125.into()));
    assert_eq!(json["images"][0]["mimeType"], "image/png");
}

/// What was left out, and the materials.
fn without_picture(library: &str) -> (String, Materials) {
    let loaded = loaded(library);
    glb(&loaded);
    let materials = loaded.attributes.materials.unwrap();
    assert_eq!((materials.images().len(), materials.used_count()), (0, 1));
    (loaded.notes.join("; "), materials)
}

#[test]
fn what_cannot_be_read_is_noted() {
    for (name, words) in [
        ("pine.png", "no such file"),
        ("../../secret.png", "outside the folder"),
        ("some.mtl", "neither PNG nor JPEG"),
        ("file:///etc/passwd", "no such file"),
    ] {
        let (notes, _) = without_picture(&format!("newmtl oak wood\nmap_Kd {name}\n"));
        assert!(notes.contains("the picture '") && notes.contains(words), "{name}: {notes}");
        assert!(notes.contains("1 material is not in the material library"), "{notes}");
    }
    // The path of another machine stands for what lies beside the library.
    for name in ["C:\\art\\oak.png", "/home/me/oak.png", "textures/oak.png"] {
        let loaded = loaded(&format!("newmtl oak wood\nmap_Kd {name}\n"));
        assert_eq!(loaded.attributes.materials.unwrap().images().len(), 1, "{name}");
        let told = format!("the picture 'oak.png' was read in place of '{}'", name.replace('\\', "/"));
        assert!(loaded.notes.contains(&told), "{:?}", loaded.notes);
    }
    let place = place("newmtl oak wood\n");
    std::fs::write(place.path("windows.obj"), SQUARE.replace("looks/some.mtl", r".\looks\some.mtl")).unwrap();
    let windows = Reader::new().materials(true).read(place.path("windows.obj")).unwrap();
    assert!(windows.attributes.materials.is_some(), "{:?}", windows.notes);
    std::fs::remove_file(place.path("looks/some.mtl")).unwrap();
    let loaded = Reader::new().materials(true).read(place.path("in.obj")).unwrap();
    assert_eq!(loaded.attributes.materials, None);
    assert!(loaded.notes[0].starts_with("a material library was left out"), "{:?}", loaded.notes);
    // However often it is named.
    std::fs::write(place.path("often.obj"), "mtllib looks/some.mtl\n".repeat(9) + SQUARE).unwrap();
    let often = Reader::new().materials(true).read(place.path("often.obj")).unwrap();
    assert_eq!(often.notes, loaded.notes);
    // Nothing is looked for unless asked.
    assert_eq!(read(place.path("in.obj")).unwrap().notes, Vec::<String>::new());
}

#[test]
fn an_obj_file_elsewhere_names_the_same_library() {
    let place = place("newmtl glass\n");
    std::fs::create_dir(place.path("out")).unwrap();
    let loaded = read(place.path("in.obj")).unwrap();
    let obj = Encoding { format: Format::Obj, gzip: false };
    let library_of = |name: &str| {
        Writer::new()
            .attributes(&loaded.attributes)
            .encoding(obj)
            .write(place.path(name), &loaded.mesh)
            .unwrap();
        let text = String::from_utf8(place.bytes(name)).unwrap();
        text.lines().next().unwrap().strip_prefix("mtllib ").unwrap().to_owned()
    };
    assert_eq!(library_of("again.obj"), "looks/some.mtl");
    assert_eq!(library_of("out/again.obj"), "../looks/some.mtl");
    assert_eq!(library_of("looks/again.obj"), "some.mtl");
    let there = Reader::new().materials(true).read(place.path("out/again.obj")).unwrap();
    assert!(there.notes[0].contains("outside the folder"), "{:?}", there.notes);
    // Several on one line.
    let two = SQUARE.replace("looks/some.mtl", "a b.mtl ./c.MTL");
    std::fs::write(place.path("in.obj"), two).unwrap();
    let loaded = read(place.path("in.obj")).unwrap();
    Writer::new()
        .attributes(&loaded.attributes)
        .encoding(obj)
        .write(place.path("out/two.obj"), &loaded.mesh)
        .unwrap();
    let text = String::from_utf8(place.bytes("out/two.obj")).unwrap();
    assert!(text.starts_with("mtllib ../a b.mtl\nmtllib ../c.MTL\nv "), "{text}");
}

#[test]
fn the_program_brings_materials_where_seams_are_kept() {
    let place = place("newmtl oak wood\nmap_Kd oak.png\nnewmtl glass\nKd 0 0 1\n");
    std::fs::create_dir(place.path("out")).unwrap();
    let (_, notes) = place.run("remesh in.obj out/a.glb -n 60 --iterations 2 --quality draft --keep-uv");
    assert!(notes.contains("looks/oak.png"), "{notes}");
    let json = split(&place.bytes("out/a.glb")).0;
    assert_eq!(json["images"].as_array().unwrap().len(), 1);
    let (_, notes) = place.run("remesh in.obj out/a.glb -n 60 --iterations 2 --quality draft");
    assert!(notes.contains("the texture is not kept: --keep-uv keeps it"), "{notes}");
    let (_, notes) = place.run("remesh in.obj out/a.obj -n 60 --iterations 2 --quality draft --keep-uv");
    assert!(!notes.contains("cannot hold"), "{notes}");
    assert!(place.bytes("out/a.obj").starts_with(b"mtllib ../looks/some.mtl\n"));
    let reader = Reader::new().materials(true).files_from(place.path("."));
    let again = reader.read(place.path("out/a.obj")).unwrap();
    assert_eq!(again.attributes.materials.unwrap().images().len(), 1);
}
