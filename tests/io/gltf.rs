//! glTF files in all their variants, and invalid ones.

use std::path::Path;
use std::time::{Duration, Instant};

use crate::support::files::{encode, read_bytes};
use glam::DVec3;
use rtfmesh::io::{Input, Loaded, Reader, read};
use rtfmesh::mesh::samples::sample;
use rtfmesh::{Error, TriMesh};
use serde_json::{Value, json};

use crate::support::files::{assert_same, gltf_of};

fn parse(json: &Value) -> Loaded {
    read_bytes(json.to_string().as_bytes(), None).unwrap()
}

fn positions(mesh: &TriMesh) -> Vec<[f64; 3]> {
    mesh.vertices.iter().map(DVec3::to_array).collect()
}

#[track_caller]
fn assert_refused(json: &Value, place: &str, problem: &str) {
    match read_bytes(json.to_string().as_bytes(), None) {
        Err(Error::Input { place: found, problem: said, remedy, .. }) => {
            assert_eq!(found.unwrap_or_default(), place, "{said}");
            assert!(said.contains(problem) && !remedy.is_empty(), "'{said}' does not say '{problem}'");
        }
        other => panic!("{other:?}"),
    }
}

/// `json` with the value at this pointer replaced, or added to an object.
fn with(json: &Value, pointer: &str, value: Value) -> Value {
    let mut changed = json.clone();
    if let Some(old) = changed.pointer_mut(pointer) {
        *old = value;
        return changed;
    }
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    changed.pointer_mut(parent).unwrap()[key] = value;
    changed
}

fn box_scene() -> Value {
    serde_json::from_str(&gltf_of(&sample("box").unwrap())).unwrap()
}

/// Four points in a buffer of its own file: floats 20 bytes apart, the same as normalized bytes, and indices.
fn with_buffer_file() -> (tempfile::TempDir, Value) {
    let folder = tempfile::tempdir().unwrap();
    let points = [[0_u8, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]];
    let mut data = Vec::new();
    for point in points {
        point.iter().for_each(|value| data.extend(f32::from(*value).to_le_bytes()));
        data.extend([9; 8]);
    }
    for point in points {
        data.extend(point.map(|value| 255 * value));
        data.push(7);
    }
    data.extend([0, 1, 2, 3, 3, 2, 1]);
    std::fs::write(folder.path().join("the data.bin"), &data).unwrap();
    let json = json!({
        "asset": { "version": "2.1" }, "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "NORMAL": 17 } }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4 },
            { "bufferView": 1, "componentType": 5121, "type": "VEC3", "count": 4, "normalized": true },
            { "bufferView": 2, "componentType": 5121, "type": "SCALAR", "count": 6 },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 80, "byteStride": 20 },
            { "buffer": 0, "byteOffset": 80, "byteLength": 16, "byteStride": 4 },
            { "buffer": 0, "byteOffset": 96, "byteLength": 7 },
        ],
        "buffers": [{ "byteLength": 103, "uri": "the%20data.bin" }],
    });
    (folder, json)
}

fn triangles(primitive: Value) -> Vec<[u32; 3]> {
    let (folder, mut json) = with_buffer_file();
    json["meshes"][0]["primitives"][0] = primitive;
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, json.to_string()).unwrap();
    let mesh = read(&path).unwrap().mesh;
    assert_eq!(positions(&mesh), [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.]]);
    mesh.triangles
}

#[test]
fn lists_strips_and_fans_with_and_without_indices() {
    let floats = json!({ "POSITION": 0 });
    let bytes = json!({ "POSITION": 1 });
    let strip = [[0, 1, 2], [1, 3, 2]];
    assert_eq!(triangles(json!({ "attributes": floats, "mode": 5 })), strip);
    assert_eq!(triangles(json!({ "attributes": bytes, "mode": 5 })), strip);
    assert_eq!(triangles(json!({ "attributes": bytes, "mode": 6 })), [[1, 2, 0], [2, 3, 0]]);
    let list = [[0, 1, 2], [3, 3, 2]];
    assert_eq!(triangles(json!({ "attributes": floats, "indices": 2 })), list);
    assert_eq!(triangles(json!({ "attributes": floats, "indices": 2, "mode": 4 })), list);
    // 0 1 2 3 3 2: triangles with a vertex twice only join parts of the strip.
    assert_eq!(triangles(json!({ "attributes": floats, "indices": 2, "mode": 5 })), strip);
}

#[test]
fn nodes_translate_rotate_mirror_and_share_meshes() {
    let half = 0.5_f64.sqrt();
    let mut json = box_scene();
    json["nodes"] = json!([
        { "children": [1, 2], "translation": [1e9, 0.0, 0.0] },
        { "mesh": 0, "rotation": [0.0, 0.0, half, half], "scale": [2.0, 1.0, 1.0] },
        {
            "mesh": 0,
            "matrix": [-1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 5.5, 1.0],
        },
        { "mesh": 0 },
    ]);
    let mesh = parse(&json).mesh;
    let unit = sample("box").unwrap();
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (16, 24));
    for (i, p) in unit.vertices.iter().enumerate() {
        let turned = DVec3::new(1e9 - p.y, 2.0 * p.x, p.z);
        assert!(mesh.vertices[i].distance(turned) < 1e-6, "{} {turned}", mesh.vertices[i]);
        assert_eq!(mesh.vertices[8 + i], DVec3::new(1e9 - p.x, p.y, p.z + 5.5));
    }
    // A mirrored mesh still faces outwards.
    for (t, [a, b, c]) in unit.triangles.iter().enumerate() {
        assert_eq!(mesh.triangles[t], [*a, *b, *c]);
        assert_eq!(mesh.triangles[12 + t], [a + 8, c + 8, b + 8]);
    }
    // Without scenes, the nodes without a parent are the roots.
    json.as_object_mut().unwrap().remove("scene");
    json.as_object_mut().unwrap().remove("scenes");
    assert_eq!(parse(&json).mesh.triangles.len(), 36);
}

#[test]
fn primitives_other_than_triangles_are_noted() {
    let mut json = box_scene();
    json["extensionsRequired"] = json!(["KHR_materials_unlit", "KHR_mesh_quantization"]);
    json["nodes"][0]["skin"] = json!(3);
    let points = json!({ "attributes": { "POSITION": 0 }, "mode": 0 });
    json["meshes"][0]["primitives"].as_array_mut().unwrap().push(points);
    let loaded = parse(&json);
    assert_eq!(loaded.mesh.triangles.len(), 12);
    let points = "1 primitive of points or lines was ignored";
    let skins = "skins were left out, and meshes are in their rest pose: there is no skin 3";
    assert_eq!(loaded.notes, [points, skins]);
}

#[test]
fn a_scene_of_points_alone_is_read_as_points() {
    let mut json = box_scene();
    json["accessors"].as_array_mut().unwrap().push(json!(
        { "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 8 }
    ));
    json["nodes"][0]["translation"] = json!([5.0, 0.0, 0.0]);
    json["meshes"][0]["primitives"] = json!([
        { "attributes": { "POSITION": 0, "COLOR_0": 2 }, "mode": 0 },
        { "attributes": { "POSITION": 0 }, "mode": 1 },
    ]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, json.to_string()).unwrap();
    let refused = read(&path).unwrap_err().to_string();
    assert!(refused.contains("no faces"), "{refused}");
    let Input::Mesh(loaded) = Reader::default().read_any(&path).unwrap() else { panic!("a volume") };
    let expected: Vec<DVec3> = sample("box").unwrap().vertices.iter().map(|p| *p + 5.0 * DVec3::X).collect();
    assert_eq!(loaded.mesh, TriMesh { vertices: expected, triangles: Vec::new() });
    assert_eq!(loaded.attributes.vertex[0].name, "colour");
    assert!(loaded.attributes.uv.is_none());
    assert_eq!(loaded.notes, ["1 primitive of lines was ignored"]);
    json["meshes"][0]["primitives"][0]["attributes"] = json!({});
    assert_refused(&json, "mesh 0, primitive 0", "the points have no positions");
}

#[test]
fn written_files_are_exact_to_32_bits_at_any_position_and_size() {
    let encoding = "glb".parse().unwrap();
    for (scale, shift) in
        [(1.0, 0.0), (1.0, 1e9), (1e-30, 0.0), (1e30, 1e33), (1e200, 0.0), (1e-200, 1e-190), (0.0, 3.0)]
    {
        let mut mesh = sample("torus").unwrap();
        mesh.vertices.iter_mut().for_each(|v| *v = *v * scale + DVec3::new(shift, -shift, 0.0));
        let bytes = encode(Path::new("x"), &mesh, encoding).unwrap();
        // A position far away has fewer digits of its own.
        let near = 1e-7_f64.max(1e-15 * shift / scale.max(1e-300));
        let got = read_bytes(&bytes, None).unwrap().mesh;
        if scale > 0.0 {
            let unit = |m: &TriMesh| TriMesh {
                vertices: m.vertices.iter().map(|v| *v / scale).collect(),
                ..m.clone()
            };
            assert_same(&unit(&got), &unit(&mesh), near, &format!("{scale} {shift}"));
        } else {
            assert_eq!(got, mesh);
        }
        let length = u32::from_le_bytes(bytes[8..12].try_into().unwrap());
        assert_eq!((length as usize, bytes.len() % 4), (bytes.len(), 0));
        let end = 20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let json: Value = serde_json::from_slice(&bytes[20..end]).unwrap();
        assert_eq!(
            json["nodes"][0].get("scale").is_some(),
            !(1e-9..1e9).contains(&scale) && scale > 0.0,
            "{json:#}"
        );
    }
    let empty = TriMesh::default();
    assert!(matches!(encode(Path::new("x"), &empty, encoding), Err(Error::Output { .. })));
}

#[test]
fn invalid_json_values_are_refused() {
    let good = box_scene();
    for (pointer, value, place, problem) in [
        ("/asset/version", json!("1.0"), "asset", "this is glTF version 1.0, not 2"),
        ("/extensionsRequired", json!(["KHR_draco_mesh_compression"]), "extensionsRequired", "'KHR_draco"),
        ("/scene", json!(3), "scene 3", "no such scene"),
        ("/scenes/0/nodes/0", json!(9), "node 9", "no such node"),
        ("/nodes/0/children", json!([0]), "node 0", "more than once in the scene"),
        ("/nodes/0/mesh", json!(1), "node 0", "no mesh 1"),
        ("/scenes/0/nodes", json!([]), "", "no vertices"),
        ("/meshes/0/primitives/0/attributes", json!({}), "mesh 0, primitive 0", "no positions"),
        ("/meshes/0/primitives/0/indices", json!(0), "accessor 0", "type is 'VEC3' instead of 'SCALAR'"),
        ("/meshes/0/primitives/0/indices", json!(7), "accessor 7", "no such accessor"),
        ("/accessors/0/count", json!(7), "mesh 0, primitive 0", "no vertex 7, indices go from 0 to 6"),
        ("/accessors/0/count", json!(9), "accessor 0", "too few for 9 elements from byte 0 on"),
        ("/accessors/0/count", json!(1_000_000_000), "accessor 0", "too few for 1000000000 elements"),
        ("/accessors/0/count", json!(u64::MAX), "accessor 0", "cut off"),
        ("/accessors/0/byteOffset", json!(u64::MAX), "accessor 0", "cut off"),
        ("/accessors/0/componentType", json!(5124), "accessor 0", "no component type 5124"),
        ("/accessors/0/bufferView", Value::Null, "accessor 0", "its data is compressed"),
        ("/accessors/1/count", json!(35), "mesh 0, primitive 0", "35 corners"),
        ("/accessors/1/componentType", json!(5122), "accessor 1", "not unsigned integers"),
        ("/accessors/1/bufferView", json!(5), "buffer view 5", "no such buffer view"),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), "buffer view 0", "cut off"),
        ("/bufferViews/0/byteStride", json!(0), "accessor 0", "are 0 bytes apart"),
        ("/bufferViews/0/buffer", json!(1), "buffer 1", "no such buffer"),
        ("/buffers/0/uri", json!("data:;base64,????"), "buffer 0", "base64 data is damaged"),
        ("/buffers/0/uri", json!("data:text/plain,hello"), "buffer 0", "not in base64"),
        ("/buffers/0/uri", json!("other.bin"), "buffer 0", "in another file, 'other.bin'"),
        ("/buffers/0/uri", json!("/dev/zero"), "buffer 0", "outside the folder of the file"),
        ("/buffers/0/uri", json!("%2e%2e/secret"), "buffer 0", "outside the folder of the file"),
        ("/buffers/0/uri", json!("https://example.com/a.bin"), "buffer 0", "outside the folder of the file"),
        ("/buffers/0/byteLength", json!(1_000_000), "buffer 0", "of its 1000000 bytes"),
    ] {
        assert_refused(&with(&good, pointer, value), place, problem);
    }
    let overflow = with(&good, "/nodes/0/scale", json!([1e308, 1e308, 1e308]));
    let overflow = with(&overflow, "/nodes/0/translation", json!([1.7e308, 1.7e308, 1.7e308]));
    assert_refused(&overflow, "", "no face has finite coordinates");
    match read_bytes(b"{ \"asset\": \n 5 }", None) {
        Err(Error::Input { place: Some(place), .. }) => {
            assert!(place.starts_with("line 2, column"), "{place}")
        }
        other => panic!("{other:?}"),
    }
}

/// Two of four points; the others come from a buffer view or, without one, are at the origin.
#[test]
fn sparse_elements_replace_others() {
    let (folder, mut json) = with_buffer_file();
    let path = folder.path().join("a.gltf");
    // The last two indices are 2 and 1: these points become the first and the second of the buffer view.
    json["accessors"][0]["sparse"] = json!({
        "count": 2,
        "indices": { "bufferView": 3, "componentType": 5121 },
        "values": { "bufferView": 0 },
    });
    json["bufferViews"].as_array_mut().unwrap().push(json!(
        { "buffer": 0, "byteOffset": 101, "byteLength": 2 }
    ));
    json["accessors"].as_array_mut().unwrap()[2]["count"] = json!(3);
    json["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": 0 }, "indices": 2 });
    let load = |json: &Value| {
        std::fs::write(&path, json.to_string()).unwrap();
        read(&path)
    };
    let positions = |json: &Value| positions(&load(json).unwrap().mesh);
    assert_eq!(positions(&json), [[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3], [1.0, 1.0, 0.0]]);
    json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert_eq!(positions(&json), [[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3], [0.0; 3]]);
    for (pointer, value, problem) in [
        ("/accessors/0/count", json!(2), "it has no element 2"),
        ("/accessors/0/count", json!(1_000_000_000), "1000000000 elements are more"),
        ("/accessors/0/count", json!(u64::MAX), "elements are more"),
        ("/accessors/0/sparse/count", json!(3), "too few for 3 elements"),
        ("/accessors/0/sparse/count", json!(5), "5 sparse elements cannot replace those of 4"),
        ("/accessors/0/sparse/indices/componentType", json!(5120), "not unsigned integers"),
        ("/accessors/0/sparse/values/bufferView", json!(9), "no such buffer view"),
    ] {
        let error = load(&with(&json, pointer, value)).unwrap_err().to_string();
        assert!(error.contains(problem), "{error}");
    }
}

#[test]
fn buffer_files_must_exist_and_be_complete() {
    let (folder, mut json) = with_buffer_file();
    json["meshes"][0]["primitives"][0]["mode"] = json!(5);
    let path = folder.path().join("a.gltf");
    let refused = |json: &Value| {
        std::fs::write(&path, json.to_string()).unwrap();
        read(&path).unwrap_err().to_string()
    };
    let missing = refused(&with(&json, "/buffers/0/uri", json!("none.bin")));
    assert!(missing.contains("a.gltf: buffer 0: none.bin: there is no such file"), "{missing}");
    std::fs::create_dir(folder.path().join("folder")).unwrap();
    let directory = refused(&with(&json, "/buffers/0/uri", json!("folder")));
    assert!(directory.contains("folder: this is not a regular file"), "{directory}");
    let short = refused(&with(&json, "/buffers/0/byteLength", json!(104)));
    assert!(short.contains("has 103 of its 104 bytes"), "{short}");
}

#[test]
fn a_small_file_cannot_stand_for_billions_of_triangles() {
    let mut json: Value = serde_json::from_str(&gltf_of(&sample("torus").unwrap())).unwrap();
    let nodes: Vec<Value> = (0..100_000).map(|_| json!({ "mesh": 0 })).collect();
    json["scenes"][0]["nodes"] = json!((0..nodes.len()).collect::<Vec<_>>());
    json["nodes"] = json!(nodes);
    let start = Instant::now();
    assert_refused(&json, "mesh 0, primitive 0", "repeats its meshes too often");
    assert!(start.elapsed() < Duration::from_secs(30));
}

#[test]
fn invalid_containers_are_refused() {
    let good = encode(Path::new("x"), &sample("box").unwrap(), "glb".parse().unwrap()).unwrap();
    let changed = |at: usize, value: u32| {
        let mut bytes = good.clone();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        read_bytes(&bytes, None).unwrap_err().to_string()
    };
    assert!(changed(4, 1).contains("this is glTF version 1, not 2"));
    assert!(changed(8, 1_000_000_000).contains("header says 1000000000 bytes"));
    assert!(changed(8, 15).contains("cut off"));
    assert!(changed(12, u32::MAX).contains("a chunk has 4294967295 bytes"));
    assert!(changed(16, 0).contains("not JSON"));
    let json = u32::from_le_bytes(good[12..16].try_into().unwrap()) as usize;
    assert!(changed(20 + json, u32::MAX).contains("a chunk has 4294967295 bytes"));
    assert!(changed(24 + json, 7).contains("the buffer has no data"));
    // Data after the declared end is ignored.
    assert!(read_bytes(&[&good, &b"tail"[..]].concat(), None).is_ok());
}
