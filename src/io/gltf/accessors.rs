//! Numbers in buffers: bounds checked once for each accessor, then read.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::path::{Component, Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;

use super::model::{Accessor, Buffer, Model};
use crate::io::{bytes_of, excerpt};
use crate::{Error, Result};

/// The buffers of a file, each fetched when it is first needed.
pub(crate) struct Buffers<'a> {
    model: &'a Model,
    binary: Option<&'a [u8]>,
    folder: Option<&'a Path>,
    fetched: Vec<OnceCell<Cow<'a, [u8]>>>,
}

impl<'a> Buffers<'a> {
    pub fn new(model: &'a Model, binary: Option<&'a [u8]>, folder: Option<&'a Path>) -> Self {
        let fetched = std::iter::repeat_with(OnceCell::new).take(model.buffers.len()).collect();
        Self { model, binary, folder, fetched }
    }

    /// Bytes of all buffers fetched so far.
    pub fn fetched_bytes(&self) -> u64 {
        self.fetched.iter().filter_map(OnceCell::get).map(|buffer| buffer.len() as u64).sum()
    }

    /// The elements of accessor `index`, which must have this type.
    pub fn elements(&self, index: usize, kind: &str) -> Result<Elements<'_>> {
        let refuse = |problem: String, remedy: &str| {
            Err(Error::input(Some(format!("accessor {index}")), problem, remedy))
        };
        let Some(accessor) = self.model.accessors.get(index) else {
            return refuse("there is no such accessor".to_owned(), "write the mesh again");
        };
        if accessor.kind != kind {
            let problem = format!("its type is '{}' instead of '{kind}'", excerpt(&accessor.kind));
            return refuse(problem, "write the mesh again");
        }
        let (Some(view), None) = (accessor.buffer_view, &accessor.sparse) else {
            let problem = "its data are sparse or compressed, which is not supported".to_owned();
            return refuse(problem, "write the mesh again without compression and sparse data");
        };
        let Some(component) = Number::of(accessor.component_type) else {
            return refuse(
                format!("there is no component type {}", accessor.component_type),
                "write the mesh again",
            );
        };
        let (bytes, stride) = self.view(view)?;
        let size = component.size() * kind.strip_prefix("VEC").and_then(|n| n.parse().ok()).unwrap_or(1);
        let stride = stride.unwrap_or(size);
        if stride < size {
            return refuse(
                format!("its elements of {size} bytes are {stride} bytes apart"),
                "write the mesh again",
            );
        }
        let needed = needed_bytes(accessor, size, stride);
        if needed.is_none_or(|needed| needed > bytes.len()) {
            let problem = format!(
                "the file is cut off: {} elements from byte {} on do not fit into the {} bytes of buffer view {view}",
                accessor.count,
                accessor.byte_offset,
                bytes.len()
            );
            return refuse(problem, "get the whole file or write the mesh again");
        }
        let bytes = bytes.get(accessor.byte_offset..).unwrap_or_default();
        Ok(Elements { bytes, stride, component, normalized: accessor.normalized, count: accessor.count })
    }

    /// The bytes of a buffer view, and how far apart its elements are.
    pub fn view(&self, index: usize) -> Result<(&[u8], Option<usize>)> {
        let refuse = |problem: String| {
            let remedy = "get the whole file or write the mesh again";
            Err(Error::input(Some(format!("buffer view {index}")), problem, remedy))
        };
        let Some(view) = self.model.buffer_views.get(index) else {
            return refuse("there is no such buffer view".to_owned());
        };
        let buffer = self.buffer(view.buffer)?;
        let end = view.byte_offset.checked_add(view.byte_length);
        let Some(bytes) = end.and_then(|end| buffer.get(view.byte_offset..end)) else {
            return refuse(format!(
                "the file is cut off: {} bytes from byte {} on do not fit into the {} bytes of buffer {}",
                view.byte_length,
                view.byte_offset,
                buffer.len(),
                view.buffer
            ));
        };
        Ok((bytes, view.byte_stride))
    }

    fn buffer(&self, index: usize) -> Result<&[u8]> {
        let at = |mut error: Error| {
            if let Error::Input { place: place @ None, .. } = &mut error {
                *place = Some(format!("buffer {index}"));
            }
            error
        };
        let (Some(buffer), Some(cell)) = (self.model.buffers.get(index), self.fetched.get(index)) else {
            return Err(at(Error::input(None, "there is no such buffer", "write the mesh again")));
        };
        if cell.get().is_none() {
            // A set cell stays as it is, and there is none here.
            let _ = cell.set(self.fetch(index, buffer).map_err(at)?);
        }
        Ok(cell.get().map(AsRef::as_ref).unwrap_or_default())
    }

    fn fetch(&self, index: usize, buffer: &'a Buffer) -> Result<Cow<'a, [u8]>> {
        let bytes = match (&buffer.uri, self.binary) {
            (Some(uri), _) => match uri.strip_prefix("data:") {
                Some(data) => Cow::Owned(decoded(data)?),
                None => Cow::Owned(read_beside(&self.beside(uri)?, uri)?),
            },
            (None, Some(binary)) if index == 0 => Cow::Borrowed(binary),
            (None, _) => {
                return Err(Error::input(None, "the buffer has no data", "write the mesh again"));
            }
        };
        if bytes.len() < buffer.byte_length {
            let problem = format!("the buffer has {} of its {} bytes", bytes.len(), buffer.byte_length);
            return Err(Error::input(None, problem, "get the whole file or write the mesh again"));
        }
        Ok(bytes)
    }

    /// The picture at an address; `None` if it has more than so many bytes.
    pub fn picture(&self, uri: &str, most_bytes: u64) -> Result<Option<Vec<u8>>> {
        if let Some(data) = uri.strip_prefix("data:") {
            return decoded(data).map(Some);
        }
        let whole = self.beside(uri)?;
        if std::fs::metadata(&whole).is_ok_and(|file| file.len() > most_bytes) {
            return Ok(None);
        }
        read_beside(&whole, uri).map(Some)
    }

    /// The path of the file that a relative address names.
    fn beside(&self, uri: &str) -> Result<PathBuf> {
        let name = percent_encoding::percent_decode_str(uri).decode_utf8_lossy();
        let path = Path::new(name.as_ref());
        let inside = |part: Component| matches!(part, Component::Normal(_) | Component::CurDir);
        if uri.contains(':') || !path.components().all(inside) {
            let problem = format!("it is in '{}', which is not beside the file", excerpt(uri));
            return Err(Error::input(None, problem, "put it into the file's folder, or write a .glb file"));
        }
        let Some(folder) = self.folder else {
            let problem = format!("it is in another file, '{}'", excerpt(uri));
            return Err(Error::input(None, problem, "give the mesh by its file name, or as a .glb file"));
        };
        let whole = folder.join(path);
        // Anything else, such as a pipe, might never end.
        if whole.exists() && !whole.is_file() {
            let problem = format!("{}: this is no file", excerpt(&name));
            return Err(Error::input(None, problem, "write a .glb file"));
        }
        Ok(whole)
    }
}

/// Reads the file of this path, which `uri` led to.
fn read_beside(whole: &Path, uri: &str) -> Result<Vec<u8>> {
    let name = percent_encoding::percent_decode_str(uri).decode_utf8_lossy();
    bytes_of(whole).map_err(|mut error| {
        if let Error::Input { problem, .. } = &mut error {
            *problem = format!("{}: {problem}", excerpt(&name));
        }
        error
    })
}

/// What a data URI holds; `data` is what follows `data:`.
fn decoded(data: &str) -> Result<Vec<u8>> {
    let refuse = |problem: String| Error::input(None, problem, "get the whole file or write the mesh again");
    let Some((_, encoded)) = data.split_once(";base64,") else {
        return Err(refuse("its data are not in base64".to_owned()));
    };
    let damaged = |error| refuse(format!("its base64 data are damaged ({error})")).caused_by(error);
    STANDARD.decode(encoded).map_err(damaged)
}

/// Bytes of the buffer view that an accessor needs; `None` if they cannot be counted.
fn needed_bytes(accessor: &Accessor, size: usize, stride: usize) -> Option<usize> {
    match accessor.count.checked_sub(1) {
        None => Some(accessor.byte_offset),
        Some(before) => before.checked_mul(stride)?.checked_add(size)?.checked_add(accessor.byte_offset),
    }
}

/// A number type.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Number {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Number {
    fn of(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

/// The elements of an accessor, all within its buffer.
pub(crate) struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    pub component: Number,
    normalized: bool,
    pub count: usize,
}

impl Elements<'_> {
    /// Number `at` of element `index`; 0 out of range.
    pub fn number(&self, index: usize, at: usize) -> f64 {
        let size = self.component.size();
        let start = index * self.stride + at * size;
        let raw = self.bytes.get(start..start + size).unwrap_or_default();
        let mut bytes = [0; 4];
        bytes.iter_mut().zip(raw).for_each(|(to, from)| *to = *from);
        let [first, second, ..] = bytes;
        let short = [first, second];
        let (value, largest) = match self.component {
            Number::I8 => (f64::from(i8::from_le_bytes([first])), 127.0),
            Number::U8 => (f64::from(first), 255.0),
            Number::I16 => (f64::from(i16::from_le_bytes(short)), 32767.0),
            Number::U16 => (f64::from(u16::from_le_bytes(short)), 65535.0),
            Number::U32 => (f64::from(u32::from_le_bytes(bytes)), 1.0),
            Number::F32 => (f64::from(f32::from_le_bytes(bytes)), 1.0),
        };
        if self.normalized { (value / largest).max(-1.0) } else { value }
    }

    pub fn positions(&self) -> impl Iterator<Item = DVec3> {
        (0..self.count).map(|index| DVec3::from_array([0, 1, 2].map(|at| self.number(index, at))))
    }

    /// The elements as indices; `None` if their type is not one of indices.
    pub fn indices(&self) -> Option<impl Iterator<Item = u32>> {
        let known = matches!(self.component, Number::U8 | Number::U16 | Number::U32);
        // Exact in f64.
        known.then(|| (0..self.count).map(|index| self.number(index, 0) as u32))
    }
}
