//! OFF: text, one vertex or face a line, with whatever colours, normals and textures behind the positions.

use std::io;
use std::io::Write;

use glam::DVec3;

use super::text::{Faces, Lines, check_promise, cut_off, number, refuse_binary, shown, vertex, whole, words};
use super::write::write_number;
use super::{Loaded, check_counts};
use crate::mesh::attributes::{Attribute, Attributes, Kind, Role};
use crate::{Error, Result, TriMesh};

/// Whether `word` opens an OFF file: `OFF` after any of `ST`, `C`, `N`, `4` and `n`.
pub(crate) fn is_keyword(word: &str) -> bool {
    let Some(prefix) = word.strip_suffix("OFF") else { return false };
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
    let mut before_colour = None;
    if let Some(keyword) = str::from_utf8(first).ok().filter(|word| is_keyword(word)) {
        check_kind(keyword, line, &lines.place())?;
        // Normals stand before colours, and textures behind them.
        let coloured = keyword.contains('C') && !keyword.starts_with("ST");
        before_colour = coloured.then_some(if keyword.contains('N') { 3 } else { 0 });
        line = line.get(first.len()..).unwrap_or_default().trim_ascii();
        if line.is_empty() {
            line = lines.next().ok_or_else(|| ended(&lines, "there is no line with the counts"))?;
        }
    }
    refuse_binary(bytes, "give a text file")?;
    let mut counts = words(line).map_while(whole);
    let (Some(vertices), Some(faces)) = (counts.next(), counts.next()) else {
        let problem = format!("'{}' are no counts of vertices and faces", shown(line));
        return Err(Error::input(Some(lines.place()), problem, "write them as two or three whole numbers"));
    };
    check_counts(vertices, faces)?;
    // Three numbers of one digit; a count and one index.
    check_promise((vertices, "vertices"), 6, lines.left(), lines.place())?;
    check_promise((faces, "faces"), 4, lines.left(), lines.place())?;
    let mut colours = before_colour.map(Colours::after);
    let positions = read_vertices(vertices, &mut lines, &mut colours)?;
    let (faces, lesser) = read_faces(faces, vertices, &mut lines)?;
    let mut notes: Vec<String> = faces.notes().into_iter().collect();
    if lesser > 0 {
        notes.push(format!("{lesser} faces with fewer than 3 vertices were ignored"));
    }
    check_counts(vertices, faces.triangles.len() as u64)?;
    let vertex = colours.and_then(|colours| colours.attribute(&mut notes)).into_iter().collect();
    let attributes = Attributes { vertex, ..Attributes::default() };
    Ok(Loaded { mesh: TriMesh { vertices: positions, triangles: faces.triangles }, attributes, notes })
}

fn check_kind(keyword: &str, line: &[u8], place: &str) -> Result<()> {
    let refuse = |problem: &str, remedy: &str| Err(Error::input(Some(place.to_owned()), problem, remedy));
    if words(line).nth(1).is_some_and(|word| word.eq_ignore_ascii_case(b"BINARY")) {
        return refuse("binary OFF files are not supported", "write the mesh again as text");
    }
    if keyword.contains(['4', 'n']) {
        return refuse("this OFF file is not in three dimensions", "write the mesh again as plain OFF");
    }
    Ok(())
}

/// Colours behind the coordinates: of whole numbers to 255, or of fractions to 1.
struct Colours {
    before: usize,
    values: Vec<[f64; 4]>,
    components: usize,
    whole: bool,
}

impl Colours {
    fn after(before: usize) -> Self {
        Self { before, values: Vec::new(), components: 4, whole: true }
    }

    fn vertex<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>) {
        let mut colour = [1.0; 4];
        let mut count = 0;
        for (value, word) in colour.iter_mut().zip(words.skip(self.before).map_while(number)) {
            *value = word;
            self.whole &= Kind::U8.holds(word);
            count += 1;
        }
        self.components = self.components.min(count);
        self.values.push(colour);
    }

    fn attribute(self, notes: &mut Vec<String>) -> Option<Attribute> {
        if self.components < 3 {
            notes.push("colours were ignored, for not all vertices have one".to_owned());
            return None;
        }
        // Nothing above 1 may be either; fractions are what has a point.
        let kind = if self.whole { Kind::U8 } else { Kind::F64 };
        let values = self.values.iter().flat_map(|colour| colour.iter().take(self.components).copied());
        Some(Attribute::new("colour", Role::Colour, kind, self.components, values.collect()))
    }
}

fn read_vertices(count: u64, lines: &mut Lines, colours: &mut Option<Colours>) -> Result<Vec<DVec3>> {
    // `check_promise` has shown that the file is long enough for this many.
    let mut vertices = Vec::with_capacity(usize::try_from(count).unwrap_or(0));
    for index in 0..count {
        let line = lines.next();
        let line =
            line.ok_or_else(|| cut_off(lines.place(), &format!("vertex {index} of {count} is missing")))?;
        let mut words = words(line);
        vertices.push(vertex(&mut words, &|| format!("{}, vertex {index}", lines.place()))?);
        if let Some(colours) = colours {
            colours.vertex(words);
        }
    }
    Ok(vertices)
}

/// The faces, and how many were points or lines.
fn read_faces(count: u64, vertices: u64, lines: &mut Lines) -> Result<(Faces, u64)> {
    let mut faces = Faces::new(0, vertices);
    let (mut corners, mut lesser) = (Vec::new(), 0);
    for index in 0..count {
        let line = lines.next();
        let line =
            line.ok_or_else(|| cut_off(lines.place(), &format!("face {index} of {count} is missing")))?;
        let place = || format!("{}, face {index}", lines.place());
        let refuse = |problem: String| {
            Err(Error::input(Some(place()), problem, "mend the face or write the mesh again"))
        };
        let mut words = words(line);
        let first = words.next().unwrap_or_default();
        let Some(size) = whole(first) else {
            return refuse(format!("the number of vertices '{}' is not a whole number", shown(first)));
        };
        corners.clear();
        for _ in 0..size {
            let Some(word) = words.next() else {
                return refuse(format!("the face has {} of {size} vertices", corners.len()));
            };
            let Some(corner) = whole(word) else {
                return refuse(format!("the vertex index '{}' is not a whole number", shown(word)));
            };
            corners.push(corner);
        }
        if size < 3 {
            lesser += 1;
        } else {
            faces.push(&corners, &place)?;
        }
    }
    Ok((faces, lesser))
}

/// Writes a mesh, with the colours of its vertices where there are some.
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
                    // With a point, so that it is no whole number.
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
