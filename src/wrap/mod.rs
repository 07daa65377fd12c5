//! A closed surface around the outside of any triangles, such as soups, assemblies and open sheets.
//!
//! A ball rolls over all triangles from outside. What it cannot enter is filled: gaps narrower than the ball,
//! what is inside, what overlaps. The surface of the places that it reaches is that of a morphological
//! closing: first the level set of the distance from the triangles at the ball's radius, as far as it can be
//! reached from outside, then the level set of the distance from that one, back towards the triangles. Its
//! vertices near triangles then move onto these, unless both sides of a sheet would meet there. Where edges
//! of the surface then cut off a sharp edge of the triangles, vertices are put onto it.

mod contact;
mod lattice;
mod sharpen;

use rayon::prelude::*;

use crate::mesh::bvh::Bvh;
use crate::mesh::intersections::intersecting_faces;
use crate::mesh::level_set::{BLOCK_NODES, SparseGrid, extract};
use crate::mesh::repair::{RepairOptions, Repaired, repair_with_progress};
use crate::mesh::simplify::{Preserved, with_vertices};
use crate::mesh::submesh::without_unused_vertices;
use crate::mesh::unit_frame::UnitFrame;
use crate::progress::ProgressReporter;
use crate::{Error, Flow, Length, Phase, Progress, ProgressToken, Result, TriMesh};
use contact::{Contact, NEARLY, WHOLLY};
use lattice::Lattice;
use sharpen::Sharpener;

/// The radius of the ball over the detail.
const BALL: f64 = 0.5;
/// The side of the grid's cells over the ball's radius.
const SIDE: f64 = 2.0 / 3.0;
/// The distance of the second level set from the triangles, in sides: sheets are twice as thick, and cells
/// between both of their sides.
const OFF: f64 = 0.75;
/// Blocks are kept as far from the triangles as the ball's radius and this many sides.
const MORE: f64 = 3.0;
/// Values of nodes this many sides or more beyond a level set need not be known.
const BESIDE: f64 = 2.0;
/// Most blocks of the grid: 20 million nodes.
const MOST_BLOCKS: usize = 40_000;
/// Vertices that are kept of those of the second level set: along sharp edges, several are at one place.
const KEPT: f64 = 0.6;
/// How often sharp edges are put back; again for those whose vertices were in each other's way.
const SHARPENED: usize = 2;
/// The detail, over the diagonal, with which the work is finished early, at the least.
const ROUGH: f64 = 0.04;
/// The detail, over the diagonal, from which one is searched that is not too fine, and its factor.
const COARSE: f64 = 1.0;
/// See [`COARSE`].
const FINER: f64 = 0.8;
/// Details of more diagonals than this are refused: the surface would be a ball.
const MOST_DETAIL: f64 = 10.0;

/// How triangles are wrapped.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct WrapOptions {
    /// The diameter of the ball: gaps narrower than this are closed, and concave edges of less than 75
    /// degrees rounded. The surface stays within this distance of what the ball touches. Sheets without a
    /// thickness become half as thick as this.
    pub detail: Length,
    /// Repairs that come before: holes filled are not entered.
    pub repairs: RepairOptions,
}

impl Default for WrapOptions {
    /// One percent of the diagonal.
    fn default() -> Self {
        Self { detail: Length::OfDiagonal(0.01), repairs: RepairOptions::default() }
    }
}

impl WrapOptions {
    /// Sets [`WrapOptions::detail`].
    #[must_use]
    pub fn detail(self, detail: Length) -> Self {
        Self { detail, ..self }
    }

    /// Sets [`WrapOptions::repairs`].
    #[must_use]
    pub fn repairs(self, repairs: RepairOptions) -> Self {
        Self { repairs, ..self }
    }

    /// # Errors
    /// [`Error::Usage`] for what is out of range.
    pub fn validate(&self) -> Result<()> {
        let (Length::Units(detail) | Length::OfDiagonal(detail)) = self.detail;
        if !(detail.is_finite() && detail > 0.0) {
            let problem = format!("`wrap` {detail} is out of range");
            return Err(Error::option("wrap", problem, "give a length above 0, such as 1%"));
        }
        self.repairs.validate()
    }
}

/// A surface around triangles.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Wrapped {
    /// The surface: closed, manifold, facing outwards, without triangles that intersect others; with many
    /// small and uneven triangles, for [`crate::remesh`].
    pub mesh: TriMesh,
    /// The triangles that it is around.
    pub repaired: Repaired,
    /// The detail, in their unit: more than asked for if the work was finished early.
    pub detail: f64,
    /// The fraction of its vertices, 0 to 1, that lie on the triangles. Others are over gaps, keep off
    /// sheets, or would have turned triangles over.
    pub on_input: f64,
}

/// A closed surface around the outside of triangles, which need not be connected or oriented in any way.
///
/// # Errors
/// [`Error::Input`] for coordinates that are not finite, and without triangles; [`Error::Usage`] for a detail
/// that is out of range or so small that the grid would be too large.
pub fn wrap(mesh: &TriMesh, options: &WrapOptions) -> Result<Wrapped> {
    wrap_with_progress(mesh, options, |_| {})
}

/// Like [`wrap`], calling `progress` several times a second, as [`crate::remesh_with_progress`] does.
///
/// # Errors
/// As [`wrap`], and [`Error::Cancelled`] if `progress` asks for it.
pub fn wrap_with_progress<F: Into<Flow>>(
    mesh: &TriMesh,
    options: &WrapOptions,
    mut progress: impl FnMut(Progress) -> F,
) -> Result<Wrapped> {
    options.validate()?;
    let mut callback = |now| progress(now).into();
    let mut reporter = ProgressReporter::new(&mut callback);
    reporter.phase(Phase::Surface, 1.0, 1.0)?;
    reporter.during(|token| run(mesh, options, token))
}

fn run(mesh: &TriMesh, options: &WrapOptions, progress: &ProgressToken) -> Result<Wrapped> {
    let repaired = repair_with_progress(mesh, &options.repairs, progress)?;
    let frame = UnitFrame::of(&repaired.mesh)?;
    let detail = match options.detail {
        Length::Units(length) => length / frame.scale,
        Length::OfDiagonal(share) => share,
    };
    if detail > MOST_DETAIL {
        let problem = format!("a detail of {detail:.3e} diagonals leaves nothing of the shape");
        return Err(Error::option("wrap", problem, "ask for a small part of the diagonal, such as 1%"));
    }
    let vertices = repaired.mesh.vertices.iter().map(|p| frame.to_unit(*p)).collect();
    let placed = TriMesh { vertices, triangles: repaired.mesh.triangles.clone() };
    let rough = detail.max(ROUGH);
    let (found, detail) = progress.or_rough(
        |progress| Ok((around(&placed, detail, frame, progress)?, detail)),
        |progress| Ok((around(&placed, rough, frame, progress)?, rough)),
    )?;
    let (mesh, on_input) = found;
    Ok(Wrapped { mesh, repaired, detail: detail * frame.scale, on_input })
}

/// Around triangles in the unit-diagonal frame; the surface is in the unit of the input. With it comes the
/// fraction of its vertices that lie on triangles.
fn around(mesh: &TriMesh, detail: f64, frame: UnitFrame, progress: &ProgressToken) -> Result<(TriMesh, f64)> {
    let bvh = Bvh::new(mesh);
    let ball = BALL * detail;
    let side = SIDE * ball;
    let reach = ball + MORE * side;
    let Some((mut grid, lattice)) = Lattice::near(&bvh, side, reach, MOST_BLOCKS, progress)? else {
        return Err(too_fine(&bvh, detail, progress)?);
    };
    let distances = distances_of(&grid, &bvh, ball + BESIDE * side, |_| true, progress)?;
    let is_free: Vec<bool> = distances.par_iter().map(|d| f64::from(*d) > ball).collect();
    let outside = lattice.outside(&grid, &is_free);
    let signed = |(distance, outside): (&f32, &bool)| {
        let beyond = distance - ball as f32;
        if *outside { beyond } else { -beyond.abs() }
    };
    grid.values = distances.par_iter().zip(&outside).map(signed).collect();
    let rolled = extract(&grid, progress)?.mesh;
    let rolled = without_unused_vertices(&rolled, rolled.triangles.clone());
    let rolled_tree = Bvh::new(&rolled);
    let off = OFF * side;
    let back = (ball - off) as f32;
    // Blocks of cavities alone are far from there.
    let is_reached: Vec<bool> =
        outside.par_chunks(BLOCK_NODES).map(|nodes| nodes.iter().any(|outside| *outside)).collect();
    let is_beside = |block: [i32; 3]| {
        let near = (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]);
        near.map(|by| [0, 1, 2].map(|axis| block[axis] + by[axis]))
            .any(|at| grid.block(at).is_some_and(|block| is_reached[block]))
    };
    let back_to = ball - off + BESIDE * side;
    let from_rolled = distances_of(&grid, &rolled_tree, back_to, is_beside, progress)?;
    let closed = |(distance, outside): (&f32, &bool)| back + if *outside { *distance } else { -distance };
    grid.values = from_rolled.par_iter().zip(&outside).map(closed).collect();
    let found = extract(&grid, progress)?.mesh;
    let mut found = without_unused_vertices(&found, found.triangles.clone());
    found.vertices.par_iter_mut().for_each(|p| *p = frame.to_input_units(*p));
    let contact = Contact { input: &bvh, rolled: &rolled_tree, ball, off, frame };
    let sharpener = Sharpener { triangles: mesh, contact: &contact, side };
    let found = brought_near(found, &sharpener, progress)?;
    let on_input = contact.on_input(&found);
    Ok((found, on_input))
}

/// A surface just off the triangles, laid on these.
fn brought_near(mut mesh: TriMesh, sharpener: &Sharpener, progress: &ProgressToken) -> Result<TriMesh> {
    let contact = sharpener.contact;
    contact.bring_near(&mut mesh, &NEARLY, progress)?;
    let kept = (KEPT * mesh.vertices.len() as f64) as usize;
    let mut mesh = with_fewer_vertices(mesh, &[], kept, progress)?;
    let before = mesh.vertices.len();
    contact.bring_near(&mut mesh, &WHOLLY, progress)?;
    for _ in 0..SHARPENED {
        contact.bring_the_rest_near(&mut mesh, progress)?;
        sharpener.sharpen(&mut mesh, progress)?;
    }
    // Needles beside sharp edges go.
    let added = mesh.vertices.len() - before;
    let sharp = sharpener.sharp_edges(&mesh);
    with_fewer_vertices(mesh, &sharp, before - added.min(before), progress)
}

/// With `count` vertices, unless triangles would intersect. `curves` stay: of each half-edge whether it is on
/// one.
fn with_fewer_vertices(
    mesh: TriMesh,
    curves: &[bool],
    count: usize,
    progress: &ProgressToken,
) -> Result<TriMesh> {
    let preserved = Preserved { apart: true, curves, ..Default::default() };
    let fewer = with_vertices(&mesh, preserved, count, progress)?.mesh;
    // What was to be avoided was looked for around each change alone.
    Ok(if intersecting_faces(&fewer, progress)?.is_empty() { fewer } else { mesh })
}

/// The distance of each node of a grid from a surface. Where it is above `most`, a lower bound that is, too;
/// twice that in blocks that are not wanted, because they are farther away.
fn distances_of(
    grid: &SparseGrid,
    surface: &Bvh,
    most: f64,
    is_wanted: impl Fn([i32; 3]) -> bool + Sync,
    progress: &ProgressToken,
) -> Result<Vec<f32>> {
    let mut distances = vec![0.0; grid.values.len()];
    let of_block = |(values, block): (&mut [f32], &[i32; 3])| {
        progress.poll()?;
        if !is_wanted(*block) {
            values.fill(2.0 * most as f32);
            return Ok(());
        }
        let mut rank = 0;
        for number in 0..BLOCK_NODES {
            let known = |step: usize, layer: usize| if layer & 7 > 0 { values[number - step] } else { 0.0 };
            let largest = known(1, number).max(known(8, number >> 3)).max(known(64, number >> 6));
            let bound = f64::from(largest) - grid.side;
            values[number] = if bound > most {
                bound as f32
            } else {
                let p = grid.position(SparseGrid::node(*block, number));
                surface.closest_from(p, &mut rank).map_or(0.0, |found| found.distance_sq.sqrt() as f32)
            };
        }
        Ok(())
    };
    distances.par_chunks_mut(BLOCK_NODES).zip(grid.blocks()).try_for_each(of_block)?;
    Ok(distances)
}

/// The error for a grid that would be too large, with a detail for which it is not.
fn too_fine(bvh: &Bvh, detail: f64, progress: &ProgressToken) -> Result<Error> {
    let mut enough = COARSE;
    loop {
        let ball = BALL * FINER * enough;
        let (side, reach) = (SIDE * ball, ball + MORE * SIDE * ball);
        if Lattice::near(bvh, side, reach, MOST_BLOCKS, progress)?.is_none() {
            break;
        }
        enough *= FINER;
    }
    let problem = format!("a detail of {:.3} % of the diagonal needs too large a grid", 100.0 * detail);
    // Rounded up.
    let remedy = format!("ask for {:.3}% or more", (1e5 * enough).ceil() / 1e3);
    Ok(Error::option("wrap", problem, remedy))
}
