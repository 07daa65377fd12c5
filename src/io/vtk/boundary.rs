//! The boundary of volume cells: the sides that only one of them has.

use glam::DVec3;

use super::cells::{Shape, VOXEL, VOXEL_ORDER, shape};
use crate::grammar::counted;
use crate::io::checks::reserve;
use crate::io::polygons::Fans;
use crate::{Error, Result};

/// The number of a side that is a surface cell.
const SURFACE_CELL: u8 = u8::MAX;

/// A side of a volume cell, or a surface cell.
#[derive(Debug, Clone, Copy)]
struct Side {
    /// Corners in their order; the fourth of a triangle is `u32::MAX`.
    corners: [u32; 4],
    cell: u32,
    /// The cell whose numbers it has.
    data: u32,
    side: u8,
}

impl Side {
    /// The same for all cells with this side.
    fn key(&self) -> [u32; 4] {
        let mut key = self.corners;
        key.sort_unstable();
        key
    }
}

/// Six times the volume within these sides, negative if they are seen from inside.
fn volume(sides: &[[u32; 4]], vertices: &[DVec3]) -> f64 {
    let at = |corner: u32| vertices.get(corner as usize).copied().unwrap_or_default();
    let origin = at(sides[0][0]);
    let triangle = |a: u32, b: u32, c: u32| {
        let [a, b, c] = [a, b, c].map(|corner| at(corner) - origin);
        a.dot(b.cross(c))
    };
    let of_side = |side: &[u32; 4]| match *side {
        [a, b, c, u32::MAX] => triangle(a, b, c),
        [a, b, c, d] => triangle(a, b, c) + triangle(a, c, d),
    };
    sides.iter().map(of_side).sum()
}

/// The triangles of the boundary.
#[derive(Debug, Default)]
pub(in crate::io) struct Outside {
    pub triangles: Vec<[u32; 3]>,
    /// The cell that describes each triangle: the surface cell at its place, or else the volume cell.
    pub cells: Vec<u32>,
    /// Sides with four corners.
    pub fans: Fans,
    /// How many surface cells are elsewhere.
    pub inner: usize,
}

/// The sides of all volume cells.
#[derive(Debug, Default)]
pub(in crate::io) struct Boundary {
    sides: Vec<Side>,
    /// Surface cells that cannot be on the boundary.
    others: usize,
}

impl Boundary {
    /// How many sides a cell of this type adds.
    ///
    /// # Errors
    /// As [`shape`].
    pub fn sides_of(kind: u8) -> Result<usize> {
        Ok(match shape(kind)? {
            Shape::None | Shape::Strip => 0,
            Shape::Polygon | Shape::Curved(_) | Shape::Pixel => 1,
            Shape::Solid(solid) => solid.sides.len(),
            Shape::Voxel => VOXEL.sides.len(),
        })
    }

    /// Bytes of memory for this many sides.
    pub fn byte_count(sides: usize) -> u64 {
        sides as u64 * size_of::<Side>() as u64
    }

    /// Makes room for this many sides.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn reserve(&mut self, sides: usize) -> Result<()> {
        reserve(&mut self.sides, sides, "the sides of volume cells")
    }

    /// Adds a cell with these corners among `count` points, of which the first is number `first` of all
    /// `vertices`.
    ///
    /// # Errors
    /// [`Error::Input`] for too few corners, and for those that do not exist.
    pub fn add(
        &mut self,
        (cell, kind): (u32, u8),
        corners: &[u64],
        (first, count): (u32, u32),
        vertices: &[DVec3],
    ) -> Result<()> {
        let refuse = |problem: String| Err(Error::input(Some(format!("cell {cell}")), problem, "repair it"));
        if let Some(bad) = corners.iter().find(|corner| **corner >= u64::from(count)) {
            return refuse(format!("there is no point {bad}, the file has {count}"));
        }
        // In range, as checked above.
        let at = |k: usize| corners.get(k).map_or(0, |corner| *corner as u32 + first);
        let (solid, order) = match shape(kind)? {
            Shape::None | Shape::Strip => return Ok(()),
            Shape::Polygon if corners.len() > 4 => {
                self.others += 1;
                return Ok(());
            }
            Shape::Polygon if corners.len() >= 3 => {
                let corners: Vec<u32> = (0..corners.len()).map(at).collect();
                self.push(&corners, cell, SURFACE_CELL);
                return Ok(());
            }
            Shape::Curved(needed) if corners.len() >= needed => {
                let corners: Vec<u32> = (0..needed).map(at).collect();
                self.push(&corners, cell, SURFACE_CELL);
                return Ok(());
            }
            Shape::Pixel if corners.len() == 4 => {
                self.push(&[0, 1, 3, 2].map(at), cell, SURFACE_CELL);
                return Ok(());
            }
            Shape::Solid(solid) if corners.len() >= solid.corners => (solid, [0, 1, 2, 3, 4, 5, 6, 7]),
            Shape::Voxel if corners.len() == 8 => (VOXEL, VOXEL_ORDER),
            _ => {
                return refuse(format!(
                    "a cell of type {kind} cannot have {}",
                    counted(corners.len(), ["corner", "corners"])
                ));
            }
        };
        let mut sides = [[u32::MAX; 4]; 6];
        for (side, places) in sides.iter_mut().zip(solid.sides) {
            side.iter_mut().zip(*places).for_each(|(to, k)| *to = at(order[*k]));
        }
        let sides = &mut sides[..solid.sides.len()];
        // Programs do not agree on the order of corners.
        if volume(sides, vertices) < 0.0 {
            for side in sides.iter_mut() {
                let corners = if side[3] == u32::MAX { 3 } else { 4 };
                side[..corners].reverse();
            }
        }
        for (number, side) in (0..).zip(sides) {
            let corners = if side[3] == u32::MAX { 3 } else { 4 };
            self.push(&side[..corners], cell, number);
        }
        Ok(())
    }

    /// Adds a side of three or four corners. Cells with corners that repeat are squeezed ones.
    fn push(&mut self, corners: &[u32], cell: u32, side: u8) {
        let mut own = [u32::MAX; 4];
        let mut count = 0;
        for corner in corners {
            if !own[..count].contains(corner) {
                own[count] = *corner;
                count += 1;
            }
        }
        if count >= 3 {
            self.sides.push(Side { corners: own, cell, data: cell, side });
        }
    }

    /// The triangles of the sides that one volume cell has, in the order of the cells.
    ///
    /// # Errors
    /// [`Error::Input`] if there is no side; [`Error::OutOfMemory`].
    pub fn finish(mut self) -> Result<Outside> {
        self.sides.sort_unstable_by_key(|side| (side.key(), side.cell, side.side));
        let mut inner = self.others;
        let mut kept = 0;
        let mut begin = 0;
        while begin < self.sides.len() {
            let key = self.sides[begin].key();
            let end = begin + self.sides[begin..].iter().take_while(|side| side.key() == key).count();
            let run = &self.sides[begin..end];
            let surface = run.iter().filter(|side| side.side == SURFACE_CELL).count();
            let mut solids = run.iter().filter(|side| side.side != SURFACE_CELL);
            match (solids.next().copied(), solids.next()) {
                (Some(mut only), None) => {
                    let on_it = run.iter().find(|side| side.side == SURFACE_CELL);
                    only.data = on_it.map_or(only.cell, |side| side.cell);
                    self.sides[kept] = only;
                    kept += 1;
                }
                _ => inner += surface,
            }
            begin = end;
        }
        self.sides.truncate(kept);
        if kept == 0 {
            let problem = "no side of its volume cells is on the outside";
            return Err(Error::input(None, problem, "check the cells for duplicates"));
        }
        self.sides.sort_unstable_by_key(|side| (side.cell, side.side));
        let mut found = Outside { inner, ..Outside::default() };
        reserve(&mut found.triangles, 2 * kept, "the boundary of volume cells")?;
        reserve(&mut found.cells, 2 * kept, "the boundary of volume cells")?;
        for side in &self.sides {
            match side.corners {
                [a, b, c, u32::MAX] => found.triangles.push([a, b, c]),
                [a, b, c, d] => {
                    found.fans.add(found.triangles.len(), 4);
                    found.triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
            found.cells.resize(found.triangles.len(), side.data);
        }
        Ok(found)
    }
}
