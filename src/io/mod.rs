//! Mesh files in and out: OBJ, PLY, STL, OFF, glTF and MEDIT, plain or packed by gzip.

mod format;
mod gltf;
mod gzip;
mod medit;
mod obj;
mod off;
mod ply;
mod stl;
mod text;
mod write;

use std::borrow::Cow;
use std::io::ErrorKind;
use std::path::Path;

use crate::mesh::TriMesh;
use crate::mesh::attributes::Attributes;
use crate::{Error, Result};

pub use format::{Encoding, Format};
pub use obj::lines::{FeatureLine, read_lines, write_skeleton};
pub use write::{
    check_target, check_text_target, encode, target_encoding, write, write_as, write_bytes, write_text,
};
pub use write::{encode_with, left_out, precision_note, write_with};

/// A mesh as its file has it, triangulated but not cleaned.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    /// Vertices in the file's order (an OBJ's and an STL's: in the order in which faces first use them), polygons split
    /// into triangles, every index in range and every coordinate finite.
    pub mesh: TriMesh,
    /// Colours, texture coordinates, labels and the like.
    pub attributes: Attributes,
    /// What of the file was left out or changed, one sentence each.
    pub notes: Vec<String>,
}

/// Reads a mesh file. What its content shows decides; where that could be anything, the extension does (in any case,
/// with or without `.gz`).
///
/// # Errors
///
/// [`Error::Input`] with the path and, where there is one, the line, vertex, face or byte: the file is missing,
/// unreadable, a directory, empty, truncated or of no known format; a face has fewer than three vertices, one
/// vertex twice or one that does not exist; a coordinate is not a finite number; there is no vertex, no face, or
/// more than `u32::MAX - 1` vertices; a buffer beside a glTF file cannot be read.
pub fn read(path: &Path) -> Result<Loaded> {
    read_as(path, None)
}

/// As [`read()`], where `declared` stands for what the extension says.
///
/// # Errors
///
/// See [`read()`].
pub fn read_as(path: &Path, declared: Option<Encoding>) -> Result<Loaded> {
    read_file(path, declared, false)
}

/// As [`read_as`], with the materials of a glTF file in `attributes.materials`. What cannot be read of them, such as a
/// picture that is missing or lies outside of the file's folder, is noted.
///
/// # Errors
///
/// See [`read()`]; also pictures of more than 256 MiB together.
pub fn read_with_materials(path: &Path, declared: Option<Encoding>) -> Result<Loaded> {
    read_file(path, declared, true)
}

fn read_file(path: &Path, declared: Option<Encoding>, with_materials: bool) -> Result<Loaded> {
    let decoded = bytes_of(path).and_then(|bytes| {
        let named = declared.or_else(|| Encoding::of_name(path));
        // A name alone is no folder, and that of this file is where the program runs.
        let folder = path.parent().unwrap_or(Path::new(""));
        decode(&bytes, named, Some((path, folder)), with_materials)
    });
    decoded.map_err(|error| error.in_file(path))
}

/// Reads a mesh from the bytes of a file, such as standard input; `declared` stands for what an extension would say.
///
/// # Errors
///
/// See [`read()`]; without a path, and buffers beside a glTF file are refused.
pub fn read_bytes(bytes: &[u8], declared: Option<Encoding>) -> Result<Loaded> {
    decode(bytes, declared, None, false)
}

/// As [`read_bytes`], with the file's materials as in [`read_with_materials`].
///
/// # Errors
///
/// See [`read_bytes`] and [`read_with_materials`].
pub fn read_bytes_with_materials(bytes: &[u8], declared: Option<Encoding>) -> Result<Loaded> {
    decode(bytes, declared, None, true)
}

/// `file` is the path and its folder, where there is one.
fn decode(
    bytes: &[u8],
    declared: Option<Encoding>,
    file: Option<(&Path, &Path)>,
    with_materials: bool,
) -> Result<Loaded> {
    let mut notes = Vec::new();
    let bytes = if gzip::is_packed(bytes) { Cow::Owned(gzip::unpack(bytes)?) } else { Cow::Borrowed(bytes) };
    if bytes.is_empty() {
        return Err(Error::input(None, "the file is empty", "write the mesh again"));
    }
    let plain = declared.map(|declared| declared.format);
    let format = match (format::plain_format(&bytes), plain, file) {
        (Some(content), Some(other), _) if content != other => {
            notes.push(format!("this is {} and not {}; read as such", content.name(), other.name()));
            content
        }
        (Some(content), None, Some((path, _))) => {
            notes.push(format!("{}; read as {}", format::extension_problem(path), content.name()));
            content
        }
        (Some(content), ..) => content,
        (None, Some(declared), _) => declared,
        (None, None, Some((path, _))) => {
            let remedy = format!("give {} or .gltf file, or say what it is", format::written_extensions());
            return Err(Error::input(None, format::extension_problem(path), remedy));
        }
        (None, None, None) => {
            let remedy = "name its `format`";
            return Err(Error::input(None, "the content does not tell what kind of file this is", remedy));
        }
    };
    let mut loaded = match format {
        Format::Obj => obj::parse(&bytes),
        Format::Ply => ply::parse(&bytes),
        Format::Stl => stl::parse(&bytes),
        Format::Off => off::parse(&bytes),
        Format::Gltf | Format::Glb => gltf::parse(&bytes, file.map(|(_, folder)| folder), with_materials),
        Format::Medit => medit::parse(&bytes),
    }?;
    notes.extend(std::mem::take(&mut loaded.notes));
    Ok(Loaded { notes, ..loaded })
}

/// Whether so many bytes are more than an honest file of `from` bytes stands for; a few bytes that are packed or
/// refer to each other can claim any number.
fn unfolds_too_far(made: u64, from: u64) -> bool {
    made > from.saturating_mul(256).saturating_add(64 << 20)
}

fn bytes_of(path: &Path) -> Result<Vec<u8>> {
    let unreadable = |error: std::io::Error| {
        let (problem, remedy) = match error.kind() {
            ErrorKind::NotFound => ("there is no such file".to_owned(), "check the name and the folder"),
            ErrorKind::PermissionDenied => {
                ("the file may not be read".to_owned(), "check the permissions of the file and its folder")
            }
            _ => (format!("the file cannot be read ({error})"), "check the path and the disk"),
        };
        Error::input(None, problem, remedy).caused_by(error)
    };
    if std::fs::metadata(path).map_err(unreadable)?.is_dir() {
        return Err(Error::input(None, "this is a directory", "give a mesh file"));
    }
    std::fs::read(path).map_err(unreadable)
}

/// Refuses what no mesh can be made of. `faces` counts the file's faces, before triangulation.
fn check_counts(vertices: u64, faces: u64) -> Result<()> {
    if vertices == 0 {
        return Err(Error::input(None, "the file has no vertices", "give a mesh with vertices and faces"));
    }
    // u32::MAX itself stays free as a "no vertex" mark.
    if vertices >= u64::from(u32::MAX) {
        let problem = format!("the file has {vertices} vertices, more than the {} possible", u32::MAX - 1);
        return Err(Error::input(None, problem, "split or simplify the mesh first"));
    }
    if faces == 0 {
        let remedy = "give a surface mesh; point clouds need a surface reconstruction first";
        return Err(Error::input(None, "the file has no faces", remedy));
    }
    Ok(())
}

/// One value that occurs more than once in `values`; `sorted` is scratch space.
fn repeated<T: Copy + Ord>(values: &[T], sorted: &mut Vec<T>) -> Option<T> {
    sorted.clear();
    sorted.extend_from_slice(values);
    sorted.sort_unstable();
    sorted.windows(2).find_map(|pair| match pair {
        [a, b] if a == b => Some(*a),
        _ => None,
    })
}

/// `text` cut to a length that fits into an error line, control characters shown as escapes.
fn excerpt(text: &str) -> String {
    const LONGEST: usize = 40;
    let mut short = String::new();
    for escaped in text.chars().map(char::escape_debug) {
        if short.chars().count() + escaped.len() > LONGEST {
            short.push_str("...");
            break;
        }
        short.extend(escaped);
    }
    short
}
