//! Writes OBJ files.

use std::collections::HashMap;
use std::io;
use std::io::Write;
use std::path::Path;

use glam::DVec3;

use super::attributes::LABELS;
use super::materials::relative_names;
use crate::TriMesh;
use crate::io::text::write_number;
use crate::mesh::attributes::{Attribute, Attributes, Role};

/// Writes the `v` line of a vertex.
pub(crate) fn write_vertex(file: &mut impl Write, vertex: DVec3) -> io::Result<()> {
    write!(file, "v")?;
    for value in vertex.to_array() {
        write!(file, " ")?;
        write_number(file, value)?;
    }
    writeln!(file)
}

/// Writes the `v` lines of all vertices, with their colours after the coordinates.
fn write_vertices(file: &mut dyn Write, mesh: &TriMesh, colour: Option<&Attribute>) -> io::Result<()> {
    let mut file = file;
    for (v, vertex) in mesh.vertices.iter().enumerate() {
        let Some(colour) = colour else {
            write_vertex(&mut file, *vertex)?;
            continue;
        };
        write!(file, "v")?;
        let shades = colour.unit_colour(v);
        for value in vertex.to_array().iter().chain(shades.iter().take(colour.components)) {
            write!(file, " ")?;
            write_number(file, *value)?;
        }
        writeln!(file)?;
    }
    Ok(())
}

/// Writes a line of a keyword and numbers.
fn write_line(file: &mut dyn Write, keyword: &str, values: &[f64]) -> io::Result<()> {
    write!(file, "{keyword}")?;
    for value in values {
        write!(file, " ")?;
        write_number(file, *value)?;
    }
    writeln!(file)
}

/// Writes a mesh, for a file in the folder `to` if that is known. Equal texture coordinates are written once.
pub(crate) fn write(
    file: &mut dyn Write,
    mesh: &TriMesh,
    attributes: &Attributes,
    to: Option<&Path>,
) -> io::Result<()> {
    let libraries = match (&attributes.library_folder, to) {
        (Some(from), Some(to)) => relative_names(&attributes.libraries, from, to),
        _ => attributes.libraries.clone(),
    };
    for library in &libraries {
        writeln!(file, "mtllib {library}")?;
    }
    let colour = attributes.vertex_role(Role::Colour).filter(|colour| colour.components >= 3);
    let normal = attributes.vertex_role(Role::Normal).filter(|normal| normal.components == 3);
    write_vertices(file, mesh, colour)?;
    let mut uv_numbers = HashMap::new();
    let mut corner_uvs = Vec::new();
    for uv in attributes.uv.iter().flat_map(|uv| &uv.values) {
        let next = uv_numbers.len() + 1;
        let number = *uv_numbers.entry(uv.map(f64::to_bits)).or_insert(next);
        if number == next {
            write_line(file, "vt", uv)?;
        }
        corner_uvs.push(number);
    }
    for v in 0..mesh.vertices.len() {
        if let Some(normal) = normal {
            write_line(file, "vn", normal.at(v))?;
        }
    }
    let mut current_labels = [None; 3];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        for ((keyword, name), current) in LABELS.into_iter().zip(&mut current_labels) {
            let Some(label) = attributes.face_named(name).filter(|label| label.components == 1) else {
                continue;
            };
            let number = label.at(t).first().map(|value| *value as usize);
            if *current != number {
                *current = number;
                let own_name = number.and_then(|number| label.names.get(number).cloned());
                let label_name = own_name.unwrap_or_else(|| format!("{name}{}", number.unwrap_or_default()));
                // A name is the rest of its line, which a backslash would continue.
                let label_name = label_name.replace(char::is_control, " ");
                let label_name = label_name.trim_end_matches(['\\', ' ']);
                // The label without a name is that of faces before the first such line.
                writeln!(file, "{}", format!("{keyword} {label_name}").trim_end())?;
            }
        }
        write!(file, "f")?;
        for (k, vertex) in triangle.iter().enumerate() {
            let vertex = u64::from(*vertex) + 1;
            match (corner_uvs.get(3 * t + k), normal) {
                (Some(uv), Some(_)) => write!(file, " {vertex}/{uv}/{vertex}")?,
                (Some(uv), None) => write!(file, " {vertex}/{uv}")?,
                (None, Some(_)) => write!(file, " {vertex}//{vertex}")?,
                (None, None) => write!(file, " {vertex}")?,
            }
        }
        writeln!(file)?;
    }
    Ok(())
}
