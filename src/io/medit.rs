//! MEDIT's text format `.mesh`: reads vertices, triangles and quadrilaterals, or the boundary of volume cells
//! where there are no such faces; skips all other sections.

use std::collections::BTreeSet;
use std::io;
use std::io::Write;

use glam::DVec3;

use super::checks::{check_counts, check_declared_count, cut_off, excerpt_of_bytes, refuse_binary};
use super::loaded::Loaded;
use super::text::{Faces, Lines, check_corners, number, unsigned_integer, vertex, write_number};
use super::unused::keep_used;
use super::vtk::boundary::{Boundary, Outside};
use crate::grammar::counted;
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

/// A section: its name in the file, how many entries it declares, and the words from the first entry on.
struct Section<'a> {
    keyword: String,
    count: u64,
    place: String,
    words: Words<'a>,
}

/// What a section of faces or volume cells has.
struct CellKind {
    keyword: &'static str,
    noun: [&'static str; 2],
    corners: usize,
    /// Of a volume cell, VTK's type.
    solid: Option<u8>,
}

const CELL_KINDS: [CellKind; 6] = [
    CellKind { keyword: "triangles", noun: ["triangle", "triangles"], corners: 3, solid: None },
    CellKind {
        keyword: "quadrilaterals",
        noun: ["quadrilateral", "quadrilaterals"],
        corners: 4,
        solid: None,
    },
    CellKind { keyword: "tetrahedra", noun: ["tetrahedron", "tetrahedra"], corners: 4, solid: Some(10) },
    CellKind { keyword: "hexahedra", noun: ["hexahedron", "hexahedra"], corners: 8, solid: Some(12) },
    CellKind { keyword: "prisms", noun: ["prism", "prisms"], corners: 6, solid: Some(13) },
    CellKind { keyword: "pyramids", noun: ["pyramid", "pyramids"], corners: 5, solid: Some(14) },
];

/// The sections that are read.
#[derive(Default)]
struct Sections<'a> {
    vertices: Option<Section<'a>>,
    /// In the order of [`CELL_KINDS`].
    cells: [Option<Section<'a>>; CELL_KINDS.len()],
    /// Whether there is a second section of one kind of volume cells.
    has_second_solids: bool,
    has_end: bool,
    ignored: BTreeSet<String>,
}

impl<'a> Sections<'a> {
    /// Takes the sections of faces, or those of volume cells.
    fn take_cells(&mut self, solid: bool) -> Vec<(&'static CellKind, Section<'a>)> {
        let pairs = CELL_KINDS.iter().zip(&mut self.cells).filter(|(kind, _)| kind.solid.is_some() == solid);
        pairs.filter_map(|(kind, section)| Some((kind, section.take()?))).collect()
    }
}

/// The triangles of a file, and the reference of each.
struct Surface {
    mesh: TriMesh,
    references: Vec<f64>,
    /// The vertices of the file that the mesh has, if not all.
    used: Option<Vec<u32>>,
    notes: Vec<String>,
}

pub(crate) fn parse(bytes: &[u8]) -> Result<Loaded> {
    refuse_binary(bytes, "give a text file; binary .meshb files are not supported")?;
    let mut sections = find_sections(Words { lines: Lines::new(bytes), line: &[] })?;
    let (faces, solids) = (sections.take_cells(false), sections.take_cells(true));
    let count = |list: &[(&CellKind, Section)]| {
        list.iter().fold(0, |sum: u64, (_, section)| sum.saturating_add(section.count))
    };
    let is_solid = count(&faces) == 0 && count(&solids) > 0;
    if is_solid && sections.has_second_solids {
        let problem = "there is a second section of one kind of volume cells";
        return Err(Error::input(None, problem, "join the sections"));
    }
    check_counts(
        sections.vertices.as_ref().map_or(0, |section| section.count),
        count(if is_solid { &solids } else { &faces }),
    )?;
    let (vertices, mut vertex_references) =
        sections.vertices.map(read_vertices).transpose()?.unwrap_or_default();
    let Surface { mesh, references, used, mut notes } = if is_solid {
        boundary(vertices, solids)?
    } else {
        sections.ignored.extend(solids.into_iter().map(|(_, section)| section.keyword));
        faces_of(vertices, faces)?
    };
    if let Some(used) = used {
        vertex_references = used.iter().map(|v| vertex_references[*v as usize]).collect();
    }
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
        face: attribute(references),
        ..Attributes::default()
    };
    if out_of_range {
        notes.push("references were ignored: some are not 32-bit integers".to_owned());
    }
    Ok(Loaded { mesh, attributes, notes, ..Loaded::default() })
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
            other => match CELL_KINDS.iter().position(|kind| kind.keyword == other) {
                Some(kind) => &mut found.cells[kind],
                None => {
                    // Enough for the note.
                    if found.ignored.len() < 8 {
                        found.ignored.insert(excerpt_of_bytes(word));
                    }
                    continue;
                }
            },
        };
        // Volume cells count only where there are no faces.
        let is_solid = CELL_KINDS.iter().any(|kind| kind.keyword == keyword && kind.solid.is_some());
        if is_solid && slot.is_some() {
            found.has_second_solids = true;
            continue;
        }
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
        *slot = Some(Section { keyword: excerpt_of_bytes(word), count, place, words: words.clone() });
    }
    Ok(found)
}

/// The positions and references of all vertices.
fn read_vertices(section: Section) -> Result<(Vec<DVec3>, Vec<f64>)> {
    let Section { count, place, mut words, .. } = section;
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

/// The mesh of these vertices and faces.
fn faces_of(vertices: Vec<DVec3>, sections: Vec<(&CellKind, Section)>) -> Result<Surface> {
    let mut faces = Faces::new(1, vertices.len() as u64);
    let mut references = Vec::new();
    for (kind, section) in sections {
        read_cells(kind, section, |corners, reference, place| {
            faces.push(corners, place)?;
            references.resize(faces.triangles.len(), reference);
            Ok(())
        })?;
    }
    let notes = faces.fans.note().into_iter().collect();
    Ok(Surface { mesh: faces.into_mesh(vertices), references, used: None, notes })
}

/// The boundary of volume cells, without the vertices inside. A triangle has the reference of its cell.
fn boundary(vertices: Vec<DVec3>, sections: Vec<(&CellKind, Section)>) -> Result<Surface> {
    let mut boundary = Boundary::default();
    let mut cell_references = Vec::new();
    for (kind, section) in sections {
        let Some(solid) = kind.solid else { continue };
        read_cells(kind, section, |corners, reference, place| {
            check_corners(corners, 1, vertices.len() as u64, place)?;
            let corners: Vec<u64> = corners.iter().map(|corner| corner - 1).collect();
            // More than can be counted would take a file of 40 GB.
            let (cell, count) = (cell_references.len() as u32, vertices.len() as u32);
            boundary.reserve(Boundary::sides_of(solid)?)?;
            boundary.add((cell, solid), &corners, (0, count), &vertices)?;
            cell_references.push(reference);
            Ok(())
        })?;
    }
    let Outside { triangles, cells, fans, .. } = boundary.finish()?;
    let solids = counted(cell_references.len(), ["volume cell", "volume cells"]);
    let mut notes = vec![format!("the surface is the boundary of {solids}")];
    notes.extend(fans.note());
    let mut mesh = TriMesh { vertices, triangles };
    fans.unfold(&mut mesh, None);
    let references = cells.iter().map(|cell| cell_references[*cell as usize]).collect();
    let used = Some(keep_used(&mut mesh));
    Ok(Surface { mesh, references, used, notes })
}

/// Calls `visit` with the corners, the reference and the place of each cell of a section.
fn read_cells(
    kind: &CellKind,
    section: Section,
    mut visit: impl FnMut(&[u64], f64, &dyn Fn() -> String) -> Result<()>,
) -> Result<()> {
    let Section { count, place, mut words, .. } = section;
    let (corners, name) = (kind.corners, kind.noun[0]);
    check_declared_count(count, kind.noun, 2 * (corners as u64 + 1), words.bytes_left(), place)?;
    let mut cell = Vec::with_capacity(corners);
    for index in 1..=count {
        cell.clear();
        for _ in 0..corners {
            let Some(word) = words.next() else {
                return Err(cut_off(words.place(), &format!("{name} {index} of {count} is missing")));
            };
            let Some(corner) = unsigned_integer(word) else {
                let place = format!("{}, {name} {index}", words.place());
                let problem = format!("the vertex index '{}' is not a whole number", excerpt_of_bytes(word));
                return Err(Error::input(Some(place), problem, "repair the face, or export the mesh again"));
            };
            cell.push(corner);
        }
        // Errors name the line of the last corner.
        let last = words.clone();
        let cell_reference = reference(&mut words, name, index)?;
        visit(&cell, cell_reference, &|| format!("{}, {name} {index}", last.place()))?;
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
