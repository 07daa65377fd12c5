//! What the text formats share: lines, words, numbers, vertices, and faces that are checked and triangulated.

use std::io;
use std::io::Write;

use glam::DVec3;

use super::checks::excerpt_of_bytes;
use super::polygons::Fans;
use crate::{Error, Result, TriMesh};

/// The lines that are not empty, without comments, which begin with `#` at the start of a word; line ends are
/// LF, CR or both.
#[derive(Clone)]
pub(crate) struct Lines<'a> {
    rest: &'a [u8],
    /// The number of the line returned last, from 1.
    pub(crate) number: u64,
    /// Whether comments are left in.
    keeps_comments: bool,
}

impl<'a> Lines<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        let rest = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        Self { rest, number: 0, keeps_comments: false }
    }

    /// With comments, or of a format without them.
    pub(crate) fn with_comments(bytes: &'a [u8]) -> Self {
        Self { keeps_comments: true, ..Self::new(bytes) }
    }

    /// Bytes not yet read, counting a line end for the last line, which need not have one.
    pub(crate) fn bytes_left(&self) -> u64 {
        self.rest.len() as u64 + 1
    }

    /// Where the line returned last is, for error messages.
    pub(crate) fn place(&self) -> String {
        format!("line {}", self.number)
    }

    /// The next line, even if empty or a comment.
    fn any_line(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let is_end = |byte: &u8| matches!(byte, b'\n' | b'\r');
        let length = self.rest.iter().position(is_end).unwrap_or(self.rest.len());
        let (line, rest) = self.rest.split_at(length);
        // CR LF is one line end, and so is each of them alone.
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
            let content = if self.keeps_comments { line } else { without_comment(line) }.trim_ascii();
            if !content.is_empty() {
                return Some(content);
            }
        }
    }
}

/// The line up to a `#` at the start of a word.
pub(crate) fn without_comment(line: &[u8]) -> &[u8] {
    let begins =
        |at: &usize| line[*at] == b'#' && (*at == 0 || line.get(at - 1).is_some_and(u8::is_ascii_whitespace));
    let length = (0..line.len()).find(begins).unwrap_or(line.len());
    &line[..length]
}

/// The words of a line.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> + Clone {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// A decimal number, or what programs write for one that is none: "nan", "-nan(ind)", "1.#QNAN".
pub(crate) fn number(word: &[u8]) -> Option<f64> {
    let word = str::from_utf8(word).ok()?;
    let is_none = || {
        let word = word.trim_start_matches(['-', '+']);
        word.starts_with("1.#") || word.get(..4).is_some_and(|start| start.eq_ignore_ascii_case("nan("))
    };
    word.parse().ok().or_else(|| is_none().then_some(f64::NAN))
}

/// A count or an index: digits only.
pub(crate) fn unsigned_integer(word: &[u8]) -> Option<u64> {
    str::from_utf8(word).ok()?.parse().ok()
}

/// Three coordinates from the next words; `place` is for the error message.
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
            Some(value) => value,
            None => {
                let problem = format!("the {axis} coordinate '{}' is not a number", excerpt_of_bytes(word));
                return refuse(problem, "write plain decimal numbers");
            }
        };
    }
    Ok(DVec3::from_array(position))
}

/// Refuses corners that are none of so many vertices, of which the file counts the first as `first`.
pub(crate) fn check_corners(
    corners: &[u64],
    first: u64,
    vertices: u64,
    place: &dyn Fn() -> String,
) -> Result<()> {
    let last = first + vertices.saturating_sub(1);
    let Some(bad) = corners.iter().find(|corner| !(first..=last).contains(corner)) else { return Ok(()) };
    let problem = format!("there is no vertex {bad}, indices go from {first} to {last}");
    Err(Error::input(Some(place()), problem, "repair the face"))
}

/// Faces that are checked and split into triangles as they are read.
pub(crate) struct Faces {
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Faces with more than three corners.
    pub(crate) fans: Fans,
    /// The file's index of the first vertex: 0 or 1.
    first: u64,
    vertices: u64,
}

impl Faces {
    /// `first` is the file's index of the first vertex.
    pub(crate) fn new(first: u64, vertices: u64) -> Self {
        Self { triangles: Vec::new(), fans: Fans::default(), first, vertices }
    }

    /// Removes all faces.
    pub(crate) fn clear(&mut self) {
        self.triangles.clear();
        self.fans.clear();
    }

    /// Adds the face with these corners, by the file's indices.
    pub(crate) fn push(&mut self, corners: &[u64], place: &dyn Fn() -> String) -> Result<()> {
        let first = self.first;
        check_corners(corners, first, self.vertices, place)?;
        self.fans.add(self.triangles.len(), corners.len());
        // In range, as checked above.
        let index = |corner: u64| (corner - first) as u32;
        self.triangles.extend(Fans::triangles(corners).map(|triangle| triangle.map(index)));
        Ok(())
    }

    /// The mesh with these vertices, in the file's order.
    pub(crate) fn into_mesh(self, vertices: Vec<DVec3>) -> TriMesh {
        let mut mesh = TriMesh { vertices, triangles: self.triangles };
        self.fans.unfold(&mut mesh, None);
        mesh
    }
}

/// Writes a number in the shortest form that reads back the same.
pub(crate) fn write_number(file: &mut (impl Write + ?Sized), value: f64) -> io::Result<()> {
    // Both forms have the fewest significant digits; the plain one has up to 300 zeros at the extremes.
    if value == 0.0 || (1e-5..1e16).contains(&value.abs()) {
        write!(file, "{value}")
    } else {
        write!(file, "{value:e}")
    }
}
