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

use super::LocalMesh;
use super::guard::Guard;
use super::star_mesh::StarMesh;
use crate::mesh::NONE;
use crate::mesh::polyline::Polyline;
use crate::polish::Target;
use crate::{ProgressToken, Result};
use penalty::LeastAngle;

/// Least gain of an edit.
const MIN_GAIN: f64 = 0.01;
/// What another vertex costs, since one goes elsewhere for it.
const COST_OF_VERTEX: f64 = 0.04;
/// Passes over all bad triangles.
const PASSES: u32 = 3;
/// An edit that leaves at most this share of the cost is taken at once.
const ENOUGH: f64 = 0.1;
/// Largest distance of a curve from its edges that a change may lead to, in spacings.
const STRAY: f64 = 0.03;

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
    least: LeastAngle,
    target: &'a Target,
    polylines: &'a [Polyline],
    spacing: f64,
    /// [`STRAY`] in the unit of the mesh.
    stray: f64,
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
    let least = LeastAngle(options.min_angle.to_radians());
    let is_bad = |mesh: &crate::TriMesh, t: &usize| least.is_missed(mesh.corners(*t));
    let count = |mesh: &crate::TriMesh| (0..mesh.triangles.len()).filter(|t| is_bad(mesh, t)).count();
    let mut mended = Mended { before: count(&local.mesh), ..Default::default() };
    if mended.before == 0 {
        return Ok(mended);
    }
    let polylines: Vec<Polyline> = local.sliding_curves.iter().map(|curve| curve.line.clone()).collect();
    let mending = Mending {
        least,
        target,
        polylines: &polylines,
        spacing: options.spacing,
        stray: STRAY * options.spacing,
        progress,
    };
    let mut mesh = StarMesh::from_local(local);
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
        if std::env::var("MENDLOG").is_ok() { eprintln!("pre-balance edits {edits} gained {gained} bad {}", mesh.triangles.iter().filter(|t| t[0]!=NONE && least.is_missed(mesh.corners(**t))).count()); }
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
    /// Tries each bad triangle once, the worst first; returns the number of edits.
    fn pass(&self, mesh: &mut StarMesh, vertices: usize) -> Result<usize> {
        let entry = |mesh: &StarMesh, t: u32| {
            let triangle = mesh.triangles[t as usize];
            if triangle[0] == NONE {
                return None;
            }
            let corners = mesh.corners(triangle);
            self.least.is_missed(corners).then(|| Reverse((LeastAngle::range(corners)[0].to_bits(), t)))
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
        let before = self.least.whole(&part.mesh);
        let surplus = mesh.used() as i64 - vertices as i64;
        let mut best = None;
        let mut least_gain = MIN_GAIN;
        for edit in Self::edits(&part.mesh, triangle) {
            let mut trial = part.clone();
            if !self.apply(&mut trial.mesh, edit) {
                continue;
            }
            let gained = Self::gained(&part, &trial);
            let cost = COST_OF_VERTEX * ((surplus + gained).abs() - surplus.abs()) as f64;
            let left = self.least.whole(&trial.mesh);
            let gain = before - left - cost;
            if gain > least_gain && trial.stays_apart_from(&part) && self.stays_close(&part, &trial) {
                (best, least_gain) = (Some(trial), gain);
                if left + cost < ENOUGH * before {
                    break;
                }
            }
        }
        mesh.put_back(&best?)
    }
}
