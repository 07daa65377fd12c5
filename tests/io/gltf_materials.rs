//! Materials, textures and images from glTF to GLB.

use crate::support::files::{encode_with, read_bytes, read_bytes_with_materials};
use glam::DVec3;
use rtfmesh::Error;
use rtfmesh::io::{Loaded, Reader};
use rtfmesh::mesh::attributes::{Alpha, Attribute, Attributes, Image, Kind, Materials, Role, Textures};
use rtfmesh::mesh::samples::sample;
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::path::Path;

use crate::support::painted::{GLB, add, checker, globe, halves, one, sphere, split, textured, uri};
use crate::support::place::Place;
use crate::support::store_glb;

fn read(json: &Value) -> Loaded {
    read_bytes_with_materials(json.to_string().as_bytes(), None).unwrap()
}

/// The file that the mesh is written to, checked by the `gltf` crate, and its JSON.
#[track_caller]
fn written(loaded: &Loaded) -> (gltf::Gltf, Value) {
    let bytes = encode_with(Path::new("out"), &loaded.mesh, &loaded.attributes, GLB).unwrap();
    store_glb(&bytes);
    let again = read_bytes_with_materials(&bytes, None).unwrap();
    assert_eq!(
        (again.attributes.materials.as_ref(), again.notes.len()),
        (loaded.attributes.materials.as_ref(), 0)
    );
    (gltf::Gltf::from_slice(&bytes).unwrap(), split(&bytes).0)
}

/// The images in a file with their types.
fn pictures(file: &gltf::Gltf) -> Vec<(Vec<u8>, String)> {
    let blob = file.blob.as_deref().unwrap_or_default();
    let picture = |image: gltf::Image| match image.source() {
        gltf::image::Source::View { view, mime_type } => {
            (blob[view.offset()..][..view.length()].to_vec(), mime_type.to_owned())
        }
        other => panic!("{other:?}"),
    };
    file.images().map(picture).collect()
}

#[test]
fn the_program_carries_a_texture_and_its_material() {
    let (place, picture) = (Place::new(), checker(0));
    std::fs::create_dir(place.path("a folder")).unwrap();
    std::fs::write(place.path("a folder/b.png"), &picture).unwrap();
    let json = sphere(one, textured(json!({ "uri": "a%20folder/b.png", "name": "board" })));
    std::fs::write(place.path("in.gltf"), json.to_string()).unwrap();
    let common = "-n 400 --iterations 2 --quality draft";
    let (_, notes) = place.run(&format!("remesh in.gltf out.glb {common} --keep-uv"));
    assert_eq!(notes.matches("note:").count(), 1, "{notes}");
    assert!(notes.contains("files that it refers to were read: a folder/b.png"), "{notes}");
    let bytes = std::fs::read(place.path("out.glb")).unwrap();
    store_glb(&bytes);
    let file = gltf::Gltf::from_slice(&bytes).unwrap();
    assert_eq!(pictures(&file), [(picture, "image/png".to_owned())]);
    assert_eq!(file.images().next().unwrap().name(), Some("board"));
    let primitive = file.meshes().next().unwrap().primitives().next().unwrap();
    let material = primitive.material();
    assert_eq!((material.name(), material.double_sided()), (Some("skin"), true));
    let surface = material.pbr_metallic_roughness();
    assert_eq!(surface.base_color_factor(), [0.5, 1.0, 1.0, 1.0]);
    assert_eq!((surface.metallic_factor(), surface.roughness_factor()), (0.25, 0.75));
    let texture = surface.base_color_texture().unwrap();
    assert_eq!((texture.tex_coord(), texture.texture().source().index()), (0, 0));
    let sampler = texture.texture().sampler();
    assert_eq!(sampler.mag_filter(), Some(gltf::texture::MagFilter::Nearest));
    assert_eq!(sampler.wrap_s(), gltf::texture::WrappingMode::ClampToEdge);
    let blob = file.blob.as_deref().unwrap();
    let reader = primitive.reader(|_| Some(blob));
    let places: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
    let uv = reader.read_tex_coords(0).unwrap().into_f32();
    for (place, [_, v]) in places.iter().zip(uv) {
        let north = f64::from(place[2]) / DVec3::from(place.map(f64::from)).length();
        assert!((north.asin() / PI + 0.5 - (1.0 - f64::from(v))).abs() < 0.02, "{place:?} {v}");
    }
    // From a GLB file, the same image.
    place.run(&format!("remesh out.glb again.glb {common} --keep-uv"));
    let again = gltf::Gltf::from_slice(&std::fs::read(place.path("again.glb")).unwrap()).unwrap();
    assert_eq!(pictures(&again), pictures(&file));
    // Only if asked for, and not in every format, which is said.
    let (_, told) = place.run(&format!("remesh in.gltf plain.glb {common} -q --report r.json"));
    let warning = "the texture is not kept: --keep-uv keeps it and puts vertices on its seams";
    assert_eq!(told, format!("warning: {warning}\n"));
    assert_eq!(place.json("r.json")["warnings"], json!([warning]));
    place.run(&format!("batch in.gltf --out many --format glb {common} -q"));
    assert_eq!(place.json("many/batch.jsonl")["warnings"], json!([warning]));
    let (_, told) = place.run(&format!("remesh in.gltf plain.obj {common}"));
    assert!(told.contains("note: in.gltf: the texture is not kept: use .glb and --keep-uv\n"));
    let (_, told) = place.run(&format!("remesh in.gltf bare.glb {common} --no-attributes"));
    assert!(!told.contains("texture"), "{told}");
    assert_eq!(place.run("measure in.gltf").1, "");
    let (plain, _) = split(&std::fs::read(place.path("plain.glb")).unwrap());
    assert_eq!((plain.get("images"), &plain["materials"]), (None, &json!([{ "name": "skin" }])));
    let (_, notes) = place.run(&format!("remesh in.gltf out.ply {common} --keep-uv"));
    assert!(notes.contains("PLY cannot hold these: 1 material (1 picture)"), "{notes}");
}

#[test]
fn every_material_has_its_primitive() {
    let (place, pictures_in) = (Place::new(), [checker(0), checker(100)]);
    let mut parts = textured(json!({ "uri": uri(&pictures_in[0]) }));
    add(&mut parts["images"], json!({ "uri": uri(&pictures_in[1]) }));
    parts["textures"][0]["source"] = json!(1);
    let south = json!({
        "name": "south", "emissiveFactor": [0.1, 0.2, 0.3], "emissiveTexture": { "index": 1 },
        "normalTexture": { "index": 0, "scale": 0.5 }, "alphaMode": "MASK", "alphaCutoff": 0.25,
    });
    add(&mut parts["materials"], south);
    // No triangle has the third material, so its image is not needed.
    add(&mut parts["materials"], json!({ "normalTexture": { "index": 2 } }));
    add(&mut parts["textures"], json!({ "source": 2 }));
    add(&mut parts["images"], json!({ "uri": "none.png" }));
    let json = sphere(halves, parts);
    std::fs::write(place.path("in.gltf"), json.to_string()).unwrap();
    let common = "remesh in.gltf out.glb -n 400 --iterations 2 --quality draft --keep-uv";
    let (_, notes) = place.run(common);
    assert!(notes.contains("borders between materials are not kept; --keep-labels"), "{notes}");
    let (_, notes) = place.run(&format!("{common} --keep-labels"));
    assert!(!notes.contains("note:"), "{notes}");
    let file = gltf::Gltf::from_slice(&std::fs::read(place.path("out.glb")).unwrap()).unwrap();
    let primitives: Vec<gltf::Primitive> = file.meshes().next().unwrap().primitives().collect();
    let names: Vec<_> = primitives.iter().map(|p| p.material().name().unwrap().to_owned()).collect();
    assert_eq!(names, ["skin", "south"]);
    let south = primitives[1].material();
    assert_eq!((south.emissive_factor(), south.alpha_cutoff()), ([0.1, 0.2, 0.3], Some(0.25)));
    let normal = south.normal_texture().unwrap();
    assert_eq!((normal.scale(), south.alpha_mode()), (0.5, gltf::material::AlphaMode::Mask));
    let found = pictures(&file);
    let base = primitives[0].material().pbr_metallic_roughness().base_color_texture().unwrap();
    assert_eq!(found.len(), 2);
    assert_eq!(found[base.texture().source().index()].0, pictures_in[0]);
    assert_eq!(found[normal.texture().source().index()].0, pictures_in[1]);
    assert_eq!(south.emissive_texture().unwrap().texture().index(), base.texture().index());
}

#[test]
fn pictures_of_normals_come_with_tangents() {
    let mesh = sample("bumpy-sphere").unwrap();
    let outwards: Vec<DVec3> = mesh.vertices.iter().map(|p| p.normalize()).collect();
    let values = outwards.iter().flat_map(|n| n.to_array()).collect();
    let image = |bytes: Vec<u8>| Image { name: None, mime: "image/png".to_owned(), bytes: bytes.into() };
    let with = |normal: Option<Image>| {
        let materials = Materials::textured(Textures {
            base_colour: image(checker(0)),
            metallic_roughness: None,
            normal,
            emissive: None,
            metallic: 0.0,
            roughness: 1.0,
            alpha: Alpha::Opaque,
            double_sided: false,
        });
        let attributes = Attributes {
            vertex: vec![Attribute::new("normal", Role::Normal, Kind::F64, 3, Vec::clone(&values))],
            face: vec![one(&mesh)],
            uv: Some(globe(&mesh)),
            materials: Some(materials),
            ..Attributes::default()
        };
        let bytes = encode_with(Path::new("out"), &mesh, &attributes, GLB).unwrap();
        store_glb(&bytes);
        gltf::Gltf::from_slice(&bytes).unwrap()
    };
    let tangents = |file: &gltf::Gltf| {
        let primitive = file.meshes().next().unwrap().primitives().next().unwrap();
        let reader = primitive.reader(|_| file.blob.as_deref());
        let found = reader.read_tangents().map(Iterator::collect::<Vec<_>>);
        found.map(|found| found.into_iter().zip(reader.read_positions().unwrap()).collect::<Vec<_>>())
    };
    assert_eq!(tangents(&with(None)), None);
    let found = tangents(&with(Some(image(checker(100))))).unwrap();
    assert!(found.len() > mesh.vertices.len(), "vertices on the seam stand twice");
    for ([x, y, z, side], at) in found {
        let (tangent, normal) = (DVec3::new(x.into(), y.into(), z.into()), DVec3::from(at.map(f64::from)));
        let (east, normal) = (DVec3::Z.cross(normal), normal.normalize());
        assert!((tangent.length() - 1.0).abs() < 1e-6 && tangent.dot(normal).abs() < 1e-6);
        // Texture coordinates mean nothing at the poles.
        if normal.z.abs() < 0.9 {
            assert!(tangent.dot(east.normalize()) > 0.9 && side == 1.0, "{tangent} at {at:?}");
        }
    }
}

#[test]
fn extensions_of_materials_are_kept_and_others_noted() {
    let mut parts = textured(json!({ "uri": uri(&checker(0)) }));
    parts["materials"][0]["extensions"] = json!({
        "KHR_materials_ior": { "ior": 1.4 },
        "KHR_materials_clearcoat": { "clearcoatTexture": { "index": 1 } },
        "X_y": {},
    });
    parts["materials"][0]["occlusionTexture"] = json!({ "index": 1, "texCoord": 1 });
    parts["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
        json!({ "KHR_texture_transform": { "offset": [0.5, 0.25] } });
    let loaded = read(&sphere(one, parts.clone()));
    assert_eq!(
        loaded.notes,
        [
            "1 texture was left out, which uses another than the first set of texture coordinates",
            "extensions of materials were left out: X_y",
        ]
    );
    let bytes = encode_with(Path::new("out"), &loaded.mesh, &loaded.attributes, GLB).unwrap();
    store_glb(&bytes);
    let (json, _) = split(&bytes);
    let used = ["KHR_materials_clearcoat", "KHR_materials_ior", "KHR_texture_transform"];
    assert_eq!(json["extensionsUsed"], json!(used));
    let material = &json["materials"][0];
    assert_eq!(material["extensions"]["KHR_materials_clearcoat"]["clearcoatTexture"], json!({ "index": 0 }));
    assert_eq!((material.get("occlusionTexture"), json.get("extensionsRequired")), (None, None));
    parts["materials"][0]["extensions"] = json!({ "KHR_materials_unlit": {} });
    parts["materials"][0].as_object_mut().unwrap().remove("occlusionTexture");
    let (file, _) = written(&read(&sphere(one, parts.clone())));
    let material = file.materials().next().unwrap();
    let texture = material.pbr_metallic_roughness().base_color_texture().unwrap();
    assert!(material.unlit());
    assert_eq!(texture.texture_transform().unwrap().offset(), [0.5, 0.25]);
    // Image types that not all programs can read.
    parts["textures"][1] = json!({ "extensions": { "EXT_texture_webp": { "source": 0 } } });
    parts["images"][0] = json!({ "uri": uri(include_bytes!("../../fuzz/seeds/images/webp-lossy")) });
    let loaded = read(&sphere(one, parts));
    let (json, _) = split(&encode_with(Path::new("out"), &loaded.mesh, &loaded.attributes, GLB).unwrap());
    assert_eq!(json["textures"], json!([{ "extensions": { "EXT_texture_webp": { "source": 0 } } }]));
    assert_eq!(
        (&json["images"][0]["mimeType"], &json["extensionsRequired"]),
        (&json!("image/webp"), &json!(["EXT_texture_webp"]))
    );
}

#[test]
fn textures_need_texture_coordinates() {
    let mut json = sphere(one, textured(json!({ "uri": uri(&checker(0)) })));
    let whole = read(&json);
    json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("TEXCOORD_0");
    let bare = read(&json);
    assert_eq!(bare.notes, ["textures were left out: the mesh has no texture coordinates"]);
    let (_, json) = written(&bare);
    assert_eq!(json["materials"][0]["pbrMetallicRoughness"]["metallicFactor"], json!(0.25));
    assert_eq!((json.get("textures"), json.get("images")), (None, None));
    // Nor if they are removed later.
    let mut without = whole.clone();
    without.attributes.uv = None;
    let (json, _) = split(&encode_with(Path::new("out"), &whole.mesh, &without.attributes, GLB).unwrap());
    assert_eq!(json["materials"], json!([{ "name": "skin" }]));
    // A file without materials has none.
    let mut json = sphere(one, json!({}));
    json.as_object_mut().unwrap().remove("materials");
    json["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("material");
    assert_eq!(read(&json).attributes.materials, None);
}

/// Checks the note on an image that is left out with its texture.
#[track_caller]
fn assert_left_out(folder: &Path, image: Value, words: &str) {
    let path = folder.join("in.gltf");
    std::fs::write(&path, sphere(one, textured(image)).to_string()).unwrap();
    let loaded = Reader::new().materials(true).read(&path).unwrap();
    let told = |note: &&String| !note.starts_with("files that it refers to were read");
    let notes: Vec<&String> = loaded.notes.iter().filter(told).collect();
    let [first, second] = notes.as_slice() else { panic!("{:?}", loaded.notes) };
    assert_eq!(**first, format!("image 0 was left out: {words}"));
    assert_eq!(*second, "texture 1 was left out: none of its images could be read");
    let materials = loaded.attributes.materials.as_ref().map(Materials::images);
    assert_eq!(materials, Some([].as_slice()));
    written(&Loaded { notes: Vec::new(), ..loaded });
}

#[test]
fn images_that_cannot_be_read_are_noted() {
    let folder = tempfile::tempdir().unwrap();
    let inside = folder.path().join("inside");
    std::fs::create_dir_all(inside.join("folder")).unwrap();
    std::fs::write(folder.path().join("secret.png"), checker(0)).unwrap();
    std::fs::write(inside.join("text.png"), "hello").unwrap();
    for (image, words) in [
        (json!({ "uri": "../secret.png" }), "it is in '../secret.png', outside the folder of the file"),
        (json!({ "uri": "%2e%2e/secret.png" }), "it is in '../secret.png', outside the folder of the file"),
        (json!({ "uri": "/dev/zero" }), "it is in '/dev/zero', outside the folder of the file"),
        (json!({ "uri": "file:///a.png" }), "it is in 'file:///a.png', outside the folder of the file"),
        (json!({ "uri": "none.png" }), "none.png: there is no such file"),
        (json!({ "uri": "folder" }), "folder: this is not a regular file"),
        (json!({ "uri": "text.png" }), "it is not an image (PNG, JPEG, WebP, AVIF or KTX2)"),
        (json!({ "uri": "data:image/png;base64," }), "it is empty"),
        (json!({ "uri": "data:image/png,x" }), "its data is not in base64"),
        (json!({ "bufferView": 99, "mimeType": "image/png" }), "there is no such buffer view"),
        (json!({}), "it has no data"),
    ] {
        assert_left_out(&inside, image, words);
    }
    let json = sphere(one, textured(json!({ "uri": "b.png" })));
    assert!(read(&json).notes[0].contains("it is in another file, 'b.png'"));
    // A small file cannot expand to a large one, nor refer to data that does not exist.
    let path = inside.join("in.gltf");
    std::fs::File::create(inside.join("large.png")).unwrap().set_len((256 << 20) + 1).unwrap();
    std::fs::write(&path, sphere(one, textured(json!({ "uri": "large.png" }))).to_string()).unwrap();
    match Reader::new().materials(true).read(&path) {
        Err(Error::Input { place: Some(place), problem, remedy, .. }) => {
            assert_eq!((place.as_str(), problem.as_str()), ("image 0", "the images have more than 256 MiB"));
            assert!(remedy.contains("without materials"));
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(rtfmesh::io::read(&path).unwrap().attributes.materials, None);
}

#[test]
fn invalid_materials_do_no_harm() {
    let picture = uri(&checker(0));
    for (pointer, value) in [
        ("/materials/0", json!(7)),
        ("/materials/0/pbrMetallicRoughness", json!([])),
        ("/materials/0/pbrMetallicRoughness/baseColorTexture", json!(1)),
        ("/materials/0/pbrMetallicRoughness/metallicFactor", json!("much")),
        ("/materials/0/pbrMetallicRoughness/metallicFactor", json!(7)),
        ("/materials/0/pbrMetallicRoughness/roughnessFactor", json!(null)),
        ("/materials/0/pbrMetallicRoughness/baseColorFactor", json!([0.5, 1.0, -1.0, 1.0])),
        ("/materials/0/pbrMetallicRoughness/baseColorTexture/extensions", json!([])),
        ("/materials/0/alphaMode", json!("SOME")),
        ("/materials/0/alphaCutoff", json!(-1)),
        ("/materials/0/emissiveFactor", json!([1])),
        ("/samplers/0/wrapS", json!(3)),
        ("/materials/0/pbrMetallicRoughness/baseColorTexture/index", json!(-1)),
        ("/materials/0/pbrMetallicRoughness/baseColorTexture/index", json!(u64::MAX)),
        ("/textures/1", json!([])),
        ("/textures/1/source", json!("a")),
        ("/textures/1/sampler", json!(9)),
        ("/samplers/0", json!(null)),
        ("/images/0", json!(3)),
        ("/images", json!({})),
        ("/textures/1/extensions", json!({ "EXT_texture_webp": 1, "KHR_texture_basisu": { "source": 7 } })),
    ] {
        let mut json = sphere(one, textured(json!({ "uri": picture })));
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        match json.pointer_mut(parent).unwrap() {
            Value::Array(values) => values[key.parse::<usize>().unwrap()] = value.clone(),
            parent => parent[key] = value.clone(),
        }
        let bytes = json.to_string().into_bytes();
        let Ok(plain) = read_bytes(&bytes, None) else { continue };
        let loaded = read_bytes_with_materials(&bytes, None).unwrap();
        assert_eq!(loaded.mesh, plain.mesh, "{pointer} {value}");
        let bytes = encode_with(Path::new("out"), &loaded.mesh, &loaded.attributes, GLB).unwrap();
        store_glb(&bytes);
        // The `gltf` crate accepts it, too.
        gltf::Gltf::from_slice(&bytes).unwrap();
        read_bytes_with_materials(&bytes, None).unwrap();
    }
    let mut json = sphere(one, textured(json!({ "uri": picture })));
    json["materials"][0]["alphaMode"] = json!("SOME");
    let loaded = read(&json);
    assert_eq!(loaded.notes, ["material 0 was left out: its values are not valid in glTF"]);
    assert_eq!(loaded.attributes.materials.unwrap().images().len(), 0, "nothing refers to its picture");
    json["materials"][0]["alphaMode"] = json!("BLEND");
    json["samplers"][0]["wrapS"] = json!(3);
    assert_eq!(read(&json).notes, ["sampler 0 was left out: its values are not valid in glTF"]);
}
