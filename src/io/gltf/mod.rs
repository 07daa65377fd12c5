//! glTF 2.0: `.gltf` and `.glb` read, `.glb` written.
//!
//! Reader and writer are our own, over `serde_json`: the `gltf` crate, 1.4, has node transforms in 32 bits alone, which
//! throws away what a mesh far from the origin keeps in them; it refuses files without the bounds of positions, and all
//! that require an extension, be it for materials; and it does not know quantized positions.

mod accessors;
mod attributes;
mod container;
mod materials;
mod model;
mod scene;
mod write;
mod write_materials;

pub(crate) use write::{byte_length, write};

use std::path::Path;

use super::Loaded;
use crate::{Error, Result};
use accessors::Buffers;
use model::Model;

/// Reads the default scene of a `.gltf` or `.glb` file, with its materials if `with_materials`. `folder` is where
/// buffers and pictures beside it are, if there can be any.
pub(crate) fn parse(bytes: &[u8], folder: Option<&Path>, with_materials: bool) -> Result<Loaded> {
    let parts = container::parts(bytes)?;
    let model: Model = serde_json::from_slice(parts.json).map_err(|error| {
        let place = format!("line {}, column {} of the JSON", error.line(), error.column());
        // The place stands at the end of the message, too.
        let text = error.to_string();
        let text = text.split(" at line ").next().unwrap_or_default();
        let problem = format!("this is no glTF ({})", super::excerpt(text));
        Error::input(Some(place), problem, "get the whole file or write the mesh again").caused_by(error)
    })?;
    model.check()?;
    let buffers = Buffers::new(&model, parts.binary, folder);
    let mut loaded = scene::triangles(&model, &buffers, bytes.len() as u64)?;
    if with_materials {
        materials::add(parts.json, &buffers, &mut loaded)?;
    }
    Ok(loaded)
}
