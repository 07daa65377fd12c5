//! Reads materials with their textures and images, if asked for.

use std::collections::{BTreeSet, HashMap};

use gltf_json::validation::{Error as Fault, Validate};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};

use super::accessors::{Buffers, Content};
use crate::grammar::counted;
use crate::io::checks::excerpt;
use crate::io::image_type::image_type;
use crate::io::loaded::Loaded;
use crate::mesh::attributes::{Image, Materials};
use crate::{Error, Result};

/// Maximum number of bytes of all images together.
const MAX_IMAGE_BYTES: u64 = 256 << 20;

/// The properties of a material that are read.
const MATERIAL_KEYS: [&str; 9] = [
    "pbrMetallicRoughness",
    "normalTexture",
    "occlusionTexture",
    "emissiveTexture",
    "emissiveFactor",
    "alphaMode",
    "alphaCutoff",
    "doubleSided",
    "extensions",
];

#[derive(Deserialize)]
struct Document {
    #[serde(default)]
    materials: Vec<Value>,
    #[serde(default)]
    textures: Vec<Value>,
    #[serde(default)]
    samplers: Vec<Value>,
    #[serde(default)]
    images: Vec<ImageEntry>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct ImageEntry {
    name: Option<String>,
    uri: Option<String>,
    buffer_view: Option<usize>,
}

/// Adds the materials that triangles use. What cannot be read is noted; too many bytes are an error.
pub(crate) fn add_materials(json: &[u8], buffers: &Buffers, loaded: &mut Loaded) -> Result<()> {
    let Some(label) = loaded.attributes.face_named("material") else { return Ok(()) };
    // The number after that of the last material stands for none.
    let used: BTreeSet<usize> = label.values.iter().map(|value| *value as usize).collect();
    let document: Document = match serde_json::from_slice(json) {
        Ok(document) => document,
        Err(error) => {
            loaded.notes.push(format!("materials were left out ({})", excerpt(&error.to_string())));
            return Ok(());
        }
    };
    let mut reader = MaterialReader {
        document: &document,
        buffers,
        has_uv: loaded.attributes.uv.is_some(),
        materials: Materials::default(),
        new_indices: [const { None }; 3].map(|_: Option<()>| HashMap::new()),
        image_bytes: 0,
        textures_without_uv: 0,
        textures_with_other_uv: 0,
        extensions: BTreeSet::new(),
        notes: &mut loaded.notes,
    };
    for (index, material) in document.materials.iter().enumerate() {
        let kept =
            if used.contains(&index) { reader.convert_material(index, material)? } else { Value::Null };
        reader.materials.materials.push(kept);
    }
    loaded.attributes.materials = Some(reader.finish());
    Ok(())
}

/// A kind of object that is referred to by index. Indices are new in the result, which has only what is used.
#[derive(Clone, Copy)]
enum Part {
    Texture,
    Sampler,
    Image,
}

/// The materials read so far.
struct MaterialReader<'a, 'b> {
    document: &'a Document,
    buffers: &'a Buffers<'b>,
    has_uv: bool,
    materials: Materials,
    /// For each [`Part`], the new index by the index in the file; `None` for what was left out.
    new_indices: [HashMap<usize, Option<usize>>; 3],
    image_bytes: u64,
    textures_without_uv: usize,
    /// Textures with another than the first set of texture coordinates.
    textures_with_other_uv: usize,
    /// Names of the extensions that were left out.
    extensions: BTreeSet<String>,
    notes: &'a mut Vec<String>,
}

impl MaterialReader<'_, '_> {
    fn convert_material(&mut self, index: usize, material: &Value) -> Result<Value> {
        let known = |key: &str| Some((key.to_owned(), material.get(key)?.clone()));
        let kept: Map<String, Value> = MATERIAL_KEYS.into_iter().filter_map(known).collect();
        let value = Value::Object(kept.clone());
        if !has_valid_types::<gltf_json::Material>(&value) || !has_valid_factors(&value) {
            self.notes.push(format!("material {index} was left out: its values are not valid in glTF"));
            return Ok(Value::Null);
        }
        Ok(Value::Object(self.convert_object(&kept)?))
    }

    /// The object with the extensions that are kept and new texture indices.
    fn convert_object(&mut self, object: &Map<String, Value>) -> Result<Map<String, Value>> {
        let mut kept = Map::new();
        for (key, value) in object {
            let value = match value {
                _ if key == "extras" => continue,
                Value::Object(inner) if key == "extensions" => self.convert_extensions(inner)?,
                Value::Object(inner) if key.ends_with("Texture") => self.convert_texture_reference(inner)?,
                Value::Object(inner) => Some(self.convert_object(inner)?),
                other => {
                    kept.insert(key.clone(), other.clone());
                    continue;
                }
            };
            if let Some(value) = value {
                kept.insert(key.clone(), Value::Object(value));
            }
        }
        Ok(kept)
    }

    fn convert_extensions(&mut self, object: &Map<String, Value>) -> Result<Option<Map<String, Value>>> {
        let (kept, dropped): (Map<_, _>, Map<_, _>) = object
            .clone()
            .into_iter()
            .partition(|(name, _)| name.starts_with("KHR_materials_") || name == "KHR_texture_transform");
        self.extensions.extend(dropped.into_iter().map(|(name, _)| excerpt(&name)));
        let kept = self.convert_object(&kept)?;
        Ok((!kept.is_empty()).then_some(kept))
    }

    /// A material's reference to a texture, with the new index; `None` if the texture was left out.
    fn convert_texture_reference(
        &mut self,
        reference: &Map<String, Value>,
    ) -> Result<Option<Map<String, Value>>> {
        let transform = reference.get("extensions").and_then(|all| all.get("KHR_texture_transform"));
        let uv = transform.and_then(|transform| transform.get("texCoord")).or(reference.get("texCoord"));
        if !self.has_uv {
            self.textures_without_uv += 1;
            return Ok(None);
        }
        if uv.is_some_and(|uv| uv.as_u64() != Some(0)) {
            self.textures_with_other_uv += 1;
            return Ok(None);
        }
        let Some(index) = self.new_index(reference.get("index"), Part::Texture)? else { return Ok(None) };
        let mut kept = self.convert_object(reference)?;
        kept.insert("index".to_owned(), json!(index));
        Ok(Some(kept))
    }

    /// The new index of the object with index `old`; `None` if it was left out.
    fn new_index(&mut self, old: Option<&Value>, part: Part) -> Result<Option<usize>> {
        let Some(old) = old.and_then(Value::as_u64).and_then(|old| usize::try_from(old).ok()) else {
            return Ok(None);
        };
        if let Some(known) = self.new_indices[part as usize].get(&old) {
            return Ok(*known);
        }
        let new = match part {
            Part::Texture => self.add_texture(old)?,
            Part::Sampler => self.add_sampler(old),
            Part::Image => self.add_image(old)?,
        };
        self.new_indices[part as usize].insert(old, new);
        Ok(new)
    }

    fn add_texture(&mut self, index: usize) -> Result<Option<usize>> {
        let Some(texture) = self.document.textures.get(index) else {
            self.notes.push(format!("texture {index} was left out: there is none"));
            return Ok(None);
        };
        let mut kept = Map::new();
        let images = self.image_sources(texture)?;
        if images.is_empty() {
            self.notes.push(format!("texture {index} was left out: none of its images could be read"));
            return Ok(None);
        }
        for (extension, image) in &images {
            match extension {
                None => kept.insert("source".to_owned(), json!(image)),
                Some(name) => kept.insert("extensions".to_owned(), json!({ *name: { "source": image } })),
            };
        }
        if let Some(sampler) = self.new_index(texture.get("sampler"), Part::Sampler)? {
            kept.insert("sampler".to_owned(), json!(sampler));
        }
        self.materials.textures.push(Value::Object(kept));
        Ok(Some(self.materials.textures.len() - 1))
    }

    /// The images of a texture: its own, and one of another type with the name of the extension for it.
    fn image_sources<'v>(&mut self, texture: &'v Value) -> Result<Vec<(Option<&'v str>, usize)>> {
        let mut found = Vec::new();
        if let Some(image) = self.new_index(texture.get("source"), Part::Image)? {
            found.push((None, image));
        }
        for (name, extension) in texture.get("extensions").and_then(Value::as_object).into_iter().flatten() {
            let is_image_type =
                matches!(name.as_str(), "EXT_texture_webp" | "EXT_texture_avif" | "KHR_texture_basisu");
            if !is_image_type {
                self.extensions.insert(excerpt(name));
            } else if found.iter().all(|(extension, _)| extension.is_none())
                && let Some(image) = self.new_index(extension.get("source"), Part::Image)?
            {
                found.push((Some(name.as_str()), image));
            }
        }
        Ok(found)
    }

    fn add_sampler(&mut self, index: usize) -> Option<usize> {
        let sampler = self.document.samplers.get(index)?;
        let known = ["magFilter", "minFilter", "wrapS", "wrapT"].into_iter();
        let kept: Value = known.filter_map(|key| Some((key.to_owned(), sampler.get(key)?.clone()))).collect();
        if !has_valid_types::<gltf_json::texture::Sampler>(&kept) {
            self.notes.push(format!("sampler {index} was left out: its values are not valid in glTF"));
            return None;
        }
        self.materials.samplers.push(kept);
        Some(self.materials.samplers.len() - 1)
    }

    fn add_image(&mut self, index: usize) -> Result<Option<usize>> {
        let entry = self.document.images.get(index);
        match entry.ok_or_else(|| unusable("there is none")).and_then(|entry| self.read_image(entry)) {
            Ok(image) => {
                self.image_bytes += image.bytes.len() as u64;
                self.materials.images.push(image);
                Ok(Some(self.materials.images.len() - 1))
            }
            Err(Missing::TooLarge) => {
                let problem = format!("the images have more than {} MiB", MAX_IMAGE_BYTES >> 20);
                let remedy = "make them smaller, or read the file without materials";
                Err(Error::input(Some(format!("image {index}")), problem, remedy))
            }
            Err(Missing::Unusable(problem)) => {
                self.notes.push(format!("image {index} was left out: {problem}"));
                Ok(None)
            }
        }
    }

    fn read_image(&self, entry: &ImageEntry) -> std::result::Result<Image, Missing> {
        // Images of an honest file are in it once, or a few times.
        let most = self.buffers.read_bytes().saturating_mul(4);
        let bytes_left = MAX_IMAGE_BYTES - self.image_bytes;
        let bytes = match (&entry.uri, entry.buffer_view) {
            (Some(uri), _) => {
                self.buffers.image(uri, bytes_left).map_err(missing)?.ok_or(Missing::TooLarge)?
            }
            (None, Some(view)) => Content::InFile(self.buffers.view(view).map_err(missing)?.0),
            (None, None) => return Err(unusable("it has no data")),
        };
        if bytes.is_empty() {
            return Err(unusable("it is empty"));
        }
        if bytes.len() as u64 > bytes_left {
            return Err(Missing::TooLarge);
        }
        if entry.uri.is_none() && self.image_bytes + bytes.len() as u64 > most {
            return Err(unusable("images refer to the same bytes too often"));
        }
        // What an image claims to be is no matter: any other file could be given away as one.
        let Some(mime) = image_type(&bytes) else {
            return Err(unusable("it is not an image (PNG, JPEG, WebP, AVIF or KTX2)"));
        };
        Ok(Image { name: entry.name.clone(), mime: mime.to_owned(), bytes: bytes.to_vec().into() })
    }

    /// Notes what was left out, and returns the materials.
    fn finish(self) -> Materials {
        if self.textures_without_uv > 0 {
            self.notes.push("textures were left out: the mesh has no texture coordinates".to_owned());
        }
        if self.textures_with_other_uv > 0 {
            let textures = ["texture was left out, which uses", "textures were left out, which use"];
            let textures = counted(self.textures_with_other_uv, textures);
            self.notes.push(format!("{textures} another than the first set of texture coordinates"));
        }
        if !self.extensions.is_empty() {
            let names: Vec<String> = self.extensions.into_iter().collect();
            self.notes.push(format!("extensions of materials were left out: {}", names.join(", ")));
        }
        self.materials
    }
}

/// Whether the values have glTF's types. Indices and the contents of extensions are not checked.
fn has_valid_types<T: DeserializeOwned + Validate>(value: &Value) -> bool {
    if !has_valid_objects(value) {
        return false;
    }
    let Ok(part) = serde_json::from_value::<T>(value.clone()) else { return false };
    let mut valid = true;
    part.validate(&gltf_json::Root::default(), gltf_json::Path::new, &mut |_, fault| {
        valid &= fault == Fault::IndexOutOfBounds;
    });
    valid
}

/// Whether objects are where glTF has them, and nothing is null. (serde accepts lists for objects, and null
/// for absent.)
fn has_valid_objects(value: &Value) -> bool {
    let is_object_key =
        |key: &str| ["pbrMetallicRoughness", "extensions"].contains(&key) || key.ends_with("Texture");
    match value {
        Value::Null => false,
        Value::Array(values) => values.iter().all(has_valid_objects),
        Value::Object(all) => all
            .iter()
            .all(|(key, value)| (value.is_object() || !is_object_key(key)) && has_valid_objects(value)),
        _ => true,
    }
}

/// Whether a material's factors are in the ranges that glTF allows.
fn has_valid_factors(material: &Value) -> bool {
    let ranges = [
        ("/pbrMetallicRoughness/baseColorFactor", 1.0),
        ("/pbrMetallicRoughness/metallicFactor", 1.0),
        ("/pbrMetallicRoughness/roughnessFactor", 1.0),
        ("/occlusionTexture/strength", 1.0),
        ("/emissiveFactor", 1.0),
        ("/alphaCutoff", f64::INFINITY),
    ];
    ranges.iter().all(|(pointer, most)| {
        let value = material.pointer(pointer);
        let numbers = value.map(|value| value.as_array().map_or(std::slice::from_ref(value), Vec::as_slice));
        let fits = |number: &Value| number.as_f64().is_some_and(|number| (0.0..=*most).contains(&number));
        numbers.is_none_or(|numbers| numbers.iter().all(fits))
    })
}

/// Why an image cannot be read.
enum Missing {
    TooLarge,
    Unusable(String),
}

fn unusable(problem: &str) -> Missing {
    Missing::Unusable(problem.to_owned())
}

fn missing(error: Error) -> Missing {
    match error {
        Error::Input { problem, .. } => Missing::Unusable(problem),
        other => Missing::Unusable(other.to_string()),
    }
}
