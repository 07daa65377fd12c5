//! Bad angles mended by local edits: vertices move over the surface and along curves, edges are flipped,
//! collapsed and split, and what is split in one place is collapsed in another, so that the number of vertices
//! stays.
//!
//! An edit is tried on the part of the mesh around a bad triangle, with the flips and moves that follow from
//! it, and kept if that lowers the cost of all angles there.

mod balance;
mod closeness;
mod edits;
mod penalty;
mod smooth;

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::curve_edges::CurvePart;
use super::{CurveEdge, LocalMesh};
use super::guard::Guard;
use super::part::Part;
use super::star_mesh::StarMesh;
use crate::mesh::NONE;
use crate::mesh::polyline::Polyline;
use crate::polish::Target;
use crate::{ProgressToken, Result, TriMesh};
use rayon::prelude::*;
use edits::Edit;
use penalty::AngleCost;

/// Least gain of an edit.
const MIN_GAIN: f64 = 0.01;
/// What another vertex costs, since one goes elsewhere for it.
const COST_OF_VERTEX: f64 = 0.04;
/// Passes over all bad triangles.
const PASSES: u32 = 3;
/// An edit that leaves at most this share of the cost is taken at once.
const ENOUGH: f64 = 0.1;
/// Largest distance of a curve from its edges that a change may lead to, in spacings,
const STRAY: f64 = 0.03;
/// and of a boundary, which is ragged on scans.
const STRAY_OF_BOUNDARY: f64 = 0.2;

/// What [`mend_angles`] is to reach.
#[derive(Debug, Clone, Copy)]
pub struct MendOptions {
    /// In degrees; what is smaller is mended.
    pub min_angle: f64,
    /// The typical edge length.
    pub spacing: f64,
}

/// What [`mend_angles`] did.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Mended {
    /// Triangles with a smaller angle before,
    pub before: usize,
    /// and after it.
    pub after: usize,
    /// Edits that were kept.
    pub edits: usize,
    /// Vertices that edits added, without those that they took away, before others went for them.
    pub gained: i64,
    /// The former index of each vertex, [`NONE`] for new ones; empty if nothing has changed.
    pub origins: Vec<u32>,
}

/// What all edits share.
struct Mending<'a> {
    cost: AngleCost,
    target: &'a Target,
    polylines: &'a [Polyline],
    spacing: f64,
    /// Of each curve, in spacings.
    strays: Vec<f64>,
    progress: &'a ProgressToken,
}

/// Mends triangles with too small angles; the number of vertices stays. `target` is the surface in the same
/// patches. The mesh stays as it is where none is too small.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub fn mend_angles(
    local: &mut LocalMesh,
    target: &Target,
    options: &MendOptions,
    progress: &ProgressToken,
) -> Result<Mended> {
    let cost = AngleCost::new(options.min_angle);
    let is_bad = |mesh: &TriMesh, t: &usize| cost.missed(mesh.corners(*t)).is_some();
    let count = |mesh: &TriMesh| (0..mesh.triangles.len()).filter(|t| is_bad(mesh, t)).count();
    let mut mended = Mended { before: count(&local.mesh), ..Default::default() };
    if mended.before == 0 {
        return Ok(mended);
    }
    let polylines: Vec<Polyline> = local.sliding_curves.iter().map(|curve| curve.line.clone()).collect();
    let mut mesh = StarMesh::from_local(local);
    let mut strays = vec![STRAY; polylines.len()];
    for CurveEdge { ends: [a, b], curve, .. } in &local.curve_edges {
        if mesh.at_edge(*a, *b).count() == 1 {
            strays[*curve as usize] = STRAY_OF_BOUNDARY;
        }
    }
    let mending = Mending {
        strays,
        cost,
        target,
        polylines: &polylines,
        spacing: options.spacing,
        progress,
    };
    let (vertices, former) = (mesh.used(), mesh.points.len() as u32);
    let done = std::cell::Cell::new((0, 0));
    Guard { looks: true, progress }.run(&mut mesh, |mesh| {
        let (mut edits, mut gained) = (0, 0);
        for _ in 0..PASSES {
            let of_pass = mending.pass(mesh, vertices)?;
            edits += of_pass;
            if of_pass == 0 {
                break;
            }
        }
        gained += mesh.used() as i64 - vertices as i64;
        done.set((edits, gained));
        if std::env::var("MENDLOG").is_ok() { eprintln!("pre-balance edits {edits} gained {gained} bad {}", mesh.triangles.iter().filter(|t| t[0]!=NONE && cost.missed(mesh.corners(**t)).is_some()).count()); }
        if std::env::var("NOBAL").is_ok() { return Ok(()); }
        mending.balance(mesh, vertices)
    })?;
    (mended.edits, mended.gained) = done.get();
    if mended.edits == 0 {
        mended.after = mended.before;
        return Ok(mended);
    }
    let origin = |v: u32| if v < former { v } else { NONE };
    mended.origins = (0..mesh.points.len() as u32).filter(|v| mesh.is_used(*v)).map(origin).collect();
    *local = mesh.into_local_mesh(&polylines);
    mended.after = count(&local.mesh);
    if std::env::var("MENDLOG").is_ok() { eprintln!("mend {} -> {} edits {} gained {}", mended.before, mended.after, mended.edits, mended.gained); }
    Ok(mended)
}

impl Mending<'_> {
    /// How far a curve may be from an edge that stands for a part of it, in spacings.
    fn stray(&self, part: Option<CurvePart>) -> f64 {
        part.and_then(|part| self.strays.get(part.curve as usize)).copied().unwrap_or(STRAY)
    }

    /// Tries each bad triangle once, the worst first; returns the number of edits.
    fn pass(&self, mesh: &mut StarMesh, vertices: usize) -> Result<usize> {
        let entry = |mesh: &StarMesh, t: u32| {
            let triangle = mesh.triangles[t as usize];
            if triangle[0] == NONE {
                return None;
            }
            self.cost.missed(mesh.corners(triangle)).map(|angle| Reverse((angle.to_bits(), t)))
        };
        let all = 0..mesh.triangles.len() as u32;
        let mut bad: BinaryHeap<Reverse<(u64, u32)>> = all.filter_map(|t| entry(mesh, t)).collect();
        let mut edits = 0;
        while let Some(Reverse((_, t))) = bad.pop() {
            if mesh.triangles[t as usize][0] == NONE {
                continue;
            }
            self.progress.poll()?;
            let Some(new) = self.mend(mesh, t, vertices) else { continue };
            edits += 1;
            bad.extend(new.into_iter().filter_map(|t| entry(mesh, t)));
        }
        Ok(edits)
    }

    /// Mends what is around a triangle; returns the triangles there, if it could.
    fn mend(&self, mesh: &mut StarMesh, t: u32, vertices: usize) -> Option<Vec<u32>> {
        let part = mesh.part_around(&mesh.triangles[t as usize]);
        let triangle = part.find(t)?;
        let before = self.cost.whole(&part.mesh);
        let surplus = mesh.used() as i64 - vertices as i64;
        let trial = |edit: &Edit| {
            let mut trial = part.clone();
            if !self.apply(&mut trial.mesh, *edit) {
                return None;
            }
            let gained = trial.mesh.used() as i64 - part.mesh.used() as i64;
            let of_vertices = COST_OF_VERTEX * ((surplus + gained).abs() - surplus.abs()) as f64;
            let cost = self.cost.whole(&trial.mesh) + of_vertices;
            (cost < before - MIN_GAIN).then_some((cost, trial))
        };
        let is_fine = |(_, trial): &(f64, Part)| trial.stays_apart_from(&part) && self.stays_close(&part, trial);
        // Moves alone are often enough.
        let moved = trial(&Edit::None).filter(|(cost, _)| *cost < ENOUGH * before).filter(is_fine);
        let best = moved.or_else(|| {
            let edits = Self::edits(&part.mesh, triangle);
            let mut trials: Vec<(f64, Part)> = edits.par_iter().filter_map(trial).collect();
            trials.sort_by(|p, q| p.0.total_cmp(&q.0));
            trials.into_iter().find(is_fine)
        });
        mesh.put_back(&best?.1)
    }
}
