//! Any bytes as an image of a scene: what comes along is an image, with the bytes that were given.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use rtfmesh::io::{Encoding, Format, Reader};

/// A triangle with texture coordinates and one texture, whose image has these bytes.
fn scene(image: &[u8]) -> String {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0_f32]];
    let values = corners.as_flattened().iter().chain(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let buffer: Vec<u8> = values.flat_map(|value| value.to_le_bytes()).collect();
    serde_json::json!({
        "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "material": 0 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3 },
            { "bufferView": 1, "componentType": 5126, "type": "VEC2", "count": 3 },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 36 }, { "buffer": 0, "byteOffset": 36, "byteLength": 24 },
        ],
        "buffers": [{ "byteLength": 60, "uri": format!("data:;base64,{}", STANDARD.encode(&buffer)) }],
        "materials": [{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }],
        "textures": [{ "source": 0 }],
        "images": [{ "uri": format!("data:;base64,{}", STANDARD.encode(image)) }],
    })
    .to_string()
}

/// The media type of the image, if it came along; a note tells of any other.
pub fn media_type(data: &[u8]) -> Option<String> {
    let gltf = Encoding { format: Format::Gltf, gzip: false };
    let reader = Reader::new().format(Some(gltf)).materials(true);
    let loaded = reader.read_bytes(scene(data).as_bytes()).expect("the rest of the scene is right");
    let materials = loaded.attributes.materials.expect("the material came along");
    let Some(image) = materials.images().first() else {
        assert!(loaded.notes.iter().any(|note| note.contains("image")), "{:?}", loaded.notes);
        return None;
    };
    assert_eq!(&*image.bytes, data);
    Some(image.mime.clone())
}

/// Reads the data as an image.
pub fn check(data: &[u8]) {
    media_type(data);
}
