//! Results to files, whole or not at all: written beside the target under another name, then renamed.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use glam::DVec3;
use tempfile::NamedTempFile;

use super::{Format, TriMesh, extension_problem};
use crate::{Error, Result};

/// Writes `mesh` as `.obj` (text, each f64 in its shortest form that reads back the same) or `.ply` (binary little
/// endian, double coordinates), by the extension of `path`. An existing file is replaced, at once and only when the
/// new one is complete.
///
/// # Errors
///
/// [`Error::Output`]: see [`check_target`]; also a full disk.
pub fn write(path: &Path, mesh: &TriMesh) -> Result<()> {
    match format_of(path)? {
        Format::Obj => atomically(path, |file| write_obj(file, mesh)),
        Format::Ply => atomically(path, |file| write_ply(file, mesh)),
    }
}

/// Writes `text` to `path`, whatever its extension, replacing the file only when the new one is complete.
///
/// # Errors
///
/// [`Error::Output`]: see [`check_text_target`]; also a full disk.
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    atomically(path, |file| file.write_all(text.as_bytes()))
}

/// Tells before the work whether [`write()`] could write to `path`; leaves nothing behind.
///
/// # Errors
///
/// [`Error::Output`]: the extension is neither `.obj` nor `.ply`, or what [`check_text_target`] finds.
pub fn check_target(path: &Path) -> Result<()> {
    format_of(path)?;
    check_text_target(path)
}

/// Tells before the work whether [`write_text`] could write to `path`; leaves nothing behind.
///
/// # Errors
///
/// [`Error::Output`]: the folder is missing or may not be written to; the target is a directory, a device or
/// read-only.
pub fn check_text_target(path: &Path) -> Result<()> {
    temporary(&place_of(path)?, path).map(drop)
}

fn format_of(path: &Path) -> Result<Format> {
    Format::of(path).ok_or_else(|| failed(path, extension_problem(path), "name the result .obj or .ply"))
}

fn failed(path: &Path, problem: impl Into<String>, remedy: &str) -> Error {
    Error::Output { path: path.to_owned(), problem: problem.into(), remedy: remedy.to_owned() }
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
        return std::fs::canonicalize(path).map_err(|error| unwritable(path, &error));
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

fn unwritable(path: &Path, error: &io::Error) -> Error {
    let remedy = match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "free some space or choose another disk",
        _ => "check the permissions of the folder or choose another",
    };
    failed(path, format!("the file cannot be written ({error})"), remedy)
}

fn temporary(place: &Path, path: &Path) -> Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".rtfmesh-").suffix(".part");
    // Temporary files are private by default; this one becomes an ordinary file, subject to the umask.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder_of(place)).map_err(|error| unwritable(path, &error))
}

pub(super) fn atomically(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<()> {
    let place = place_of(path)?;
    let file = temporary(&place, path)?;
    let mut buffer = BufWriter::new(file.as_file());
    // Synced before the rename, or a power cut could leave the new name on an empty file.
    let filled = fill(&mut buffer).and_then(|()| buffer.flush()).and_then(|()| file.as_file().sync_all());
    drop(buffer);
    filled.map_err(|error| unwritable(path, &error))?;
    file.persist(&place).map(drop).map_err(|error| unwritable(path, &error.error))
}

fn write_obj(file: &mut impl Write, mesh: &TriMesh) -> io::Result<()> {
    for vertex in &mesh.vertices {
        write_obj_vertex(file, *vertex)?;
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| u64::from(vertex) + 1);
        writeln!(file, "f {a} {b} {c}")?;
    }
    Ok(())
}

pub(super) fn write_obj_vertex(file: &mut impl Write, vertex: DVec3) -> io::Result<()> {
    write!(file, "v")?;
    for value in vertex.to_array() {
        // Both forms are the shortest that read back the same; the plain one has 300 digits at the extremes.
        if value == 0.0 || (1e-5..1e16).contains(&value.abs()) {
            write!(file, " {value}")?;
        } else {
            write!(file, " {value:e}")?;
        }
    }
    writeln!(file)
}

fn write_ply(file: &mut impl Write, mesh: &TriMesh) -> io::Result<()> {
    // Readers know `int` best; `uint` is for meshes that it cannot count.
    let index = if i32::try_from(mesh.vertices.len()).is_ok() { "int" } else { "uint" };
    let (vertices, faces) = (mesh.vertices.len(), mesh.triangles.len());
    write!(
        file,
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n\
         property double x\nproperty double y\nproperty double z\n\
         element face {faces}\nproperty list uchar {index} vertex_indices\nend_header\n"
    )?;
    for value in mesh.vertices.iter().flat_map(|vertex| vertex.to_array()) {
        file.write_all(&value.to_le_bytes())?;
    }
    for triangle in &mesh.triangles {
        file.write_all(&[3])?;
        for vertex in triangle {
            file.write_all(&vertex.to_le_bytes())?;
        }
    }
    Ok(())
}
