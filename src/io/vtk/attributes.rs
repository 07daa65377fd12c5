//! Makes attributes of the arrays of a VTK file.

use std::collections::{HashMap, HashSet};

use super::array::{Array, Budget, Purpose};
use super::cells::Piece;
use crate::Result;
use crate::grammar::counted;
use crate::io::checks::{excerpt, reserve};
use crate::io::volumes::raw::Number;
use crate::mesh::attributes::{Attribute, Attributes, CornerUv, Kind, Role, are_numbers_of_triangles};

/// The name of the array that has the texture coordinates of a triangle's three corners, where corners at a
/// point differ. VTK itself has them for points alone.
pub(super) const CORNER_UV: &str = "corner_texture_coordinates";

/// The names that programs give to normals, in lower case.
const NORMAL_NAMES: [&str; 2] = ["normals", "normal"];
/// The names that programs give to texture coordinates, in lower case.
const TEXTURE_NAMES: [&str; 4] = ["texture coordinates", "tcoords", "texturecoordinates", "uv"];
/// The names that programs give to colours, in lower case.
const COLOUR_NAMES: [&str; 7] = ["colour", "color", "colours", "colors", "rgb", "rgba", "rgbcolor"];

/// Which point and which cell each vertex and triangle of the mesh is.
pub(super) struct Rows<'r> {
    /// `None` for all in their order.
    pub points: Option<&'r [u32]>,
    pub point_count: usize,
    pub cells: &'r [u32],
    pub triangles: &'r [[u32; 3]],
}

/// The numbers that all pieces have under one name.
struct Column<'p> {
    name: &'p str,
    purpose: Purpose,
    kind: Kind,
    components: usize,
    values: Vec<f64>,
}

/// The attributes of the mesh.
///
/// # Errors
/// [`crate::Error::Input`] if arrays stand for too much; [`crate::Error::OutOfMemory`].
pub(super) fn read_attributes(
    pieces: &[Piece],
    rows: &Rows,
    budget: &mut Budget,
    notes: &mut Vec<String>,
) -> Result<Attributes> {
    let of_points = Source { pieces, of_points: true };
    let of_cells = Source { pieces, of_points: false };
    let points = of_points.columns(rows.points, rows.point_count, budget, notes)?;
    let cells = of_cells.columns(Some(rows.cells), rows.cells.len(), budget, notes)?;
    let mut attributes = Attributes::default();
    let mut taken = Taken::default();
    for column in points {
        let lower = column.name.to_ascii_lowercase();
        let is_texture = column.purpose == Purpose::Texture || TEXTURE_NAMES.contains(&lower.as_str());
        let is_pair =
            column.components == 2 || (column.purpose == Purpose::Texture && column.components == 3);
        if is_texture && is_pair && attributes.uv.is_none() && column.kind.range().is_none() {
            let pair = |v: &u32| {
                let at = *v as usize * column.components;
                [column.values[at], column.values[at + 1]]
            };
            let values: Vec<[f64; 2]> = rows.triangles.as_flattened().iter().map(pair).collect();
            // Numbers that are none stand for no texture.
            if values.as_flattened().iter().all(|value| value.is_finite()) {
                attributes.uv = Some(CornerUv { kind: column.kind, values });
                continue;
            }
        }
        taken.add(column, Role::Other, &mut attributes.vertex);
    }
    let mut taken = Taken::default();
    for column in cells {
        if column.name == CORNER_UV && column.components == 6 && column.kind.range().is_none() {
            let values = column.values.as_chunks::<2>().0.to_vec();
            attributes.uv = Some(CornerUv { kind: column.kind, values });
            continue;
        }
        // A number for each cell would put a border around each of them.
        let is_whole = column.kind.range().is_some() && column.components == 1;
        let names_cells = column.purpose == Purpose::Ids
            || column.name.starts_with("vtk")
            || (is_whole && are_numbers_of_triangles(&column.values));
        let role = if is_whole && !names_cells { Role::Label } else { Role::Other };
        taken.add(column, role, &mut attributes.face);
    }
    Ok(attributes)
}

/// Which roles attributes have already.
#[derive(Default)]
struct Taken {
    colour: bool,
    normal: bool,
}

impl Taken {
    /// Adds a column as one attribute, or as one for each component if there are more than four.
    fn add(&mut self, column: Column, role: Role, found: &mut Vec<Attribute>) {
        let name = clean_name(column.name);
        let Column { kind, components, values, .. } = column;
        let lower = name.to_ascii_lowercase();
        let is_colour = matches!(components, 3 | 4)
            && (kind == Kind::U8
                || column.purpose == Purpose::Colours
                || COLOUR_NAMES.contains(&lower.as_str()));
        let is_normal = components == 3
            && kind.range().is_none()
            && (column.purpose == Purpose::Normals || NORMAL_NAMES.contains(&lower.as_str()));
        let role = match role {
            Role::Other if is_normal && !self.normal => {
                self.normal = true;
                Role::Normal
            }
            Role::Other if is_colour && !self.colour => {
                self.colour = true;
                Role::Colour
            }
            other => other,
        };
        if components <= 4 {
            found.push(Attribute::new(&name, role, kind, components, values));
            return;
        }
        for k in 0..components {
            let own = values.iter().skip(k).step_by(components).copied().collect();
            found.push(Attribute::new(&format!("{name}_{k}"), Role::Other, kind, 1, own));
        }
    }
}

/// A name that is one line and not empty.
fn clean_name(name: &str) -> String {
    let shown: String = name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    if shown.trim().is_empty() { "values".to_owned() } else { shown }
}

/// The arrays of points or those of cells.
struct Source<'p, 'a> {
    pieces: &'p [Piece<'a>],
    of_points: bool,
}

impl<'p, 'a> Source<'p, 'a> {
    fn arrays(&self, piece: &'p Piece<'a>) -> &'p [Array<'a>] {
        if self.of_points { &piece.point_data } else { &piece.cell_data }
    }

    fn rows(&self, piece: &Piece) -> usize {
        if self.of_points { piece.point_count } else { piece.cell_count() }
    }

    /// The arrays that all pieces have, for the rows that the mesh has: these, or all in their order.
    fn columns(
        &self,
        picked: Option<&[u32]>,
        count: usize,
        budget: &mut Budget,
        notes: &mut Vec<String>,
    ) -> Result<Vec<Column<'p>>> {
        let pieces: Vec<&Piece> = self.pieces.iter().filter(|piece| self.rows(piece) > 0).collect();
        let Some((first, others)) = pieces.split_first() else { return Ok(Vec::new()) };
        let named = |piece: &&'p Piece<'a>| -> HashMap<&'p str, &'p Array<'a>> {
            self.arrays(piece).iter().map(|array| (array.name.as_str(), array)).collect()
        };
        let others: Vec<HashMap<&str, &Array>> = others.iter().map(named).collect();
        let (mut found, mut known, mut dropped) = (Vec::new(), HashSet::new(), Vec::new());
        for array in self.arrays(first) {
            if !known.insert(array.name.as_str()) {
                continue;
            }
            let mut parts = vec![array];
            parts.extend(others.iter().filter_map(|other| other.get(array.name.as_str()).copied()));
            let fits = |(part, piece): (&&Array, &&Piece)| {
                let rows = self.rows(piece).saturating_mul(part.components);
                part.number == array.number
                    && part.components == array.components
                    && part.values.len() >= rows
            };
            let is_whole = parts.len() == pieces.len() && parts.iter().zip(&pieces).all(fits);
            let kind = is_whole.then(|| self.kind(&parts, &pieces)).flatten();
            match kind {
                Some(kind) => {
                    let values = self.values(&parts, &pieces, (picked, count), budget)?;
                    let Array { name, purpose, components, .. } = array;
                    found.push(Column { name, purpose: *purpose, kind, components: *components, values });
                }
                None => dropped.push(array.name.as_str()),
            }
        }
        if !dropped.is_empty() {
            let what = if self.of_points { "point" } else { "cell" };
            let names = excerpt(&dropped.iter().take(8).copied().collect::<Vec<_>>().join(", "));
            let arrays = counted(dropped.len(), ["array that does", "arrays that do"]);
            notes.push(format!("{arrays} not fit each {what} of the file left out: {names}"));
        }
        Ok(found)
    }

    /// The type that holds all numbers; `None` if some are not of the type that the file declares.
    fn kind(&self, parts: &[&Array], pieces: &[&Piece]) -> Option<Kind> {
        let all = |test: &dyn Fn(f64) -> bool| {
            parts
                .iter()
                .zip(pieces)
                .all(|(part, piece)| (0..self.rows(piece) * part.components).all(|k| test(part.values.at(k))))
        };
        let first = parts.first()?;
        match first.number {
            Number::Usual(kind) => {
                // Only text can have others.
                (first.values.number == first.number || all(&|value| kind.holds(value))).then_some(kind)
            }
            Number::F16 => Some(Kind::F32),
            Number::I64 | Number::U64 => {
                let kinds = [Kind::I32, Kind::U32, Kind::F64];
                kinds.into_iter().find(|kind| all(&|value| kind.holds(value)))
            }
        }
    }

    fn values(
        &self,
        parts: &[&Array],
        pieces: &[&Piece],
        (picked, count): (Option<&[u32]>, usize),
        budget: &mut Budget,
    ) -> Result<Vec<f64>> {
        let components = parts.first().map_or(1, |array| array.components);
        let length = count.saturating_mul(components);
        budget.take(8 * length as u64)?;
        let mut values = Vec::new();
        reserve(&mut values, length, "the arrays of a VTK file")?;
        let begins: Vec<usize> = pieces
            .iter()
            .scan(0, |sum, piece| {
                let begin = *sum;
                *sum += self.rows(piece);
                Some(begin)
            })
            .collect();
        for row in 0..count {
            let row = picked.map_or(row, |picked| picked.get(row).map_or(0, |row| *row as usize));
            let piece = begins.partition_point(|begin| *begin <= row).saturating_sub(1);
            let own = row - begins.get(piece).copied().unwrap_or_default();
            let part = parts.get(piece);
            values.extend(
                (0..components).map(|k| part.map_or(0.0, |array| array.values.at(own * components + k))),
            );
        }
        Ok(values)
    }
}
