//! A connected mesh whose vertices move by the energy with the normals' term, with flips between.

use glam::DVec3;
use rayon::prelude::*;

use super::cells::Cells;
use super::flips::flip_edges;
use super::{CellQuadric, WEIGHT};
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::half_edges::next;
use crate::mesh::sizing::SizeField;
use crate::polish::locked::Locked;
use crate::polish::relax::{CHUNK, undo_bad_moves, vertex_normal};
use crate::polish::{ConstrainedMesh, Target, WORST_PASSES, is_fixed, turn_cosine, worst};
use crate::{ProgressToken, Result};

/// Rounds of moves and flips.
const ROUNDS: u32 = 16;
/// Share of the mean of the neighbours in where a vertex is drawn to, against the centroid of its cell.
const EVEN: f64 = 0.5;
/// Vertices at edges where the mesh turns by less are moved freely in the end: the cosine of 18 degrees.
const FLAT: f64 = 0.95;

/// Moves vertices onto ridges, with flips between that judge distances from the surface as well as angles.
/// Those in `held` stay when the worst triangles are improved in the end.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn line_up(
    constrained: &mut ConstrainedMesh,
    held: &[bool],
    (target, sizes): (&Target, &SizeField),
    progress: &ProgressToken,
) -> Result<()> {
    let mut cells = Cells::new(&constrained.mesh, (target, sizes));
    let mut half_edges = constrained.take_half_edges();
    let done = line_up_half_edges(&mut half_edges, (constrained, held), (target, &mut cells), progress);
    constrained.keep_half_edges(half_edges);
    done
}

fn line_up_half_edges(
    half_edges: &mut HalfEdgeMesh,
    (constrained, held): (&mut ConstrainedMesh, &[bool]),
    (target, cells): (&Target, &mut Cells),
    progress: &ProgressToken,
) -> Result<()> {
    let curve_edges = constrained.kept_edges(false);
    let ConstrainedMesh { mesh, fixed, .. } = &mut *constrained;
    let points = &mut mesh.vertices;
    let count = points.len();
    let fixed: Vec<bool> = (0..count).map(|v| is_fixed(half_edges, fixed, v)).collect();
    let locked = Locked { fixed: &fixed, curve_edges: &curve_edges };
    for _ in 0..ROUNDS {
        progress.poll()?;
        let all = (0..count as u32).into_par_iter().with_min_len(CHUNK);
        let normals: Vec<DVec3> = all.map(|v| vertex_normal(half_edges, points, v)).collect();
        cells.assign(points, &normals);
        let quadrics = cells.quadrics(points);
        let goal = |(v, quadric): (usize, &CellQuadric)| {
            let here = points[v];
            if fixed[v] || quadric.area <= 0.0 {
                return here;
            }
            let mut quadric = *quadric;
            let mean = neighbours_mean(half_edges, points, v as u32) - here;
            quadric.first = quadric.first.lerp(mean * quadric.area, EVEN);
            here + quadric.minimum(WEIGHT)
        };
        let mut moved: Vec<DVec3> = quadrics.par_iter().enumerate().with_min_len(CHUNK).map(goal).collect();
        undo_bad_moves(half_edges, points, &normals, &mut moved);
        *points = moved;
        flip_edges(half_edges, points, locked, target);
    }
    let is_held = |v: usize| held.get(v).copied().unwrap_or(false);
    let still: Vec<bool> =
        (0..count).map(|v| fixed[v] || is_held(v) || turns(half_edges, points, v as u32)).collect();
    worst::improve(half_edges, points, &mut vec![usize::MAX; count], &still, target, WORST_PASSES);
    Ok(())
}

fn neighbours_mean(half_edges: &HalfEdgeMesh, points: &[DVec3], v: u32) -> DVec3 {
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for h in half_edges.ring(v) {
        sum += points[half_edges.origin(next(h)) as usize];
        count += 1.0;
    }
    if count > 0.0 { sum / count } else { points[v as usize] }
}

/// Whether the mesh turns at an edge of a vertex.
fn turns(half_edges: &HalfEdgeMesh, points: &[DVec3], v: u32) -> bool {
    half_edges.ring(v).any(|h| turn_cosine(half_edges, points, h).is_some_and(|cosine| cosine < FLAT))
}
