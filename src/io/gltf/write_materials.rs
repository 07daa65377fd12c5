//! Writes the materials, textures and images of a `.glb` file.

use std::collections::BTreeSet;

use serde_json::{Map, Value, json};

use crate::mesh::attributes::{Attributes, Image, Materials};

/// The materials, if they can be written: textures need texture coordinates.
pub(crate) fn writable_materials(attributes: &Attributes) -> Option<&Materials> {
    let fits = |materials: &&Materials| attributes.uv.is_some() || materials.textures.is_empty();
    attributes.materials.as_ref().filter(fits)
}

/// Bytes of the images in the buffer and of the materials and textures in JSON.
pub(crate) fn byte_length(materials: &Materials) -> u64 {
    let image_bytes: usize = materials.images.iter().map(|image| image.bytes.len().next_multiple_of(4)).sum();
    let json_bytes = materials
        .materials
        .iter()
        .chain(&materials.textures)
        .map(|value| value.to_string().len())
        .sum::<usize>();
    (image_bytes + json_bytes) as u64
}

/// The entries of the materials with these names. An empty last name stands for no material and is left out.
pub(crate) fn material_entries(names: &[String], materials: Option<&Materials>) -> Vec<Value> {
    let names = match names.split_last() {
        Some((last, others)) if last.is_empty() => others,
        _ => names,
    };
    let material = |(index, name): (usize, &String)| {
        let own = materials.and_then(|materials| materials.materials.get(index)?.as_object());
        let mut material: Map<String, Value> = own.cloned().unwrap_or_default();
        material.insert("name".to_owned(), json!(name));
        Value::Object(material)
    };
    names.iter().enumerate().map(material).collect()
}

/// Adds the textures, samplers and images to the document; `views` are the buffer views of the images.
pub(crate) fn add_textures(document: &mut Value, materials: &Materials, views: &[usize]) {
    let image = |(image, view): (&Image, &usize)| {
        let mut entry = json!({ "bufferView": view, "mimeType": image.mime });
        if let Some(name) = &image.name {
            entry["name"] = json!(name);
        }
        entry
    };
    let images = materials.images.iter().zip(views).map(image).collect();
    for (key, values) in [
        ("textures", materials.textures.clone()),
        ("samplers", materials.samplers.clone()),
        ("images", images),
    ] {
        if !values.is_empty() {
            document[key] = Value::Array(values);
        }
    }
    let mut extensions_used = BTreeSet::new();
    materials
        .materials
        .iter()
        .chain(&materials.textures)
        .for_each(|value| collect_extensions(value, &mut extensions_used));
    if !extensions_used.is_empty() {
        document["extensionsUsed"] = json!(extensions_used);
    }
    // Without these extensions a texture has no image at all.
    let mut required = BTreeSet::new();
    let without_source = materials.textures.iter().filter(|texture| texture.get("source").is_none());
    without_source.for_each(|value| collect_extensions(value, &mut required));
    if !required.is_empty() {
        document["extensionsRequired"] = json!(required);
    }
}

/// Adds the names of all extensions in a value.
fn collect_extensions<'a>(value: &'a Value, names: &mut BTreeSet<&'a str>) {
    for (key, inner) in value.as_object().into_iter().flatten() {
        if key == "extensions" {
            names.extend(inner.as_object().into_iter().flat_map(Map::keys).map(String::as_str));
        }
        collect_extensions(inner, names);
    }
}
