//! Reads numbers from buffers through accessors; bounds are checked once for each accessor.

use std::cell::OnceCell;
use std::ops::Deref;
use std::rc::Rc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;

use super::model::{Accessor, Buffer, Model};
use crate::grammar::counted;
use crate::io::binary;
use crate::io::checks::excerpt;
use crate::io::references::References;
use crate::mesh::attributes::Kind;
use crate::{Error, Result};

const BYTES: [&str; 2] = ["byte", "bytes"];

/// The buffers of a file, each loaded when it is first needed.
pub(crate) struct Buffers<'a> {
    model: &'a Model,
    binary: Option<&'a [u8]>,
    references: &'a References<'a>,
    file_bytes: u64,
    loaded: Vec<OnceCell<Content<'a>>>,
}

/// The bytes of a buffer or an image.
pub(crate) enum Content<'a> {
    InFile(&'a [u8]),
    /// Decoded from text.
    Own(Vec<u8>),
    /// The bytes of another file, which several buffers may share.
    OtherFile(Rc<Vec<u8>>),
}

impl Deref for Content<'_> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::InFile(bytes) => bytes,
            Self::Own(bytes) => bytes,
            Self::OtherFile(bytes) => bytes,
        }
    }
}

impl<'a> Buffers<'a> {
    pub fn new(
        model: &'a Model,
        binary: Option<&'a [u8]>,
        references: &'a References<'a>,
        file_bytes: u64,
    ) -> Self {
        let loaded = std::iter::repeat_with(OnceCell::new).take(model.buffers.len()).collect();
        Self { model, binary, references, file_bytes, loaded }
    }

    /// Bytes of the file and of those read so far that it names.
    pub fn read_bytes(&self) -> u64 {
        self.file_bytes.saturating_add(self.references.bytes())
    }

    /// The elements of accessor `index`, which must have this type.
    pub fn elements(&self, index: usize, kind: &str) -> Result<Elements<'_>> {
        let refuse = |problem: String, remedy: &str| {
            Err(Error::input(Some(format!("accessor {index}")), problem, remedy))
        };
        let Some(accessor) = self.model.accessors.get(index) else {
            return refuse("there is no such accessor".to_owned(), "export the mesh again");
        };
        if accessor.kind != kind {
            let problem = format!("its type is '{}' instead of '{kind}'", excerpt(&accessor.kind));
            return refuse(problem, "export the mesh again");
        }
        let (Some(view), None) = (accessor.buffer_view, &accessor.sparse) else {
            let problem = "its data is sparse or compressed, which is not supported".to_owned();
            return refuse(problem, "export the mesh again without compression and sparse data");
        };
        let Some(component) = from_code(accessor.component_type) else {
            return refuse(
                format!("there is no component type {}", accessor.component_type),
                "export the mesh again",
            );
        };
        let (bytes, stride) = self.view(view)?;
        let components = match kind {
            "MAT4" => 16,
            _ => kind.strip_prefix("VEC").and_then(|n| n.parse().ok()).unwrap_or(1),
        };
        let size = binary::size(component) * components;
        let stride = stride.unwrap_or(size);
        if stride < size {
            let [size, stride] = [size, stride].map(|count| counted(count, BYTES));
            return refuse(format!("its elements of {size} are {stride} apart"), "export the mesh again");
        }
        let needed = needed_bytes(accessor, size, stride);
        if needed.is_none_or(|needed| needed > bytes.len()) {
            let problem = format!(
                "the file is cut off: buffer view {view} has {}, too few for {} from byte {} on",
                counted(bytes.len(), BYTES),
                counted(accessor.count, ["element", "elements"]),
                accessor.byte_offset
            );
            return refuse(problem, "get the complete file, or export the mesh again");
        }
        let bytes = bytes.get(accessor.byte_offset..).unwrap_or_default();
        Ok(Elements { bytes, stride, component, normalized: accessor.normalized, count: accessor.count })
    }

    /// The bytes of a buffer view, and its stride.
    pub fn view(&self, index: usize) -> Result<(&[u8], Option<usize>)> {
        let refuse = |problem: String| {
            let remedy = "get the complete file, or export the mesh again";
            Err(Error::input(Some(format!("buffer view {index}")), problem, remedy))
        };
        let Some(view) = self.model.buffer_views.get(index) else {
            return refuse("there is no such buffer view".to_owned());
        };
        let buffer = self.buffer(view.buffer)?;
        let end = view.byte_offset.checked_add(view.byte_length);
        let Some(bytes) = end.and_then(|end| buffer.get(view.byte_offset..end)) else {
            return refuse(format!(
                "the file is cut off: buffer {} has {}, too few for {} from byte {} on",
                view.buffer,
                counted(buffer.len(), BYTES),
                counted(view.byte_length, BYTES),
                view.byte_offset
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
        let (Some(buffer), Some(cell)) = (self.model.buffers.get(index), self.loaded.get(index)) else {
            return Err(at(Error::input(None, "there is no such buffer", "export the mesh again")));
        };
        if cell.get().is_none() {
            // Cannot fail: the cell is empty.
            let _ = cell.set(self.load(index, buffer).map_err(at)?);
        }
        Ok(cell.get().map(Deref::deref).unwrap_or_default())
    }

    fn load(&self, index: usize, buffer: &'a Buffer) -> Result<Content<'a>> {
        let bytes = match (&buffer.uri, self.binary) {
            (Some(uri), _) => match uri.strip_prefix("data:") {
                Some(data) => Content::Own(decode_data_uri(data)?),
                None => Content::OtherFile(self.references.read_uri(uri, u64::MAX)?.unwrap_or_default()),
            },
            (None, Some(binary)) if index == 0 => Content::InFile(binary),
            (None, _) => {
                return Err(Error::input(None, "the buffer has no data", "export the mesh again"));
            }
        };
        if bytes.len() < buffer.byte_length {
            let length = counted(buffer.byte_length, BYTES);
            let problem = format!("the buffer has {} of its {length}", bytes.len());
            return Err(Error::input(None, problem, "get the complete file, or export the mesh again"));
        }
        Ok(bytes)
    }

    /// The image at an address; `None` if it has more than this many bytes.
    pub fn image(&self, uri: &str, most_bytes: u64) -> Result<Option<Content<'_>>> {
        if let Some(data) = uri.strip_prefix("data:") {
            return decode_data_uri(data).map(|bytes| Some(Content::Own(bytes)));
        }
        Ok(self.references.read_uri(uri, most_bytes)?.map(Content::OtherFile))
    }
}

/// The content of a data URI; `data` is what follows `data:`.
fn decode_data_uri(data: &str) -> Result<Vec<u8>> {
    let refuse = |problem: String| {
        Error::input(
            None,
            problem,
            "get the complete file, or export the mesh \
     again",
        )
    };
    let Some((_, encoded)) = data.split_once(";base64,") else {
        return Err(refuse("its data is not in base64".to_owned()));
    };
    let damaged = |error| refuse(format!("its base64 data is damaged ({error})")).caused_by(error);
    STANDARD.decode(encoded).map_err(damaged)
}

/// Bytes of the buffer view that an accessor needs; `None` on overflow.
fn needed_bytes(accessor: &Accessor, size: usize, stride: usize) -> Option<usize> {
    match accessor.count.checked_sub(1) {
        None => Some(accessor.byte_offset),
        Some(last) => last.checked_mul(stride)?.checked_add(size)?.checked_add(accessor.byte_offset),
    }
}

/// The number type of an accessor with this code.
fn from_code(code: u32) -> Option<Kind> {
    Some(match code {
        5120 => Kind::I8,
        5121 => Kind::U8,
        5122 => Kind::I16,
        5123 => Kind::U16,
        5125 => Kind::U32,
        5126 => Kind::F32,
        _ => return None,
    })
}

/// The elements of an accessor, all within its buffer.
pub(crate) struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    pub component: Kind,
    normalized: bool,
    pub count: usize,
}

impl Elements<'_> {
    /// Component `at` of element `index`; 0 if out of range.
    pub fn number(&self, index: usize, at: usize) -> f64 {
        let size = binary::size(self.component);
        let start = index * self.stride + at * size;
        let raw = self.bytes.get(start..start + size).unwrap_or_default();
        let value = binary::value_le(self.component, raw);
        // 32-bit integers are none of the types that may be normalized.
        match self.component.range() {
            Some([_, largest]) if self.normalized => (value / largest).max(-1.0),
            _ => value,
        }
    }

    pub fn positions(&self) -> impl Iterator<Item = DVec3> {
        (0..self.count).map(|index| DVec3::from_array([0, 1, 2].map(|at| self.number(index, at))))
    }

    /// The elements as indices; `None` if they are not unsigned integers.
    pub fn indices(&self) -> Option<impl Iterator<Item = u32>> {
        let is_unsigned = matches!(self.component, Kind::U8 | Kind::U16 | Kind::U32);
        // Exact in f64.
        is_unsigned.then(|| (0..self.count).map(|index| self.number(index, 0) as u32))
    }
}
