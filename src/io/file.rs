//! Files on disk: written whole or not at all, under a temporary name that is then renamed.

use std::ffi::OsStr;
use std::fs::File;
use std::io;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::shown;
use crate::{Error, Result};

/// Writes `text` to `path`, whatever its extension, replacing the file only when the new one is complete.
///
/// # Errors
///
/// [`Error::Output`]: see [`check_text_target`]; also a full disk.
pub fn write_text(path: impl AsRef<Path>, text: &str) -> Result<()> {
    write_bytes(path, text.as_bytes())
}

/// Like [`write_text`], for any bytes.
///
/// # Errors
///
/// See [`write_text`].
pub fn write_bytes(path: impl AsRef<Path>, bytes: &[u8]) -> Result<()> {
    write_atomically(path.as_ref(), |file| file.write_all(bytes))
}

/// Checks in advance whether [`write_text`] can write to `path`, and leaves nothing behind.
///
/// # Errors
///
/// [`Error::Output`]: the folder is missing or may not be written to; the target is a directory, a device or
/// read-only, or `-`, which stands for standard output and takes meshes only.
pub fn check_text_target(path: impl AsRef<Path>) -> Result<()> {
    let path = path.as_ref();
    if path == Path::new("-") {
        return Err(output_error(path, "- is standard output, which takes meshes only", "name a file"));
    }
    create_temporary(&final_path(path)?, path).map(drop)
}

pub(crate) fn output_error(path: &Path, problem: impl Into<String>, remedy: &str) -> Error {
    Error::output(path, problem, remedy)
}

/// The path to replace: `path` itself, or what it links to.
fn final_path(path: &Path) -> Result<PathBuf> {
    let Some(name) = path.file_name().filter(|name| *name != OsStr::new("")) else {
        return Err(output_error(path, "this is not a file name", "give the name of a file to write"));
    };
    if let Ok(known) = std::fs::metadata(path) {
        if known.is_dir() {
            return Err(output_error(path, "this is a directory", "give the name of a file to write"));
        }
        // Renaming over a device would remove it.
        if !known.is_file() {
            return Err(output_error(path, "this is not a regular file", "give the name of a file to write"));
        }
        if known.permissions().readonly() {
            return Err(output_error(path, "the file is read-only", "choose another name or allow writing"));
        }
        return std::fs::canonicalize(path).map_err(|error| unwritable(path, error));
    }
    // To write through it would make a file that nobody sees; to replace it would lose the link.
    if std::fs::symlink_metadata(path).is_ok() {
        let problem = "this is a link to a file that does not exist";
        return Err(output_error(path, problem, "name that file, or remove the link"));
    }
    let folder = folder_of(path);
    if !folder.is_dir() {
        let problem = format!("there is no folder '{}'", shown(folder));
        return Err(output_error(path, problem, "create the folder or choose another"));
    }
    Ok(folder.join(name))
}

pub(crate) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

pub(crate) fn unwritable(path: &Path, error: io::Error) -> Error {
    let remedy = match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "free some space or choose another disk",
        _ => "check the permissions of the folder or choose another",
    };
    output_error(path, format!("the file cannot be written ({error})"), remedy).caused_by(error)
}

fn create_temporary(target: &Path, path: &Path) -> Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".rtfmesh-").suffix(".part");
    let earlier = std::fs::metadata(target).ok();
    // Temporary files are private by default; a new one becomes an ordinary file, subject to the umask.
    #[cfg(unix)]
    if earlier.is_none() {
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder_of(target)).map_err(|error| unwritable(path, error))?;
    // What replaces a file is as private as that was.
    if let Some(earlier) = earlier {
        file.as_file().set_permissions(earlier.permissions()).map_err(|error| unwritable(path, error))?;
    }
    Ok(file)
}

/// A file that is complete under a temporary name; it is removed unless it is put in its place.
pub(crate) struct Prepared {
    file: NamedTempFile,
    target: PathBuf,
    path: PathBuf,
}

impl Prepared {
    /// What `fill` writes, for the file at `path`.
    ///
    /// # Errors
    /// [`Error::Output`], such as for a full disk.
    pub fn new(path: &Path, fill: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> Result<Self> {
        let target = final_path(path)?;
        let file = create_temporary(&target, path)?;
        let mut buffer = BufWriter::new(file.as_file());
        // Synced before the rename, or a power cut could leave the new name on an empty file.
        let filled = fill(&mut buffer).and_then(|()| buffer.flush()).and_then(|()| file.as_file().sync_all());
        drop(buffer);
        filled.map_err(|error| unwritable(path, error))?;
        Ok(Self { file, target, path: path.to_owned() })
    }

    /// Of these bytes.
    ///
    /// # Errors
    /// As [`Prepared::new`].
    pub fn of_bytes(path: &Path, bytes: &[u8]) -> Result<Self> {
        Self::new(path, |file| file.write_all(bytes))
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// [`Error::Output`] if the system does not rename it.
    pub fn put(self) -> Result<()> {
        let Self { file, target, path } = self;
        file.persist(&target).map(drop).map_err(|error| unwritable(&path, error.error))
    }
}

/// Replaces the file at `path` by what `fill` writes, once that is complete.
pub(crate) fn write_atomically(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<()> {
    Prepared::new(path, fill)?.put()
}
