//! The files that a file names: buffers, images, values of volumes. Whoever converts the files of strangers
//! must not give away files of their own, so these lie in the folder of the file or below it.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;

use super::checks::excerpt;
use super::open::read_regular_file;
use crate::{Error, Result};

/// Reads the files that a file names, each once.
#[derive(Debug, Default)]
pub(crate) struct References<'a> {
    /// The folder of the file; `None` if its bytes came from elsewhere, which allows no other files.
    folder: Option<&'a Path>,
    /// Another folder that files may be in.
    allowed: Option<&'a Path>,
    /// What was read, by the one path of each file.
    read: RefCell<BTreeMap<PathBuf, Rc<Vec<u8>>>>,
    /// Their names in the file.
    names: RefCell<Vec<String>>,
    bytes: Cell<u64>,
}

impl<'a> References<'a> {
    /// References of a file in `folder`, to files in it, below it, or in or below the folder `allowed`.
    pub fn new(folder: &'a Path, allowed: Option<&'a Path>) -> Self {
        // The parent of a bare file name is the empty path: the working directory.
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        Self { folder: Some(folder), allowed, ..Self::default() }
    }

    /// The folder of the file.
    pub fn folder(&self) -> Option<&'a Path> {
        self.folder
    }

    /// Bytes of all files read so far.
    pub fn bytes(&self) -> u64 {
        self.bytes.get()
    }

    /// The content of the file with this name, a path relative to the folder; `None` if it has more than
    /// `most_bytes`.
    ///
    /// # Errors
    /// [`Error::Input`]: it may not be read or does not exist, or is not a regular file.
    pub fn read(&self, name: &str, most_bytes: u64) -> Result<Option<Rc<Vec<u8>>>> {
        let path = self.path_of(name)?;
        if let Some(known) = self.read.borrow().get(&path) {
            return Ok((known.len() as u64 <= most_bytes).then(|| Rc::clone(known)));
        }
        if std::fs::metadata(&path).is_ok_and(|file| file.len() > most_bytes) {
            return Ok(None);
        }
        let content = Rc::new(read_regular_file(&path).map_err(|error| with_name(error, name))?);
        self.bytes.set(self.bytes.get() + content.len() as u64);
        self.names.borrow_mut().push(excerpt(name));
        self.read.borrow_mut().insert(path, Rc::clone(&content));
        Ok(Some(content))
    }

    /// Like [`References::read`], for a URI reference, whose special characters are percent-encoded.
    ///
    /// # Errors
    /// See there.
    pub fn read_uri(&self, uri: &str, most_bytes: u64) -> Result<Option<Rc<Vec<u8>>>> {
        self.read(&percent_encoding::percent_decode_str(uri).decode_utf8_lossy(), most_bytes)
    }

    /// A note on the files that were read, if there are any.
    pub fn note(&self) -> Option<String> {
        let names = self.names.borrow();
        (!names.is_empty()).then(|| format!("files that it refers to were read: {}", names.join(", ")))
    }

    /// The one path of the file with this name, without links.
    fn path_of(&self, name: &str) -> Result<PathBuf> {
        let relative = Path::new(name);
        let is_inside = relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        if has_scheme(name) || (!is_inside && self.allowed.is_none()) {
            return Err(outside(name));
        }
        let Some(folder) = self.folder else {
            let problem =
                format!("it is in another file, '{}', which cannot be found from here", excerpt(name));
            return Err(Error::input(
                None,
                problem,
                "give the input by its path, or put everything into one \
            file",
            ));
        };
        let path = folder.join(relative);
        let one_path = |path: &Path| {
            std::fs::canonicalize(path).map_err(|error| {
                let problem = match error.kind() {
                    std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
                    _ => format!("the file cannot be read ({error})"),
                };
                with_name(Error::input(None, problem, "put it next to the file").caused_by(error), name)
            })
        };
        let path = one_path(&path)?;
        let is_in = |folder: &Path| Ok::<_, Error>(path.starts_with(one_path(folder)?));
        if !is_in(folder)? && !self.allowed.map_or(Ok(false), is_in)? {
            return Err(outside(name));
        }
        // Told here, since an error of reading would say how to give an input.
        if !path.is_file() {
            let problem = format!("{}: this is not a regular file", excerpt(name));
            return Err(Error::input(None, problem, "put a file in its place"));
        }
        Ok(path)
    }
}

fn outside(name: &str) -> Error {
    let problem = format!("it is in '{}', outside the folder of the file", excerpt(name));
    Error::input(None, problem, "move it into that folder, or allow its folder by `files_from`")
}

/// The error with the name of the file that it is about.
fn with_name(mut error: Error, name: &str) -> Error {
    if let Error::Input { problem, .. } = &mut error {
        *problem = format!("{}: {problem}", excerpt(name));
    }
    error
}

/// Whether a name begins as a URL or a drive does.
fn has_scheme(name: &str) -> bool {
    let is_of_scheme = |c: char| c.is_ascii_alphanumeric() || "+-.".contains(c);
    name.split_once(':').is_some_and(|(scheme, _)| {
        scheme.starts_with(|c: char| c.is_ascii_alphabetic()) && scheme.chars().all(is_of_scheme)
    })
}
