//! Small angles mended by local edits: vertices move over the surface and along curves, edges are flipped,
//! collapsed and split. What is split in one place is collapsed in another, so that the number of vertices
//! stays.
//!
//! An edit is tried on the part of the mesh around a triangle with a small angle, together with the flips and
//! moves that follow from it, and kept if that lowers what the angles there cost.

mod angle_cost;
mod balance;
mod closeness;
mod edits;
mod smooth;

use std::cell::Cell;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use super::curve_edges::CurvePart;
use super::guard::Guard;
use super::part::Part;
use super::star_mesh::StarMesh;
use super::{CurveEdge, LocalMesh};
use crate::mesh::NONE;
use crate::mesh::polyline::Polyline;
use crate::polish::Target;
use crate::{ProgressToken, Result, TriMesh};
use angle_cost::AngleCost;
use edits::Edit;
use rayon::prelude::*;

/// Least gain of an edit.
const MIN_GAIN: f64 = 0.01;
/// What another vertex costs, since one goes elsewhere for it.
const COST_OF_VERTEX: f64 = 0.04;
/// Largest shares of the vertices that may come from elsewhere; at the second try none, since the first did not
/// get rid of them elsewhere.
const MOST_ADDED: [f64; 2] = [0.05, 0.0];
/// Passes over all triangles with small angles.
const PASSES: u32 = 3;
/// Moves alone that leave at most this share of the cost are enough.
const ENOUGH: f64 = 0.1;
/// Largest distance of a curve from its edges that a change may lead to, in spacings,
const STRAY: f64 = 0.03;
/// and of a boundary, which is ragged on scans.
const STRAY_OF_BOUNDARY: f64 = 0.2;

/// What [`mend_angles`] is to reach.
#[derive(Debug, Clone, Copy)]
pub struct MendOptions {
    /// Triangles with a smaller angle are mended; in degrees, up to 40.
    pub min_angle: f64,
    /// The typical edge length.
    pub spacing: f64,
}

/// What [`mend_angles`] did.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Mended {
    /// Edits that were kept.
    pub edits: usize,
    /// Vertices that these added, less those that they took away, before others went for them.
    pub added: i64,
    /// Vertices on curves and at corners.
    pub curve_vertices: usize,
    /// The former index of each vertex, [`NONE`] for new ones; empty if nothing has changed.
    pub origins: Vec<u32>,
}

/// What all edits share.
struct Mending<'a> {
    cost: AngleCost,
    target: &'a Target,
    polylines: &'a [Polyline],
    /// Largest distance of each curve from its edges, in spacings.
    strays: &'a [f64],
    spacing: f64,
    /// The number of vertices to end with.
    vertices: usize,
    /// By how many their number may differ meanwhile.
    most_added: i64,
    progress: &'a ProgressToken,
}

/// Mends triangles with small angles, as far as that keeps topology, curves and shape and makes no triangles
/// intersect; the number of vertices stays. `target` is the surface in the same patches. A mesh without small
/// angles stays as it is. Panics if an index is out of range.
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
    let is_small = |mesh: &TriMesh, t: usize| cost.small_angle(mesh.corners(t)).is_some();
    if !(0..local.mesh.triangles.len()).any(|t| is_small(&local.mesh, t)) {
        return Ok(Mended::default());
    }
    let polylines: Vec<Polyline> = local.sliding_curves.iter().map(|curve| curve.line.clone()).collect();
    let start = StarMesh::from_local(local);
    let strays = strays(&start, &local.curve_edges, polylines.len());
    for most_added in MOST_ADDED {
        let mending = Mending {
            cost,
            target,
            polylines: &polylines,
            strays: &strays,
            spacing: options.spacing,
            vertices: start.used(),
            most_added: (most_added * start.used() as f64) as i64,
            progress,
        };
        let mut mesh = start.clone();
        let done = Cell::new((0, 0));
        Guard { looks: true, progress }.run(&mut mesh, |mesh| {
            done.set(mending.mend_all(mesh)?);
            mending.balance(mesh)
        })?;
        let (edits, added) = done.get();
        if edits == 0 {
            break;
        }
        if mesh.used() == mending.vertices {
            let former = start.points.len() as u32;
            let origin = |v: u32| if v < former { v } else { NONE };
            let origins = (0..mesh.points.len() as u32).filter(|v| mesh.is_used(*v)).map(origin).collect();
            *local = mesh.into_local_mesh(&polylines);
            let curve_vertices = local.fixed.iter().filter(|fixed| **fixed).count();
            return Ok(Mended { edits, added, curve_vertices, origins });
        }
    }
    Ok(Mended::default())
}

/// How far each curve may be from its edges, in spacings.
fn strays(mesh: &StarMesh, curve_edges: &[CurveEdge], curves: usize) -> Vec<f64> {
    let mut strays = vec![STRAY; curves];
    for CurveEdge { ends: [a, b], curve, .. } in curve_edges {
        if mesh.at_edge(*a, *b).count() == 1 {
            strays[*curve as usize] = STRAY_OF_BOUNDARY;
        }
    }
    strays
}

impl Mending<'_> {
    /// How far the curve may be from an edge that stands for a part of it, in spacings.
    fn stray(&self, part: Option<CurvePart>) -> f64 {
        part.and_then(|part| self.strays.get(part.curve as usize)).copied().unwrap_or(STRAY)
    }

    /// Vertices beyond those to end with.
    fn surplus(&self, mesh: &StarMesh) -> i64 {
        mesh.used() as i64 - self.vertices as i64
    }

    /// Passes over all triangles with small angles; returns the number of edits and the surplus of vertices.
    fn mend_all(&self, mesh: &mut StarMesh) -> Result<(usize, i64)> {
        let mut history = History::default();
        for _ in 0..PASSES {
            let before = history.edits;
            self.pass(mesh, &mut history)?;
            if history.edits == before {
                break;
            }
        }
        Ok((history.edits, self.surplus(mesh)))
    }

    /// Tries each triangle with a small angle once, the smallest first, but for those around which nothing has
    /// changed since they were tried last.
    fn pass(&self, mesh: &mut StarMesh, history: &mut History) -> Result<()> {
        let entry = |mesh: &StarMesh, t: u32| {
            let triangle = mesh.triangles[t as usize];
            if triangle[0] == NONE {
                return None;
            }
            self.cost.small_angle(mesh.corners(triangle)).map(|angle| Reverse((angle.to_bits(), t)))
        };
        let all = 0..mesh.triangles.len() as u32;
        let mut small: BinaryHeap<Reverse<(u64, u32)>> = all.filter_map(|t| entry(mesh, t)).collect();
        while let Some(Reverse((_, t))) = small.pop() {
            if mesh.triangles[t as usize][0] == NONE {
                continue;
            }
            self.progress.poll()?;
            let part = mesh.part_around(&mesh.triangles[t as usize]);
            if history.is_known(t, &part) {
                continue;
            }
            match self.mended(&part, t, self.surplus(mesh)).and_then(|mended| mesh.put_back(&mended)) {
                Some(new) => {
                    history.edited(&part);
                    small.extend(new.into_iter().filter_map(|t| entry(mesh, t)));
                }
                None => history.failed(t),
            }
        }
        Ok(())
    }

    /// The part around a triangle after the best edit, if any is good enough; `surplus` is that of the mesh.
    fn mended(&self, part: &Part, t: u32, surplus: i64) -> Option<Part> {
        let triangle = part.find(t)?;
        let before = self.cost.of_all(&part.mesh);
        let trial = |edit: &Edit| {
            let mut trial = part.clone();
            if !self.apply(&mut trial.mesh, *edit) {
                return None;
            }
            let gained = trial.mesh.used() as i64 - part.mesh.used() as i64;
            let cost = self.cost.of_all(&trial.mesh) + self.cost_of_vertices(surplus, gained);
            (cost < before - MIN_GAIN).then_some((cost, trial))
        };
        let is_sound = |(_, trial): &(f64, Part)| self.is_sound(part, trial);
        let moved = trial(&Edit::None).filter(|(cost, _)| *cost < ENOUGH * before).filter(is_sound);
        let best = moved.or_else(|| {
            let edits = Edit::at(&part.mesh, triangle);
            let mut trials: Vec<(f64, Part)> = edits.par_iter().filter_map(trial).collect();
            // Stable, so that the order of the edits decides between equal ones.
            trials.sort_by(|p, q| p.0.total_cmp(&q.0));
            trials.into_iter().find(is_sound)
        });
        best.map(|(_, part)| part)
    }

    /// What vertices cost that an edit adds, or takes away.
    fn cost_of_vertices(&self, surplus: i64, gained: i64) -> f64 {
        let further = (surplus + gained).abs() - surplus.abs();
        if further > 0 && (surplus + gained).abs() > self.most_added {
            return f64::INFINITY;
        }
        COST_OF_VERTEX * further as f64
    }

    /// Whether a changed part stays close to the surface, and no more of its triangles intersect.
    fn is_sound(&self, before: &Part, after: &Part) -> bool {
        after.stays_apart_from(before) && self.stays_close(before, after)
    }
}

/// What was tried where.
#[derive(Default)]
struct History {
    edits: usize,
    /// How many edits had been kept when a triangle was last tried in vain,
    failed: HashMap<u32, usize>,
    /// and when one changed something at a vertex.
    changed: HashMap<u32, usize>,
}

impl History {
    /// Whether a triangle was tried in vain and nothing has changed in the part around it since.
    fn is_known(&self, t: u32, part: &Part) -> bool {
        let Some(failed) = self.failed.get(&t) else { return false };
        part.vertices().iter().all(|v| self.changed.get(v).is_none_or(|changed| changed <= failed))
    }

    fn failed(&mut self, t: u32) {
        self.failed.insert(t, self.edits);
    }

    fn edited(&mut self, part: &Part) {
        self.edits += 1;
        self.changed.extend(part.vertices().iter().map(|v| (*v, self.edits)));
    }
}
