//! What text formats share: lines, words, numbers, and faces that are checked and split.

use glam::DVec3;

use super::{excerpt, repeated};
use crate::{Error, Result};

/// Refuses text that is none. `remedy` says what to give instead.
pub(crate) fn refuse_binary(bytes: &[u8], remedy: &str) -> Result<()> {
    let Some(at) = bytes.iter().position(|byte| *byte == 0) else { return Ok(()) };
    let line = 1 + bytes.iter().take(at).filter(|byte| **byte == b'\n').count();
    Err(Error::input(Some(format!("line {line}")), "binary data in a text format", remedy))
}

/// Lines that say something, without comments, from a `#` on. Any kind of line end will do.
#[derive(Clone)]
pub(crate) struct Lines<'a> {
    rest: &'a [u8],
    /// The line that was given last, from 1.
    pub(crate) number: u64,
}

impl<'a> Lines<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), number: 0 }
    }

    /// Bytes not yet given; a last line needs no end.
    pub(crate) fn left(&self) -> u64 {
        self.rest.len() as u64 + 1
    }

    /// The place of the line that was given last.
    pub(crate) fn place(&self) -> String {
        format!("line {}", self.number)
    }

    /// The next line whatever is on it, comment and all.
    fn any_line(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let is_end = |byte: &u8| matches!(byte, b'\n' | b'\r');
        let length = self.rest.iter().position(is_end).unwrap_or(self.rest.len());
        let (line, rest) = self.rest.split_at(length);
        // A carriage return with a line feed is one line end, alone it is one too.
        self.rest = rest.strip_prefix(b"\r\n").or_else(|| rest.get(1..)).unwrap_or_default();
        self.number += 1;
        Some(line)
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        loop {
            let line = self.any_line()?;
            let said = line.split(|byte| *byte == b'#').next().unwrap_or_default().trim_ascii();
            if !said.is_empty() {
                return Some(said);
            }
        }
    }
}

/// The words of a line.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// A word as an error shows it.
pub(crate) fn shown(word: &[u8]) -> String {
    excerpt(&String::from_utf8_lossy(word))
}

pub(crate) fn number(word: &[u8]) -> Option<f64> {
    str::from_utf8(word).ok()?.parse().ok()
}

/// A count or an index.
pub(crate) fn whole(word: &[u8]) -> Option<u64> {
    str::from_utf8(word).ok()?.parse().ok()
}

/// Three coordinates from the next words; `place` is asked for only if there is something wrong.
pub(crate) fn vertex<'a>(
    words: &mut impl Iterator<Item = &'a [u8]>,
    place: &dyn Fn() -> String,
) -> Result<DVec3> {
    let mut position = [0.0; 3];
    for (axis, value) in ["x", "y", "z"].iter().zip(&mut position) {
        let refuse = |problem, remedy: &str| Err(Error::input(Some(place()), problem, remedy));
        let Some(word) = words.next() else {
            return refuse(
                format!("the vertex has no {axis} coordinate"),
                "give each vertex three coordinates",
            );
        };
        *value = match number(word) {
            Some(value) if value.is_finite() => value,
            Some(_) => {
                let problem = format!("the {axis} coordinate '{}' is not finite", shown(word));
                return refuse(problem, "remove or mend the vertex");
            }
            None => {
                let problem = format!("the {axis} coordinate '{}' is not a number", shown(word));
                return refuse(problem, "write plain decimal numbers");
            }
        };
    }
    Ok(DVec3::from_array(position))
}

/// Refuses a count of things, each of at least so many bytes, that what is left of the file cannot hold; before any
/// memory is set aside for it.
pub(crate) fn check_promise(
    (count, what): (u64, &str),
    bytes_each: u64,
    left: u64,
    place: String,
) -> Result<()> {
    let least = count.saturating_mul(bytes_each);
    if least <= left {
        return Ok(());
    }
    let problem = format!(
        "the file is cut off: it declares {count} {what}, at least {least} bytes, but {left} are left"
    );
    Err(Error::input(Some(place), problem, "get the whole file or write the mesh again"))
}

/// The error where a file ends too early.
pub(crate) fn cut_off(place: String, missing: &str) -> Error {
    let problem = format!("the file is cut off: {missing}");
    Error::input(Some(place), problem, "get the whole file or write the mesh again")
}

/// Faces, checked and split into triangles.
pub(crate) struct Faces {
    pub(crate) triangles: Vec<[u32; 3]>,
    /// How many had more than three corners.
    polygons: u64,
    /// The number of the first vertex in the file, and how many there are.
    first: u64,
    vertices: u64,
    sorted: Vec<u64>,
}

impl Faces {
    /// `first` is the number of the file's first vertex.
    pub(crate) fn new(first: u64, vertices: u64) -> Self {
        Self { triangles: Vec::new(), polygons: 0, first, vertices, sorted: Vec::new() }
    }

    /// A face by its vertices as the file numbers them.
    pub(crate) fn push(&mut self, corners: &[u64], place: &dyn Fn() -> String) -> Result<()> {
        let refuse = |problem, remedy: &str| Err(Error::input(Some(place()), problem, remedy));
        let (first, last) = (self.first, self.first + self.vertices.saturating_sub(1));
        if let Some(bad) = corners.iter().find(|corner| !(first..=last).contains(corner)) {
            let problem = format!("there is no vertex {bad}, they count from {first} to {last}");
            return refuse(problem, "mend the face");
        }
        if let Some(vertex) = repeated(corners, &mut self.sorted) {
            let problem = format!("the face lists vertex {vertex} twice");
            return refuse(problem, "remove the face or the repeated vertex");
        }
        // In range by the check above, so nothing is cut off.
        let index = |corner: u64| (corner - first) as u32;
        if let [a, others @ ..] = corners {
            self.triangles.extend(others.windows(2).filter_map(|pair| match pair {
                [b, c] => Some([index(*a), index(*b), index(*c)]),
                _ => None,
            }));
        }
        self.polygons += u64::from(corners.len() > 3);
        Ok(())
    }

    /// What was changed.
    pub(crate) fn notes(&self) -> Option<String> {
        let count = self.polygons;
        (count > 0).then(|| format!("{count} faces with more than 3 vertices were split into triangles"))
    }
}
