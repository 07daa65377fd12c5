//! Material libraries of OBJ files: colours and pictures as the materials of glTF, and where libraries are.

use std::collections::{HashMap, HashSet};
use std::path::{Component, Path, PathBuf};

use serde_json::{Value, json};

use super::logical_lines::logical_lines;
use crate::grammar::counted;
use crate::io::checks::excerpt;
use crate::io::image_type::image_type;
use crate::io::loaded::Loaded;
use crate::io::references::References;
use crate::mesh::attributes::{CLAMP, Image, Materials};
use crate::{Error, Result};

/// Maximum number of bytes of all pictures together.
const MAX_IMAGE_BYTES: u64 = 256 << 20;
/// Maximum number of bytes of a library.
const MAX_LIBRARY_BYTES: u64 = 16 << 20;
/// Maximum number of libraries that are read.
const MOST_LIBRARIES: usize = 64;
/// Maximum number of pictures that are read.
const MOST_IMAGES: usize = 4096;

/// A material as its library describes it.
#[derive(Debug, Clone)]
struct Material {
    colour: [f64; 3],
    opacity: f64,
    emission: [f64; 3],
    metallic: f64,
    roughness: f64,
    picture: Option<Picture>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Picture {
    /// Its name in the library.
    name: String,
    /// The folder of the library, relative to that of the mesh.
    folder: String,
    is_clamped: bool,
}

impl Default for Material {
    fn default() -> Self {
        let (colour, emission) = ([0.8; 3], [0.0; 3]);
        Self { colour, opacity: 1.0, emission, metallic: 0.0, roughness: 1.0, picture: None }
    }
}

/// The libraries that a line names: several, if it has names that end in `.mtl` before its end.
pub(crate) fn library_names(line: &str) -> Vec<&str> {
    let (mut names, mut rest) = (Vec::new(), line.trim());
    let lower = |text: &str| text.to_ascii_lowercase();
    while let Some(at) = lower(rest).find(".mtl ") {
        names.push(rest[..at + 4].trim());
        rest = rest[at + 4..].trim();
    }
    names.push(rest);
    names.retain(|name| !name.is_empty());
    names
}

/// The libraries as a file in the folder `to` names them, where a file in the folder `from` has these lines:
/// by paths relative to it.
pub(crate) fn relative_names(lines: &[String], from: &Path, to: &Path) -> Vec<String> {
    let one = |folder: &Path| {
        std::fs::canonicalize(if folder.as_os_str().is_empty() { Path::new(".") } else { folder }).ok()
    };
    let (Some(from), Some(to)) = (one(from), one(to)) else { return lines.to_vec() };
    if from == to {
        return lines.to_vec();
    }
    let relative = |name: &str| {
        let path = Path::new(name);
        let is_relative = path.components().all(|c| !matches!(c, Component::RootDir | Component::Prefix(_)));
        let path = if is_relative { without_dots(&from.join(path)) } else { return name.to_owned() };
        let shared = path.components().zip(to.components()).take_while(|(a, b)| a == b).count();
        // Another drive.
        if shared == 0 {
            return path.to_string_lossy().into_owned();
        }
        let up = to.components().skip(shared).map(|_| "..".into());
        let down = path.components().skip(shared).map(|part| part.as_os_str().to_string_lossy());
        up.chain(down).collect::<Vec<_>>().join("/")
    };
    lines.iter().flat_map(|line| library_names(line)).map(relative).collect()
}

/// The path without `.` and `..`.
fn without_dots(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => drop(plain.pop()),
            other => plain.push(other),
        }
    }
    plain
}

/// Adds the materials that triangles use. What cannot be read is noted; too many bytes are an error.
pub(crate) fn add_materials(references: &References, loaded: &mut Loaded) -> Result<()> {
    let Some(label) = loaded.attributes.face_named("material") else { return Ok(()) };
    let names = label.names.clone();
    let mut known = HashMap::new();
    let mut libraries: Vec<&str> = Vec::new();
    let mut named = HashSet::new();
    let all = loaded.attributes.libraries.iter().flat_map(|line| library_names(line));
    // Some programs name a library before each part.
    libraries.extend(all.filter(|name| named.insert(*name)));
    for name in libraries.iter().take(MOST_LIBRARIES) {
        let mut name = (*name).to_owned();
        let mut read = references.read(&name, MAX_LIBRARY_BYTES);
        if read.is_err() && name.contains('\\') {
            // A path as Windows has it.
            name = name.replace('\\', "/");
            read = references.read(&name, MAX_LIBRARY_BYTES);
        }
        match read {
            Ok(Some(bytes)) => read_library(&String::from_utf8_lossy(&bytes), folder_of(&name), &mut known),
            Ok(None) => loaded.notes.push(format!("the material library '{}' is too large", excerpt(&name))),
            Err(Error::Input { problem, .. }) => {
                loaded.notes.push(format!("a material library was left out: {problem}"));
            }
            Err(other) => return Err(other),
        }
    }
    if libraries.is_empty() {
        return Ok(());
    }
    let missing = names.iter().filter(|name| !name.is_empty() && !known.contains_key(*name)).count();
    if missing > 0 && !known.is_empty() {
        let materials = counted(missing, ["material is", "materials are"]);
        loaded.notes.push(format!("{materials} not in the material library"));
    }
    let mut maker = Maker {
        references,
        has_uv: loaded.attributes.uv.is_some(),
        materials: Materials::default(),
        textures: HashMap::new(),
        image_bytes: 0,
        without_uv: 0,
        notes: &mut loaded.notes,
    };
    for name in &names {
        let made = known.get(name).map_or(Ok(Value::Null), |material| maker.material(material))?;
        maker.materials.materials.push(made);
    }
    if maker.without_uv > 0 {
        maker.notes.push("textures were left out: the mesh has no texture coordinates".to_owned());
    }
    if maker.materials.used_count() > 0 {
        loaded.attributes.materials = Some(maker.materials);
    }
    Ok(())
}

/// The folder in a name, with its slash.
fn folder_of(name: &str) -> &str {
    name.rfind('/').map_or("", |slash| &name[..=slash])
}

/// Reads the materials of a library; of two with one name, the first counts.
fn read_library(text: &str, folder: &str, known: &mut HashMap<String, Material>) {
    let mut open: Option<(String, Material)> = None;
    for (_, line) in logical_lines(text) {
        let mut words = line.split_whitespace();
        let Some(keyword) = words.next() else { continue };
        let keyword = keyword.to_ascii_lowercase();
        if keyword == "newmtl" {
            if let Some((name, material)) = open.take() {
                known.entry(name).or_insert(material);
            }
            open = Some((words.collect::<Vec<_>>().join(" "), Material::default()));
            continue;
        }
        let Some((_, material)) = &mut open else { continue };
        let words: Vec<&str> = words.collect();
        let share = |k: usize| {
            let value = words.get(k).and_then(|word| word.parse::<f64>().ok());
            value.filter(|value| value.is_finite()).map(|value| value.clamp(0.0, 1.0))
        };
        // One number stands for three.
        let colour = || Some([share(0)?, share(1).or(share(0))?, share(2).or(share(0))?]);
        match keyword.as_str() {
            "kd" => material.colour = colour().unwrap_or(material.colour),
            "ke" => material.emission = colour().unwrap_or(material.emission),
            "d" => material.opacity = share(0).unwrap_or(1.0),
            // 1 would be invisible, but some programs write it for opaque.
            "tr" => material.opacity = share(0).filter(|share| *share < 1.0).map_or(1.0, |share| 1.0 - share),
            "pm" => material.metallic = share(0).unwrap_or(0.0),
            "pr" => material.roughness = share(0).unwrap_or(1.0),
            "map_kd" => material.picture = picture(&words, folder),
            _ => {}
        }
    }
    if let Some((name, material)) = open {
        known.entry(name).or_insert(material);
    }
}

/// The picture that a `map_` line names behind its options.
fn picture(words: &[&str], folder: &str) -> Option<Picture> {
    let mut is_clamped = false;
    let mut at = 0;
    while let Some(option) = words.get(at).filter(|word| word.starts_with('-') && word.len() > 1) {
        let is_number = |word: &&&str| word.parse::<f64>().is_ok();
        let arguments = match *option {
            "-o" | "-s" | "-t" => words.iter().skip(at + 1).take(3).take_while(is_number).count(),
            "-mm" => 2,
            _ => 1,
        };
        is_clamped |= *option == "-clamp" && words.get(at + 1) == Some(&"on");
        at += 1 + arguments;
    }
    let name = words.get(at..).unwrap_or_default().join(" ").trim_matches('"').replace('\\', "/");
    (!name.is_empty()).then(|| Picture { name, folder: folder.to_owned(), is_clamped })
}

/// Makes materials of glTF.
struct Maker<'a> {
    references: &'a References<'a>,
    has_uv: bool,
    materials: Materials,
    /// The texture of each picture; `None` for what was left out.
    textures: HashMap<Picture, Option<usize>>,
    image_bytes: u64,
    without_uv: usize,
    notes: &'a mut Vec<String>,
}

impl Maker<'_> {
    fn material(&mut self, material: &Material) -> Result<Value> {
        let texture = match &material.picture {
            Some(picture) => self.texture(picture)?,
            None => None,
        };
        // Programs write any colour where a picture takes its place.
        let [r, g, b] = if texture.is_some() { [1.0; 3] } else { material.colour };
        let mut made = json!({
            "pbrMetallicRoughness": {
                "baseColorFactor": [r, g, b, material.opacity],
                "metallicFactor": material.metallic,
                "roughnessFactor": material.roughness,
            },
        });
        if let Some(texture) = texture {
            made["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": texture });
        }
        if material.emission != [0.0; 3] {
            made["emissiveFactor"] = json!(material.emission);
        }
        if material.opacity < 1.0 {
            made["alphaMode"] = json!("BLEND");
        }
        Ok(made)
    }

    fn texture(&mut self, picture: &Picture) -> Result<Option<usize>> {
        if !self.has_uv {
            self.without_uv += 1;
            return Ok(None);
        }
        if let Some(known) = self.textures.get(picture) {
            return Ok(*known);
        }
        let made = self.image(picture)?.map(|image| {
            let mut texture = json!({ "source": image });
            if picture.is_clamped {
                if self.materials.samplers.is_empty() {
                    self.materials.samplers.push(json!({ "wrapS": CLAMP, "wrapT": CLAMP }));
                }
                texture["sampler"] = json!(0);
            }
            self.materials.textures.push(texture);
            self.materials.textures.len() - 1
        });
        self.textures.insert(picture.clone(), made);
        Ok(made)
    }

    /// The number of the picture's image; what cannot be read is noted.
    fn image(&mut self, picture: &Picture) -> Result<Option<usize>> {
        let left = MAX_IMAGE_BYTES - self.image_bytes;
        let own_name = picture.name.rsplit('/').next().unwrap_or(&picture.name);
        if self.materials.images.len() >= MOST_IMAGES {
            return self.leave_out(own_name, "there are too many");
        }
        // Absolute paths are those of another machine: the file next to the library is meant.
        let named = self.references.read(&format!("{}{}", picture.folder, picture.name), left);
        let read = match named {
            Err(Error::Input { .. }) if own_name != picture.name => {
                let beside = self.references.read(&format!("{}{own_name}", picture.folder), left);
                if let Ok(Some(_)) = beside {
                    let names = [own_name, picture.name.as_str()].map(excerpt);
                    self.notes
                        .push(format!("the picture '{}' was read in place of '{}'", names[0], names[1]));
                }
                beside.or(named)
            }
            other => other,
        };
        let bytes = match read {
            Ok(Some(bytes)) => bytes,
            Ok(None) => {
                let problem = format!("the pictures have more than {} MiB", MAX_IMAGE_BYTES >> 20);
                let remedy = "make them smaller, or read the file without materials";
                return Err(Error::input(Some(excerpt(own_name)), problem, remedy));
            }
            Err(Error::Input { problem, .. }) => return self.leave_out(own_name, &problem),
            Err(other) => return Err(other),
        };
        // What a name claims is no matter: any other file could be given away as a picture.
        let Some(mime) = image_type(&bytes).filter(|mime| matches!(*mime, "image/png" | "image/jpeg")) else {
            return self.leave_out(own_name, "it is neither PNG nor JPEG; convert it");
        };
        self.image_bytes += bytes.len() as u64;
        let name = own_name.rsplit_once('.').map_or(own_name, |(stem, _)| stem);
        let bytes = bytes.to_vec().into();
        self.materials.images.push(Image { name: Some(name.to_owned()), mime: mime.to_owned(), bytes });
        Ok(Some(self.materials.images.len() - 1))
    }

    /// Notes a picture that is missing.
    fn leave_out(&mut self, name: &str, problem: &str) -> Result<Option<usize>> {
        self.notes.push(format!("the picture '{}' was left out: {problem}", excerpt(name)));
        Ok(None)
    }
}
