//! OFF: text, one vertex or face per line, with colours, normals and texture coordinates after the positions.

use std::io;
use std::io::Write;

use glam::DVec3;

use super::checks::{check_declared_count, check_vertex_count, cut_off, excerpt_of_bytes, refuse_binary};
use super::loaded::Loaded;
use super::polygons::short_faces_note;
use super::text::{Faces, Lines, number, unsigned_integer, vertex, words, write_number};
use crate::mesh::attributes::{Attribute, Attributes, Kind, Role};
use crate::{Error, Result, TriMesh};

/// What MeshLab has before `OFF` for normals and colours.
const MESHLABS: [&str; 2] = ["NC", "NCST"];

/// Whether `word` opens an OFF file: `OFF` after any of `ST`, `C`, `N`, `4` and `n`.
pub(crate) fn is_keyword(word: &str) -> bool {
    let Some(prefix) = word.strip_suffix("OFF") else { return false };
    if MESHLABS.contains(&prefix) {
        return true;
    }
    let prefix = prefix.strip_prefix("ST").unwrap_or(prefix);
    let prefix = prefix.strip_prefix('C').unwrap_or(prefix);
    let prefix = prefix.strip_prefix('N').unwrap_or(prefix);
    let prefix = prefix.strip_prefix('4').unwrap_or(prefix);
    matches!(prefix, "" | "n")
}

pub(crate) fn parse(bytes: &[u8]) -> Result<Loaded> {
    let mut lines = Lines::new(bytes);
    let ended = |lines: &Lines, what: &str| cut_off(lines.place(), what);
    let mut line = lines.next().ok_or_else(|| ended(&lines, "there is nothing but comments"))?;
    let first = words(line).next().unwrap_or_default();
    let (mut colour_column, mut notes) = (None, Vec::new());
    if let Some(keyword) = str::from_utf8(first).ok().filter(|word| is_keyword(word)) {
        check_kind(keyword, line, &lines.place())?;
        // Normals come before colours, but not in MeshLab's files; texture coordinates after them.
        let coloured = keyword.contains('C') && !keyword.starts_with("ST");
        let has_normals_first = keyword.contains('N') && !keyword.starts_with("NC");
        colour_column = coloured.then_some(if has_normals_first { 3 } else { 0 });
        let lost = [("normals", keyword.contains('N')), ("texture coordinates", keyword.contains("ST"))];
        let lost = lost.into_iter().filter(|(_, is_there)| *is_there);
        notes.extend(lost.map(|(what, _)| format!("{what} of the vertices were ignored")));
        line = line.get(first.len()..).unwrap_or_default().trim_ascii();
        if line.is_empty() {
            line = lines.next().ok_or_else(|| ended(&lines, "there is no line with the counts"))?;
        }
    }
    refuse_binary(bytes, "give a text file")?;
    let mut counts = words(line).map_while(unsigned_integer);
    let (Some(vertices), Some(faces)) = (counts.next(), counts.next()) else {
        let problem =
            format!("'{}' is not a line of the counts of vertices and faces", excerpt_of_bytes(line));
        return Err(Error::input(Some(lines.place()), problem, "write two or three whole numbers"));
    };
    check_vertex_count(vertices)?;
    // A vertex has at least three one-digit numbers, a face a count and one index, each with a separator.
    check_declared_count(vertices, ["vertex", "vertices"], 6, lines.bytes_left(), lines.place())?;
    check_declared_count(faces, ["face", "faces"], 4, lines.bytes_left(), lines.place())?;
    let mut colours = colour_column.map(Colours::from_column);
    let positions = read_vertices(vertices, &mut lines, &mut colours)?;
    let (faces, skipped) = read_faces(faces, vertices, &mut lines)?;
    notes.extend(faces.fans.note());
    notes.extend(short_faces_note(skipped));
    let vertex = colours.and_then(|colours| colours.into_attribute(&mut notes)).into_iter().collect();
    let attributes = Attributes { vertex, ..Attributes::default() };
    Ok(Loaded { mesh: faces.into_mesh(positions), attributes, notes, ..Loaded::default() })
}

/// Refuses binary files and those of other dimensions than three.
fn check_kind(keyword: &str, line: &[u8], place: &str) -> Result<()> {
    let refuse = |problem: &str, remedy: &str| Err(Error::input(Some(place.to_owned()), problem, remedy));
    if words(line).nth(1).is_some_and(|word| word.eq_ignore_ascii_case(b"BINARY")) {
        return refuse("binary OFF files are not supported", "export the mesh again as text");
    }
    if keyword.contains(['4', 'n']) {
        return refuse("this OFF file is not in three dimensions", "export the mesh again as plain OFF");
    }
    Ok(())
}

/// Vertex colours after the coordinates: integers up to 255, or fractions up to 1.
struct Colours {
    /// Numbers between the coordinates and the colour.
    column: usize,
    values: Vec<[f64; 4]>,
    components: usize,
    all_integers: bool,
}

impl Colours {
    fn from_column(column: usize) -> Self {
        Self { column, values: Vec::new(), components: 4, all_integers: true }
    }

    fn read_vertex<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>) {
        let mut colour = [1.0; 4];
        let mut count = 0;
        for (value, word) in colour.iter_mut().zip(words.skip(self.column).map_while(number)) {
            *value = word;
            self.all_integers &= Kind::U8.holds(word);
            count += 1;
        }
        self.components = self.components.min(count);
        self.values.push(colour);
    }

    fn into_attribute(self, notes: &mut Vec<String>) -> Option<Attribute> {
        if self.components < 3 {
            notes.push("colours were ignored: not all vertices have one".to_owned());
            return None;
        }
        // Values up to 1 could be either; a decimal point makes them fractions.
        let kind = if self.all_integers { Kind::U8 } else { Kind::F64 };
        let values = self.values.iter().flat_map(|colour| colour.iter().take(self.components).copied());
        Some(Attribute::new("colour", Role::Colour, kind, self.components, values.collect()))
    }
}

fn read_vertices(count: u64, lines: &mut Lines, colours: &mut Option<Colours>) -> Result<Vec<DVec3>> {
    // `check_declared_count` has shown that the file is long enough for this many.
    let mut vertices = Vec::with_capacity(usize::try_from(count).unwrap_or(0));
    for index in 0..count {
        let line = lines.next();
        let line =
            line.ok_or_else(|| cut_off(lines.place(), &format!("vertex {index} of {count} is missing")))?;
        let mut words = words(line);
        vertices.push(vertex(&mut words, &|| format!("{}, vertex {index}", lines.place()))?);
        if let Some(colours) = colours {
            colours.read_vertex(words);
        }
    }
    Ok(vertices)
}

/// The faces, and how many were skipped as points or lines.
fn read_faces(count: u64, vertices: u64, lines: &mut Lines) -> Result<(Faces, u64)> {
    let mut faces = Faces::new(0, vertices);
    let (mut corners, mut skipped) = (Vec::new(), 0);
    for index in 0..count {
        let line = lines.next();
        let line =
            line.ok_or_else(|| cut_off(lines.place(), &format!("face {index} of {count} is missing")))?;
        let place = || format!("{}, face {index}", lines.place());
        let refuse = |problem: String| {
            Err(Error::input(Some(place()), problem, "repair the face, or export the mesh again"))
        };
        let mut words = words(line);
        let first = words.next().unwrap_or_default();
        let Some(size) = unsigned_integer(first) else {
            return refuse(format!(
                "the number of vertices '{}' is not a whole number",
                excerpt_of_bytes(first)
            ));
        };
        corners.clear();
        for _ in 0..size {
            let Some(word) = words.next() else {
                return refuse(format!("the face has {} of {size} vertices", corners.len()));
            };
            let Some(corner) = unsigned_integer(word) else {
                return refuse(format!(
                    "the vertex index '{}' is not a whole number",
                    excerpt_of_bytes(word)
                ));
            };
            corners.push(corner);
        }
        if size < 3 {
            skipped += 1;
        } else {
            faces.push(&corners, &place)?;
        }
    }
    Ok((faces, skipped))
}

/// Writes a mesh with the colours of its vertices, if it has them.
pub(crate) fn write(file: &mut dyn Write, mesh: &TriMesh, attributes: &Attributes) -> io::Result<()> {
    let colour = attributes.vertex_role(Role::Colour).filter(|colour| colour.components >= 3);
    let keyword = if colour.is_some() { "COFF" } else { "OFF" };
    writeln!(file, "{keyword}\n{} {} 0", mesh.vertices.len(), mesh.triangles.len())?;
    for (v, vertex) in mesh.vertices.iter().enumerate() {
        for (value, end) in vertex.to_array().into_iter().zip([" ", " ", ""]) {
            write_number(file, value)?;
            file.write_all(end.as_bytes())?;
        }
        if let Some(colour) = colour {
            let shades = colour.unit_colour(v);
            for (value, shade) in colour.at(v).iter().zip(shades) {
                match colour.kind {
                    Kind::U8 => write!(file, " {value}")?,
                    // Debug formatting writes a decimal point even for whole numbers.
                    _ => write!(file, " {shade:?}")?,
                }
            }
        }
        writeln!(file)?;
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(file, "3 {a} {b} {c}")?;
    }
    Ok(())
}
