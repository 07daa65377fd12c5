//! Reads mesh files: finds out the format, decompresses, and calls the format's reader.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use super::checks::without_padding;
use super::format::{Encoding, Format, extension_problem, format_of_content, known_extensions};
use super::loaded::Loaded;
use super::open::{Patience, read_file_bytes};
use super::references::References;
use super::volumes::Volume;
use super::{gltf, gzip, medit, obj, off, ply, points, stl, threemf, volumes, vtk};
use crate::{Error, Result};

/// Settings of reading a file.
#[derive(Debug, Clone, Default)]
pub struct ReadOptions {
    /// The format to use instead of the one that the extension indicates.
    pub format: Option<Encoding>,
    /// Whether to also read materials and their images, as [`read_with_materials`] does.
    pub with_materials: bool,
    /// Another folder, besides that of the file, from which files that it refers to may be read.
    pub files_from: Option<PathBuf>,
    /// How long to wait for a pipe.
    pub patience: Patience,
}

/// Reads a mesh file. Its content decides on the format; where that is ambiguous, the extension does (in
/// upper or lower case, with or without `.gz`).
///
/// # Errors
///
/// [`Error::Input`] with the path and, where there is one, the line, vertex, face or byte: the file is
/// missing, unreadable, a directory or a device, empty, truncated or of an unknown format; a face has fewer
/// than three vertices, one vertex twice or one that does not exist; a coordinate is not a finite number;
/// there is no vertex, no face, or more than `u32::MAX - 1` vertices; a file that it names, such as a buffer
/// of a glTF file, cannot be read or lies outside its folder. [`Error::OutOfMemory`].
pub fn read(path: &Path) -> Result<Loaded> {
    read_as(path, None)
}

/// As [`read()`], with the format `declared` instead of the one that the extension indicates.
///
/// # Errors
///
/// See [`read()`].
pub fn read_as(path: &Path, declared: Option<Encoding>) -> Result<Loaded> {
    read_any(path, declared, false).and_then(|input| mesh(input).map_err(|e| e.in_file(path)))
}

/// As [`read_as`], with the materials of a glTF file, or those of an OBJ file's libraries, and their images
/// in `attributes.materials`. What cannot be read of them, such as an image that is missing or lies outside
/// the file's folder, is noted.
///
/// # Errors
///
/// See [`read()`]; also images of more than 256 MiB together.
pub fn read_with_materials(path: &Path, declared: Option<Encoding>) -> Result<Loaded> {
    read_any(path, declared, true).and_then(|input| mesh(input).map_err(|e| e.in_file(path)))
}

/// The contents of a file.
#[derive(Debug, Clone, PartialEq)]
pub enum Input {
    /// A mesh, or points without triangles, for [`crate::cloud::PointCloud`].
    Mesh(Loaded),
    /// Values on a grid, for [`crate::volume`].
    Volume(Volume),
}

impl Input {
    /// What was left out or changed, one sentence each.
    pub fn notes(&self) -> &[String] {
        match self {
            Self::Mesh(loaded) => &loaded.notes,
            Self::Volume(volume) => &volume.notes,
        }
    }

    /// A mesh, or points without faces.
    ///
    /// # Errors
    /// [`Error::Input`] for a volume.
    pub fn mesh_or_points(self) -> Result<Loaded> {
        match self {
            Self::Mesh(loaded) => Ok(loaded),
            Self::Volume(_) => {
                let remedy = "give a surface mesh, or make a mesh of the volume with `volume::iso_surface`";
                Err(Error::input(None, "the file has values on a grid, not a mesh", remedy))
            }
        }
    }
}

/// Reads a mesh, points or a volume, with or without materials.
///
/// # Errors
///
/// See there; for volumes, also other than three axes with one number a node.
pub fn read_any(path: &Path, declared: Option<Encoding>, with_materials: bool) -> Result<Input> {
    read_any_with(path, &ReadOptions { format: declared, with_materials, ..ReadOptions::default() })
}

/// As [`read_any`], with all options.
///
/// # Errors
///
/// See there; also [`Error::Cancelled`] by the token in `options`.
pub fn read_any_with(path: &Path, options: &ReadOptions) -> Result<Input> {
    let decoded = read_file_bytes(path, &options.patience).and_then(|bytes| {
        let named = options.format.or_else(|| Encoding::of_name(path));
        let folder = path.parent().unwrap_or(Path::new(""));
        let references = References::new(folder, options.files_from.as_deref());
        decode(&bytes, named, Some(path), &references, options.with_materials)
    });
    decoded.map_err(|error| error.in_file(path))
}

/// Reads a mesh from the bytes of a file, such as standard input; `declared` replaces the extension.
///
/// # Errors
///
/// See [`read()`], without a path; buffers in separate files of a glTF file are refused.
pub fn read_bytes(bytes: &[u8], declared: Option<Encoding>) -> Result<Loaded> {
    decode(bytes, declared, None, &References::default(), false).and_then(mesh)
}

/// As [`read_bytes`], with materials as in [`read_with_materials`].
///
/// # Errors
///
/// See [`read_bytes`] and [`read_with_materials`].
pub fn read_bytes_with_materials(bytes: &[u8], declared: Option<Encoding>) -> Result<Loaded> {
    decode(bytes, declared, None, &References::default(), true).and_then(mesh)
}

/// As [`read_any`], from bytes.
///
/// # Errors
///
/// See [`read_any`] and [`read_bytes`].
pub fn read_any_bytes(bytes: &[u8], declared: Option<Encoding>, with_materials: bool) -> Result<Input> {
    decode(bytes, declared, None, &References::default(), with_materials)
}

/// A mesh with faces.
fn mesh(input: Input) -> Result<Loaded> {
    input.mesh_or_points().and_then(Loaded::with_faces)
}

/// `file` is the path, if the bytes come from a file, whose other files `references` reads.
fn decode(
    bytes: &[u8],
    declared: Option<Encoding>,
    file: Option<&Path>,
    references: &References,
    with_materials: bool,
) -> Result<Input> {
    let mut notes = Vec::new();
    let bytes =
        if gzip::is_compressed(bytes) { Cow::Owned(gzip::decompress(bytes)?) } else { Cow::Borrowed(bytes) };
    if bytes.is_empty() {
        return Err(Error::input(None, "the file is empty", "export the mesh again"));
    }
    let declared_format = declared.map(|declared| declared.format);
    let format = match (format_of_content(&bytes), declared_format, file) {
        (Some(content), Some(other), _) if content != other => {
            notes.push(format!(
                "the content is {}, not {}, and was read as such",
                content.name(),
                other.name()
            ));
            content
        }
        (Some(content), None, Some(path)) => {
            notes.push(format!("{}; read as {}", extension_problem(path), content.name()));
            content
        }
        (Some(content), ..) => content,
        (None, Some(declared), _) => declared,
        (None, None, Some(path)) => {
            let remedy = format!("use a format for {}, or declare the input format", known_extensions("."));
            return Err(Error::input(None, extension_problem(path), remedy));
        }
        (None, None, None) => {
            let remedy = format!("set its `format`: one for {}", known_extensions(""));
            return Err(Error::input(None, "the content does not determine the format", remedy));
        }
    };
    let bytes = if format.is_always_text() { without_padding(&bytes) } else { &bytes };
    let input = parsed(format, bytes, references, with_materials)?;
    notes.extend(references.note());
    Ok(match input {
        Input::Mesh(mut loaded) => {
            notes.append(&mut loaded.notes);
            Input::Mesh(Loaded { notes, ..loaded })
        }
        Input::Volume(mut volume) => {
            notes.append(&mut volume.notes);
            Input::Volume(Volume { notes, ..volume })
        }
    })
}

fn parsed(format: Format, bytes: &[u8], references: &References, with_materials: bool) -> Result<Input> {
    match format {
        Format::Obj => obj::parse(bytes, references, with_materials).map(Input::Mesh),
        Format::Ply => ply::parse(bytes).map(Input::Mesh),
        Format::Stl => stl::parse(bytes).map(Input::Mesh),
        Format::Off => off::parse(bytes).map(Input::Mesh),
        Format::Gltf | Format::Glb => gltf::parse(bytes, references, with_materials).map(Input::Mesh),
        Format::Medit => medit::parse(bytes).map(Input::Mesh),
        Format::Xyz => points::xyz::parse(bytes).map(Input::Mesh),
        Format::Pcd => points::pcd::parse(bytes).map(Input::Mesh),
        Format::Las => points::las::parse(bytes).map(Input::Mesh),
        Format::E57 => points::e57::parse(bytes).map(Input::Mesh),
        Format::Npy => volumes::npy::parse(bytes).map(Input::Volume),
        Format::Nrrd => volumes::nrrd::parse(bytes, references).map(Input::Volume),
        Format::Nifti => volumes::nifti::parse(bytes).map(Input::Volume),
        Format::MetaImage => volumes::metaimage::parse(bytes, references).map(Input::Volume),
        Format::Vtp | Format::Vtu | Format::Vti => vtk::parse_xml(bytes),
        Format::Vtk => vtk::parse_legacy(bytes),
        Format::ThreeMf => threemf::parse(bytes, with_materials).map(Input::Mesh),
    }
}
