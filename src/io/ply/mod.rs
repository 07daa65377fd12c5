//! Stanford PLY: text, binary little and big endian.
//!
//! The maintained crate, `ply-rs-bw` 4.0, is not used because it fails on files that occur: its text grammar
//! refuses "nan" in properties that are not needed (MeshLab writes such normals), ".5", "1." and blank lines;
//! its header refuses comments that are not UTF-8; a property declared twice silently shifts all that follow;
//! and for an element without properties it loops as often as the header claims.
//!
//! Messages count faces and vertices from 0, as PLY's own indices do.

pub(crate) mod attributes;
mod data;
mod header;
mod strips;
pub(crate) mod write;

use glam::DVec3;

use super::checks::{check_vertex_count, cut_off, excerpt, too_much, without_padding};
use super::loaded::Loaded;
use crate::grammar::counted;
use crate::io::polygons::{Fans, short_faces_note};
use crate::mesh::attributes::{Attributes, Kind};
use crate::{Error, Result, TriMesh};
use attributes::{Columns, UvLists, build_attributes};
use data::{Binary, Fault, Reading, Source, Text};
use header::{Element, Encoding, Header, Values};
use strips::read_strips;

pub(crate) fn parse(bytes: &[u8]) -> Result<Loaded> {
    if !bytes.starts_with(b"ply\n") && !bytes.starts_with(b"ply\r") {
        let remedy = "give a PLY file; other formats need converting first";
        return Err(Error::input(at_byte(0), "the file does not start with a 'ply' line", remedy));
    }
    let header = Header::parse(bytes)?;
    let layout = Layout::of(&header)?;
    match header.encoding {
        Encoding::Ascii => {
            let body = without_padding(bytes.get(header.data_start..).unwrap_or_default());
            read_elements(&header, &layout, Text::new(body, header.lines))
        }
        binary => read_elements(&header, &layout, Binary::new(bytes, header.data_start, binary)),
    }
}

fn at_byte(byte: usize) -> Option<String> {
    Some(format!("byte {byte}"))
}

/// Which properties of the vertices and faces are the coordinates and the corners.
struct Layout {
    /// Of a vertex: x, y and z.
    axes: [usize; 3],
    /// Of a face: the list of vertex indices; none has this number if there are no faces.
    corners: usize,
    /// Of a face: the list of texture coordinates.
    uv: Option<(usize, Kind)>,
    vertices: u64,
}

impl Layout {
    fn of(header: &Header) -> Result<Self> {
        let count = |name| header.element(name).map_or(0, |element| element.count);
        let vertices = count("vertex");
        check_vertex_count(vertices)?;
        let Some(vertex) = header.element("vertex") else {
            return Err(Error::Internal("a PLY element was counted but is missing".to_owned()));
        };
        let mut axes = [0; 3];
        for (axis, name) in axes.iter_mut().zip(["x", "y", "z"]) {
            let found = vertex.properties.iter().position(|property| property.name == name);
            match found.and_then(|at| Some((at, vertex.properties.get(at)?.values))) {
                Some((at, Values::Scalar(_))) => *axis = at,
                _ => {
                    let problem = format!("the header declares no number '{name}' for vertices");
                    return Err(Error::input(None, problem, "export the mesh again with x, y and z"));
                }
            }
        }
        let Some(face) = header.element("face").filter(|face| face.count > 0) else {
            return Ok(Self { axes, corners: usize::MAX, uv: None, vertices });
        };
        let corners = face.properties.iter().position(|property| {
            is_corners(&property.name)
                && matches!(property.values, Values::List { item, .. } if item.range().is_some())
        });
        let Some(corners) = corners else {
            let problem = "the header declares no integer list 'vertex_indices' for faces";
            return Err(Error::input(None, problem, "export the mesh again with vertex_indices"));
        };
        let uv = face.properties.iter().enumerate().find_map(|(at, property)| match property.values {
            Values::List { item, .. } if property.name == "texcoord" => Some((at, item)),
            _ => None,
        });
        Ok(Self { axes, corners, uv, vertices })
    }
}

/// Whether a list of this name has the corners of faces.
fn is_corners(name: &str) -> bool {
    name == "vertex_indices" || name == "vertex_index"
}

fn read_elements<S: Source>(header: &Header, layout: &Layout, mut source: S) -> Result<Loaded> {
    let mut mesh = TriMesh::default();
    let mut notes = Vec::new();
    let (mut vertex_columns, mut face_columns) = (None, None);
    let mut fans = Fans::default();
    let has_faces = header.element("face").is_some_and(|face| face.count > 0);
    for element in &header.elements {
        check_declared_size(element, header.encoding, &source)?;
        match element.name.as_str() {
            "vertex" => {
                let mut columns = Columns::new(element, &layout.axes);
                mesh.vertices = read_vertices(element, layout, &mut source, &mut columns)?;
                vertex_columns = Some(columns);
            }
            "face" => {
                let mut columns = (Columns::new(element, &[]), UvLists::default());
                let short;
                (mesh.triangles, fans, short) = read_faces(element, layout, &mut source, &mut columns)?;
                face_columns = Some(columns);
                notes.extend(fans.note());
                notes.extend(short_faces_note(short));
            }
            "tristrips" if !has_faces => {
                mesh.triangles = read_strips(element, layout.vertices, &mut source)?;
            }
            other => {
                skip_element(element, &mut source)?;
                if element.count > 0 {
                    let [one, many] =
                        ["element", "elements"].map(|word| format!("{word} '{}'", excerpt(other)));
                    let elements = counted(element.count, [&format!("{one} was"), &format!("{many} were")]);
                    notes.push(format!("{elements} ignored"));
                }
            }
        }
        let is_read = |name: &str| matches!(name, "vertex_indices" | "vertex_index" | "texcoord");
        let lists =
            element.properties.iter().filter(|property| matches!(property.values, Values::List { .. }));
        let names = lists.map(|property| property.name.as_str());
        let ignored: Vec<&str> = names.filter(|name| !is_read(name)).take(8).collect();
        if matches!(element.name.as_str(), "vertex" | "face") && !ignored.is_empty() {
            let names = excerpt(&ignored.join(", "));
            notes.push(format!("these properties of each {} were ignored: {names}", element.name));
        }
        // Whatever follows the mesh is not needed.
        if !mesh.vertices.is_empty() && !mesh.triangles.is_empty() {
            break;
        }
    }
    let mut attributes = Attributes::default();
    if let Some(vertex) = vertex_columns {
        let (face, uv) = face_columns.unwrap_or_default();
        let uv = layout.uv.map(|(_, kind)| (kind, uv));
        attributes = build_attributes(&mesh, (vertex, face), uv, &mut notes);
    }
    fans.unfold(&mut mesh, attributes.uv.as_mut());
    notes.extend(source.note());
    Ok(Loaded { mesh, attributes, notes, ..Loaded::default() })
}

/// Refuses a count that the rest of the file is too short for, before memory is allocated for it.
fn check_declared_size<S: Source>(element: &Element, encoding: Encoding, source: &S) -> Result<()> {
    let least = element.count.saturating_mul(element.least_bytes(encoding));
    if least <= source.bytes_left() {
        return Ok(());
    }
    let (name, count) = (excerpt(&element.name), counted(element.count, ["element", "elements"]));
    let missing = too_much(&format!("{count} '{name}'"), least, source.bytes_left());
    Err(cut_off(source.place(), &format!("the header declares {missing}")))
}

/// The error for a fault in element `index`.
fn element_error<S: Source>(fault: Fault, element: &Element, index: u64, source: &S) -> Error {
    let name = excerpt(&element.name);
    let place = Some(format!("{}, {name} {index}", source.place()));
    let remedy = "get the complete file, or export the mesh again";
    match fault {
        Fault::End => {
            let problem = format!("the file is cut off: {name} {index} of {} is incomplete", element.count);
            Error::input(place, problem, remedy)
        }
        Fault::ShortLine => Error::input(place, format!("the {name} has too few values on its line"), remedy),
        Fault::NotANumber(word) => {
            Error::input(place, format!("'{word}' is not a number"), "write plain decimal numbers")
        }
    }
}

fn read_vertices<S: Source>(
    element: &Element,
    layout: &Layout,
    source: &mut S,
    columns: &mut Columns,
) -> Result<Vec<DVec3>> {
    // `check_declared_size` has shown that the file is long enough for this many.
    let mut vertices = Vec::with_capacity(usize::try_from(element.count).unwrap_or(0));
    for index in 0..element.count {
        let vertex = read_vertex(element, layout, source, columns);
        let vertex = vertex.map_err(|fault| element_error(fault, element, index, source))?;
        vertices.push(vertex);
    }
    Ok(vertices)
}

fn read_vertex<S: Source>(
    element: &Element,
    layout: &Layout,
    source: &mut S,
    columns: &mut Columns,
) -> Reading<DVec3> {
    source.begin()?;
    let mut position = [0.0; 3];
    for (at, property) in element.properties.iter().enumerate() {
        let axis = layout.axes.iter().position(|axis| *axis == at);
        match (axis.and_then(|axis| position.get_mut(axis)), property.values) {
            (Some(coordinate), Values::Scalar(kind)) => *coordinate = source.value(kind)?,
            (_, Values::Scalar(_)) if columns.read(at, source)? => {}
            (_, kind) => skip_property(kind, source)?,
        }
    }
    source.finish();
    Ok(DVec3::from_array(position))
}

/// The triangles, which of them are fans, and the number of faces with fewer than three corners, which are
/// left out.
fn read_faces<S: Source>(
    element: &Element,
    layout: &Layout,
    source: &mut S,
    columns: &mut (Columns, UvLists),
) -> Result<(Vec<[u32; 3]>, Fans, u64)> {
    let mut triangles = Vec::with_capacity(usize::try_from(element.count).unwrap_or(0));
    let (mut fans, mut short) = (Fans::default(), 0);
    let (mut corners, mut own) = (Vec::new(), Vec::new());
    for index in 0..element.count {
        corners.clear();
        let face = read_face(element, layout, source, &mut corners, columns);
        face.map_err(|fault| element_error(fault, element, index, source))?;
        let problem = |problem: String, remedy: &str| {
            Err(Error::input(Some(format!("{}, face {index}", source.place())), problem, remedy))
        };
        if let Some(bad) = corners.iter().find(|corner| !(0.0..layout.vertices as f64).contains(*corner)) {
            let last = layout.vertices - 1;
            return problem(
                format!("there is no vertex {bad}, indices go from 0 to {last}"),
                "repair the face",
            );
        }
        // In range, as checked above.
        own.clear();
        own.extend(corners.iter().map(|corner| *corner as u32));
        fans.add(triangles.len(), own.len());
        triangles.extend(Fans::triangles(&own));
        columns.0.repeat_last(own.len().saturating_sub(2));
        if layout.uv.is_some() {
            columns.1.end_face(own.len());
        }
        short += u64::from(own.len() < 3);
    }
    Ok((triangles, fans, short))
}

fn read_face<S: Source>(
    element: &Element,
    layout: &Layout,
    source: &mut S,
    corners: &mut Vec<f64>,
    (columns, uv): &mut (Columns, UvLists),
) -> Reading<()> {
    source.begin()?;
    uv.current_face.clear();
    for (at, property) in element.properties.iter().enumerate() {
        match property.values {
            Values::List { count, item } if at == layout.corners => {
                for _ in 0..list_count(count, source)? {
                    let corner = source.value(item)?;
                    // In text, an integer list can still contain a fraction.
                    if corner.fract() != 0.0 {
                        return Err(Fault::NotANumber(corner.to_string()));
                    }
                    corners.push(corner);
                }
            }
            Values::List { count, item } if layout.uv.is_some_and(|(uv, _)| uv == at) => {
                for _ in 0..list_count(count, source)? {
                    uv.current_face.push(source.value(item)?);
                }
            }
            Values::Scalar(_) if columns.read(at, source)? => {}
            kind => skip_property(kind, source)?,
        }
    }
    source.finish();
    Ok(())
}

fn list_count<S: Source>(kind: Kind, source: &mut S) -> Reading<u64> {
    let count = source.value(kind)?;
    if count < 0.0 || count.fract() != 0.0 {
        return Err(Fault::NotANumber(count.to_string()));
    }
    Ok(count as u64)
}

fn skip_property<S: Source>(values: Values, source: &mut S) -> Reading<()> {
    match values {
        Values::Scalar(kind) => source.skip(kind, 1),
        Values::List { count, item } => {
            let count = list_count(count, source)?;
            source.skip(item, count)
        }
    }
}

fn skip_element<S: Source>(element: &Element, source: &mut S) -> Result<()> {
    // Elements without properties take no bytes, however many the header claims.
    let count = if element.properties.is_empty() { 0 } else { element.count };
    for index in 0..count {
        let skipped = source.begin().and_then(|()| {
            element.properties.iter().try_for_each(|property| skip_property(property.values, source))
        });
        skipped.map_err(|fault| element_error(fault, element, index, source))?;
    }
    Ok(())
}
