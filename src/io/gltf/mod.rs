//! glTF 2.0: `.gltf` and `.glb` read, `.glb` written.
//!
//! Both use `serde_json` directly, because the `gltf` crate, 1.4, has node transforms in f32 only, which
//! loses precision for a mesh far from the origin; it refuses files without the bounds of positions, and all
//! that require an extension, even one for materials; and it does not know quantized positions.

mod accessors;
mod animations;
mod attributes;
mod container;
mod materials;
mod model;
mod scene;
mod skins;
mod tangents;
mod write;
mod write_materials;
mod write_skin;

pub(crate) use write::{byte_length, rounded_positions, write};

use super::checks::{excerpt, outgrows};
use super::loaded::Loaded;
use super::references::References;
use crate::{Error, Result};
use accessors::Buffers;
use model::Model;

/// Reads the default scene of a `.gltf` or `.glb` file, with the materials if asked for. `references` reads
/// buffers and images in separate files.
pub(crate) fn parse(bytes: &[u8], references: &References, with_materials: bool) -> Result<Loaded> {
    let parts = container::split_container(bytes)?;
    check_objects(parts.json)?;
    let model: Model = serde_json::from_slice(parts.json).map_err(|error| {
        let place = format!("line {}, column {} of the JSON", error.line(), error.column());
        // The message repeats the place at its end.
        let text = error.to_string();
        let text = text.split(" at line ").next().unwrap_or_default();
        let problem = format!("this is not glTF ({})", excerpt(text));
        Error::input(Some(place), problem, "get the complete file, or export the mesh again").caused_by(error)
    })?;
    model.check()?;
    let buffers = Buffers::new(&model, parts.binary, references, bytes.len() as u64);
    let mut loaded = scene::merge_scene(&model, &buffers, parts.json)?;
    if with_materials {
        materials::add_materials(parts.json, &buffers, &mut loaded)?;
    } else if loaded.attributes.uv.is_some() {
        loaded.unread_images = model.image_count();
    }
    Ok(loaded)
}

/// Refuses JSON of little but brackets: two characters are an object, of up to 100 bytes in memory.
fn check_objects(json: &[u8]) -> Result<()> {
    let count = |bracket: u8| json.iter().filter(|byte| **byte == bracket).count() as u64;
    if outgrows(100 * count(b'{') + 32 * count(b'['), json.len() as u64) {
        let problem = "the JSON has too many empty objects and lists";
        return Err(Error::input(None, problem, "export the mesh again without them"));
    }
    Ok(())
}
