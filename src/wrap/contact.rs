//! The vertices of a surface just off its triangles, moved onto these.

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::TriMesh;
use crate::mesh::bvh::Bvh;
use crate::mesh::intersections::intersecting_faces;
use crate::mesh::repair::{is_flat, same_places};
use crate::mesh::unit_frame::UnitFrame;
use crate::{ProgressToken, Result};

/// A vertex farther from the triangles than this many times the offset spans a gap.
const FAR: f64 = 1.6;
/// How far behind a point of the triangles there must be room inside, in offsets, for a vertex to move onto
/// it.
const BEHIND: f64 = 1.5;
/// Shares of the way to the triangles for a mesh whose vertices are all off them. Along sharp edges, whole
/// rows of vertices would otherwise meet.
pub(super) const NEARLY: [f64; 4] = [0.98, 0.85, 0.5, 0.0];
/// Shares of the rest of the way.
pub(super) const WHOLLY: [f64; 2] = [1.0, 0.0];

/// What tells how far vertices move.
pub(super) struct Contact<'a> {
    /// The triangles.
    pub input: &'a Bvh,
    /// Where the ball's centre goes.
    pub rolled: &'a Bvh,
    /// The ball's radius.
    pub ball: f64,
    /// The distance of the surface from the triangles.
    pub off: f64,
    /// In which all these are; the mesh to be moved is in the unit of the input, in which its triangles must
    /// not intersect.
    pub frame: UnitFrame,
}

impl Contact<'_> {
    /// Moves vertices towards the triangles by the first of the `shares` of their way; where triangles then
    /// intersect, have no area or vertices are at one place, by the next. Returns the fraction of the
    /// vertices that went by the first.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn bring_near(&self, mesh: &mut TriMesh, shares: &[f64], progress: &ProgressToken) -> Result<f64> {
        let before = mesh.vertices.clone();
        let goals: Vec<Option<DVec3>> = before.par_iter().map(|p| self.goal(*p)).collect();
        // Of each vertex, how many of the shares were too large.
        let mut stages = vec![0; before.len()];
        loop {
            for (v, p) in mesh.vertices.iter_mut().enumerate() {
                *p = goals[v].map_or(before[v], |goal| before[v].lerp(goal, shares[stages[v]]));
            }
            let mut back = faulty(mesh, progress)?;
            back.retain(|v| goals[*v as usize].is_some() && stages[*v as usize] + 1 < shares.len());
            if back.is_empty() {
                break;
            }
            back.into_iter().for_each(|v| stages[v as usize] += 1);
        }
        let first = goals.iter().zip(&stages).filter(|(goal, stage)| goal.is_some() && **stage == 0);
        Ok(first.count() as f64 / goals.len().max(1) as f64)
    }

    /// The place of a vertex on the triangles; `None` if it stays.
    fn goal(&self, vertex: DVec3) -> Option<DVec3> {
        let p = self.frame.to_unit(vertex);
        let found = self.input.closest(p)?;
        let distance = found.distance_sq.sqrt();
        if distance > FAR * self.off {
            return None;
        }
        // Behind a single sheet it would be outside again.
        let inwards = (found.point - p).normalize_or_zero();
        let behind = found.point + BEHIND * self.off * inwards;
        let outside = (self.ball - 0.5 * self.off).powi(2);
        let is_thin = self.rolled.closest(behind).is_some_and(|found| found.distance_sq < outside);
        (!is_thin).then(|| self.frame.to_input_units(found.point))
    }
}

/// Vertices of triangles that intersect others or have no area, and those at one place, ascending.
fn faulty(mesh: &TriMesh, progress: &ProgressToken) -> Result<Vec<u32>> {
    let flat = (0..mesh.triangles.len()).filter(|t| is_flat(mesh.corners(*t))).map(|t| t as u32);
    let triangles = intersecting_faces(mesh, progress)?.into_iter().chain(flat);
    let mut found: Vec<u32> = triangles.flat_map(|t| mesh.triangles[t as usize]).collect();
    let again = (0..).zip(same_places(&mesh.vertices)).filter(|(own, first)| own != first);
    found.extend(again.flat_map(|(own, first)| [own, first]));
    found.sort_unstable();
    found.dedup();
    Ok(found)
}
