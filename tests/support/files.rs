//! Meshes as the bytes of files: by the library, and as text and JSON without its own writers; and how far
//! meshes agree.

use glam::DVec3;
use rtfmesh::io::{Encoding, Input, Loaded, Reader, Writer};
use rtfmesh::mesh::attributes::Attributes;
use rtfmesh::{Result, TriMesh};
use serde_json::json;
use std::fmt::Write as _;
use std::path::Path;

/// A mesh from the bytes of a file.
pub fn read_bytes(bytes: &[u8], declared: Option<Encoding>) -> Result<Loaded> {
    Reader::new().format(declared).read_bytes(bytes)
}

/// As [`read_bytes`], with materials.
pub fn read_bytes_with_materials(bytes: &[u8], declared: Option<Encoding>) -> Result<Loaded> {
    Reader::new().format(declared).materials(true).read_bytes(bytes)
}

/// A mesh, points or a volume from the bytes of a file.
pub fn read_any_bytes(bytes: &[u8], declared: Option<Encoding>, materials: bool) -> Result<Input> {
    Reader::new().format(declared).materials(materials).read_any_bytes(bytes)
}

/// The bytes of a file.
pub fn encode(name: &Path, mesh: &TriMesh, encoding: Encoding) -> Result<Vec<u8>> {
    Writer::new().encoding(encoding).encode(name, mesh)
}

/// As [`encode`], with attributes.
pub fn encode_with(
    name: &Path,
    mesh: &TriMesh,
    attributes: &Attributes,
    encoding: Encoding,
) -> Result<Vec<u8>> {
    Writer::new().attributes(attributes).encoding(encoding).encode(name, mesh)
}

/// Fails unless both have the same triangles to within this share of the diagonal.
#[track_caller]
pub fn assert_same(got: &TriMesh, want: &TriMesh, share: f64, what: &str) {
    let [low, high] = want.bounds().unwrap();
    let near = share * (high - low).length();
    assert_eq!(got.triangles.len(), want.triangles.len(), "{what}");
    for (a, b) in corners(got).iter().flatten().zip(corners(want).iter().flatten()) {
        assert!(a.distance(*b) <= near, "{what}: {a} instead of {b}");
    }
}

/// Facets as text.
pub fn text_stl(mesh: &TriMesh) -> String {
    let mut text = "solid made by hand\n".to_owned();
    for triangle in corners(mesh) {
        text.push_str(" facet normal 0 0 nan\n  outer loop\n");
        for DVec3 { x, y, z } in triangle {
            writeln!(text, "   vertex {x} {y} {z:e}").unwrap();
        }
        text.push_str("  endloop\n endfacet\n");
    }
    text + "endsolid made by hand\n"
}

/// JSON with the buffers inside.
pub fn gltf_of(mesh: &TriMesh) -> String {
    let mut data = Vec::new();
    let values = mesh.vertices.iter().flat_map(|v| v.as_vec3().to_array());
    values.for_each(|value| data.extend(value.to_le_bytes()));
    let positions = data.len();
    mesh.triangles.as_flattened().iter().for_each(|index| data.extend((*index as u16).to_le_bytes()));
    json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": mesh.vertices.len() },
            { "bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": 3 * mesh.triangles.len() },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": positions },
            { "buffer": 0, "byteOffset": positions, "byteLength": data.len() - positions },
        ],
        "buffers": [{
            "byteLength": data.len(), "uri": format!("data:application/gltf-buffer;base64,{}", base64(&data)),
        }],
    })
    .to_string()
}

pub fn base64(data: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for three in data.chunks(3) {
        let bits = (0..3).fold(0_u32, |bits, i| bits << 8 | u32::from(*three.get(i).unwrap_or(&0)));
        for i in 0..4 {
            let digit = DIGITS[(bits >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= three.len() { char::from(digit) } else { '=' });
        }
    }
    text
}

pub fn corners(mesh: &TriMesh) -> Vec<[DVec3; 3]> {
    (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect()
}
