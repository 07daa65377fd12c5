//! A mesh as one `.glb` file.

use std::io::{self, Write};

use glam::DVec3;
use serde_json::{Value, json};

use crate::TriMesh;

/// Positions further out than this many times the longest side of the bounding box lose digits in 32 bits, which a
/// node's translation keeps.
const FAR: f64 = 2.0;
/// Half sides out of this range need a node's scale, so that products of lengths stay within 32 bits.
const SMALL: f64 = 1e-9;
const LARGE: f64 = 1e9;

/// Bytes before the JSON, and before the binary data.
const HEADER: u64 = 20;
const CHUNK: u64 = 8;

/// What the node does to the positions in the buffer.
struct Placement {
    translation: DVec3,
    scale: f64,
}

impl Placement {
    fn of(mesh: &TriMesh) -> Self {
        let (low, high) = mesh.bounds().unwrap_or_default();
        // Halved first, because the difference can overflow.
        let half = 0.5 * high - 0.5 * low;
        let largest = half.max_element();
        let out = low.abs().max(high.abs()).max_element() > 2.0 * FAR * largest;
        // Where every digit fits anyway, positions stay what they are.
        let far = out && mesh.vertices.iter().any(|vertex| vertex.as_vec3().as_dvec3() != *vertex);
        let odd = largest > 0.0 && !(SMALL..LARGE).contains(&largest);
        let translation = if far || odd { 0.5 * low + 0.5 * high } else { DVec3::ZERO };
        // A power of two, so that no digit is lost.
        let scale = if odd { largest.log2().floor().clamp(-1022.0, 1023.0).exp2() } else { 1.0 };
        Self { translation, scale }
    }

    fn inverse(&self, position: DVec3) -> [f32; 3] {
        ((position - self.translation) / self.scale).as_vec3().to_array()
    }

    fn node(&self) -> Value {
        let mut node = json!({ "mesh": 0 });
        if self.translation != DVec3::ZERO {
            node["translation"] = json!(self.translation.to_array());
        }
        if self.scale != 1.0 {
            node["scale"] = json!([self.scale, self.scale, self.scale]);
        }
        node
    }
}

/// Bytes of the positions and of the indices.
fn data_bytes(mesh: &TriMesh) -> [u64; 2] {
    [12 * mesh.vertices.len() as u64, 12 * mesh.triangles.len() as u64]
}

/// Bytes of the file to within those of its JSON, a few kilobytes.
pub(in crate::mesh::io) fn byte_length(mesh: &TriMesh) -> u64 {
    HEADER + CHUNK + data_bytes(mesh).iter().sum::<u64>()
}

fn document(mesh: &TriMesh, placement: &Placement) -> Value {
    let [positions, indices] = data_bytes(mesh);
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for vertex in &mesh.vertices {
        for ((low, high), value) in low.iter_mut().zip(&mut high).zip(placement.inverse(*vertex)) {
            (*low, *high) = (low.min(value), high.max(value));
        }
    }
    let [low, high] = [low, high].map(|bound| bound.map(f64::from));
    json!({
        "asset": { "version": "2.0", "generator": concat!("rtfmesh ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [placement.node()],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "mode": 4 }] }],
        "accessors": [
            {
                "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": mesh.vertices.len(),
                // Exact in f64, and so in JSON.
                "min": low, "max": high,
            },
            { "bufferView": 1, "componentType": 5125, "type": "SCALAR", "count": 3 * mesh.triangles.len() },
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": positions, "target": 34962 },
            { "buffer": 0, "byteOffset": positions, "byteLength": indices, "target": 34963 },
        ],
        "buffers": [{ "byteLength": positions + indices }],
    })
}

/// Writes `mesh`, which must have faces and fit into 4 GiB.
pub(in crate::mesh::io) fn write(file: &mut dyn Write, mesh: &TriMesh) -> io::Result<()> {
    let placement = Placement::of(mesh);
    let mut json = document(mesh, &placement).to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let data = data_bytes(mesh).iter().sum::<u64>();
    let total = HEADER + json.len() as u64 + CHUNK + data;
    let word = |value: u64| u32::try_from(value).map(u32::to_le_bytes).map_err(io::Error::other);
    file.write_all(b"glTF")?;
    file.write_all(&word(2)?)?;
    file.write_all(&word(total)?)?;
    file.write_all(&word(json.len() as u64)?)?;
    file.write_all(b"JSON")?;
    file.write_all(&json)?;
    file.write_all(&word(data)?)?;
    file.write_all(b"BIN\0")?;
    for value in mesh.vertices.iter().flat_map(|vertex| placement.inverse(*vertex)) {
        file.write_all(&value.to_le_bytes())?;
    }
    for index in mesh.triangles.as_flattened() {
        file.write_all(&index.to_le_bytes())?;
    }
    Ok(())
}
