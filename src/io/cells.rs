//! Cells as polygon meshes: OBJ with colours at the corners, PLY with colours of the faces.

use std::io::Write;
use std::path::Path;

use super::binary::append_le;
use super::file::{check_text_target, output_error, write_bytes};
use super::format::{Encoding, Format};
use super::ply::write::type_name;
use super::text::write_number;
use crate::Result;
use crate::mesh::attributes::Kind;
use crate::mesh::cell_mesh::CellMesh;

/// Writes cells to an OBJ or PLY file, each polygon in its colour: red, green and blue.
///
/// In PLY each face has the number of its vertex as `cell`; in OBJ each cell is a group, and its corners have
/// its colour. An existing file is replaced only when the new one is complete.
///
/// # Errors
/// [`crate::Error::Output`] for another extension, or if the file cannot be written. Panics if there are
/// fewer colours than polygons.
pub fn write_cells(path: impl AsRef<Path>, cells: &CellMesh, colours: &[[u8; 3]]) -> Result<()> {
    let path = path.as_ref();
    write_bytes(path, &encode_cells(path, cells, colours)?)
}

/// The bytes of the file that [`write_cells`] would write.
///
/// # Errors
/// [`crate::Error::Output`] for another extension. Panics as [`write_cells`] does.
pub fn encode_cells(path: impl AsRef<Path>, cells: &CellMesh, colours: &[[u8; 3]]) -> Result<Vec<u8>> {
    let path = path.as_ref();
    match format(path)? {
        Format::Obj => obj(cells, colours).map_err(|error| super::file::unwritable(path, error)),
        _ => Ok(ply(cells, colours)),
    }
}

/// Checks in advance whether [`write_cells`] can write to `path`.
///
/// # Errors
/// [`crate::Error::Output`].
pub(crate) fn check_cells_target(path: &Path) -> Result<()> {
    format(path)?;
    check_text_target(path)
}

fn format(path: &Path) -> Result<Format> {
    match Encoding::of_name(path) {
        Some(Encoding { format: format @ (Format::Obj | Format::Ply), gzip: false }) => Ok(format),
        _ => Err(output_error(path, "cells are written as OBJ or PLY", "name the file .obj or .ply")),
    }
}

fn ply(cells: &CellMesh, colours: &[[u8; 3]]) -> Vec<u8> {
    // Most readers know counts of 8 bits alone.
    let is_short = cells.starts.windows(2).all(|pair| pair[1] - pair[0] <= u32::from(u8::MAX));
    let count = if is_short { Kind::U8 } else { Kind::U32 };
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n\
         property double x\nproperty double y\nproperty double z\nelement face {}\n\
         property list {} int vertex_indices\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nproperty int cell\nend_header\n",
        cells.vertices.len(),
        cells.cells.len(),
        type_name(count)
    )
    .into_bytes();
    for value in cells.vertices.iter().flat_map(|vertex| vertex.to_array()) {
        append_le(&mut bytes, Kind::F64, value);
    }
    for (index, cell) in cells.cells.iter().enumerate() {
        let corners = cells.polygon(index);
        append_le(&mut bytes, count, corners.len() as f64);
        corners.iter().for_each(|corner| bytes.extend(corner.to_le_bytes()));
        bytes.extend(colours[index]);
        bytes.extend(cell.to_le_bytes());
    }
    bytes
}

fn obj(cells: &CellMesh, colours: &[[u8; 3]]) -> std::io::Result<Vec<u8>> {
    // All corners of a polygon have the colour of its cell, and no other cell has them.
    let mut of_vertex = vec![[0; 3]; cells.vertices.len()];
    for (index, colour) in colours.iter().enumerate().take(cells.cells.len()) {
        cells.polygon(index).iter().for_each(|v| of_vertex[*v as usize] = *colour);
    }
    let mut bytes = Vec::new();
    for (vertex, colour) in cells.vertices.iter().zip(of_vertex) {
        write!(bytes, "v")?;
        for value in vertex.to_array().into_iter().chain(colour.map(|shade| f64::from(shade) / 255.0)) {
            write!(bytes, " ")?;
            write_number(&mut bytes, value)?;
        }
        writeln!(bytes)?;
    }
    let mut before = None;
    for (index, cell) in cells.cells.iter().enumerate() {
        if before.replace(cell) != Some(cell) {
            writeln!(bytes, "g cell_{cell}")?;
        }
        write!(bytes, "f")?;
        cells.polygon(index).iter().try_for_each(|corner| write!(bytes, " {}", corner + 1))?;
        writeln!(bytes)?;
    }
    Ok(bytes)
}
