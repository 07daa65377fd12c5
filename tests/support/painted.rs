//! Spheres with texture coordinates, materials and pictures, as glTF.

use super::files::base64;
use crate::support::files::encode_with;
use glam::DVec3;
use rtfmesh::TriMesh;
use rtfmesh::io::{Encoding, Format};
use rtfmesh::mesh::attributes::{Attribute, Attributes, CornerUv, Kind, Role};
use rtfmesh::mesh::samples::sample;
use serde_json::{Value, json};
use std::f64::consts::{PI, TAU};
use std::path::Path;

pub const GLB: Encoding = Encoding { format: Format::Glb, gzip: false };

/// Longitude and latitude, each face on one side of the cut.
pub fn globe(mesh: &TriMesh) -> CornerUv {
    let around = |v: DVec3| v.y.atan2(v.x) / TAU + 0.5;
    let of_face = |t: usize| {
        let corners = mesh.corners(t);
        let middle = around(corners.iter().sum());
        corners.map(|v| {
            let u = around(v);
            [u + (middle - u).round(), v.normalize().z.asin() / PI + 0.5]
        })
    };
    CornerUv { kind: Kind::F32, values: (0..mesh.triangles.len()).flat_map(of_face).collect() }
}

/// The northern half has another material than the southern.
pub fn halves(mesh: &TriMesh) -> Attribute {
    let south = |t: usize| f64::from(u8::from(mesh.corners(t).iter().sum::<DVec3>().z < 0.0));
    let values = (0..mesh.triangles.len()).map(south).collect();
    let label = Attribute::new("material", Role::Label, Kind::U32, 1, values);
    Attribute { names: vec!["north".to_owned(), "south".to_owned()], ..label }
}

/// A sphere with texture coordinates as JSON, its buffer inside, with these parts added.
pub fn sphere(label: impl Fn(&TriMesh) -> Attribute, parts: Value) -> Value {
    let mesh = sample("bumpy-sphere").unwrap();
    let attributes = Attributes { face: vec![label(&mesh)], uv: Some(globe(&mesh)), ..Default::default() };
    let bytes = encode_with(Path::new("sphere"), &mesh, &attributes, GLB).unwrap();
    let (mut json, binary) = split(&bytes);
    json["buffers"][0]["uri"] = json!(format!("data:application/gltf-buffer;base64,{}", base64(&binary)));
    for (key, value) in parts.as_object().unwrap() {
        json[key] = value.clone();
    }
    json
}

/// The JSON and the buffer of a GLB file.
pub fn split(bytes: &[u8]) -> (Value, Vec<u8>) {
    let glb = gltf::Glb::from_slice(bytes).unwrap();
    (serde_json::from_slice(&glb.json).unwrap(), glb.bin.unwrap_or_default().into_owned())
}

pub fn one(mesh: &TriMesh) -> Attribute {
    let values = vec![0.0; mesh.triangles.len()];
    Attribute {
        names: vec!["skin".to_owned()],
        ..Attribute::new("material", Role::Label, Kind::U32, 1, values)
    }
}

/// A checker board as PNG.
pub fn checker(shade: u8) -> Vec<u8> {
    let mut picture = tiny_skia::Pixmap::new(8, 8).unwrap();
    for (k, pixel) in picture.pixels_mut().iter_mut().enumerate() {
        let value = if (k / 8 + k) % 2 == 0 { shade } else { 255 };
        *pixel = tiny_skia::PremultipliedColorU8::from_rgba(value, value, value, 255).unwrap();
    }
    picture.encode_png().unwrap()
}

pub fn add(list: &mut Value, value: Value) {
    list.as_array_mut().unwrap().push(value);
}

pub fn uri(picture: &[u8]) -> String {
    format!("data:image/png;base64,{}", base64(picture))
}

/// A material with a base colour texture, and all that it takes.
pub fn textured(image: Value) -> Value {
    json!({
        "materials": [{
            "name": "skin", "doubleSided": true, "extras": { "note": 1 },
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.5, 1.0, 1.0, 1.0], "metallicFactor": 0.25, "roughnessFactor": 0.75,
                "baseColorTexture": { "index": 1 },
            },
        }],
        "textures": [{ "source": 5 }, { "source": 0, "sampler": 0, "name": "t" }],
        "samplers": [{ "magFilter": 9728, "wrapS": 33071 }],
        "images": [image],
    })
}

/// A sphere with a picture on it, as a .gltf file with everything inside.
pub fn painted_globe() -> String {
    sphere(one, textured(json!({ "uri": uri(&checker(0)) }))).to_string()
}
