//! Writes PLY files: binary little endian, double coordinates, attributes in their own types.

use std::io;
use std::io::Write;

use crate::TriMesh;
use crate::io::binary::append_le;
use crate::io::rows::write_rows;
use crate::mesh::attributes::{Attribute, Attributes, CornerUv, Kind, Role};

/// The name of a number type in headers.
pub(crate) fn type_name(kind: Kind) -> &'static str {
    match kind {
        Kind::I8 => "char",
        Kind::U8 => "uchar",
        Kind::I16 => "short",
        Kind::U16 => "ushort",
        Kind::I32 => "int",
        Kind::U32 => "uint",
        Kind::F32 => "float",
        Kind::F64 => "double",
    }
}

/// The number type of an attribute in the file. Few readers know colours of 64 bits, which text formats give.
fn kind_in_file(attribute: &Attribute) -> Kind {
    if attribute.role == Role::Colour && attribute.kind == Kind::F64 { Kind::U8 } else { attribute.kind }
}

fn append_attribute(bytes: &mut Vec<u8>, attribute: &Attribute, index: usize) {
    let kind = kind_in_file(attribute);
    for value in attribute.at(index) {
        let value = if kind == attribute.kind { *value } else { kind.rounded(255.0 * value) };
        append_le(bytes, kind, value);
    }
}

/// Adds the header lines of an attribute. Names get no blanks, and an underscore if the element has them
/// already.
fn declare_attribute(header: &mut String, attribute: &Attribute) {
    let name: String = attribute.name.split_whitespace().collect::<Vec<_>>().join("_");
    let components = match (attribute.role, attribute.components) {
        (Role::Colour, 3 | 4) => ["red", "green", "blue", "alpha"].map(str::to_owned),
        (Role::Normal, 3) => ["nx", "ny", "nz", ""].map(str::to_owned),
        (_, 1) => [name, String::new(), String::new(), String::new()],
        _ => [0, 1, 2, 3].map(|k| format!("{name}_{k}")),
    };
    let kind = type_name(kind_in_file(attribute));
    for component in components.iter().take(attribute.components) {
        let element = header.rfind("element ").unwrap_or(0);
        let mut component = component.clone();
        while header.get(element..).is_some_and(|above| above.contains(&format!(" {component}\n"))) {
            component.push('_');
        }
        *header += &format!("property {kind} {component}\n");
    }
}

pub(crate) fn write(file: &mut dyn Write, mesh: &TriMesh, attributes: &Attributes) -> io::Result<()> {
    // Most readers know `int`; `uint` is for meshes with too many vertices for it.
    let index = if i32::try_from(mesh.vertices.len()).is_ok() { "int" } else { "uint" };
    let (vertices, faces) = (mesh.vertices.len(), mesh.triangles.len());
    let uv = attributes.uv.as_ref();
    let by_vertex = uv.and_then(|uv| uv.by_vertex(mesh));
    let by_corner = uv.filter(|_| by_vertex.is_none());
    let mut header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n\
         property double x\nproperty double y\nproperty double z\n"
    );
    if let (Some(CornerUv { kind, .. }), Some(_)) = (uv, &by_vertex) {
        let kind = type_name(*kind);
        header += &format!("property {kind} s\nproperty {kind} t\n");
    }
    attributes.vertex.iter().for_each(|attribute| declare_attribute(&mut header, attribute));
    header += &format!("element face {faces}\nproperty list uchar {index} vertex_indices\n");
    if let Some(CornerUv { kind, .. }) = by_corner {
        header += &format!("property list uchar {} texcoord\n", type_name(*kind));
    }
    attributes.face.iter().for_each(|attribute| declare_attribute(&mut header, attribute));
    file.write_all(header.as_bytes())?;
    file.write_all(b"end_header\n")?;
    write_rows(file, vertices, |row, v| {
        mesh.vertices[v].to_array().iter().for_each(|value| append_le(row, Kind::F64, *value));
        if let (Some(CornerUv { kind, .. }), Some(values)) = (uv, &by_vertex) {
            values.get(v).into_iter().flatten().for_each(|value| append_le(row, *kind, *value));
        }
        attributes.vertex.iter().for_each(|attribute| append_attribute(row, attribute, v));
    })?;
    write_rows(file, faces, |row, t| {
        row.push(3);
        mesh.triangles[t].iter().for_each(|vertex| row.extend(vertex.to_le_bytes()));
        if let Some(CornerUv { kind, values }) = by_corner {
            row.push(6);
            let own = values.iter().skip(3 * t).take(3);
            own.flatten().for_each(|value| append_le(row, *kind, *value));
        }
        attributes.face.iter().for_each(|attribute| append_attribute(row, attribute, t));
    })
}
