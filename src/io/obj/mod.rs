//! Wavefront OBJ, read with `tobj`.
//!
//! `tobj` gives neither line numbers nor vertices shared between groups, and it refuses or misreads things
//! that occur in practice (comments after a face, continued lines, colours with alpha). Every line is
//! therefore checked here first, so that errors name the line, and `tobj` gets plain `v` and `f` lines only.

pub(crate) mod attributes;
pub(crate) mod feature_lines;
mod logical_lines;
pub(crate) mod materials;
pub(crate) mod write;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

use glam::DVec3;

use super::checks::{check_counts, check_vertex_count, excerpt, refuse_binary};
use super::loaded::Loaded;
use super::references::References;
use crate::grammar::counted;
use crate::io::polygons::{Fans, short_faces_note};
use crate::io::text::number;
use crate::{Error, Result, TriMesh};
use attributes::AttributeReader;
use logical_lines::{at_line, logical_lines};

/// `references` reads material libraries and their pictures, if asked for.
pub(crate) fn parse(bytes: &[u8], references: &References, with_materials: bool) -> Result<Loaded> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    refuse_binary(bytes, "give an OBJ text file, or use the extension of the binary format")?;
    // Names and comments may be in any encoding; numbers and keywords are ASCII either way.
    let text = String::from_utf8_lossy(bytes);
    let mut scan = Scan { plain: String::with_capacity(text.len()), ..Scan::default() };
    for (line, content) in logical_lines(&text) {
        scan.read_line(line, &content)?;
    }
    scan.check()?;
    let mut mesh = if scan.faces == 0 { points(&scan.plain) } else { read_with_tobj(&scan.plain)? };
    let mut notes = scan.notes();
    let unused = scan.vertices - mesh.vertices.len() as u64;
    if unused > 0 {
        let vertices = ["vertex that no face uses was", "vertices that no face uses were"];
        notes.push(format!("{} left out", counted(unused, vertices)));
    }
    let mut attributes = scan.attributes.into_attributes(&mesh, &mut notes);
    scan.fans.unfold(&mut mesh, attributes.uv.as_mut());
    let mut loaded = Loaded { mesh, attributes, notes, ..Loaded::default() };
    if !loaded.attributes.libraries.is_empty() {
        loaded.attributes.library_folder = references.folder().map(Path::to_owned);
    }
    if with_materials {
        materials::add_materials(references, &mut loaded)?;
    }
    Ok(loaded)
}

/// The checked lines so far: those for `tobj` as text, all else counted or passed to the attributes.
#[derive(Default)]
struct Scan {
    plain: String,
    vertices: u64,
    faces: u64,
    triangles: usize,
    fans: Fans,
    short_faces: u64,
    points_and_lines: u64,
    attributes: AttributeReader,
    unknown_keywords: BTreeSet<String>,
    /// Vertex numbers from 1 in ascending order, each with the first line that uses it before its definition,
    /// which may still follow.
    undefined: Vec<(u64, u64)>,
    corners: Vec<u64>,
}

impl Scan {
    fn read_line(&mut self, line: u64, content: &str) -> Result<()> {
        let mut words = content.split_whitespace();
        let Some(keyword) = words.next() else { return Ok(()) };
        match keyword {
            "v" => self.read_vertex(line, words)?,
            "f" | "fo" => self.read_face(line, words)?,
            "p" | "l" => self.points_and_lines += 1,
            "s" | "mg" | "maplib" | "usemap" => {}
            _ if self.attributes.read_line(keyword, words.by_ref()) => {}
            // Enough for the note.
            other if self.unknown_keywords.len() < 5 => {
                self.unknown_keywords.insert(excerpt(other));
            }
            _ => {}
        }
        Ok(())
    }

    fn read_vertex<'a>(&mut self, line: u64, mut words: impl Iterator<Item = &'a str>) -> Result<()> {
        self.plain.push('v');
        for axis in ["x", "y", "z"] {
            let Some(word) = words.next() else {
                let problem = format!("the vertex has no {axis} coordinate");
                return Err(Error::input(at_line(line), problem, "give each vertex three coordinates"));
            };
            let Some(value) = number(word.as_bytes()) else {
                let problem = format!("the {axis} coordinate '{}' is not a number", excerpt(word));
                return Err(Error::input(at_line(line), problem, "write plain decimal numbers"));
            };
            self.plain.push(' ');
            self.plain.push_str(if value.is_nan() { "nan" } else { word });
        }
        self.plain.push('\n');
        self.attributes.read_vertex(words);
        self.vertices += 1;
        Ok(())
    }

    fn read_face<'a>(&mut self, line: u64, words: impl Iterator<Item = &'a str>) -> Result<()> {
        self.corners.clear();
        for word in words {
            let corner = self.corner(line, word)?;
            self.corners.push(corner);
            self.attributes.add_corner(corner, word);
        }
        let count = self.corners.len();
        if count < 3 {
            self.short_faces += 1;
            self.attributes.skip_face();
            return Ok(());
        }
        self.attributes.end_face();
        self.plain.push('f');
        for corner in &self.corners {
            // Writing to a String cannot fail.
            let _ = write!(self.plain, " {corner}");
        }
        self.plain.push('\n');
        self.faces += 1;
        self.fans.add(self.triangles, count);
        self.triangles += count - 2;
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
            let highest = self.undefined.last().map_or(self.vertices, |(known, _)| *known);
            if number > highest.max(self.vertices) {
                self.undefined.push((number, line));
            }
            return Ok(number);
        }
        let backwards = index.unsigned_abs();
        if (1..=self.vertices).contains(&backwards) {
            return Ok(self.vertices - backwards + 1);
        }
        let problem = format!("there is no vertex {index} (vertices above this line: {})", self.vertices);
        Err(Error::input(at_line(line), problem, "indices count from 1, or back from -1; repair the face"))
    }

    /// Checks what only the whole file shows.
    fn check(&self) -> Result<()> {
        // Nothing but vertices are points.
        if self.points_and_lines == 0 && self.short_faces == 0 {
            check_vertex_count(self.vertices)?;
        } else {
            check_counts(self.vertices, self.faces)?;
        }
        if let Some((number, line)) = self.undefined.iter().find(|(number, _)| *number > self.vertices) {
            let problem = format!("there is no vertex {number}, the file has {}", self.vertices);
            return Err(Error::input(
                at_line(*line),
                problem,
                "repair the face, or check for a cut-off file",
            ));
        }
        Ok(())
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        notes.extend(self.fans.note());
        notes.extend(short_faces_note(self.short_faces));
        if self.points_and_lines > 0 {
            let elements = ["point or line element was", "point and line elements were"];
            notes.push(format!("{} ignored", counted(self.points_and_lines, elements)));
        }
        if !self.unknown_keywords.is_empty() {
            let kinds: Vec<&str> = self.unknown_keywords.iter().map(String::as_str).collect();
            notes.push(format!("lines with these keywords were ignored: {}", kinds.join(", ")));
        }
        notes
    }
}

/// The points of plain `v` lines, all of which are numbers.
fn points(plain: &str) -> TriMesh {
    let point = |line: &str| {
        let mut numbers = line.split(' ').skip(1).map(|word| word.parse().unwrap_or(f64::NAN));
        DVec3::from_array(std::array::from_fn(|_| numbers.next().unwrap_or(f64::NAN)))
    };
    TriMesh { vertices: plain.lines().map(point).collect(), triangles: Vec::new() }
}

/// The mesh of plain `v` and `f` lines.
fn read_with_tobj(plain: &str) -> Result<TriMesh> {
    let options = tobj::LoadOptions { triangulate: true, ..tobj::LoadOptions::default() };
    let no_materials = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
    let refused = |error: tobj::LoadError| {
        Error::input(None, format!("the OBJ file cannot be read ({error})"), "export the mesh again")
            .caused_by(error)
    };
    let (models, _) = tobj::load_obj_buf(&mut plain.as_bytes(), &options, no_materials).map_err(refused)?;
    let mut mesh = TriMesh::default();
    // Without group and material lines there is only one model, so vertices are shared as in the file.
    if let [model] = models.as_slice() {
        let (positions, _) = model.mesh.positions.as_chunks::<3>();
        let (triangles, _) = model.mesh.indices.as_chunks::<3>();
        mesh.vertices = positions.iter().copied().map(DVec3::from_array).collect();
        mesh.triangles = triangles.to_vec();
    }
    Ok(mesh)
}
