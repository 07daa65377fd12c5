//! Reads mesh files: finds out the format, decompresses, and calls the format's reader.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use super::checks::without_padding;
use super::format::{Encoding, Format, extension_problem, format_of_content, known_extensions};
use super::loaded::Loaded;
use super::open::{Patience, read_file_bytes};
use super::references::References;
use super::volumes::Volume;
use super::{gltf, gzip, medit, not_finite, obj, off, ply, points, stl, threemf, volumes, vtk};
use crate::{Error, Result};

/// Reads a mesh file as [`Reader::read`] does by default.
///
/// # Errors
///
/// See there.
pub fn read(path: impl AsRef<Path>) -> Result<Loaded> {
    Reader::new().read(path)
}

/// Reads files, with settings.
///
/// ```no_run
/// use rtfmesh::io::Reader;
///
/// let textured = Reader::new().materials(true).read("car.glb")?;
/// # Ok::<(), rtfmesh::Error>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Reader {
    format: Option<Encoding>,
    materials: bool,
    files_from: Option<PathBuf>,
    patience: Patience,
}

impl Reader {
    /// A reader for meshes without their materials.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets the format to use instead of the one that the extension indicates. What the content says comes
    /// first.
    #[must_use]
    pub fn format(self, format: impl Into<Option<Encoding>>) -> Self {
        Self { format: format.into(), ..self }
    }

    /// Sets whether to also read the materials of a glTF or 3MF file, or those of an OBJ file's libraries,
    /// and their images into `attributes.materials`. What cannot be read of them, such as an image that is
    /// missing or lies outside the file's folder, is noted. Images of more than 256 MiB together are an
    /// error.
    #[must_use]
    pub fn materials(self, materials: bool) -> Self {
        Self { materials, ..self }
    }

    /// Sets another folder, besides that of the file, from which files that it refers to may be read.
    #[must_use]
    pub fn files_from(self, folder: impl Into<Option<PathBuf>>) -> Self {
        Self { files_from: folder.into(), ..self }
    }

    /// Sets how long to wait for a pipe.
    #[must_use]
    pub fn patience(self, patience: Patience) -> Self {
        Self { patience, ..self }
    }

    /// Reads a mesh file. Its content decides on the format; where that is ambiguous, the extension does (in
    /// upper or lower case, with or without `.gz`).
    ///
    /// # Errors
    ///
    /// [`Error::Input`] with the path and, where there is one, the line, vertex, face or byte: the file is
    /// missing, unreadable, a directory or a device, empty, truncated or of an unknown format; a face has a
    /// vertex that does not exist; there is no vertex or no face with finite coordinates, or more than
    /// `u32::MAX - 1` vertices; a file that it names, such as a buffer of a glTF file, cannot be read or lies
    /// outside its folder. [`Error::OutOfMemory`]; [`Error::Cancelled`] by the token of [`Reader::patience`].
    pub fn read(&self, path: impl AsRef<Path>) -> Result<Loaded> {
        let path = path.as_ref();
        self.read_any(path)?.mesh().map_err(|error| error.in_file(path))
    }

    /// Like [`Reader::read`], for a mesh, points or a volume.
    ///
    /// # Errors
    ///
    /// See there; for volumes, also other than three axes with one number a node.
    pub fn read_any(&self, path: impl AsRef<Path>) -> Result<Input> {
        let path = path.as_ref();
        let decoded = read_file_bytes(path, &self.patience).and_then(|bytes| {
            let named = self.format.or_else(|| Encoding::of_name(path));
            let folder = path.parent().unwrap_or(Path::new(""));
            let references = References::new(folder, self.files_from.as_deref());
            decode(&bytes, named, Some(path), &references, self.materials)
        });
        decoded.map_err(|error| error.in_file(path))
    }

    /// Like [`Reader::read`], from the bytes of a file.
    ///
    /// # Errors
    ///
    /// See there, without a path; buffers in separate files of a glTF file are refused.
    pub fn read_bytes(&self, bytes: &[u8]) -> Result<Loaded> {
        self.read_any_bytes(bytes)?.mesh()
    }

    /// Like [`Reader::read_any`], from the bytes of a file.
    ///
    /// # Errors
    ///
    /// See there and [`Reader::read_bytes`].
    pub fn read_any_bytes(&self, bytes: &[u8]) -> Result<Input> {
        decode(bytes, self.format, None, &References::default(), self.materials)
    }
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

    /// A mesh with faces.
    ///
    /// # Errors
    /// [`Error::Input`] for points or a volume.
    pub fn mesh(self) -> Result<Loaded> {
        self.mesh_or_points().and_then(Loaded::with_faces)
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
    let input = parse(format, bytes, references, with_materials)?;
    notes.extend(references.note());
    Ok(match input {
        Input::Mesh(mut loaded) => {
            not_finite::leave_out(&mut loaded)?;
            notes.append(&mut loaded.notes);
            Input::Mesh(Loaded { notes, ..loaded })
        }
        Input::Volume(mut volume) => {
            notes.append(&mut volume.notes);
            Input::Volume(Volume { notes, ..volume })
        }
    })
}

fn parse(format: Format, bytes: &[u8], references: &References, with_materials: bool) -> Result<Input> {
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
