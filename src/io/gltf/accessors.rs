//! Reads numbers from buffers through accessors; bounds are checked once for each accessor.

use std::cell::{Cell, OnceCell};
use std::ops::Deref;
use std::rc::Rc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;

use super::model::{Accessor, Buffer, Model, Sparse};
use crate::grammar::counted;
use crate::io::binary;
use crate::io::checks::{excerpt, outgrows};
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
    /// The elements of accessors with sparse ones, each put together when it is first needed.
    dense: Vec<OnceCell<Vec<u8>>>,
    /// Bytes of these.
    dense_bytes: Cell<u64>,
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
        let dense = vec![OnceCell::new(); model.accessors.len()];
        Self { model, binary, references, file_bytes, loaded, dense, dense_bytes: Cell::new(0) }
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
        let components = match kind {
            "MAT4" => 16,
            _ => kind.strip_prefix("VEC").and_then(|n| n.parse().ok()).unwrap_or(1),
        };
        let at = |error| at_accessor(error, index);
        let elements = match (accessor.buffer_view, &accessor.sparse) {
            (_, Some(sparse)) => self.dense(index, accessor, sparse, components).map_err(at)?,
            (Some(view), None) => {
                let range = Range { view, offset: accessor.byte_offset, count: accessor.count };
                self.range(&range, accessor.component_type, components).map_err(at)?
            }
            (None, None) => {
                let problem = "its data is compressed, which is not supported".to_owned();
                return refuse(problem, "export the mesh again without compression");
            }
        };
        Ok(Elements { normalized: accessor.normalized, ..elements })
    }

    /// The elements of a part of a buffer view.
    fn range(&self, range: &Range, component_type: u32, components: usize) -> Result<Elements<'_>> {
        let component = component(component_type)?;
        let (bytes, stride) = self.view(range.view)?;
        let size = binary::size(component) * components;
        let stride = stride.unwrap_or(size);
        if stride < size {
            let [size, stride] = [size, stride].map(|count| counted(count, BYTES));
            let problem = format!("its elements of {size} are {stride} apart");
            return Err(Error::input(None, problem, "export the mesh again"));
        }
        let needed = range.needed_bytes(size, stride);
        if needed.is_none_or(|needed| needed > bytes.len()) {
            let problem = format!(
                "the file is cut off: buffer view {} has {}, too few for {} from byte {} on",
                range.view,
                counted(bytes.len(), BYTES),
                counted(range.count, ["element", "elements"]),
                range.offset
            );
            return Err(Error::input(None, problem, "get the complete file, or export the mesh again"));
        }
        let bytes = bytes.get(range.offset..).unwrap_or_default();
        Ok(Elements { bytes, stride, component, normalized: false, count: range.count })
    }

    /// The elements of an accessor of which `sparse` replaces some.
    fn dense(
        &self,
        index: usize,
        accessor: &Accessor,
        sparse: &Sparse,
        components: usize,
    ) -> Result<Elements<'_>> {
        let component = component(accessor.component_type)?;
        let stride = binary::size(component) * components;
        let cell = &self.dense[index];
        if cell.get().is_none() {
            // Cannot fail: the cell is empty.
            let _ = cell.set(self.put_together(accessor, sparse, components, stride)?);
        }
        let bytes = cell.get().map(Vec::as_slice).unwrap_or_default();
        Ok(Elements { bytes, stride, component, normalized: false, count: accessor.count })
    }

    /// The bytes of all elements of such an accessor, `size` bytes each. Without a buffer view, those that
    /// are not replaced are 0.
    fn put_together(
        &self,
        accessor: &Accessor,
        sparse: &Sparse,
        components: usize,
        size: usize,
    ) -> Result<Vec<u8>> {
        let refuse = |problem| Err(Error::input(None, problem, "export the mesh again"));
        let (code, count) = (accessor.component_type, accessor.count);
        let length = count.saturating_mul(size);
        if sparse.count > count {
            let replaced = counted(sparse.count, ["sparse element", "sparse elements"]);
            return refuse(format!("{replaced} cannot replace those of {count}"));
        }
        let all_bytes = self.dense_bytes.get().saturating_add(length as u64);
        if outgrows(all_bytes, self.read_bytes()) {
            let elements = counted(count, ["element is", "elements are"]);
            return refuse(format!("{elements} more than the file can mean"));
        }
        self.dense_bytes.set(all_bytes);
        let mut all = vec![0; length];
        let mut put = |place: usize, elements: &Elements, number: usize| {
            let from = number * elements.stride;
            let value = elements.bytes.get(from..from + size);
            if let (Some(value), Some(own)) = (value, all.get_mut(place * size..(place + 1) * size)) {
                own.copy_from_slice(value);
            }
        };
        if let Some(view) = accessor.buffer_view {
            let range = Range { view, offset: accessor.byte_offset, count };
            let base = self.range(&range, code, components)?;
            (0..count).for_each(|number| put(number, &base, number));
        }
        let Sparse { count: replaced, indices, values } = sparse;
        let of = |view, offset| Range { view, offset, count: *replaced };
        let places = self.range(&of(indices.buffer_view, indices.byte_offset), indices.component_type, 1)?;
        let values = self.range(&of(values.buffer_view, values.byte_offset), code, components)?;
        let Some(places) = places.indices() else {
            return refuse("the indices of its sparse elements are not unsigned integers".to_owned());
        };
        for (number, place) in places.enumerate() {
            let place = place as usize;
            if place >= count {
                return refuse(format!("it has no element {place}, which a sparse one would replace"));
            }
            put(place, &values, number);
        }
        Ok(all)
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

/// A part of a buffer view.
struct Range {
    view: usize,
    offset: usize,
    /// Elements.
    count: usize,
}

impl Range {
    /// Bytes of the buffer view up to the end of the elements; `None` on overflow.
    fn needed_bytes(&self, size: usize, stride: usize) -> Option<usize> {
        match self.count.checked_sub(1) {
            None => Some(self.offset),
            Some(last) => last.checked_mul(stride)?.checked_add(size)?.checked_add(self.offset),
        }
    }
}

/// The error, at this accessor if it names no place.
fn at_accessor(mut error: Error, index: usize) -> Error {
    if let Error::Input { place: place @ None, .. } = &mut error {
        *place = Some(format!("accessor {index}"));
    }
    error
}

/// The number type with this code.
fn component(code: u32) -> Result<Kind> {
    Ok(match code {
        5120 => Kind::I8,
        5121 => Kind::U8,
        5122 => Kind::I16,
        5123 => Kind::U16,
        5125 => Kind::U32,
        5126 => Kind::F32,
        _ => {
            let problem = format!("there is no component type {code}");
            return Err(Error::input(None, problem, "export the mesh again"));
        }
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
