//! Results to files, whole or not at all: written beside the target under another name, then renamed.

use std::ffi::OsStr;
use std::fs::File;
use std::io;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::write::GzEncoder;
use glam::DVec3;
use tempfile::NamedTempFile;

use super::format::{extension_problem, written_extensions};
use super::{Encoding, Format, TriMesh, gltf, medit, obj, off, ply, stl};
use crate::mesh::attributes::{Attribute, Attributes, Role};
use crate::{Error, Result};

/// Writes `mesh` in the format of the extension of `path`, packed if that ends in `.gz`: OBJ, OFF and MEDIT as text, each
/// f64 in its shortest form that reads back the same; PLY as binary little endian with double coordinates; STL and GLB
/// as binary with 32-bit numbers, those of GLB relative to the mesh's own place and size. An existing file is replaced,
/// at once and only when the new one is complete.
///
/// # Errors
///
/// [`Error::Output`]: see [`check_target`]; also a full disk, or a mesh that the format cannot hold.
pub fn write(path: &Path, mesh: &TriMesh) -> Result<()> {
    write_as(path, mesh, target_encoding(path)?)
}

/// As [`write()`], in this encoding whatever the extension.
///
/// # Errors
///
/// See [`write()`].
pub fn write_as(path: &Path, mesh: &TriMesh, encoding: Encoding) -> Result<()> {
    write_with(path, mesh, &Attributes::default(), encoding)
}

/// As [`write_as`], with what of the attributes the format can hold: [`left_out`] says what it cannot.
///
/// # Errors
///
/// See [`write()`]. Panics if the attributes are of another mesh.
pub fn write_with(path: &Path, mesh: &TriMesh, attributes: &Attributes, encoding: Encoding) -> Result<()> {
    check_fits(path, (mesh, attributes), encoding.format)?;
    atomically(path, |file| fill(file, (mesh, attributes), encoding))
}

/// The bytes of the file that [`write_as`] would write; `name` stands for its path in errors.
///
/// # Errors
///
/// [`Error::Output`] for a mesh that the format cannot hold.
pub fn encode(name: &Path, mesh: &TriMesh, encoding: Encoding) -> Result<Vec<u8>> {
    encode_with(name, mesh, &Attributes::default(), encoding)
}

/// The bytes of the file that [`write_with`] would write.
///
/// # Errors
///
/// See [`encode`].
pub fn encode_with(
    name: &Path,
    mesh: &TriMesh,
    attributes: &Attributes,
    encoding: Encoding,
) -> Result<Vec<u8>> {
    check_fits(name, (mesh, attributes), encoding.format)?;
    let mut bytes = Vec::new();
    fill(&mut bytes, (mesh, attributes), encoding).map_err(|error| unwritable(name, error))?;
    Ok(bytes)
}

/// What the format rounds away, if it is more than a millionth of the bounding box's diagonal.
pub fn precision_note(mesh: &TriMesh, format: Format) -> Option<String> {
    if format != Format::Stl {
        return None;
    }
    let (low, high) = mesh.bounds()?;
    let off = |vertex: &DVec3| (vertex.as_vec3().as_dvec3() - *vertex).abs().max_element();
    let share = mesh.vertices.iter().map(off).fold(0.0, f64::max) / (high - low).length();
    let text = format!(
        "STL holds 32-bit numbers alone, which moves vertices by up to {:.2e} of the bounding box's diagonal; another \
         format keeps them",
        share
    );
    (share > 1e-6).then_some(text)
}

/// What the format drops of the attributes, as a sentence for people; `None` if nothing.
pub fn left_out(attributes: &Attributes, format: Format) -> Option<String> {
    let role = |a: &Attribute, role: Role, components: std::ops::RangeInclusive<usize>| {
        a.role == role && components.contains(&a.components)
    };
    let has_vertex = |a: &Attribute| match format {
        Format::Ply => true,
        Format::Obj | Format::Glb => role(a, Role::Colour, 3..=4) || role(a, Role::Normal, 3..=3),
        Format::Off => role(a, Role::Colour, 3..=4),
        Format::Medit => a.name == medit::REFERENCE,
        Format::Stl | Format::Gltf => false,
    };
    let has_face = |a: &Attribute| match format {
        Format::Ply => true,
        Format::Obj => matches!(a.name.as_str(), "material" | "group" | "object"),
        Format::Glb => a.name == "material",
        Format::Medit => medit::face_label(attributes).is_some_and(|label| label.name == a.name),
        Format::Stl | Format::Off | Format::Gltf => false,
    };
    let has_uv = matches!(format, Format::Ply | Format::Obj | Format::Glb);
    let dropped = Attributes {
        vertex: attributes.vertex.iter().filter(|a| !has_vertex(a)).cloned().collect(),
        face: attributes.face.iter().filter(|a| !has_face(a)).cloned().collect(),
        uv: attributes.uv.clone().filter(|_| !has_uv),
        libraries: Vec::new(),
        materials: attributes
            .materials
            .clone()
            .filter(|materials| format != Format::Glb && materials.used() > 0),
    };
    let what = dropped.listed().join(", ");
    let named = |a: &&Attribute| !a.names.is_empty() && has_face(a);
    let names = attributes.face.iter().filter(named).any(|_| matches!(format, Format::Ply | Format::Medit));
    match (what.is_empty(), names) {
        (true, false) => None,
        (true, true) => Some(format!("{} holds labels as numbers, without their names", format.name())),
        (false, _) => Some(format!("{} cannot hold these: {what}", format.name())),
    }
}

fn fill(file: &mut dyn Write, mesh: (&TriMesh, &Attributes), encoding: Encoding) -> io::Result<()> {
    if !encoding.gzip {
        return fill_plain(file, mesh, encoding.format);
    }
    // The header has neither name nor time, so that the same mesh gives the same bytes.
    let mut packed = BufWriter::new(GzEncoder::new(file, Compression::default()));
    fill_plain(&mut packed, mesh, encoding.format)?;
    packed.into_inner().map_err(io::IntoInnerError::into_error)?.finish()?;
    Ok(())
}

fn fill_plain(
    file: &mut dyn Write,
    (mesh, attributes): (&TriMesh, &Attributes),
    format: Format,
) -> io::Result<()> {
    match format {
        Format::Obj => obj::attributes::write(file, mesh, attributes),
        Format::Ply => ply::write::write(file, mesh, attributes),
        Format::Stl => stl::write(file, mesh),
        Format::Off => off::write(file, mesh, attributes),
        Format::Glb => gltf::write(file, mesh, attributes),
        Format::Medit => medit::write(file, mesh, attributes),
        // `check_fits` has refused it.
        Format::Gltf => Err(io::Error::other(ONLY_GLB)),
    }
}

const ONLY_GLB: &str = "glTF is written as .glb alone";

/// Refuses what the format cannot hold.
fn check_fits(path: &Path, (mesh, attributes): (&TriMesh, &Attributes), format: Format) -> Result<()> {
    match format {
        Format::Gltf => Err(failed(path, ONLY_GLB, "name the result .glb")),
        Format::Glb if mesh.triangles.is_empty() => {
            Err(failed(path, "a GLB file cannot hold a mesh without faces", "choose another format"))
        }
        // Some room for the JSON.
        Format::Glb if gltf::byte_length(mesh, attributes) > u64::from(u32::MAX) - (1 << 16) => {
            Err(failed(path, "a GLB file cannot hold more than 4 GiB", "choose another format"))
        }
        Format::Stl if mesh.triangles.len() as u64 > u64::from(u32::MAX) => {
            Err(failed(path, "an STL file cannot hold so many triangles", "choose another format"))
        }
        Format::Stl if mesh.vertices.iter().any(|vertex| !vertex.as_vec3().is_finite()) => {
            Err(failed(path, "an STL file cannot hold numbers beyond 3.4e38", "choose another format"))
        }
        _ => Ok(()),
    }
}

/// Writes `text` to `path`, whatever its extension, replacing the file only when the new one is complete.
///
/// # Errors
///
/// [`Error::Output`]: see [`check_text_target`]; also a full disk.
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    write_bytes(path, text.as_bytes())
}

/// As [`write_text`], for anything.
///
/// # Errors
/// See there.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    atomically(path, |file| file.write_all(bytes))
}

/// Tells before the work whether [`write()`] could write to `path`; leaves nothing behind.
///
/// # Errors
///
/// [`Error::Output`]: what [`target_encoding`] or [`check_text_target`] finds.
pub fn check_target(path: &Path) -> Result<()> {
    target_encoding(path)?;
    check_text_target(path)
}

/// Tells before the work whether [`write_text`] could write to `path`; leaves nothing behind.
///
/// # Errors
///
/// [`Error::Output`]: the folder is missing or may not be written to; the target is a directory, a device or
/// read-only, or `-`, which stands for standard output where meshes are written.
pub fn check_text_target(path: &Path) -> Result<()> {
    if path == Path::new("-") {
        return Err(failed(path, "- is standard output, which takes a mesh alone", "name a file"));
    }
    temporary(&place_of(path)?, path).map(drop)
}

/// How [`write()`] writes a file of this name.
///
/// # Errors
///
/// [`Error::Output`]: the extension is that of no format that is written.
pub fn target_encoding(path: &Path) -> Result<Encoding> {
    let remedy = format!("name the result {}", written_extensions());
    match Encoding::of_name(path) {
        Some(Encoding { format: Format::Gltf, .. }) => Err(failed(path, ONLY_GLB, "name the result .glb")),
        Some(encoding) => Ok(encoding),
        None => Err(failed(path, extension_problem(path), &remedy)),
    }
}

fn failed(path: &Path, problem: impl Into<String>, remedy: &str) -> Error {
    Error::output(path, problem, remedy)
}

/// The file to replace: `path` itself, or what it links to.
fn place_of(path: &Path) -> Result<PathBuf> {
    let Some(name) = path.file_name().filter(|name| *name != OsStr::new("")) else {
        return Err(failed(path, "this is no file name", "give the name of a file to write"));
    };
    if let Ok(known) = std::fs::metadata(path) {
        if known.is_dir() {
            return Err(failed(path, "this is a directory", "give the name of a file to write"));
        }
        // Renaming over a device would remove it.
        if !known.is_file() {
            return Err(failed(path, "this is not a regular file", "give the name of a file to write"));
        }
        if known.permissions().readonly() {
            return Err(failed(path, "the file is read-only", "choose another name or allow writing"));
        }
        return std::fs::canonicalize(path).map_err(|error| unwritable(path, error));
    }
    let folder = folder_of(path);
    if !folder.is_dir() {
        let problem = format!("there is no folder '{}'", folder.display());
        return Err(failed(path, problem, "make the folder first or choose another"));
    }
    Ok(folder.join(name))
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn unwritable(path: &Path, error: io::Error) -> Error {
    let remedy = match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "free some space or choose another disk",
        _ => "check the permissions of the folder or choose another",
    };
    failed(path, format!("the file cannot be written ({error})"), remedy).caused_by(error)
}

fn temporary(place: &Path, path: &Path) -> Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".rtfmesh-").suffix(".part");
    // Temporary files are private by default; this one becomes an ordinary file, subject to the umask.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder_of(place)).map_err(|error| unwritable(path, error))
}

pub(crate) fn atomically(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<()> {
    let place = place_of(path)?;
    let file = temporary(&place, path)?;
    let mut buffer = BufWriter::new(file.as_file());
    // Synced before the rename, or a power cut could leave the new name on an empty file.
    let filled = fill(&mut buffer).and_then(|()| buffer.flush()).and_then(|()| file.as_file().sync_all());
    drop(buffer);
    filled.map_err(|error| unwritable(path, error))?;
    file.persist(&place).map(drop).map_err(|error| unwritable(path, error.error))
}

pub(crate) fn write_obj_vertex(file: &mut impl Write, vertex: DVec3) -> io::Result<()> {
    write!(file, "v")?;
    for value in vertex.to_array() {
        write!(file, " ")?;
        write_number(file, value)?;
    }
    writeln!(file)
}

/// In the shortest form that reads back the same.
pub(crate) fn write_number(file: &mut (impl Write + ?Sized), value: f64) -> io::Result<()> {
    // Both forms are the shortest; the plain one has 300 digits at the extremes.
    if value == 0.0 || (1e-5..1e16).contains(&value.abs()) {
        write!(file, "{value}")
    } else {
        write!(file, "{value:e}")
    }
}
