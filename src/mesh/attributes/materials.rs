//! glTF materials: factors, and pictures laid onto the surface by its texture coordinates.

use std::sync::Arc;

use serde_json::{Value, json};

/// Of a sampler: beyond the picture, its border goes on.
pub(crate) const CLAMP: u32 = 33071;

/// The materials that the face label `material` numbers, as glTF has them. [`crate::io::Reader::materials`]
/// reads them, also from the libraries of OBJ files; of the formats written, GLB alone holds them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Materials {
    /// One object for each material, without its name; null for those that no triangle has. Textures in them
    /// count in `textures`.
    pub(crate) materials: Vec<Value>,
    /// Objects that refer to `samplers` and `images`.
    pub(crate) textures: Vec<Value>,
    pub(crate) samplers: Vec<Value>,
    pub(crate) images: Vec<Image>,
}

/// A picture, packed as it was in its file.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Its name, if it has one.
    pub name: Option<String>,
    /// What its bytes are, such as `image/png`.
    pub mime: String,
    /// The bytes of a file of that kind.
    pub bytes: Arc<[u8]>,
}

impl Materials {
    /// The pictures, each once.
    pub fn images(&self) -> &[Image] {
        &self.images
    }

    /// The materials, textures and samplers as a JSON object with these three keys, as glTF has them.
    pub fn to_json(&self) -> String {
        let Self { materials, textures, samplers, .. } = self;
        json!({ "materials": materials, "textures": textures, "samplers": samplers }).to_string()
    }

    /// How many materials some triangle has.
    pub fn used_count(&self) -> usize {
        self.materials.iter().filter(|material| **material != Value::Null).count()
    }
}
