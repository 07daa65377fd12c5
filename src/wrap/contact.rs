//! The vertices of a surface just off its triangles, moved onto these.

use std::collections::HashSet;

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::TriMesh;
use crate::mesh::bvh::Bvh;
use crate::mesh::intersections::{intersecting_faces, intersecting_with};
use crate::mesh::position_key;
use crate::mesh::repair::is_flat;
use crate::mesh::triangle::doubled_normal;
use crate::mesh::unit_frame::UnitFrame;
use crate::{ProgressToken, Result};

/// Where the ball ends at most this many offsets from the triangles, vertices move onto these: into concave
/// edges of at least 75 degrees.
const NEAR: f64 = 1.3;
/// Where it ends farther from them than this, as in edges of 60 degrees, vertices stay with it; in between,
/// they go part of the way, so that there is no step.
const AWAY: f64 = 2.0;
/// How far behind a point of the triangles there must be room inside, in offsets, for a vertex to move onto
/// it.
const BEHIND: f64 = 1.5;
/// Shares of the way to the triangles for a mesh whose vertices are all off them. Along sharp edges, whole
/// rows of vertices would otherwise meet.
pub(super) const NEARLY: [f64; 4] = [0.98, 0.85, 0.5, 0.0];
/// Shares of the rest of the way.
pub(super) const WHOLLY: [f64; 2] = [1.0, 0.0];
/// Shares of the way of vertices that had to stay.
const PARTLY: [f64; 3] = [1.0, 0.5, 0.0];
/// A vertex had to stay if it is farther from where it belongs than this, in offsets.
const STUCK: f64 = 0.25;
/// Around fewer than one of this many triangles, intersections are looked for there alone.
const FEW: usize = 4;
/// After this many rounds, vertices around those that go back do so, too, one ring more in each further
/// round. Otherwise, a row of vertices may go back one after the other.
const PATIENT: usize = 8;
/// How often vertices that had to stay are moved, at the most.
const ROUNDS: usize = 4;
/// A vertex closer to the triangles than this, in offsets, lies on them.
const TOUCHING: f64 = 0.05;

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
    /// Moves vertices towards the triangles, as [`Contact::settle`] does.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn bring_near(&self, mesh: &mut TriMesh, shares: &[f64], progress: &ProgressToken) -> Result<()> {
        let goals: Vec<Option<DVec3>> = mesh.vertices.par_iter().map(|p| self.goal(*p)).collect();
        self.settle(mesh, &goals, shares, progress)
    }

    /// Moves vertices that had to stay far from where they belong to where the mean of their neighbours does,
    /// a few times.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn bring_the_rest_near(&self, mesh: &mut TriMesh, progress: &ProgressToken) -> Result<()> {
        for _ in 0..ROUNDS {
            progress.poll()?;
            let stuck: Vec<bool> = mesh.vertices.par_iter().map(|p| self.is_stuck(*p)).collect();
            if !stuck.contains(&true) {
                break;
            }
            let mut goals = means_of_neighbours(mesh, &stuck);
            goals.iter_mut().for_each(|mean| *mean = mean.and_then(|mean| self.goal(mean)));
            self.settle(mesh, &goals, &PARTLY, progress)?;
        }
        Ok(())
    }

    /// Moves vertices of a mesh without intersections towards their goals by the first of the `shares` of
    /// their way; where triangles then intersect, have no area or face inwards, or vertices are at one place,
    /// by the next. The last share is 0. After some rounds, vertices around these go back as well.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn settle(
        &self,
        mesh: &mut TriMesh,
        goals: &[Option<DVec3>],
        shares: &[f64],
        progress: &ProgressToken,
    ) -> Result<()> {
        let before = mesh.vertices.clone();
        // Of each vertex, how many of the shares were too large.
        let mut stages = vec![0; before.len()];
        let mut moving: Vec<u32> =
            (0..).zip(goals).filter(|(_, goal)| goal.is_some()).map(|(v, _)| v).collect();
        for round in 0.. {
            if moving.is_empty() {
                break;
            }
            for v in moving.iter().map(|v| *v as usize) {
                mesh.vertices[v] = goals[v].map_or(before[v], |goal| before[v].lerp(goal, shares[stages[v]]));
            }
            let can_go_back =
                |v: &u32| goals[*v as usize].is_some() && stages[*v as usize] + 1 < shares.len();
            let mut back = self.faulty(mesh, &moving, progress)?;
            back.retain(can_go_back);
            (PATIENT..=round).for_each(|_| with_neighbours(mesh, &mut back));
            back.retain(can_go_back);
            back.iter().for_each(|v| stages[*v as usize] += 1);
            moving = back;
        }
        Ok(())
    }

    /// Vertices of triangles that intersect others, have no area or face inwards, and those at one place,
    /// ascending; where `moved` vertices are the reason.
    fn faulty(&self, mesh: &TriMesh, moved: &[u32], progress: &ProgressToken) -> Result<Vec<u32>> {
        let around = faces_at(mesh, moved);
        let is_few = around.len() < mesh.triangles.len() / FEW;
        let intersecting = match is_few {
            true => intersecting_with(mesh, &around, progress)?,
            false => intersecting_faces(mesh, progress)?,
        };
        let is_turned = |t: &u32| {
            let corners = mesh.corners(*t as usize);
            is_flat(corners) || self.faces_inwards(corners)
        };
        let turned: Vec<u32> = around.into_par_iter().filter(is_turned).collect();
        let mut found = at_one_place(mesh, moved);
        found.extend(intersecting.into_iter().chain(turned).flat_map(|t| mesh.triangles[t as usize]));
        found.sort_unstable();
        found.dedup();
        Ok(found)
    }

    /// Whether a triangle of a surface is turned away from where the ball's centre goes: folded over beside a
    /// sharp edge, without a triangle that it intersects.
    fn faces_inwards(&self, corners: [DVec3; 3]) -> bool {
        let corners = corners.map(|p| self.frame.to_unit(p));
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        let outwards = self.rolled.closest(centre).map(|found| found.point - centre);
        outwards.is_some_and(|outwards| doubled_normal(corners).dot(outwards) < 0.0)
    }

    /// The fraction of the vertices of a mesh that lie on the triangles.
    pub fn on_input(&self, mesh: &TriMesh) -> f64 {
        let near = (TOUCHING * self.off).powi(2);
        let is_on = |p: &&DVec3| {
            self.input.closest(self.frame.to_unit(**p)).is_some_and(|found| found.distance_sq < near)
        };
        mesh.vertices.par_iter().filter(is_on).count() as f64 / mesh.vertices.len().max(1) as f64
    }

    /// Whether a vertex is off the triangles and far from where it belongs.
    fn is_stuck(&self, vertex: DVec3) -> bool {
        let far = STUCK * self.off;
        let on_input = self.input.closest(self.frame.to_unit(vertex));
        let is_off = on_input.is_some_and(|found| found.distance_sq > far * far);
        is_off && self.goal(vertex).is_some_and(|goal| goal.distance(vertex) > far * self.frame.scale)
    }

    /// Where a vertex belongs: on the triangles, or in a gap of these, where the ball ends. `None` if it
    /// stays.
    fn goal(&self, vertex: DVec3) -> Option<DVec3> {
        let p = self.frame.to_unit(vertex);
        let centre = self.rolled.closest(p)?.point;
        let inwards = (p - centre).normalize_or_zero();
        let ends = centre + self.ball * inwards;
        let found = self.input.closest(p)?;
        let away = ends.distance(found.point) / self.off;
        let goal = found.point.lerp(ends, ((away - NEAR) / (AWAY - NEAR)).clamp(0.0, 1.0));
        // Behind a single sheet it would be outside again.
        let behind = goal + BEHIND * self.off * inwards;
        let outside = (self.ball - 0.5 * self.off).powi(2);
        let is_thin = self.rolled.closest(behind).is_some_and(|found| found.distance_sq < outside);
        (!is_thin).then(|| self.frame.to_input_units(goal))
    }
}

/// For each vertex of a closed mesh that is wanted, the mean of its neighbours.
fn means_of_neighbours(mesh: &TriMesh, wanted: &[bool]) -> Vec<Option<DVec3>> {
    let mut sums = vec![(DVec3::ZERO, 0.0); mesh.vertices.len()];
    for triangle in &mesh.triangles {
        for k in (0..3).filter(|k| wanted[triangle[*k] as usize]) {
            let (sum, count) = &mut sums[triangle[k] as usize];
            *sum += mesh.vertices[triangle[(k + 1) % 3] as usize];
            *count += 1.0;
        }
    }
    sums.into_iter().map(|(sum, count)| (count > 0.0).then(|| sum / count)).collect()
}

/// The faces of a mesh that have one of these vertices, ascending.
fn faces_at(mesh: &TriMesh, vertices: &[u32]) -> Vec<u32> {
    let mut is_wanted = vec![false; mesh.vertices.len()];
    vertices.iter().for_each(|v| is_wanted[*v as usize] = true);
    let has_wanted = |t: &u32| mesh.triangles[*t as usize].iter().any(|v| is_wanted[*v as usize]);
    (0..mesh.triangles.len() as u32).filter(has_wanted).collect()
}

/// Adds to ascending vertices of a mesh their neighbours.
fn with_neighbours(mesh: &TriMesh, vertices: &mut Vec<u32>) {
    let around = faces_at(mesh, vertices);
    vertices.extend(around.into_iter().flat_map(|t| mesh.triangles[t as usize]));
    vertices.sort_unstable();
    vertices.dedup();
}

/// All vertices of a mesh at places that one of these shares with another vertex.
fn at_one_place(mesh: &TriMesh, vertices: &[u32]) -> Vec<u32> {
    let key = |v: u32| position_key(mesh.vertices[v as usize]);
    let places: HashSet<[u64; 3]> = vertices.iter().map(|v| key(*v)).collect();
    let there = (0..mesh.vertices.len() as u32).into_par_iter().filter(|v| places.contains(&key(*v)));
    let mut there: Vec<([u64; 3], u32)> = there.map(|v| (key(v), v)).collect();
    there.par_sort_unstable();
    let shared = there.chunk_by(|one, two| one.0 == two.0).filter(|at| at.len() > 1);
    shared.flatten().map(|(_, v)| *v).collect()
}
