//! Wavefront OBJ, through `tobj`.
//!
//! `tobj` gives neither line numbers nor vertices shared between groups, and it refuses or misreads things that
//! occur in practice (comments after a face, continued lines, colours with alpha). A scan therefore goes before it:
//! it checks every line that matters, so that errors name the line, and hands on the plain `v` and `f` lines alone.

pub(crate) mod attributes;
pub(crate) mod lines;

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fmt::Write as _;

use glam::DVec3;

use super::{Loaded, check_counts, excerpt, repeated, text};
use crate::{Error, Result, TriMesh};
use attributes::Extras;

pub(crate) fn parse(bytes: &[u8]) -> Result<Loaded> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    text::refuse_binary(bytes, "give an OBJ text file, or a binary format by its own name")?;
    // Names and comments may be in any encoding; numbers and keywords are ASCII either way.
    let text = String::from_utf8_lossy(bytes);
    let mut scan = Scan { plain: String::with_capacity(text.len()), ..Scan::default() };
    for (line, content) in logical_lines(&text) {
        scan.line(line, &content)?;
    }
    scan.check()?;
    let mesh = triangles_of(&scan.plain)?;
    let mut notes = scan.notes();
    let unused = scan.vertices - mesh.vertices.len() as u64;
    if unused > 0 {
        notes.push(format!("{unused} vertices are used by no face and were left out"));
    }
    let attributes = scan.extras.attributes(&mesh, &mut notes);
    Ok(Loaded { mesh, attributes, notes })
}

/// Lines without comments, those ending in a backslash joined, each with the number of its first line from 1.
pub(crate) fn logical_lines(text: &str) -> impl Iterator<Item = (u64, Cow<'_, str>)> {
    let mut lines = (1..).zip(text.lines());
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let mut joined = Cow::Borrowed(without_comment(first));
        while joined.ends_with('\\') {
            // Grown in place: a file may be one line in a million pieces.
            let longer = joined.to_mut();
            longer.pop();
            longer.push(' ');
            longer.push_str(lines.next().map_or("", |(_, next)| without_comment(next)));
        }
        Some((number, joined))
    })
}

fn without_comment(line: &str) -> &str {
    line.split('#').next().unwrap_or(line).trim_end()
}

pub(crate) fn at_line(line: u64) -> Option<String> {
    Some(format!("line {line}"))
}

/// What the scan has seen so far. Of the mesh it keeps only the lines for `tobj`.
#[derive(Default)]
struct Scan {
    plain: String,
    vertices: u64,
    faces: u64,
    polygons: u64,
    points_and_lines: u64,
    extras: Extras,
    unknown: BTreeSet<String>,
    /// Vertex numbers (from 1) that were not yet defined where a face used them, rising, with the line: a later `v`
    /// may still define them.
    awaited: Vec<(u64, u64)>,
    corners: Vec<u64>,
    sorted: Vec<u64>,
}

impl Scan {
    fn line(&mut self, line: u64, content: &str) -> Result<()> {
        let mut words = content.split_whitespace();
        let Some(keyword) = words.next() else { return Ok(()) };
        match keyword {
            "v" => self.vertex(line, words)?,
            "f" | "fo" => self.face(line, words)?,
            "p" | "l" => self.points_and_lines += 1,
            "s" | "mg" | "maplib" | "usemap" => {}
            _ if self.extras.line(keyword, words.by_ref()) => {}
            // Enough of them to tell what kind of file this is.
            other if self.unknown.len() < 5 => {
                self.unknown.insert(excerpt(other));
            }
            _ => {}
        }
        Ok(())
    }

    fn vertex<'a>(&mut self, line: u64, mut words: impl Iterator<Item = &'a str>) -> Result<()> {
        self.plain.push('v');
        for axis in ["x", "y", "z"] {
            let Some(word) = words.next() else {
                let problem = format!("the vertex has no {axis} coordinate");
                return Err(Error::input(at_line(line), problem, "give each vertex three coordinates"));
            };
            let Ok(value) = word.parse::<f64>() else {
                let problem = format!("the {axis} coordinate '{}' is not a number", excerpt(word));
                return Err(Error::input(at_line(line), problem, "write plain decimal numbers"));
            };
            if !value.is_finite() {
                let problem = format!("the {axis} coordinate '{}' is not finite", excerpt(word));
                return Err(Error::input(at_line(line), problem, "remove or mend the vertex"));
            }
            self.plain.push(' ');
            self.plain.push_str(word);
        }
        self.plain.push('\n');
        self.extras.vertex(words);
        self.vertices += 1;
        Ok(())
    }

    fn face<'a>(&mut self, line: u64, words: impl Iterator<Item = &'a str>) -> Result<()> {
        self.corners.clear();
        for word in words {
            let corner = self.corner(line, word)?;
            self.corners.push(corner);
            self.extras.corner(corner, word);
        }
        let count = self.corners.len();
        if count < 3 {
            let problem = format!("the face has {count} of at least 3 vertices");
            return Err(Error::input(at_line(line), problem, "remove the face"));
        }
        if let Some(vertex) = repeated(&self.corners, &mut self.sorted) {
            let problem = format!("the face lists vertex {vertex} twice");
            return Err(Error::input(at_line(line), problem, "remove the face or the repeated vertex"));
        }
        self.extras.end_face();
        self.plain.push('f');
        for corner in &self.corners {
            // Writing to a String cannot fail.
            let _ = write!(self.plain, " {corner}");
        }
        self.plain.push('\n');
        self.faces += 1;
        self.polygons += u64::from(count > 3);
        Ok(())
    }

    /// The vertex number from 1 that `word`, "7", "-2" or "7/1/3", stands for.
    fn corner(&mut self, line: u64, word: &str) -> Result<u64> {
        let index = word.split('/').next().unwrap_or(word);
        let Ok(index) = index.parse::<i64>() else {
            let problem = format!("the vertex index '{}' is not a whole number", excerpt(word));
            return Err(Error::input(at_line(line), problem, "write indices as 1, -1 or 1/1/1"));
        };
        if let Ok(number @ 1..) = u64::try_from(index) {
            let highest = self.awaited.last().map_or(self.vertices, |(known, _)| *known);
            if number > highest.max(self.vertices) {
                self.awaited.push((number, line));
            }
            return Ok(number);
        }
        let backwards = index.unsigned_abs();
        if (1..=self.vertices).contains(&backwards) {
            return Ok(self.vertices - backwards + 1);
        }
        let problem = format!("there is no vertex {index} (vertices above this line: {})", self.vertices);
        Err(Error::input(at_line(line), problem, "indices count from 1, or back from -1; mend the face"))
    }

    fn check(&self) -> Result<()> {
        check_counts(self.vertices, self.faces)?;
        if let Some((number, line)) = self.awaited.iter().find(|(number, _)| *number > self.vertices) {
            let problem = format!("there is no vertex {number}, the file has {}", self.vertices);
            return Err(Error::input(at_line(*line), problem, "mend the face, or check for a cut-off file"));
        }
        Ok(())
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.polygons > 0 {
            notes
                .push(format!("{} faces with more than 3 vertices were split into triangles", self.polygons));
        }
        if self.points_and_lines > 0 {
            notes.push(format!("{} point and line elements were ignored", self.points_and_lines));
        }
        if !self.unknown.is_empty() {
            let kinds: Vec<&str> = self.unknown.iter().map(String::as_str).collect();
            notes.push(format!("lines of these kinds were ignored: {}", kinds.join(", ")));
        }
        notes
    }
}

fn triangles_of(plain: &str) -> Result<TriMesh> {
    let options = tobj::LoadOptions { triangulate: true, ..tobj::LoadOptions::default() };
    let no_materials = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
    let refused = |error: tobj::LoadError| {
        Error::input(None, format!("the OBJ file cannot be read ({error})"), "write the mesh again")
            .caused_by(error)
    };
    let (models, _) = tobj::load_obj_buf(&mut plain.as_bytes(), &options, no_materials).map_err(refused)?;
    let mut mesh = TriMesh::default();
    // Without group and material lines there is one model, so vertices are shared as in the file.
    if let [model] = models.as_slice() {
        let (positions, _) = model.mesh.positions.as_chunks::<3>();
        let (triangles, _) = model.mesh.indices.as_chunks::<3>();
        mesh.vertices = positions.iter().copied().map(DVec3::from_array).collect();
        mesh.triangles = triangles.to_vec();
    }
    Ok(mesh)
}
