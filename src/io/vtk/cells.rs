//! The cells of VTK files: lists of corners, and what shapes they stand for.

use super::array::{Array, Values};
use crate::{Error, Result};

/// A part of a file: points, cells, and their numbers.
#[derive(Debug, Default)]
pub(super) struct Piece<'a> {
    pub points: Option<Array<'a>>,
    pub point_count: usize,
    /// Cells in the order of their data.
    pub cells: Vec<CellSet<'a>>,
    pub point_data: Vec<Array<'a>>,
    pub cell_data: Vec<Array<'a>>,
}

impl Piece<'_> {
    pub fn cell_count(&self) -> usize {
        self.cells.iter().fold(0, |sum: usize, set| sum.saturating_add(set.count))
    }
}

/// Cells that the file lists together.
#[derive(Debug)]
pub(super) struct CellSet<'a> {
    pub count: usize,
    pub kinds: Kinds<'a>,
    /// `None` for points and lines, which are not read.
    pub corners: Option<Corners<'a>>,
}

/// The numbers of VTK's cell types.
#[derive(Debug)]
pub(super) enum Kinds<'a> {
    All(u8),
    Each(Values<'a>),
}

/// Where the corners of each cell are.
#[derive(Debug)]
pub(super) enum Corners<'a> {
    /// The first list says where the corners of each cell end in the second, or begin and end.
    Offsets { offsets: Values<'a>, begins: bool, corners: Values<'a> },
    /// Each cell is the number of its corners and these.
    Counted(Values<'a>),
}

impl CellSet<'_> {
    /// Calls `visit` with the number, type and corners of each cell that is read.
    ///
    /// # Errors
    /// [`Error::Input`]: the list is too short or an index is not a whole number; what `visit` returns.
    pub fn for_each(&self, mut visit: impl FnMut(usize, u8, &[u64]) -> Result<()>) -> Result<()> {
        let Some(lists) = &self.corners else { return Ok(()) };
        let (mut at, mut corners) = (0, Vec::new());
        for cell in 0..self.count {
            let refuse = |problem: &str| {
                let remedy = "get the complete file, or export the mesh again";
                Err(Error::input(Some(format!("cell {cell}")), problem, remedy))
            };
            let (list, end) = match lists {
                Corners::Offsets { offsets, begins, corners } => {
                    if *begins && cell == 0 {
                        at = offsets.index(0).map_or(usize::MAX, |first| first as usize);
                    }
                    (corners, offsets.index(cell + usize::from(*begins)))
                }
                Corners::Counted(list) => {
                    let count = list.index(at);
                    at += 1;
                    (list, count.map(|count| count.saturating_add(at as u64)))
                }
            };
            let Some(end) = end.and_then(|end| usize::try_from(end).ok()) else {
                return refuse("the list of the cells' corners is cut off or has no whole numbers");
            };
            if end < at || end > list.len() {
                return refuse("the corners of the cell lie outside their list");
            }
            corners.clear();
            for k in at..end {
                let Some(corner) = list.index(k) else {
                    return refuse(&format!("the corner {} is not the index of a point", list.at(k)));
                };
                corners.push(corner);
            }
            at = end;
            let kind = match &self.kinds {
                Kinds::All(kind) => *kind,
                Kinds::Each(kinds) => match kinds.index(cell).and_then(|kind| u8::try_from(kind).ok()) {
                    Some(kind) => kind,
                    None => return refuse("the cell has no type"),
                },
            };
            visit(cell, kind, &corners)?;
        }
        Ok(())
    }
}

/// What a cell is to a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// Nothing, a point or a line.
    None,
    Polygon,
    /// A polygon of the first corners, this many; the others are on its edges and inside.
    Curved(usize),
    /// A rectangle whose corners are in the order of rows.
    Pixel,
    Strip,
    Solid(&'static Solid),
    /// Six rectangles whose corners are in the order of rows and layers.
    Voxel,
}

/// A cell with a volume.
#[derive(Debug, PartialEq)]
pub(super) struct Solid {
    pub corners: usize,
    /// The corners of each side, seen from outside.
    pub sides: &'static [&'static [usize]],
}

const TETRAHEDRON: Solid = Solid { corners: 4, sides: &[&[0, 1, 3], &[1, 2, 3], &[2, 0, 3], &[0, 2, 1]] };
const HEXAHEDRON: Solid = Solid {
    corners: 8,
    sides: &[&[0, 4, 7, 3], &[1, 2, 6, 5], &[0, 1, 5, 4], &[3, 7, 6, 2], &[0, 3, 2, 1], &[4, 5, 6, 7]],
};
const WEDGE: Solid =
    Solid { corners: 6, sides: &[&[0, 1, 2], &[3, 5, 4], &[0, 3, 4, 1], &[1, 4, 5, 2], &[2, 5, 3, 0]] };
const PYRAMID: Solid =
    Solid { corners: 5, sides: &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]] };

/// The corners of a voxel or pixel in the order of a hexahedron and a polygon.
pub(super) const VOXEL_ORDER: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];

/// The hexahedron that a voxel is with its corners in [`VOXEL_ORDER`].
pub(super) const VOXEL: &Solid = &HEXAHEDRON;

/// What a cell of this type is.
///
/// # Errors
/// [`Error::Input`] for types whose surface is not known.
pub(super) fn shape(kind: u8) -> Result<Shape> {
    Ok(match kind {
        // Points, lines and curves.
        0..=4 | 21 | 35 | 68 | 75 => Shape::None,
        5 | 7 | 9 => Shape::Polygon,
        6 => Shape::Strip,
        8 => Shape::Pixel,
        22 | 34 | 69 | 76 => Shape::Curved(3),
        23 | 28 | 30 | 70 | 77 => Shape::Curved(4),
        10 | 24 | 71 | 78 => Shape::Solid(&TETRAHEDRON),
        11 => Shape::Voxel,
        12 | 25 | 29 | 33 | 72 | 79 => Shape::Solid(&HEXAHEDRON),
        13 | 26 | 31 | 32 | 73 | 80 => Shape::Solid(&WEDGE),
        14 | 27 | 74 | 81 => Shape::Solid(&PYRAMID),
        other => {
            let name = match other {
                15 | 16 => " (prisms)",
                41 => " (convex point sets)",
                42 => " (polyhedra)",
                _ => "",
            };
            let problem = format!("cells of type {other}{name} are not supported");
            return Err(Error::input(None, problem, SURFACE_REMEDY));
        }
    })
}

/// How to make a file that can be read of one that cannot.
pub(super) const SURFACE_REMEDY: &str =
    "write the surface alone as .vtp: Extract Surface in ParaView, extract_surface() in PyVista";
