//! Materials, textures and pictures of a `.glb` file.

use std::collections::BTreeSet;

use serde_json::{Map, Value, json};

use crate::mesh::attributes::{Attributes, Image, Materials};

/// The materials that the file can have: textures need texture coordinates.
pub(crate) fn materials_of(attributes: &Attributes) -> Option<&Materials> {
    let fits = |materials: &&Materials| attributes.uv.is_some() || materials.textures.is_empty();
    attributes.materials.as_ref().filter(fits)
}

/// Bytes that they take, in the buffer and in JSON, to within those of what refers to them.
pub(crate) fn byte_length(materials: &Materials) -> u64 {
    let pictures: usize = materials.images.iter().map(|image| image.bytes.len().next_multiple_of(4)).sum();
    let text = materials
        .materials
        .iter()
        .chain(&materials.textures)
        .map(|value| value.to_string().len())
        .sum::<usize>();
    (pictures + text) as u64
}

/// The materials of these names; one without a name at the end stands for none and is left out.
pub(crate) fn materials(names: &[String], materials: Option<&Materials>) -> Vec<Value> {
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

/// Adds what materials refer to; `views` are the buffer views of the pictures.
pub(crate) fn add(document: &mut Value, materials: &Materials, views: &[usize]) {
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
    let mut used = BTreeSet::new();
    materials.materials.iter().chain(&materials.textures).for_each(|value| extensions(value, &mut used));
    if !used.is_empty() {
        document["extensionsUsed"] = json!(used);
    }
    // Whoever does not know them has no picture at all.
    let mut required = BTreeSet::new();
    let alone = materials.textures.iter().filter(|texture| texture.get("source").is_none());
    alone.for_each(|value| extensions(value, &mut required));
    if !required.is_empty() {
        document["extensionsRequired"] = json!(required);
    }
}

/// The names of the extensions in a value.
fn extensions<'a>(value: &'a Value, names: &mut BTreeSet<&'a str>) {
    for (key, inner) in value.as_object().into_iter().flatten() {
        if key == "extensions" {
            names.extend(inner.as_object().into_iter().flat_map(Map::keys).map(String::as_str));
        }
        extensions(inner, names);
    }
}
