//! MEDIT's text format `.mesh`: sections of vertices, triangles and quadrilaterals among others that are passed over.

use std::collections::BTreeSet;
use std::io::{self, Write};

use glam::DVec3;

use super::text::{Faces, Lines, check_promise, cut_off, number, refuse_binary, shown, vertex, whole};
use super::write::write_number;
use super::{Loaded, check_counts};
use crate::{Error, Result, TriMesh};

/// Words over all lines.
#[derive(Clone)]
struct Words<'a> {
    lines: Lines<'a>,
    line: &'a [u8],
}

impl<'a> Words<'a> {
    fn left(&self) -> u64 {
        self.lines.left() + self.line.len() as u64
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

/// A section: how many entries it declares, and where they begin.
struct Section<'a> {
    count: u64,
    place: String,
    words: Words<'a>,
}

/// The sections that matter.
#[derive(Default)]
struct Sections<'a> {
    vertices: Option<Section<'a>>,
    triangles: Option<Section<'a>>,
    quadrilaterals: Option<Section<'a>>,
    ended: bool,
    ignored: BTreeSet<String>,
}

pub(super) fn parse(bytes: &[u8]) -> Result<Loaded> {
    refuse_binary(bytes, "give a text file; binary .meshb files are not supported")?;
    let sections = find_sections(Words { lines: Lines::new(bytes), line: &[] })?;
    let count = |section: &Option<Section>| section.as_ref().map_or(0, |section| section.count);
    let in_file = count(&sections.vertices);
    let faces_in_file = count(&sections.triangles).saturating_add(count(&sections.quadrilaterals));
    check_counts(in_file, faces_in_file)?;
    let vertices = sections.vertices.map(read_vertices).transpose()?.unwrap_or_default();
    let mut faces = Faces::new(1, in_file);
    for (section, corners, name) in
        [(sections.triangles, 3, "triangle"), (sections.quadrilaterals, 4, "quadrilateral")]
    {
        if let Some(section) = section {
            read_faces(section, corners, name, &mut faces)?;
        }
    }
    let mut notes: Vec<String> = faces.notes().into_iter().collect();
    if !sections.ended {
        notes.push("there is no 'End' at the end; sections may be missing".to_owned());
    }
    if !sections.ignored.is_empty() {
        let names: Vec<&str> = sections.ignored.iter().map(String::as_str).collect();
        notes.push(format!("these sections were ignored: {}", names.join(", ")));
    }
    Ok(Loaded { mesh: TriMesh { vertices, triangles: faces.triangles }, notes })
}

fn find_sections(mut words: Words) -> Result<Sections> {
    let mut found = Sections::default();
    while let Some(word) = words.next() {
        if !word.first().is_some_and(u8::is_ascii_alphabetic) || number(word).is_some() {
            continue;
        }
        let keyword = shown(word).to_ascii_lowercase();
        let place = words.place();
        let refuse = |problem: String, remedy: &str| Err(Error::input(Some(place.clone()), problem, remedy));
        let slot = match keyword.as_str() {
            "meshversionformatted" => continue,
            "end" => {
                found.ended = true;
                break;
            }
            "dimension" => match words.next().and_then(whole) {
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
            // Enough of them to tell what kind of file this is.
            _ if found.ignored.len() < 8 => {
                found.ignored.insert(shown(word));
                continue;
            }
            _ => continue,
        };
        let counted = words.next().unwrap_or_default();
        let Some(count) = whole(counted) else {
            let problem = format!("the count '{}' after '{keyword}' is not a whole number", shown(counted));
            return refuse(problem, "mend the file or write the mesh again");
        };
        if slot.is_some() {
            return refuse(format!("there is a second section '{keyword}'"), "join the sections");
        }
        *slot = Some(Section { count, place, words: words.clone() });
    }
    Ok(found)
}

fn read_vertices(section: Section) -> Result<Vec<DVec3>> {
    let Section { count, place, mut words } = section;
    check_promise((count, "vertices"), 8, words.left(), place)?;
    // The file is long enough for this many.
    let mut vertices = Vec::with_capacity(usize::try_from(count).unwrap_or(0));
    for index in 1..=count {
        // The words of a vertex are on the line of the first.
        let mut next = words.clone();
        if next.next().is_none() {
            return Err(cut_off(words.place(), &format!("vertex {index} of {count} is missing")));
        }
        vertices.push(vertex(&mut words, &|| format!("{}, vertex {index}", next.place()))?);
        reference(&mut words, "vertex", index)?;
    }
    Ok(vertices)
}

fn read_faces(section: Section, corners: usize, name: &str, faces: &mut Faces) -> Result<()> {
    let Section { count, place, mut words } = section;
    check_promise((count, &format!("{name}s")), 2 * (corners as u64 + 1), words.left(), place)?;
    let mut face = Vec::with_capacity(corners);
    for index in 1..=count {
        face.clear();
        for _ in 0..corners {
            let Some(word) = words.next() else {
                return Err(cut_off(words.place(), &format!("{name} {index} of {count} is missing")));
            };
            let Some(corner) = whole(word) else {
                let place = format!("{}, {name} {index}", words.place());
                let problem = format!("the vertex index '{}' is not a whole number", shown(word));
                return Err(Error::input(Some(place), problem, "mend the face or write the mesh again"));
            };
            face.push(corner);
        }
        faces.push(&face, &|| format!("{}, {name} {index}", words.place()))?;
        reference(&mut words, name, index)?;
    }
    Ok(())
}

/// Passes over the reference that ends each entry.
fn reference(words: &mut Words, name: &str, index: u64) -> Result<()> {
    if words.next().and_then(number).is_some() {
        return Ok(());
    }
    let place = Some(format!("{}, {name} {index}", words.place()));
    let problem = format!("the {name} has no reference number at its end");
    Err(Error::input(place, problem, "write a 0 there, or the mesh again"))
}

pub(super) fn write(file: &mut dyn Write, mesh: &TriMesh) -> io::Result<()> {
    writeln!(file, "MeshVersionFormatted 2\n\nDimension 3\n\nVertices\n{}", mesh.vertices.len())?;
    for vertex in &mesh.vertices {
        for value in vertex.to_array() {
            write_number(file, value)?;
            file.write_all(b" ")?;
        }
        writeln!(file, "0")?;
    }
    writeln!(file, "\nTriangles\n{}", mesh.triangles.len())?;
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| u64::from(vertex) + 1);
        writeln!(file, "{a} {b} {c} 0")?;
    }
    writeln!(file, "\nEnd")
}
