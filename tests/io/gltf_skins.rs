//! Skins with their skeletons and animations, from glTF to GLB.

use crate::support::files::base64;
use crate::support::files::{encode_with, read_bytes};
use crate::support::painted::{GLB, add, split};
use crate::support::place::Place;
use crate::support::store_glb;
use glam::{DMat4, DQuat, DVec3};
use gltf::animation::util::ReadOutputs;
use rtfmesh::io::{Loaded, lost_attributes_note};
use rtfmesh::mesh::distance::distances;
use rtfmesh::{ProgressToken, TriMesh};
use serde_json::{Value, json};
use std::collections::HashSet;
use std::f64::consts::TAU;
use std::path::Path;

/// A scene in JSON, and its buffer.
struct Scene {
    json: Value,
    data: Vec<u8>,
}

impl Scene {
    fn new() -> Self {
        let json = json!({
            "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [] }],
            "nodes": [], "meshes": [], "skins": [], "animations": [], "accessors": [], "bufferViews": [],
            "buffers": [{}],
        });
        Self { json, data: Vec::new() }
    }

    fn accessor(&mut self, bytes: &[u8], component_type: u32, kind: &str, count: usize) -> usize {
        let views = self.json["bufferViews"].as_array().unwrap().len();
        let view = json!({ "buffer": 0, "byteOffset": self.data.len(), "byteLength": bytes.len() });
        add(&mut self.json["bufferViews"], view);
        self.data.extend(bytes);
        let mut accessor = json!({
            "bufferView": views, "componentType": component_type, "type": kind, "count": count,
        });
        if kind == "VEC3" || kind == "SCALAR" {
            let n = if kind == "VEC3" { 3 } else { 1 };
            accessor["min"] = json!(vec![-1e6; n]);
            accessor["max"] = json!(vec![1e6; n]);
        }
        add(&mut self.json["accessors"], accessor);
        views
    }

    fn floats(&mut self, kind: &str, each: usize, values: &[f64]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect();
        self.accessor(&bytes, 5126, kind, values.len() / each)
    }

    /// Adds a mesh; joints and weights of each vertex are optional.
    fn mesh(&mut self, mesh: &TriMesh, influences: Option<&[([u8; 4], [f64; 4])]>) -> usize {
        let positions: Vec<f64> = mesh.vertices.iter().flat_map(DVec3::to_array).collect();
        let mut attributes = json!({ "POSITION": self.floats("VEC3", 3, &positions) });
        if let Some(influences) = influences {
            let joints: Vec<u8> = influences.iter().flat_map(|(joints, _)| *joints).collect();
            attributes["JOINTS_0"] = json!(self.accessor(&joints, 5121, "VEC4", influences.len()));
            let weights: Vec<f64> = influences.iter().flat_map(|(_, weights)| *weights).collect();
            attributes["WEIGHTS_0"] = json!(self.floats("VEC4", 4, &weights));
        }
        let indices: Vec<u8> = mesh.triangles.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
        let indices = self.accessor(&indices, 5125, "SCALAR", 3 * mesh.triangles.len());
        let primitive = json!({ "attributes": attributes, "indices": indices });
        add(&mut self.json["meshes"], json!({ "primitives": [primitive] }));
        self.json["meshes"].as_array().unwrap().len() - 1
    }

    fn text(&self) -> String {
        let mut json = self.json.clone();
        json["buffers"][0] = json!({
            "byteLength": self.data.len(),
            "uri": format!("data:application/gltf-buffer;base64,{}", base64(&self.data)),
        });
        json.to_string()
    }

    fn read(&self) -> Loaded {
        read_bytes(self.text().as_bytes(), None).unwrap()
    }

    fn posed(&self, time: usize) -> Vec<DVec3> {
        posed(&gltf::Gltf::from_slice(self.text().as_bytes()).unwrap(), &self.data, time)
    }
}

/// A closed tube along x, of this length.
fn tube(length: f64) -> TriMesh {
    let (around, along) = (16_u32, 48_u32);
    let at = |ring: u32, k: u32| {
        let (x, angle) =
            (length * f64::from(ring) / f64::from(along), TAU * f64::from(k) / f64::from(around));
        DVec3::new(x, 0.3 * angle.cos(), 0.3 * angle.sin())
    };
    let mut mesh = TriMesh::default();
    mesh.vertices.extend((0..=along).flat_map(|ring| (0..around).map(move |k| at(ring, k))));
    mesh.vertices.extend([DVec3::ZERO, DVec3::new(length, 0.0, 0.0)]);
    let index = |ring: u32, k: u32| ring * around + k % around;
    let caps = index(along, 0) + around;
    for k in 0..around {
        for ring in 0..along {
            let [a, b] = [index(ring, k), index(ring, k + 1)];
            let [c, d] = [index(ring + 1, k), index(ring + 1, k + 1)];
            mesh.triangles.extend([[a, d, c], [a, b, d]]);
        }
        mesh.triangles.push([caps, index(0, k + 1), index(0, k)]);
        mesh.triangles.push([caps + 1, index(along, k), index(along, k + 1)]);
    }
    mesh
}

fn bend(x: f64) -> ([u8; 4], [f64; 4]) {
    let t = (0.5 + 0.5 * (x - 2.0)).clamp(0.0, 1.0);
    let t = t * t * (3.0 - 2.0 * t);
    ([0, 1, 0, 0], [1.0 - t, t, 0.0, 0.0])
}

fn columns(matrix: DMat4) -> [f64; 16] {
    matrix.to_cols_array()
}

/// A bar of two bones below a node that scales and turns, and an animation that bends it.
fn bar() -> Scene {
    let mut scene = Scene::new();
    let mesh = tube(4.0);
    let influences: Vec<_> = mesh.vertices.iter().map(|v| bend(v.x)).collect();
    let mesh = scene.mesh(&mesh, Some(&influences));
    let half = 0.5_f64.sqrt();
    scene.json["nodes"] = json!([
        // The transform of a skinned node does not count.
        { "mesh": mesh, "skin": 0, "translation": [50.0, 50.0, 50.0] },
        { "name": "hip", "translation": [0.0, 0.0, 0.25], "children": [2] },
        { "name": "knee", "translation": [2.0, 0.0, -0.25], "children": [3] },
        { "name": "toe", "translation": [2.0, 0.0, 0.0] },
        {
            "name": "armature", "children": [1], "scale": [0.5, 0.5, 0.5],
            "rotation": [half, 0.0, 0.0, half], "translation": [1.0, 2.0, 3.0],
        },
        { "name": "camera" },
    ]);
    scene.json["scenes"] = json!([{ "nodes": [5, 0, 4] }]);
    let binds = [DVec3::new(0.0, 0.0, -0.25), DVec3::new(-2.0, 0.0, 0.0)].map(DMat4::from_translation);
    let binds = scene.floats("MAT4", 16, binds.map(columns).as_flattened());
    scene.json["skins"] = json!([{ "joints": [1, 2], "inverseBindMatrices": binds }]);
    let times = scene.floats("SCALAR", 1, &[0.0, 1.5]);
    let turns = scene.floats("VEC4", 4, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half]);
    let tangents = [[0.0; 3], [0.0, 0.0, 0.25], [0.0; 3], [0.0; 3], [0.0, 1.0, 0.25], [0.0; 3]];
    let moves = scene.floats("VEC3", 3, tangents.as_flattened());
    scene.json["animations"] = json!([{
        "name": "bend",
        "channels": [
            { "sampler": 0, "target": { "node": 2, "path": "rotation" } },
            { "sampler": 1, "target": { "node": 1, "path": "translation" } },
        ],
        "samplers": [
            { "input": times, "output": turns },
            { "input": times, "output": moves, "interpolation": "CUBICSPLINE" },
        ],
    }]);
    scene
}

/// The transforms of all nodes to the scene, at a keyframe of the first animation.
fn transforms(file: &gltf::Gltf, data: &[u8], key: usize) -> Vec<DMat4> {
    let parts = |node: &gltf::Node| {
        let (translation, rotation, scale) = node.transform().decomposed();
        (translation.map(f64::from), rotation.map(f64::from), scale.map(f64::from))
    };
    let mut local: Vec<_> = file.nodes().map(|node| parts(&node)).collect();
    for channel in file.animations().next().iter().flat_map(|animation| animation.channels()) {
        let own = &mut local[channel.target().node().index()];
        let cubic = channel.sampler().interpolation() == gltf::animation::Interpolation::CubicSpline;
        let at = if cubic { 3 * key + 1 } else { key };
        match channel.reader(|_| Some(data)).read_outputs().unwrap() {
            ReadOutputs::Translations(mut all) => own.0 = all.nth(at).unwrap().map(f64::from),
            ReadOutputs::Rotations(all) => own.1 = all.into_f32().nth(at).unwrap().map(f64::from),
            ReadOutputs::Scales(mut all) => own.2 = all.nth(at).unwrap().map(f64::from),
            ReadOutputs::MorphTargetWeights(_) => {}
        }
    }
    let mut global = vec![DMat4::NAN; local.len()];
    let mut pending: Vec<(gltf::Node, DMat4)> =
        file.default_scene().unwrap().nodes().map(|node| (node, DMat4::IDENTITY)).collect();
    while let Some((node, above)) = pending.pop() {
        let (translation, rotation, scale) = local[node.index()];
        let rotation = DQuat::from_array(rotation).normalize();
        let own = DMat4::from_scale_rotation_translation(scale.into(), rotation, translation.into());
        global[node.index()] = above * own;
        pending.extend(node.children().map(|child| (child, above * own)));
    }
    global
}

/// The vertices of all meshes by linear blend skinning, at a keyframe of the first animation.
fn posed(file: &gltf::Gltf, data: &[u8], key: usize) -> Vec<DVec3> {
    let global = transforms(file, data, key);
    let mut found = Vec::new();
    for node in file.nodes().filter(|node| node.mesh().is_some()) {
        let mesh = node.mesh().unwrap();
        let primitive = mesh.primitives().next().unwrap();
        let reader = primitive.reader(|_| Some(data));
        let positions = reader.read_positions().unwrap().map(|p| DVec3::from_array(p.map(f64::from)));
        let Some(skin) = node.skin() else {
            found.extend(positions.map(|p| global[node.index()].transform_point3(p)));
            continue;
        };
        let bind: Vec<[[f32; 4]; 4]> =
            skin.reader(|_| Some(data)).read_inverse_bind_matrices().unwrap().collect();
        let bind = bind.iter().map(|m| glam::Mat4::from_cols_array_2d(m).as_dmat4());
        let matrices: Vec<DMat4> =
            skin.joints().zip(bind).map(|(j, bind)| global[j.index()] * bind).collect();
        let joints = reader.read_joints(0).unwrap().into_u16();
        let weights = reader.read_weights(0).unwrap().into_f32();
        for ((p, joints), weights) in positions.zip(joints).zip(weights) {
            assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6, "{weights:?}");
            assert!(weights.iter().all(|weight| *weight >= 0.0), "{weights:?}");
            let moved = joints
                .iter()
                .zip(weights)
                .map(|(joint, weight)| f64::from(weight) * matrices[usize::from(*joint)].transform_point3(p));
            found.push(moved.sum());
        }
    }
    found
}

/// The file without remeshing, checked by the `gltf` crate, and its buffer.
fn written(loaded: &Loaded) -> (gltf::Gltf, Vec<u8>) {
    let bytes = encode_with(Path::new("out"), &loaded.mesh, &loaded.attributes, GLB).unwrap();
    store_glb(&bytes);
    (gltf::Gltf::from_slice(&bytes).unwrap(), split(&bytes).1)
}

#[track_caller]
fn assert_near(found: &[DVec3], wanted: &[DVec3]) {
    assert_eq!(found.len(), wanted.len());
    for (a, b) in found.iter().zip(wanted) {
        assert!(a.distance(*b) < 1e-5, "{a} instead of {b}");
    }
}

/// The largest distance between two surfaces, in percent of the diagonal.
fn apart(a: &TriMesh, b: &TriMesh) -> f64 {
    distances(a, b, &ProgressToken::default()).unwrap().hausdorff
}

#[test]
fn the_program_carries_a_skin_that_deforms_the_result_as_the_input() {
    let (place, scene) = (Place::new(), bar());
    std::fs::write(place.path("in.gltf"), scene.text()).unwrap();
    let common = "-n 900 --iterations 5 --quality draft";
    let (_, notes) = place.run(&format!("remesh in.gltf out.glb {common}"));
    assert_eq!(notes.matches("note:").count(), 0, "{notes}");
    let bytes = place.bytes("out.glb");
    store_glb(&bytes);
    let (file, data) = (gltf::Gltf::from_slice(&bytes).unwrap(), split(&bytes).1);
    let triangles = [tube(4.0).triangles, read_bytes(&bytes, None).unwrap().mesh.triangles];
    let [rest, bent] = [0, 1].map(|key| {
        let [input, result] = [scene.posed(key), posed(&file, &data, key)];
        let [input, result] = [(input, &triangles[0]), (result, &triangles[1])]
            .map(|(vertices, triangles)| TriMesh { vertices, triangles: triangles.clone() });
        (apart(&input, &result), input, result)
    });
    assert!(apart(&rest.1, &bent.1) > 20.0 && apart(&rest.2, &bent.2) > 20.0);
    assert!(bent.0 < 1.5 * rest.0 && rest.0 < 0.5, "{} at rest and {} bent", rest.0, bent.0);
    // The camera has nothing to do with it; the toe may hold something.
    let names: Vec<_> = file.nodes().filter_map(|node| node.name().map(str::to_owned)).collect();
    assert_eq!(names, ["armature", "hip", "knee", "toe"]);
    let knee = file.nodes().find(|node| node.name() == Some("knee")).unwrap();
    assert_eq!(knee.children().next().and_then(|node| node.name().map(str::to_owned)).unwrap(), "toe");
    let animation = file.animations().next().unwrap();
    assert_eq!((animation.name(), animation.channels().count()), (Some("bend"), 2));
    let input = animation.channels().next().unwrap().sampler().input();
    assert_eq!((input.min(), input.max()), (Some(json!([0.0])), Some(json!([1.5]))));
    let (_, notes) = place.run(&format!("remesh in.gltf out.ply {common}"));
    let lost = "PLY cannot hold these: skin with weights of each vertex (2 joints, 1 animation)";
    assert_eq!((notes.matches("note:").count(), notes.contains(lost)), (1, true), "{notes}");
    // A second pass loses nothing more.
    let again = read_bytes(&bytes, None).unwrap();
    let (file_again, data_again) = written(&again);
    assert_near(&posed(&file_again, &data_again, 1), &posed(&file, &data, 1));
}

#[test]
fn skinned_meshes_lie_where_their_joints_take_them() {
    let scene = bar();
    let loaded = scene.read();
    assert_eq!(loaded.notes, Vec::<String>::new());
    assert_near(&loaded.mesh.vertices, &scene.posed(0));
    let skin = loaded.attributes.skin.as_ref().unwrap();
    assert_eq!((skin.joint_count(), skin.animation_count(), skin.vertices.len()), (2, 1, 786));
    assert!(lost_attributes_note(&loaded.attributes, GLB.format).is_none());
    let (file, data) = written(&loaded);
    assert_near(&posed(&file, &data, 1), &scene.posed(1));
}

#[test]
fn several_skins_and_meshes_without_skins_become_one_skin() {
    let mut scene = bar();
    let tube = tube(1.0);
    // What the knee carries has no skin. A second skin has other coordinates; one of its joints is the same.
    let carried = scene.mesh(&tube, None);
    let influences = vec![([0, 1, 0, 0], [0.25, 0.75, 0.0, 0.0]); tube.vertices.len()];
    let second = scene.mesh(&tube, Some(&influences));
    let binds = [DVec3::new(9.0, 0.0, 0.0), DVec3::new(7.5, 0.0, 0.25)].map(DMat4::from_translation);
    let binds = scene.floats("MAT4", 16, binds.map(columns).as_flattened());
    add(&mut scene.json["skins"], json!({ "joints": [1, 2], "inverseBindMatrices": binds }));
    add(&mut scene.json["nodes"], json!({ "mesh": carried, "translation": [0.5, 1.0, 0.0] }));
    add(&mut scene.json["nodes"], json!({ "mesh": second, "skin": 1 }));
    scene.json["nodes"][2]["children"] = json!([3, 6]);
    scene.json["scenes"][0]["nodes"] = json!([0, 4, 7]);
    let loaded = scene.read();
    assert_eq!(loaded.notes, Vec::<String>::new());
    assert_eq!(loaded.attributes.skin.as_ref().unwrap().joint_count(), 4);
    let (file, data) = written(&loaded);
    assert_eq!((file.skins().len(), file.meshes().len()), (1, 1));
    // glTF wants each joint once, so the second skin's knee is a node below the knee.
    let joints: HashSet<usize> = file.skins().next().unwrap().joints().map(|joint| joint.index()).collect();
    assert_eq!(joints.len(), 4);
    assert_near(&posed(&file, &data, 0), &scene.posed(0));
    assert_near(&posed(&file, &data, 1), &scene.posed(1));
    // Joints in several trees get a root in common.
    scene.json["scenes"][0]["nodes"] = json!([0, 4, 6, 7]);
    scene.json["nodes"][2]["children"] = json!([3]);
    let (file, data) = written(&scene.read());
    assert_eq!(file.default_scene().unwrap().nodes().count(), 2);
    assert_near(&posed(&file, &data, 1), &scene.posed(1));
}

#[test]
fn a_skinned_mesh_far_away_keeps_its_shape() {
    let mut scene = bar();
    scene.json["nodes"][4]["translation"] = json!([1e7, 0.0, 0.0]);
    let loaded = scene.read();
    let (file, data) = written(&loaded);
    let [found, wanted] = [posed(&file, &data, 1), scene.posed(1)];
    let shift = DVec3::new(1e7, 0.0, 0.0);
    for (a, b) in found.iter().zip(&wanted) {
        assert!((*a - shift).distance(*b - shift) < 2.0, "{a} instead of {b}");
    }
}

#[test]
fn the_four_largest_weights_are_kept() {
    let mut scene = bar();
    let count = scene.json["accessors"][1]["count"].as_u64().unwrap() as usize;
    let weights: Vec<f64> = [0.1, 0.1, 0.3, 0.0].repeat(count);
    let more: Vec<f64> = [0.2, 0.0, 0.1, 0.4].repeat(count);
    let [weights, more] = [weights, more].map(|values| scene.floats("VEC4", 4, &values));
    let joints = scene.accessor(&[0, 1, 2, 9].repeat(count), 5121, "VEC4", count);
    let others = scene.accessor(&[3, 0, 4, 2].repeat(count), 5121, "VEC4", count);
    scene.json["skins"] = json!([{ "joints": [1, 2, 3, 4, 5] }]);
    let attributes = &mut scene.json["meshes"][0]["primitives"][0]["attributes"];
    for (name, accessor) in
        [("JOINTS_0", joints), ("WEIGHTS_0", weights), ("JOINTS_1", others), ("WEIGHTS_1", more)]
    {
        attributes[name] = json!(accessor);
    }
    let loaded = scene.read();
    let note =
        format!("{count} vertices follow more than four joints; those with the largest weights are kept");
    assert_eq!(loaded.notes, [note]);
    let influences = loaded.attributes.skin.unwrap().vertices[7];
    assert_eq!(influences.joints, [2, 3, 0, 1]);
    for (found, wanted) in influences.weights.iter().zip([0.7, 0.2, 0.1, 0.1]) {
        assert!((f64::from(*found) - wanted / 1.1).abs() < 1e-6, "{influences:?}");
    }
}

#[test]
fn joints_beyond_eight_are_ignored_with_a_note() {
    let mut scene = bar();
    let attributes = &mut scene.json["meshes"][0]["primitives"][0]["attributes"];
    let count = 786;
    for (name, from) in [("JOINTS", "JOINTS_0"), ("WEIGHTS", "WEIGHTS_0")] {
        for k in 1..4 {
            attributes[format!("{name}_{k}")] = attributes[from].clone();
        }
    }
    let loaded = scene.read();
    let note =
        format!("{count} vertices have more than two sets of four joints; the further sets were ignored");
    assert_eq!(loaded.notes, [note]);
    let skin = loaded.attributes.skin.unwrap();
    assert_eq!(skin.vertices.len(), count);
    assert_eq!(skin.vertices, bar().read().attributes.skin.unwrap().vertices);
}

#[test]
fn animations_are_left_out_with_a_note_where_nothing_has_a_skin() {
    let mut scene = bar();
    scene.json["nodes"][0]["skin"] = json!(null);
    assert_eq!(scene.read().notes, ["1 animation was left out, because no mesh of the scene has a skin"]);
    let again = scene.json["animations"][0].clone();
    add(&mut scene.json["animations"], again);
    assert_eq!(scene.read().notes, ["2 animations were left out, because no mesh of the scene has a skin"]);
    // Those of a mesh in another scene.
    let mut scene = bar();
    let mesh = scene.json["nodes"][0]["mesh"].clone();
    let nodes = scene.json["nodes"].as_array().unwrap().len();
    add(&mut scene.json["nodes"], json!({ "mesh": mesh }));
    scene.json["scenes"][0]["nodes"] = json!([nodes]);
    assert_eq!(scene.read().notes, ["1 animation was left out, because no mesh of the scene has a skin"]);
    scene.json["animations"] = json!([]);
    assert_eq!(scene.read().notes, Vec::<String>::new());
    // Whatever is wrong with them.
    scene.json["animations"] = json!(5);
    assert_eq!(scene.read().notes, Vec::<String>::new());
}

#[test]
fn invalid_skins_are_left_out_with_a_note() {
    let with = |pointer: &str, value: Value| {
        let mut scene = bar();
        *scene.json.pointer_mut(pointer).unwrap_or_else(|| panic!("{pointer}")) = value;
        scene
    };
    for (pointer, value, problem) in [
        ("/nodes/0/skin", json!(1), "there is no skin 1"),
        ("/skins/0/joints", json!([]), "skin 0: it has no joints"),
        (
            "/skins/0/joints",
            json!([1]),
            "mesh 0, primitive 0: vertex 208 refers to joint 1; joints count from 0, and the skin has 1",
        ),
        ("/skins/0/joints/1", json!(77), "skin 0: its joint, node 77, is not in the scene"),
        ("/scenes/0/nodes", json!([0]), "skin 0: its joint, node 1, is not in the scene"),
        ("/skins/0/joints", json!([1, 2, 3]), "skin 0: accessor 4 has 2 elements for 3 joints"),
        ("/skins/0/inverseBindMatrices", json!(0), "type is 'VEC3' instead of 'MAT4'"),
        ("/skins/0/inverseBindMatrices", json!(99), "accessor 99: there is no such accessor"),
        ("/accessors/4/count", json!(3), "the file is cut off"),
        ("/meshes/0/primitives/0/attributes/WEIGHTS_0", json!(null), "it has a skin, and no joints"),
        ("/meshes/0/primitives/0/attributes/WEIGHTS_0", json!(77), "accessor 77: there is no such"),
        ("/meshes/0/primitives/0/attributes/JOINTS_0", json!(2), "its joints are not unsigned integers"),
        ("/accessors/1/count", json!(5), "accessor 1 has 5 elements for 786 vertices"),
        ("/nodes/1/name", json!(5), "invalid type"),
    ] {
        let loaded = with(pointer, value).read();
        assert_eq!((loaded.attributes.skin, loaded.mesh.triangles.len()), (None, 1568), "{pointer}");
        let [note] = loaded.notes.as_slice() else { panic!("{pointer}: {:?}", loaded.notes) };
        let start = "skins were left out, and meshes are in their rest pose: ";
        assert!(note.starts_with(start) && note.contains(problem), "{pointer}: {note}");
    }
    for bad in [f32::NAN, f32::INFINITY, -0.5] {
        let mut scene = bar();
        let view = scene.json["bufferViews"][2]["byteOffset"].as_u64().unwrap() as usize + 64;
        scene.data[view..view + 4].copy_from_slice(&bad.to_le_bytes());
        let notes = scene.read().notes.concat();
        assert!(notes.contains("the weights of vertex 4 are not valid"), "{notes}");
    }
    let cycle = with("/nodes/3", json!({ "children": [1] }));
    let said = read_bytes(cycle.text().as_bytes(), None).unwrap_err().to_string();
    assert!(said.contains("more than once in the scene"), "{said}");
}

#[test]
fn invalid_animations_are_left_out_with_a_note() {
    for (pointer, value, problem) in [
        ("/animations/0/channels/0/sampler", json!(9), "there is no sampler 9"),
        ("/animations/0/samplers/0/input", json!(99), "accessor 99: there is no such accessor"),
        ("/animations/0/samplers/0/output", json!(0), "type is 'VEC3' instead of 'VEC4'"),
        ("/accessors/5/count", json!(1), "a sampler has 2 values for 1 time"),
        ("/accessors/6/count", json!(1_000_000), "the file is cut off"),
    ] {
        let mut scene = bar();
        *scene.json.pointer_mut(pointer).unwrap() = value;
        let loaded = scene.read();
        assert_eq!(loaded.attributes.skin.as_ref().unwrap().animation_count(), 0, "{pointer}");
        let [note] = loaded.notes.as_slice() else { panic!("{pointer}: {:?}", loaded.notes) };
        assert!(note.starts_with("animation 0 was left out: ") && note.contains(problem), "{note}");
        written(&loaded);
    }
}

#[test]
fn many_animations_cannot_stand_for_more_than_their_file() {
    let mut scene = bar();
    let times = scene.floats("SCALAR", 1, &[0.0; 100_000]);
    let turns = json!({ "bufferView": times, "componentType": 5121, "type": "VEC4", "count": 100_000 });
    let (mut channels, mut samplers) = (Vec::new(), Vec::new());
    for k in 0..400 {
        add(&mut scene.json["accessors"], turns.clone());
        samplers.push(json!({ "input": times, "output": times + 1 + k }));
        channels.push(json!({ "sampler": k, "target": { "node": 1, "path": "rotation" } }));
    }
    scene.json["animations"] = json!([{ "channels": channels, "samplers": samplers }]);
    let loaded = scene.read();
    assert_eq!(loaded.notes, ["animation 0 was left out: animations repeat their numbers too often"]);
}

#[test]
fn morph_targets_are_counted() {
    let mut scene = bar();
    scene.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": 0 }, { "POSITION": 0 }]);
    let weights = json!({ "sampler": 0, "target": { "node": 0, "path": "weights" } });
    add(&mut scene.json["animations"][0]["channels"], weights);
    let loaded = scene.read();
    let [(code, text)] = loaded.warnings.as_slice() else { panic!("{:?}", loaded.warnings) };
    assert_eq!(*code, rtfmesh::WarningCode::LeftOut);
    assert!(text.starts_with("2 morph targets are not kept: "), "{text}");
    assert!(loaded.notes.is_empty(), "{:?}", loaded.notes);
    assert_eq!(loaded.attributes.skin.unwrap().animation_count(), 1);
}
