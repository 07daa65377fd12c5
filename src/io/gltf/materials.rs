//! Materials with their textures and pictures, which are read only for those who ask.

use std::borrow::Cow;
use std::collections::{BTreeSet, HashMap};

use gltf_json::validation::{Error as Fault, Validate};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};

use super::accessors::Buffers;
use crate::io::{Loaded, excerpt};
use crate::mesh::attributes::{Image, Materials};
use crate::{Error, Result};

/// Bytes of all pictures together.
const MOST_BYTES: u64 = 256 << 20;

/// What of a material is kept.
const KEPT: [&str; 9] = [
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
    images: Vec<Picture>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Picture {
    name: Option<String>,
    uri: Option<String>,
    buffer_view: Option<usize>,
    mime_type: Option<String>,
}

/// Adds the materials that triangles use. What cannot be read is noted; too many bytes are an error.
pub(crate) fn add(json: &[u8], buffers: &Buffers, loaded: &mut Loaded) -> Result<()> {
    let Some(label) = loaded.attributes.face_named("material") else { return Ok(()) };
    // The number after the last stands for none.
    let used: BTreeSet<usize> = label.values.iter().map(|value| *value as usize).collect();
    let document: Document = match serde_json::from_slice(json) {
        Ok(document) => document,
        Err(error) => {
            loaded.notes.push(format!("materials were left out ({})", excerpt(&error.to_string())));
            return Ok(());
        }
    };
    let mut gathered = Gathered {
        document: &document,
        buffers,
        has_uv: loaded.attributes.uv.is_some(),
        materials: Materials::default(),
        known: [const { None }; 3].map(|_: Option<()>| HashMap::new()),
        bytes: 0,
        without_uv: 0,
        other_uv: 0,
        extensions: BTreeSet::new(),
        notes: &mut loaded.notes,
    };
    for (index, material) in document.materials.iter().enumerate() {
        let kept = if used.contains(&index) { gathered.material(index, material)? } else { Value::Null };
        gathered.materials.materials.push(kept);
    }
    loaded.attributes.materials = Some(gathered.end());
    Ok(())
}

/// What textures refer to; each kind counts anew in the result.
#[derive(Clone, Copy)]
enum Part {
    Texture,
    Sampler,
    Image,
}

/// What has been gathered so far.
struct Gathered<'a, 'b> {
    document: &'a Document,
    buffers: &'a Buffers<'b>,
    has_uv: bool,
    materials: Materials,
    /// The new numbers of what was looked at, by [`Part`]; `None` for what cannot be had.
    known: [HashMap<usize, Option<usize>>; 3],
    bytes: u64,
    without_uv: usize,
    other_uv: usize,
    /// Names of those that are left out.
    extensions: BTreeSet<String>,
    notes: &'a mut Vec<String>,
}

impl Gathered<'_, '_> {
    fn material(&mut self, index: usize, material: &Value) -> Result<Value> {
        let known = |key: &str| Some((key.to_owned(), material.get(key)?.clone()));
        let kept: Map<String, Value> = KEPT.into_iter().filter_map(known).collect();
        let value = Value::Object(kept.clone());
        if !is_sound::<gltf_json::Material>(&value) || !is_in_range(&value) {
            self.notes.push(format!("material {index} was left out: glTF has no such values"));
            return Ok(Value::Null);
        }
        Ok(Value::Object(self.object(&kept)?))
    }

    /// The object without what is not kept, with new numbers of textures.
    fn object(&mut self, object: &Map<String, Value>) -> Result<Map<String, Value>> {
        let mut kept = Map::new();
        for (key, value) in object {
            let value = match value {
                _ if key == "extras" => continue,
                Value::Object(inner) if key == "extensions" => self.extensions(inner)?,
                Value::Object(inner) if key.ends_with("Texture") => self.use_of_texture(inner)?,
                Value::Object(inner) => Some(self.object(inner)?),
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

    fn extensions(&mut self, object: &Map<String, Value>) -> Result<Option<Map<String, Value>>> {
        let (kept, dropped): (Map<_, _>, Map<_, _>) = object
            .clone()
            .into_iter()
            .partition(|(name, _)| name.starts_with("KHR_materials_") || name == "KHR_texture_transform");
        self.extensions.extend(dropped.into_iter().map(|(name, _)| excerpt(&name)));
        let kept = self.object(&kept)?;
        Ok((!kept.is_empty()).then_some(kept))
    }

    /// A material's reference to a texture.
    fn use_of_texture(&mut self, reference: &Map<String, Value>) -> Result<Option<Map<String, Value>>> {
        let moved = reference.get("extensions").and_then(|all| all.get("KHR_texture_transform"));
        let uv = moved.and_then(|moved| moved.get("texCoord")).or(reference.get("texCoord"));
        if !self.has_uv {
            self.without_uv += 1;
            return Ok(None);
        }
        if uv.is_some_and(|uv| uv.as_u64() != Some(0)) {
            self.other_uv += 1;
            return Ok(None);
        }
        let Some(number) = self.number(reference.get("index"), Part::Texture)? else { return Ok(None) };
        let mut kept = self.object(reference)?;
        kept.insert("index".to_owned(), json!(number));
        Ok(Some(kept))
    }

    /// The new number of what `old` is the number of; `None` if it cannot be had.
    fn number(&mut self, old: Option<&Value>, part: Part) -> Result<Option<usize>> {
        let Some(old) = old.and_then(Value::as_u64).and_then(|old| usize::try_from(old).ok()) else {
            return Ok(None);
        };
        if let Some(known) = self.known[part as usize].get(&old) {
            return Ok(*known);
        }
        let new = match part {
            Part::Texture => self.texture(old)?,
            Part::Sampler => self.sampler(old),
            Part::Image => self.image(old)?,
        };
        self.known[part as usize].insert(old, new);
        Ok(new)
    }

    fn texture(&mut self, index: usize) -> Result<Option<usize>> {
        let Some(texture) = self.document.textures.get(index) else {
            self.notes.push(format!("texture {index} was left out: there is none"));
            return Ok(None);
        };
        let mut kept = Map::new();
        let pictures = self.sources(texture)?;
        if pictures.is_empty() {
            self.notes.push(format!("texture {index} was left out: it has no picture that could be read"));
            return Ok(None);
        }
        for (extension, image) in &pictures {
            match extension {
                None => kept.insert("source".to_owned(), json!(image)),
                Some(name) => kept.insert("extensions".to_owned(), json!({ *name: { "source": image } })),
            };
        }
        if let Some(sampler) = self.number(texture.get("sampler"), Part::Sampler)? {
            kept.insert("sampler".to_owned(), json!(sampler));
        }
        self.materials.textures.push(Value::Object(kept));
        Ok(Some(self.materials.textures.len() - 1))
    }

    /// The pictures of a texture: its own, and one in another packing with the extension that names it.
    fn sources<'v>(&mut self, texture: &'v Value) -> Result<Vec<(Option<&'v str>, usize)>> {
        let mut found = Vec::new();
        if let Some(image) = self.number(texture.get("source"), Part::Image)? {
            found.push((None, image));
        }
        for (name, extension) in texture.get("extensions").and_then(Value::as_object).into_iter().flatten() {
            let packing =
                matches!(name.as_str(), "EXT_texture_webp" | "EXT_texture_avif" | "KHR_texture_basisu");
            if !packing {
                self.extensions.insert(excerpt(name));
            } else if found.iter().all(|(extension, _)| extension.is_none())
                && let Some(image) = self.number(extension.get("source"), Part::Image)?
            {
                found.push((Some(name.as_str()), image));
            }
        }
        Ok(found)
    }

    fn sampler(&mut self, index: usize) -> Option<usize> {
        let sampler = self.document.samplers.get(index)?;
        let known = ["magFilter", "minFilter", "wrapS", "wrapT"].into_iter();
        let kept: Value = known.filter_map(|key| Some((key.to_owned(), sampler.get(key)?.clone()))).collect();
        if !is_sound::<gltf_json::texture::Sampler>(&kept) {
            self.notes.push(format!("sampler {index} was left out: glTF has no such values"));
            return None;
        }
        self.materials.samplers.push(kept);
        Some(self.materials.samplers.len() - 1)
    }

    fn image(&mut self, index: usize) -> Result<Option<usize>> {
        let picture = self.document.images.get(index);
        match picture.ok_or_else(|| unusable("there is none")).and_then(|picture| self.read(picture)) {
            Ok(image) => {
                self.bytes += image.bytes.len() as u64;
                self.materials.images.push(image);
                Ok(Some(self.materials.images.len() - 1))
            }
            Err(Missing::TooLarge) => {
                let problem = format!("the pictures have more than {} MiB", MOST_BYTES >> 20);
                let remedy = "make them smaller, or read the file without materials";
                Err(Error::input(Some(format!("image {index}")), problem, remedy))
            }
            Err(Missing::Unusable(problem)) => {
                self.notes.push(format!("image {index} was left out: {problem}"));
                Ok(None)
            }
        }
    }

    fn read(&self, picture: &Picture) -> std::result::Result<Image, Missing> {
        let most = MOST_BYTES - self.bytes;
        let bytes = match (&picture.uri, picture.buffer_view) {
            (Some(uri), _) => {
                Cow::Owned(self.buffers.picture(uri, most).map_err(missing)?.ok_or(Missing::TooLarge)?)
            }
            (None, Some(view)) => Cow::Borrowed(self.buffers.view(view).map_err(missing)?.0),
            (None, None) => return Err(unusable("it has no data")),
        };
        if bytes.is_empty() {
            return Err(unusable("it is empty"));
        }
        if bytes.len() as u64 > most {
            return Err(Missing::TooLarge);
        }
        let in_uri = picture.uri.as_deref().and_then(|uri| uri.strip_prefix("data:")?.split(';').next());
        let declared = picture.mime_type.as_deref().or(in_uri).filter(|mime| mime.starts_with("image/"));
        let Some(mime) = shown(&bytes).or(declared) else {
            return Err(unusable("it is neither PNG nor JPEG"));
        };
        Ok(Image { name: picture.name.clone(), mime: mime.to_owned(), bytes: bytes.into() })
    }

    /// Notes what was left out once for all.
    fn end(self) -> Materials {
        if self.without_uv > 0 {
            self.notes.push("textures were left out, for want of texture coordinates".to_owned());
        }
        if self.other_uv > 0 {
            let what = format!("{} textures of materials were left out", self.other_uv);
            self.notes.push(format!("{what}: their texture coordinates are not the first of the vertices"));
        }
        if !self.extensions.is_empty() {
            let names: Vec<String> = self.extensions.into_iter().collect();
            self.notes.push(format!("extensions of materials were left out: {}", names.join(", ")));
        }
        self.materials
    }
}

/// Whether the values of a part of a file have glTF's types, whatever they refer to; what extensions hold is theirs.
fn is_sound<T: DeserializeOwned + Validate>(value: &Value) -> bool {
    if !has_objects(value) {
        return false;
    }
    let Ok(part) = serde_json::from_value::<T>(value.clone()) else { return false };
    let mut sound = true;
    part.validate(&gltf_json::Root::default(), gltf_json::Path::new, &mut |_, fault| {
        sound &= fault == Fault::IndexOutOfBounds;
    });
    sound
}

/// Whether objects are where glTF has them, and nothing is null: serde takes lists, too, and null for what is not there.
fn has_objects(value: &Value) -> bool {
    let must = |key: &str| ["pbrMetallicRoughness", "extensions"].contains(&key) || key.ends_with("Texture");
    match value {
        Value::Null => false,
        Value::Array(values) => values.iter().all(has_objects),
        Value::Object(all) => {
            all.iter().all(|(key, value)| (value.is_object() || !must(key)) && has_objects(value))
        }
        _ => true,
    }
}

/// Whether a material's factors are those that glTF allows.
fn is_in_range(material: &Value) -> bool {
    let most = [
        ("/pbrMetallicRoughness/baseColorFactor", 1.0),
        ("/pbrMetallicRoughness/metallicFactor", 1.0),
        ("/pbrMetallicRoughness/roughnessFactor", 1.0),
        ("/occlusionTexture/strength", 1.0),
        ("/emissiveFactor", 1.0),
        ("/alphaCutoff", f64::INFINITY),
    ];
    most.iter().all(|(pointer, most)| {
        let value = material.pointer(pointer);
        let numbers = value.map(|value| value.as_array().map_or(std::slice::from_ref(value), Vec::as_slice));
        let fits = |number: &Value| number.as_f64().is_some_and(|number| (0.0..=*most).contains(&number));
        numbers.is_none_or(|numbers| numbers.iter().all(fits))
    })
}

/// Why there are no bytes.
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

/// What the bytes show themselves to be.
fn shown(bytes: &[u8]) -> Option<&'static str> {
    let kinds: [(&[u8], &str); 3] = [
        (b"\x89PNG\r\n\x1a\n", "image/png"),
        (b"\xff\xd8\xff", "image/jpeg"),
        (b"\xabKTX 20\xbb\r\n", "image/ktx2"),
    ];
    let webp = bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP");
    let known = kinds.into_iter().find(|(start, _)| bytes.starts_with(start)).map(|(_, mime)| mime);
    known.or(webp.then_some("image/webp"))
}
