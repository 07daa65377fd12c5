//! STL: text and binary.
//!
//! The crate `stl_io` 0.11 is not used: it reads the numbers of text files as f32, and takes every file that
//! begins with "solid " for text, although many programs write that into binary headers.
//!
//! STL has no shared vertices, only corners: equal ones become one vertex, numbered in order of first
//! appearance.

use std::collections::HashMap;
use std::io;
use std::io::Write;

use glam::DVec3;

use super::checks::{check_counts, cut_off, excerpt_of_bytes, refuse_binary, without_padding};
use super::loaded::Loaded;
use super::polygons::Fans;
use super::text::{Lines, number, vertex, words};
use crate::grammar::counted;
use crate::mesh::attributes::{Attribute, Attributes, Kind, Role};
use crate::{Error, Result, TriMesh};

/// Bytes before the count in a binary file, and bytes of each triangle.
const HEADER: usize = 80;
const FACET: usize = 50;

/// Whether the file has exactly the size of a binary STL file with the count in its header.
pub(crate) fn has_binary_size(bytes: &[u8]) -> bool {
    let expected = declared_count(bytes).and_then(|count| count.checked_mul(FACET)?.checked_add(HEADER + 4));
    expected.is_some_and(|expected| expected > HEADER + 4 && expected == bytes.len())
}

fn declared_count(bytes: &[u8]) -> Option<usize> {
    let (count, _) = bytes.get(HEADER..)?.split_first_chunk::<4>()?;
    usize::try_from(u32::from_le_bytes(*count)).ok()
}

pub(crate) fn parse(bytes: &[u8]) -> Result<Loaded> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let solid = bytes.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    let text = without_padding(bytes);
    // What is left of a cut binary file may be one name and zeros.
    let is_whole_line = text.len() == bytes.len() || text.contains(&b'\n') || text.contains(&b'\r');
    let is_text = solid && is_whole_line && !text.iter().take(1024).any(|byte| *byte == 0);
    if is_text && !has_binary_size(bytes) { parse_text(bytes) } else { parse_binary(bytes) }
}

/// Builds the mesh: corners at the same position become one vertex.
#[derive(Default)]
struct MeshBuilder {
    mesh: TriMesh,
    fans: Fans,
    known: HashMap<[u64; 3], u32>,
}

impl MeshBuilder {
    /// The vertex at this position. Files with more than 2^32 corners were refused before.
    fn vertex(&mut self, position: DVec3) -> u32 {
        // Adding zero turns -0.0 into 0.0 and changes nothing else.
        let key = position.to_array().map(|value| (value + 0.0).to_bits());
        let vertices = &mut self.mesh.vertices;
        *self.known.entry(key).or_insert_with(|| {
            vertices.push(position);
            vertices.len() as u32 - 1
        })
    }

    /// Adds a triangle, or a polygon that is split into triangles.
    fn add_facet(&mut self, corners: &[DVec3]) {
        self.fans.add(self.mesh.triangles.len(), corners.len());
        for triangle in Fans::triangles(corners) {
            let triangle = triangle.map(|corner| self.vertex(corner));
            self.mesh.triangles.push(triangle);
        }
    }
}

fn parse_binary(bytes: &[u8]) -> Result<Loaded> {
    let Some(count) = declared_count(bytes) else {
        let missing = format!("a binary STL file has at least {} bytes", HEADER + 4);
        return Err(cut_off(format!("byte {}", bytes.len()), &missing));
    };
    let body = bytes.get(HEADER + 4..).unwrap_or_default();
    let (facets, _) = body.as_chunks::<FACET>();
    let Some(facets) = facets.get(..count) else {
        let there = facets.len();
        return Err(cut_off(
            format!("byte {}", bytes.len()),
            &format!(
                "the header declares {}, but {there} are there",
                counted(count, ["triangle", "triangles"])
            ),
        ));
    };
    check_counts(3 * count as u64, count as u64)?;
    let mut builder = MeshBuilder::default();
    let mut attributes = false;
    for facet in facets {
        let (numbers, attribute) = facet.as_chunks::<4>();
        let value = |at: usize| numbers.get(at).map_or(0.0, |raw| f64::from(f32::from_le_bytes(*raw)));
        // The normal comes first.
        let triangle = [3, 6, 9].map(|at| DVec3::new(value(at), value(at + 1), value(at + 2)));
        attributes |= attribute.iter().any(|byte| *byte != 0);
        builder.add_facet(&triangle);
    }
    let mut notes = Vec::new();
    if attributes {
        notes.push("attributes or colours of the triangles were ignored".to_owned());
    }
    let surplus = body.len() - FACET * count;
    if surplus > 0 {
        let bytes = ["byte after the last triangle was", "bytes after the last triangle were"];
        notes.push(format!("{} ignored", counted(surplus as u64, bytes)));
    }
    Ok(Loaded { mesh: builder.mesh, notes, ..Loaded::default() })
}

fn parse_text(bytes: &[u8]) -> Result<Loaded> {
    let bytes = without_padding(bytes);
    refuse_binary(bytes, "give a whole STL file, text or binary")?;
    let mut lines = Lines::with_comments(bytes);
    let mut parser = TextParser::default();
    while let Some(line) = lines.next() {
        parser.read_line(line, &|| lines.place())?;
    }
    if parser.open_loop.is_some() || parser.in_solid {
        return Err(cut_off(lines.place(), "there is no 'endsolid' line"));
    }
    let TextParser { builder: MeshBuilder { mut mesh, fans, .. }, solids, .. } = parser;
    if mesh.triangles.is_empty() {
        return Err(Error::input(None, "the file has no facets", "give a mesh with facets"));
    }
    check_counts(mesh.vertices.len() as u64, mesh.triangles.len() as u64)?;
    fans.unfold(&mut mesh, None);
    let notes = fans.note().into_iter().collect();
    Ok(Loaded { mesh, attributes: solids.attributes(), notes, ..Loaded::default() })
}

/// The words that the text format knows.
const KEYWORDS: [&[u8]; 7] = [b"solid", b"endsolid", b"facet", b"endfacet", b"outer", b"endloop", b"vertex"];

/// What was read of a text file.
#[derive(Default)]
struct TextParser {
    builder: MeshBuilder,
    /// Corners since the last "outer loop".
    open_loop: Option<Vec<DVec3>>,
    in_solid: bool,
    solids: Solids,
}

impl TextParser {
    /// Reads a line, which may have several keywords, up to a whole facet.
    fn read_line(&mut self, line: &[u8], place: &dyn Fn() -> String) -> Result<()> {
        let mut rest = words(line).peekable();
        let mut is_first = true;
        while let Some(word) = rest.next() {
            let mut keyword = word.to_ascii_lowercase();
            if keyword == b"end" {
                // "end solid" means the same as "endsolid".
                keyword.extend(rest.next().unwrap_or_default().to_ascii_lowercase());
            }
            match (keyword.as_slice(), &mut self.open_loop) {
                // A name is the rest of the line, unless a facet follows.
                (b"solid", None) => {
                    self.in_solid = true;
                    let mut name = Vec::new();
                    while let Some(word) = rest.next_if(|word| !word.eq_ignore_ascii_case(b"facet")) {
                        name.push(String::from_utf8_lossy(word));
                    }
                    self.solids.begin(&name.join(" "));
                }
                (b"endsolid", None) => {
                    self.in_solid = false;
                    let mut later = rest.clone();
                    if !later.any(|word| word.eq_ignore_ascii_case(b"facet")) {
                        return Ok(());
                    }
                    // Its name, up to the next solid.
                    while rest.next_if(|word| !word.eq_ignore_ascii_case(b"solid")).is_some() {}
                }
                (b"facet", None) => {
                    let is_normal =
                        |word: &&[u8]| word.eq_ignore_ascii_case(b"normal") || number(word).is_some();
                    while rest.next_if(is_normal).is_some() {}
                }
                (b"endfacet", None) => {}
                (b"outer", None) => {
                    rest.next_if(|word| word.eq_ignore_ascii_case(b"loop"));
                    self.open_loop = Some(Vec::new());
                }
                (b"vertex", Some(points)) => points.push(vertex(&mut rest, place)?),
                (b"endloop", Some(points)) => {
                    if points.len() < 3 {
                        let problem = format!("the facet has {} of at least 3 vertices", points.len());
                        return Err(Error::input(Some(place()), problem, "remove the facet"));
                    }
                    self.builder.add_facet(points);
                    self.solids.label_up_to(self.builder.mesh.triangles.len());
                    self.open_loop = None;
                }
                _ if is_first || KEYWORDS.contains(&keyword.as_slice()) => {
                    let keyword = excerpt_of_bytes(&keyword);
                    let problem = format!("'{keyword}' does not belong here in an STL file");
                    let remedy = "repair the line, or export the mesh again";
                    return Err(Error::input(Some(place()), problem, remedy));
                }
                // More than the line needs.
                _ => {}
            }
            is_first = false;
        }
        Ok(())
    }
}

/// The name of the label of the solids, that of OBJ's groups.
const SOLID: &str = "group";

/// Which solid of a text file each triangle is in.
#[derive(Default)]
struct Solids {
    names: Vec<String>,
    numbers: HashMap<String, u32>,
    current: u32,
    labels: Vec<f64>,
}

impl Solids {
    /// What follows belongs to the solid of this name; one without a name is named by its number.
    fn begin(&mut self, name: &str) {
        let next = self.names.len();
        let name = if name.is_empty() { format!("solid_{}", next + 1) } else { name.to_owned() };
        self.current = *self.numbers.entry(name.clone()).or_insert(next as u32);
        if self.current as usize == next {
            self.names.push(name);
        }
    }

    /// Labels the triangles up to this number that have no label yet.
    fn label_up_to(&mut self, triangles: usize) {
        self.labels.resize(triangles, self.current.into());
    }

    /// The labels, where there are several solids.
    fn attributes(self) -> Attributes {
        let mut attributes = Attributes::default();
        if self.names.len() > 1 {
            let labels = Attribute::new(SOLID, Role::Label, Kind::U32, 1, self.labels);
            attributes.face.push(Attribute { names: self.names, ..labels });
        }
        attributes
    }
}

/// The labels that are written as solids: groups with names.
pub(crate) fn solids(attributes: &Attributes) -> Option<&Attribute> {
    attributes.face_named(SOLID).filter(|label| label.names.len() > 1)
}

/// Writes a text file with a solid for each label, if there are named groups, or else a binary file.
pub(crate) fn write(file: &mut dyn Write, mesh: &TriMesh, attributes: &Attributes) -> io::Result<()> {
    match solids(attributes) {
        Some(labels) => write_text(file, mesh, labels),
        None => write_binary(file, mesh),
    }
}

/// Writes the solids in the order of their labels.
fn write_text(file: &mut dyn Write, mesh: &TriMesh, labels: &Attribute) -> io::Result<()> {
    let mut order: Vec<usize> = (0..mesh.triangles.len()).collect();
    order.sort_by_key(|t| labels.at(*t)[0] as usize);
    for solid in order.chunk_by(|a, b| labels.at(*a) == labels.at(*b)) {
        let name = labels.names.get(labels.at(solid[0])[0] as usize).map_or("", String::as_str);
        // A name is the rest of its line.
        let name = name.replace(char::is_control, " ");
        writeln!(file, "solid {name}")?;
        for t in solid {
            let [x, y, z] = normal(mesh.corners(*t)).as_vec3().to_array();
            writeln!(file, "  facet normal {x:e} {y:e} {z:e}\n    outer loop")?;
            for corner in mesh.corners(*t) {
                // 32 bits as in binary files, in the shortest form that reads back the same.
                let [x, y, z] = corner.as_vec3().to_array();
                writeln!(file, "      vertex {x:e} {y:e} {z:e}")?;
            }
            writeln!(file, "    endloop\n  endfacet")?;
        }
        writeln!(file, "endsolid {name}")?;
    }
    Ok(())
}

/// The normal of a triangle, of length 1 or 0.
fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    // Divided by the longest side first, so that the cross product neither overflows nor underflows.
    let (u, v) = (b - a, c - a);
    let longest = u.abs().max_element().max(v.abs().max_element());
    (u / longest).cross(v / longest).normalize_or_zero()
}

/// Writes a binary file, with a header that readers do not take for text.
fn write_binary(file: &mut dyn Write, mesh: &TriMesh) -> io::Result<()> {
    let mut header = [0; HEADER];
    for (byte, text) in header.iter_mut().zip(b"binary STL") {
        *byte = *text;
    }
    file.write_all(&header)?;
    file.write_all(&(mesh.triangles.len() as u32).to_le_bytes())?;
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        for value in [normal([a, b, c]), a, b, c].into_iter().flat_map(|vector| vector.to_array()) {
            file.write_all(&(value as f32).to_le_bytes())?;
        }
        file.write_all(&[0, 0])?;
    }
    Ok(())
}
