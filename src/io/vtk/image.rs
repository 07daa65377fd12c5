//! Values on a grid in VTK files: one array of the nodes, or of the voxels between them.

use glam::{DAffine3, DMat3, DVec3};

use super::array::{Array, Purpose};
use crate::io::checks::excerpt;
use crate::io::volumes::Volume;
use crate::io::volumes::raw::{Layout, check_frame, size};
use crate::{Error, Result};

/// Where the nodes of a grid are.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    /// Indices of the first node on each axis.
    pub first: [i64; 3],
    /// Nodes along each axis.
    pub nodes: [u64; 3],
    pub origin: DVec3,
    pub spacing: DVec3,
    /// The directions of the axes, in columns.
    pub directions: DMat3,
}

impl Default for Grid {
    /// Without nodes, as long as the file has not said where they are.
    fn default() -> Self {
        let (origin, spacing, directions) = (DVec3::ZERO, DVec3::ONE, DMat3::IDENTITY);
        Self { first: [0; 3], nodes: [0; 3], origin, spacing, directions }
    }
}

/// The volume of the array that programs show first, of the nodes if they have one.
///
/// # Errors
/// [`Error::Input`]: no array has one number a node, or it has too few; a grid that is flat.
pub(super) fn volume(grid: &Grid, points: &[Array], cells: &[Array], notes: Vec<String>) -> Result<Volume> {
    let mut notes = notes;
    let chosen = |arrays: &'_ [Array]| {
        let single = || arrays.iter().enumerate().filter(|(_, array)| array.components == 1);
        let shown = single().find(|(_, array)| array.purpose == Purpose::Scalars);
        shown.or_else(|| single().next()).map(|(at, _)| at)
    };
    let (array, is_of_voxels, all) = match (chosen(points), chosen(cells)) {
        (Some(at), _) => (&points[at], false, points),
        (None, Some(at)) => (&cells[at], true, cells),
        (None, None) => {
            let problem = "it has no array of one number for each node or voxel";
            return Err(Error::input(None, problem, "write one number per node"));
        }
    };
    let others = all.iter().filter(|other| other.components == 1).count() - 1;
    if others > 0 {
        let name = excerpt(&array.name);
        notes.push(format!("the array '{name}' was read; other arrays of the file were not"));
    }
    let lengths = grid.nodes.map(|nodes| if is_of_voxels { nodes.saturating_sub(1) } else { nodes });
    let (size, _) = size(&lengths)?;
    let half = if is_of_voxels { 0.5 } else { 0.0 };
    let first = DVec3::from_array(grid.first.map(|index| index as f64 + half));
    let matrix = grid.directions * DMat3::from_diagonal(grid.spacing);
    let frame = DAffine3 { matrix3: matrix, translation: grid.origin + matrix * first };
    check_frame(&frame)?;
    let layout = Layout {
        size,
        number: array.values.number,
        is_big_endian: array.values.is_big_endian,
        is_last_fastest: false,
        scale: [1.0, 0.0],
    };
    let place = format!("the array '{}'", excerpt(&array.name));
    layout.read(&array.values.bytes, &place, frame, notes)
}
