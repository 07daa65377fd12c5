//! The surface of a VTK file's pieces: triangles of its polygons and strips, or the boundary of its solids.

use glam::DVec3;

use super::POLYGON;
use super::array::Budget;
use super::attributes::{Rows, read_attributes};
use super::boundary::{Boundary, Outside};
use super::cells::{Piece, Shape, VOXEL_ORDER, shape};
use crate::grammar::counted;
use crate::io::checks::{check_vertex_count, cut_off, reserve};
use crate::io::loaded::Loaded;
use crate::io::polygons::{Fans, short_faces_note};
use crate::io::text::Faces;
use crate::io::unused::keep_used;
use crate::mesh::attributes::Attributes;
use crate::{Error, Result, TriMesh};

/// What the cells of all pieces are.
#[derive(Default)]
struct Counts {
    /// Cells without area.
    ignored: usize,
    curved: usize,
    solids: usize,
    strips: usize,
}

/// Triangles, and the cell of each.
#[derive(Default)]
struct Surface {
    triangles: Vec<[u32; 3]>,
    cells: Vec<u32>,
    fans: Fans,
    /// Polygons with fewer than three corners, which are left out.
    short: u64,
}

/// The surface with its attributes.
///
/// # Errors
/// [`Error::Input`]: corners that do not exist, cells that have no surface, numbers that are missing.
pub(super) fn surface(pieces: &[Piece], budget: &mut Budget) -> Result<Loaded> {
    let vertices = points(pieces)?;
    let counts = counts(pieces)?;
    let mut notes = Vec::new();
    let found = match counts.solids {
        0 => polygons(pieces)?,
        solids => {
            notes.push(format!(
                "the surface is the boundary of {}",
                counted(solids, ["volume cell", "volume cells"])
            ));
            boundary(pieces, &vertices, budget, &mut notes)?
        }
    };
    notes.extend(found.fans.note());
    notes.extend(short_faces_note(found.short));
    if counts.curved > 0 {
        let cells = counted(counts.curved, ["cell of a higher order was", "cells of a higher order were"]);
        notes.push(format!("{cells} read by the corners alone"));
    }
    if counts.ignored > 0 && !found.triangles.is_empty() {
        let cells = counted(counts.ignored, ["point or line was", "points and lines were"]);
        notes.push(format!("{cells} ignored"));
    }
    let mut mesh = TriMesh { vertices, triangles: found.triangles };
    found.fans.unfold(&mut mesh, None);
    let used = if counts.solids > 0 { Some(keep_used(&mut mesh)) } else { None };
    let rows = Rows {
        points: used.as_deref(),
        point_count: mesh.vertices.len(),
        cells: &found.cells,
        triangles: &mesh.triangles,
    };
    let attributes = read_attributes(pieces, &rows, budget, &mut notes)?;
    let attributes = if mesh.triangles.is_empty() {
        // Points without faces.
        Attributes { face: Vec::new(), uv: None, ..attributes }
    } else {
        attributes
    };
    Ok(Loaded { mesh, attributes, notes, ..Loaded::default() })
}

/// The points of all pieces.
fn points(pieces: &[Piece]) -> Result<Vec<DVec3>> {
    let count = pieces.iter().fold(0, |sum: u64, piece| sum.saturating_add(piece.point_count as u64));
    check_vertex_count(count)?;
    let mut vertices = Vec::new();
    for piece in pieces {
        let Some(points) = &piece.points else { continue };
        if points.components != 3 || points.values.len() / 3 < piece.point_count {
            let points = counted(piece.point_count, ["point needs", "points need"]);
            let missing = format!("{points} three numbers each");
            return Err(cut_off("the points".to_owned(), &missing));
        }
        reserve(&mut vertices, piece.point_count, "the points of a VTK file")?;
        for point in 0..piece.point_count {
            vertices.push(DVec3::from_array([0, 1, 2].map(|axis| points.values.at(3 * point + axis))));
        }
    }
    // Pieces that have no list of points.
    check_vertex_count(vertices.len() as u64)?;
    Ok(vertices)
}

fn counts(pieces: &[Piece]) -> Result<Counts> {
    let mut counts = Counts::default();
    for set in pieces.iter().flat_map(|piece| &piece.cells) {
        if set.corners.is_none() {
            counts.ignored = counts.ignored.saturating_add(set.count);
        }
        set.for_each(|_, kind, corners| {
            match shape(kind)? {
                Shape::None => counts.ignored += 1,
                Shape::Curved(_) => counts.curved += 1,
                Shape::Solid(solid) => {
                    counts.solids += 1;
                    counts.curved += usize::from(corners.len() > solid.corners);
                }
                Shape::Voxel => counts.solids += 1,
                Shape::Strip => counts.strips += 1,
                Shape::Polygon | Shape::Pixel => {}
            }
            Ok(())
        })?;
    }
    if counts.solids > 0 && counts.strips > 0 {
        let problem = "the file has volume cells and triangle strips";
        return Err(Error::input(None, problem, super::cells::SURFACE_REMEDY));
    }
    Ok(counts)
}

/// The triangles of cells with an area.
fn polygons(pieces: &[Piece]) -> Result<Surface> {
    let mut found = Surface::default();
    let (mut first_point, mut first_cell) = (0_u32, 0_u32);
    let (mut triangles, mut few) = (0, Vec::new());
    for set in pieces.iter().flat_map(|piece| &piece.cells) {
        set.for_each(|_, _, corners| {
            triangles += corners.len().saturating_sub(2);
            Ok(())
        })?;
    }
    reserve(&mut found.triangles, triangles, "the triangles of a VTK file")?;
    reserve(&mut found.cells, triangles, "the triangles of a VTK file")?;
    for piece in pieces {
        // One face at a time, so that the list of all is reserved once.
        let mut faces = Faces::new(0, piece.point_count as u64);
        for set in &piece.cells {
            set.for_each(|cell, kind, corners| {
                let place = || format!("cell {}", first_cell as usize + cell);
                faces.clear();
                few.clear();
                match shape(kind)? {
                    Shape::Strip => {
                        for (k, three) in corners.windows(3).enumerate() {
                            let [a, b, c] = [three[0], three[1], three[2]];
                            // Corners that repeat turn or join strips.
                            if a != b && b != c && c != a {
                                let order = if k % 2 == 0 { [a, b, c] } else { [b, a, c] };
                                faces.push(&order, &place)?;
                            }
                        }
                    }
                    Shape::Pixel if corners.len() == 4 => {
                        few.extend(VOXEL_ORDER[..4].iter().map(|k| corners[*k]));
                        faces.push(&few, &place)?;
                    }
                    Shape::Curved(count) if corners.len() >= count => {
                        faces.push(&corners[..count], &place)?
                    }
                    Shape::Polygon if corners.len() >= 3 => faces.push(corners, &place)?,
                    Shape::Polygon if kind == POLYGON => found.short += 1,
                    Shape::None => {}
                    _ => {
                        let problem = format!(
                            "a cell of type {kind} cannot have {}",
                            counted(corners.len(), ["corner", "corners"])
                        );
                        return Err(Error::input(Some(place()), problem, "remove the cell"));
                    }
                }
                // Of a strip, each triangle is a face.
                if faces.fans.count() > 0 {
                    found.fans.add(found.triangles.len(), faces.triangles.len() + 2);
                }
                let own = faces.triangles.iter().map(|triangle| triangle.map(|v| v + first_point));
                found.triangles.extend(own);
                found.cells.resize(found.triangles.len(), first_cell + cell as u32);
                Ok(())
            })?;
            first_cell = later(first_cell, set.count)?;
        }
        first_point = later(first_point, piece.point_count)?;
    }
    Ok(found)
}

/// The triangles of the sides that only one volume cell has.
fn boundary(
    pieces: &[Piece],
    vertices: &[DVec3],
    budget: &mut Budget,
    notes: &mut Vec<String>,
) -> Result<Surface> {
    let mut sides = Boundary::default();
    let mut count = 0_usize;
    for set in pieces.iter().flat_map(|piece| &piece.cells) {
        set.for_each(|_, kind, _| {
            count += Boundary::sides_of(kind)?;
            Ok(())
        })?;
    }
    budget.take(Boundary::byte_count(count))?;
    sides.reserve(count)?;
    let (mut first_point, mut first_cell) = (0_u32, 0_u32);
    for piece in pieces {
        for set in &piece.cells {
            set.for_each(|cell, kind, corners| {
                sides.add(
                    (first_cell + cell as u32, kind),
                    corners,
                    (first_point, piece.point_count as u32),
                    vertices,
                )
            })?;
            first_cell = later(first_cell, set.count)?;
        }
        first_point = later(first_point, piece.point_count)?;
    }
    let Outside { triangles, cells, fans, inner } = sides.finish()?;
    if inner > 0 {
        let cells = ["surface cell that is not on it was", "surface cells that are not on it were"];
        notes.push(format!("{} left out", counted(inner, cells)));
    }
    Ok(Surface { triangles, cells, fans, short: 0 })
}

/// The number of the first point or cell of the next list.
fn later(first: u32, count: usize) -> Result<u32> {
    let next = u32::try_from(count).ok().and_then(|count| first.checked_add(count));
    next.filter(|next| *next < u32::MAX).ok_or_else(|| {
        let problem = "the file has more cells than can be counted with 32 bits";
        Error::input(None, problem, "split the mesh first")
    })
}
