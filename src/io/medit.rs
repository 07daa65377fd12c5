//! MEDIT's text format `.mesh`: reads vertices, triangles and quadrilaterals, and skips all other sections.

use std::collections::BTreeSet;
use std::io;
use std::io::Write;

use glam::DVec3;

use super::checks::{check_counts, check_declared_count, cut_off, excerpt_of_bytes, refuse_binary};
use super::loaded::Loaded;
use super::text::{Faces, Lines, number, unsigned_integer, vertex, write_number};
use crate::mesh::attributes::{Attribute, Attributes, Kind, Role};
use crate::{Error, Result, TriMesh};

/// The name of the attribute with which every vertex and face ends.
pub(crate) const REFERENCE: &str = "reference";

/// The words of all lines.
#[derive(Clone)]
struct Words<'a> {
    lines: Lines<'a>,
    line: &'a [u8],
}

impl<'a> Words<'a> {
    fn bytes_left(&self) -> u64 {
        self.lines.bytes_left() + self.line.len() as u64
    }

    fn place(&self) -> String {
        self.lines.place()
    }
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let mut line = self.line.trim_ascii_start();
        if line.is_empty() {
            line = self.lines.next()?;
        }
        let length = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (word, rest) = line.split_at(length);
        self.line = rest;
        Some(word)
    }
}

/// A section: how many entries it declares, and the words from the first entry on.
struct Section<'a> {
    count: u64,
    place: String,
    words: Words<'a>,
}

/// The sections that are read.
#[derive(Default)]
struct Sections<'a> {
    vertices: Option<Section<'a>>,
    triangles: Option<Section<'a>>,
    quadrilaterals: Option<Section<'a>>,
    has_end: bool,
    ignored: BTreeSet<String>,
}

pub(crate) fn parse(bytes: &[u8]) -> Result<Loaded> {
    refuse_binary(bytes, "give a text file; binary .meshb files are not supported")?;
    let sections = find_sections(Words { lines: Lines::new(bytes), line: &[] })?;
    let count = |section: &Option<Section>| section.as_ref().map_or(0, |section| section.count);
    let vertex_count = count(&sections.vertices);
    let face_count = count(&sections.triangles).saturating_add(count(&sections.quadrilaterals));
    check_counts(vertex_count, face_count)?;
    let (vertices, vertex_references) = sections.vertices.map(read_vertices).transpose()?.unwrap_or_default();
    let mut faces = Faces::new(1, vertex_count);
    let mut face_references = Vec::new();
    for (section, corners, name) in
        [(sections.triangles, 3, "triangle"), (sections.quadrilaterals, 4, "quadrilateral")]
    {
        if let Some(section) = section {
            read_faces(section, corners, name, &mut faces, &mut face_references)?;
        }
    }
    let mut notes: Vec<String> = faces.fans.note().into_iter().collect();
    if !sections.has_end {
        notes.push("the file does not end with 'End'; sections may be missing".to_owned());
    }
    if !sections.ignored.is_empty() {
        let names: Vec<&str> = sections.ignored.iter().map(String::as_str).collect();
        notes.push(format!("these sections were ignored: {}", names.join(", ")));
    }
    let mut out_of_range = false;
    let mut attribute = |values: Vec<f64>| {
        let fits = values.iter().all(|value| Kind::I32.holds(*value));
        out_of_range |= !fits;
        // Zeros only are the default.
        let is_set = fits && values.iter().any(|value| *value != 0.0);
        is_set.then(|| Attribute::new(REFERENCE, Role::Label, Kind::I32, 1, values)).into_iter().collect()
    };
    let attributes = Attributes {
        vertex: attribute(vertex_references),
        face: attribute(face_references),
        ..Attributes::default()
    };
    if out_of_range {
        notes.push("references were ignored: some are not 32-bit integers".to_owned());
    }
    Ok(Loaded { mesh: faces.into_mesh(vertices), attributes, notes, ..Loaded::default() })
}

fn find_sections(mut words: Words) -> Result<Sections> {
    let mut found = Sections::default();
    while let Some(word) = words.next() {
        if !word.first().is_some_and(u8::is_ascii_alphabetic) || number(word).is_some() {
            continue;
        }
        let keyword = excerpt_of_bytes(word).to_ascii_lowercase();
        let place = words.place();
        let refuse = |problem: String, remedy: &str| Err(Error::input(Some(place.clone()), problem, remedy));
        let slot = match keyword.as_str() {
            "meshversionformatted" => continue,
            "end" => {
                found.has_end = true;
                break;
            }
            "dimension" => match words.next().and_then(unsigned_integer) {
                Some(3) => continue,
                _ => {
                    return refuse(
                        "the mesh is not in three dimensions".to_owned(),
                        "write it with 'Dimension 3'",
                    );
                }
            },
            "vertices" => &mut found.vertices,
            "triangles" => &mut found.triangles,
            "quadrilaterals" => &mut found.quadrilaterals,
            // Enough for the note.
            _ if found.ignored.len() < 8 => {
                found.ignored.insert(excerpt_of_bytes(word));
                continue;
            }
            _ => continue,
        };
        let count_word = words.next().unwrap_or_default();
        let Some(count) = unsigned_integer(count_word) else {
            let problem = format!(
                "the count '{}' after '{keyword}' is not a whole number",
                excerpt_of_bytes(count_word)
            );
            return refuse(problem, "repair the file, or export the mesh again");
        };
        if slot.is_some() {
            return refuse(format!("there is a second section '{keyword}'"), "join the sections");
        }
        *slot = Some(Section { count, place, words: words.clone() });
    }
    Ok(found)
}

/// The positions and references of all vertices.
fn read_vertices(section: Section) -> Result<(Vec<DVec3>, Vec<f64>)> {
    let Section { count, place, mut words } = section;
    check_declared_count(count, ["vertex", "vertices"], 8, words.bytes_left(), place)?;
    // `check_declared_count` has shown that the file is long enough for this many.
    let mut vertices = Vec::with_capacity(usize::try_from(count).unwrap_or(0));
    let mut references = Vec::with_capacity(vertices.capacity());
    for index in 1..=count {
        // Errors name the line of the vertex's first word.
        let mut next = words.clone();
        if next.next().is_none() {
            return Err(cut_off(words.place(), &format!("vertex {index} of {count} is missing")));
        }
        vertices.push(vertex(&mut words, &|| format!("{}, vertex {index}", next.place()))?);
        references.push(reference(&mut words, "vertex", index)?);
    }
    Ok((vertices, references))
}

fn read_faces(
    section: Section,
    corners: usize,
    name: &str,
    faces: &mut Faces,
    references: &mut Vec<f64>,
) -> Result<()> {
    let Section { count, place, mut words } = section;
    let noun = [name, &format!("{name}s")];
    check_declared_count(count, noun, 2 * (corners as u64 + 1), words.bytes_left(), place)?;
    let mut face = Vec::with_capacity(corners);
    for index in 1..=count {
        face.clear();
        for _ in 0..corners {
            let Some(word) = words.next() else {
                return Err(cut_off(words.place(), &format!("{name} {index} of {count} is missing")));
            };
            let Some(corner) = unsigned_integer(word) else {
                let place = format!("{}, {name} {index}", words.place());
                let problem = format!("the vertex index '{}' is not a whole number", excerpt_of_bytes(word));
                return Err(Error::input(Some(place), problem, "repair the face, or export the mesh again"));
            };
            face.push(corner);
        }
        faces.push(&face, &|| format!("{}, {name} {index}", words.place()))?;
        let face_reference = reference(&mut words, name, index)?;
        references.resize(faces.triangles.len(), face_reference);
    }
    Ok(())
}

/// The reference at the end of an entry.
fn reference(words: &mut Words, name: &str, index: u64) -> Result<f64> {
    if let Some(reference) = words.next().and_then(number) {
        return Ok(reference);
    }
    let place = Some(format!("{}, {name} {index}", words.place()));
    let problem = format!("the {name} has no reference number at its end");
    Err(Error::input(place, problem, "write a 0 there, or the mesh again"))
}

/// The face attribute that is written as MEDIT's references: the one of that name, or else the first label.
pub(crate) fn face_label(attributes: &Attributes) -> Option<&Attribute> {
    let first = || attributes.face.iter().find(|a| a.role == Role::Label && a.components == 1);
    attributes.face_named(REFERENCE).or_else(first)
}

/// Writes a mesh with its references, or zeros.
pub(crate) fn write(file: &mut dyn Write, mesh: &TriMesh, attributes: &Attributes) -> io::Result<()> {
    let vertex_reference = attributes.vertex.iter().find(|attribute| attribute.name == REFERENCE);
    let triangle_reference = face_label(attributes);
    let reference = |attribute: Option<&Attribute>, index: usize| {
        attribute.and_then(|a| a.at(index).first()).map_or(0, |value| *value as i64)
    };
    writeln!(file, "MeshVersionFormatted 2\n\nDimension 3\n\nVertices\n{}", mesh.vertices.len())?;
    for (v, vertex) in mesh.vertices.iter().enumerate() {
        for value in vertex.to_array() {
            write_number(file, value)?;
            file.write_all(b" ")?;
        }
        writeln!(file, "{}", reference(vertex_reference, v))?;
    }
    writeln!(file, "\nTriangles\n{}", mesh.triangles.len())?;
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|vertex| u64::from(vertex) + 1);
        writeln!(file, "{a} {b} {c} {}", reference(triangle_reference, t))?;
    }
    writeln!(file, "\nEnd")
}
