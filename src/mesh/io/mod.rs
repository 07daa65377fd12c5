//! Mesh files: OBJ and PLY in and out, each chosen by the file name's extension.

mod lines;
mod obj;
mod ply;
mod ply_data;
mod ply_header;
mod write;

use std::io::ErrorKind;
use std::path::Path;

use super::TriMesh;
use crate::{Error, Result};

pub use lines::{FeatureLine, read_lines, write_skeleton};
pub use write::{check_target, check_text_target, write, write_text};

/// A mesh as its file has it, triangulated but not cleaned.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    /// Vertices in the file's order (an OBJ's: in the order in which faces first use them), polygons split into
    /// triangles, every index in range and every coordinate finite.
    pub mesh: TriMesh,
    /// What of the file was left out or changed, one sentence each.
    pub notes: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Format {
    Obj,
    Ply,
}

impl Format {
    fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            _ => None,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
        }
    }
}

/// Reads an `.obj` or `.ply` file (any case of the extension).
///
/// # Errors
///
/// [`Error::Input`] with the path and, where there is one, the line, vertex, face or byte: the file is missing,
/// unreadable, a directory, empty, truncated or of another format; a face has fewer than three vertices, one
/// vertex twice or one that does not exist; a coordinate is not a finite number; there is no vertex, no face, or
/// more than `u32::MAX - 1` vertices.
pub fn read(path: &Path) -> Result<Loaded> {
    read_unnamed(path).map_err(|error| error.in_file(path))
}

fn read_unnamed(path: &Path) -> Result<Loaded> {
    // A missing file is reported before a wrong extension: a mistyped name is the likelier cause.
    let bytes = bytes_of(path)?;
    let Some(format) = Format::of(path) else {
        return Err(Error::input(None, extension_problem(path), "give an .obj or .ply file"));
    };
    if bytes.is_empty() {
        return Err(Error::input(None, "the file is empty", "write the mesh again"));
    }
    if let Some(content) = plain_format(&bytes).filter(|content| *content != format) {
        let name = content.name();
        let remedy = format!("rename it to .{}", name.to_lowercase());
        return Err(Error::input(None, format!("this is a{} {name} file", article(content)), remedy));
    }
    let loaded = match format {
        Format::Obj => obj::parse(&bytes)?,
        Format::Ply => ply::parse(&bytes)?,
    };
    Ok(loaded)
}

fn article(format: Format) -> &'static str {
    if format == Format::Obj { "n" } else { "" }
}

fn bytes_of(path: &Path) -> Result<Vec<u8>> {
    let unreadable = |error: std::io::Error| match error.kind() {
        ErrorKind::NotFound => Error::input(None, "there is no such file", "check the name and the folder"),
        ErrorKind::PermissionDenied => {
            Error::input(None, "the file may not be read", "check the permissions of the file and its folder")
        }
        _ => Error::input(None, format!("the file cannot be read ({error})"), "check the path and the disk"),
    };
    if std::fs::metadata(path).map_err(unreadable)?.is_dir() {
        return Err(Error::input(None, "this is a directory", "give a mesh file"));
    }
    std::fs::read(path).map_err(unreadable)
}

fn extension_problem(path: &Path) -> String {
    match path.extension() {
        Some(extension) => format!("unknown file type '.{}'", extension.to_string_lossy()),
        None => "the file name has no extension".to_owned(),
    }
}

/// The format that the content shows beyond doubt; `None` where it could be anything.
fn plain_format(bytes: &[u8]) -> Option<Format> {
    if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") {
        return Some(Format::Ply);
    }
    // Comments and names may come first; a line with three numbers after "v" is an OBJ's own.
    let start = String::from_utf8_lossy(bytes.get(..4096).unwrap_or(bytes));
    let vertex_line = |line: &str| {
        let mut words = line.split_whitespace();
        words.next() == Some("v") && words.take(3).filter(|word| word.parse::<f64>().is_ok()).count() == 3
    };
    start.lines().any(vertex_line).then_some(Format::Obj)
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
    let mut short: String = text.chars().take(LONGEST).flat_map(char::escape_debug).collect();
    if text.chars().nth(LONGEST).is_some() {
        short.push_str("...");
    }
    short
}
