//! Small angles, and obtuse ones at curves, mended by local edits: vertices move over the surface and along
//! curves, edges are flipped, collapsed and split. What is split in one place is collapsed in another, so
//! that the number of vertices stays.
//!
//! An edit is tried on the part of the mesh around a triangle with a small angle, together with the flips and
//! moves that follow from it, and kept if that lowers what the angles there cost.

mod angle_cost;
mod balance;
mod closeness;
mod edits;
mod nearby;
mod smooth;

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use super::curve_edges::CurvePart;
use super::part::Part;
use super::star_mesh::{Place, StarMesh};
use crate::mesh::NONE;
use crate::mesh::polyline::Polyline;
use crate::polish::{ConstrainedMesh, Target};
use crate::{ProgressToken, Result};
use angle_cost::AngleCost;
use edits::Edit;
use nearby::Nearby;
use rayon::prelude::*;

/// Minimum gain of an edit.
const MIN_GAIN: f64 = 0.01;
/// What another vertex costs, since one goes elsewhere for it.
const COST_OF_VERTEX: f64 = 0.04;
/// Largest shares of the vertices that may come from elsewhere; at the second try none, since the first did
/// not get rid of them elsewhere.
const MOST_ADDED: [f64; 2] = [0.1, 0.0];
/// Passes over all triangles with small angles.
const PASSES: u32 = 3;
/// No more triangles are tried once more than this many were tried in vain, plus one for each edit and
/// [`IN_VAIN_PER_VERTEX`] for each vertex: then the surface has more details than the mesh has vertices for.
const IN_VAIN: usize = 20;
/// Triangles that may be tried in vain for each vertex of the mesh, in addition to [`IN_VAIN`].
const IN_VAIN_PER_VERTEX: f64 = 0.02;
/// Maximum of [`IN_VAIN`] and [`IN_VAIN_PER_VERTEX`] together, however many vertices there are.
const MOST_IN_VAIN: usize = 300;
/// Edits that leave at most this share of the cost are enough.
const ENOUGH: f64 = 0.1;
/// Largest distance of a curve from its edges that a change may lead to, in spacings.
const STRAY: f64 = 0.03;
/// Largest distance that a change may lead to at a ragged curve that no user has drawn, in spacings: such
/// curves are the ends of scans, or creases that follow a scan's triangles.
const STRAY_OF_RAGGED: f64 = 0.2;
/// A curve is ragged if its raggedness exceeds this, in radians, and it has [`LEAST_BENDS`]. The raggedness
/// is 0 to 4 degrees on CAD parts, 5 to 65 on scans.
const RAGGED: f64 = 0.1;
/// A ragged curve has at least this many bends: fewer may be intended.
const LEAST_BENDS: usize = 6;

/// Angles whose difference is below this are the same, in radians.
const SAME: f64 = 1e-9;

/// What [`mend_angles`] is to reach.
#[derive(Debug, Clone, Copy)]
pub struct MendOptions {
    /// Triangles with a smaller angle are mended; in degrees, up to 40, 0 for none.
    pub min_angle: f64,
    /// The typical edge length.
    pub spacing: f64,
    /// The distance from the surface that a change may lead to, if not 0.1 edge lengths; the number of
    /// vertices may change then, and none are spent on obtuse triangles.
    pub deviation: Option<f64>,
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
    deviation: Option<f64>,
    /// The number of vertices to end with.
    vertices: usize,
    /// By how many their number may differ meanwhile.
    most_added: i64,
    progress: &'a ProgressToken,
}

/// Mends triangles with small angles, and obtuse ones with a vertex on a curve, as far as that keeps
/// topology, curves and shape and makes no triangles intersect; the number of vertices stays. `target` is the
/// surface in the same patches. A mesh without such triangles stays as it is. Panics if an index is out of
/// range.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub fn mend_angles(
    local: &mut ConstrainedMesh,
    target: &Target,
    options: &MendOptions,
    progress: &ProgressToken,
) -> Result<Mended> {
    let cost = AngleCost::new(options.min_angle, options.deviation.is_none());
    let is_bad = |(t, triangle): (usize, &[u32; 3])| {
        let is_at_curve = triangle.iter().any(|v| local.fixed.get(*v as usize).is_some_and(|fixed| *fixed));
        cost.rank(local.mesh.corners(t), is_at_curve).is_some()
    };
    let has_bad = || local.mesh.triangles.par_iter().enumerate().any(is_bad);
    if options.min_angle == 0.0 || !has_bad() || progress.leave_out() {
        return Ok(Mended::default());
    }
    let polylines: Vec<Polyline> = local.sliding_curves.iter().map(|curve| curve.line.clone()).collect();
    let start = StarMesh::from_constrained(local);
    let strays: Vec<f64> = polylines.iter().map(stray).collect();
    for most_added in MOST_ADDED {
        let mending = Mending {
            cost,
            target,
            polylines: &polylines,
            strays: &strays,
            spacing: options.spacing,
            deviation: options.deviation,
            vertices: start.used(),
            most_added: (most_added * start.used() as f64) as i64,
            progress,
        };
        let mut mesh = start.clone();
        let mut state = State::new(&mesh, options.spacing);
        mending.mend_all(&mut mesh, &mut state)?;
        let (edits, added) = (state.edits, mending.surplus(&mesh));
        if options.deviation.is_none() {
            mending.balance(&mut mesh, &mut state)?;
        }
        if edits == 0 {
            break;
        }
        if mesh.used() == mending.vertices || options.deviation.is_some() {
            let former = start.points.len() as u32;
            let origin = |v: u32| if v < former { v } else { NONE };
            let origins = (0..mesh.points.len() as u32).filter(|v| mesh.is_used(*v)).map(origin).collect();
            *local = mesh.into_constrained(&polylines);
            let curve_vertices = local.fixed.iter().filter(|fixed| **fixed).count();
            return Ok(Mended { edits, added, curve_vertices, origins });
        }
    }
    Ok(Mended::default())
}

/// How far a curve may be from its edges, in spacings.
fn stray(line: &Polyline) -> f64 {
    let is_ragged = !line.is_drawn() && line.bends() >= LEAST_BENDS && line.raggedness() > RAGGED;
    if is_ragged { STRAY_OF_RAGGED } else { STRAY }
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

    /// Passes over all triangles with small angles.
    fn mend_all(&self, mesh: &mut StarMesh, state: &mut State) -> Result<()> {
        for _ in 0..PASSES {
            let before = state.edits;
            self.pass(mesh, state)?;
            if state.edits == before {
                break;
            }
        }
        Ok(())
    }

    /// Tries each triangle with a small angle once, the smallest first, except for those around which nothing
    /// has changed since they were tried last.
    fn pass(&self, mesh: &mut StarMesh, state: &mut State) -> Result<()> {
        let entry = |mesh: &StarMesh, t: u32| {
            let triangle = mesh.triangles[t as usize];
            if triangle[0] == NONE {
                return None;
            }
            let is_at_curve = triangle.iter().any(|v| mesh.places[*v as usize] != Place::Inside);
            let rank = self.cost.rank(mesh.corners(triangle), is_at_curve)?;
            Some(Reverse((rank.to_bits(), t)))
        };
        let all = 0..mesh.triangles.len() as u32;
        let in_vain = IN_VAIN + (IN_VAIN_PER_VERTEX * self.vertices as f64) as usize;
        let in_vain = in_vain.min(MOST_IN_VAIN);
        let mut small: BinaryHeap<Reverse<(u64, u32)>> = all.filter_map(|t| entry(mesh, t)).collect();
        while let Some(Reverse((_, t))) = small.pop() {
            if mesh.triangles[t as usize][0] == NONE || self.is_corner_of_curves(mesh, t) {
                continue;
            }
            if state.in_vain > in_vain + state.edits || self.progress.leave_out() {
                break;
            }
            self.progress.poll()?;
            let part = mesh.part_around(&mesh.triangles[t as usize]);
            if state.is_known(t, &part) {
                continue;
            }
            let mended = self.best_edit(mesh, &part, t, &state.nearby);
            match mended.and_then(|mended| mesh.put_back(&mended)) {
                Some(new) => {
                    state.record_edit(mesh, &part, &new);
                    small.extend(new.into_iter().filter_map(|t| entry(mesh, t)));
                }
                None => state.record_failure(t),
            }
        }
        Ok(())
    }

    /// Whether the smallest angle of a triangle is that of two curves at a corner, which no edit changes.
    fn is_corner_of_curves(&self, mesh: &StarMesh, t: u32) -> bool {
        let triangle = mesh.triangles[t as usize];
        let is_at = |k: usize| {
            let [v, a, b] = [k, k + 1, k + 2].map(|k| triangle[k % 3]);
            let [p, q, r] = mesh.corners([v, a, b]);
            mesh.places[v as usize] == Place::Corner
                && mesh.curves.contains(v, a)
                && mesh.curves.contains(v, b)
                && self
                    .cost
                    .small_angle([p, q, r])
                    .is_some_and(|least| (q - p).angle_between(r - p) <= least + SAME)
        };
        (0..3).any(is_at)
    }

    /// The part around a triangle after the best edit, if any is good enough.
    fn best_edit(&self, mesh: &StarMesh, part: &Part, t: u32, nearby: &Nearby) -> Option<Part> {
        let triangle = part.corners_of(t)?;
        let surplus = self.surplus(mesh);
        let before = self.cost.of_all(&part.mesh);
        let is_obtuse = self.cost.small_angle(part.mesh.corners(triangle)).is_none();
        let trial = |edit: &Edit| {
            let mut trial = part.clone();
            if !self.apply(&mut trial.mesh, *edit) {
                return None;
            }
            let gained = trial.mesh.used() as i64 - part.mesh.used() as i64;
            let cost = self.cost.of_all(&trial.mesh) + self.cost_of_vertices(surplus, gained);
            (cost < before - MIN_GAIN).then_some((cost, trial))
        };
        let is_sound = |(_, trial): &(f64, Part)| self.is_sound(mesh, nearby, part, trial);
        let mut best: Option<(f64, Part)> = None;
        for mut edits in Edit::at(&part.mesh, triangle) {
            if is_obtuse {
                edits.retain(|edit| matches!(edit, Edit::None | Edit::Flip(..)));
            }
            let mut trials: Vec<(f64, Part)> = edits.par_iter().filter_map(trial).collect();
            // Stable, so that the order of the edits decides between equal ones.
            trials.sort_by(|p, q| p.0.total_cmp(&q.0));
            let better = |(cost, _): &(f64, Part)| best.as_ref().is_none_or(|(least, _)| cost < least);
            if let Some(found) = trials.into_iter().take_while(better).find(is_sound) {
                best = Some(found);
            }
            if best.as_ref().is_some_and(|(cost, _)| *cost < ENOUGH * before) {
                break;
            }
        }
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
    fn is_sound(&self, mesh: &StarMesh, nearby: &Nearby, before: &Part, after: &Part) -> bool {
        nearby.stays_apart(mesh, before, after) && self.stays_close(before, after)
    }
}

/// What was tried where.
struct State {
    nearby: Nearby,
    edits: usize,
    /// Triangles tried in vain.
    in_vain: usize,
    /// How many edits had been kept when a triangle was last tried in vain.
    failed: HashMap<u32, usize>,
    /// How many edits had been kept when one last changed something at a vertex.
    changed: HashMap<u32, usize>,
}

impl State {
    fn new(mesh: &StarMesh, spacing: f64) -> Self {
        let nearby = Nearby::new(mesh, spacing);
        Self { nearby, edits: 0, in_vain: 0, failed: HashMap::new(), changed: HashMap::new() }
    }

    /// Whether a triangle was tried in vain and nothing has changed in the part around it since.
    fn is_known(&self, t: u32, part: &Part) -> bool {
        let Some(failed) = self.failed.get(&t) else { return false };
        part.vertices().iter().all(|v| self.changed.get(v).is_none_or(|changed| changed <= failed))
    }

    fn record_failure(&mut self, t: u32) {
        self.in_vain += 1;
        self.failed.insert(t, self.edits);
    }

    /// Notes that a part was put back changed, with these triangles.
    fn record_edit(&mut self, mesh: &StarMesh, part: &Part, new: &[u32]) {
        self.edits += 1;
        self.changed.extend(part.vertices().iter().map(|v| (*v, self.edits)));
        new.iter().for_each(|t| self.nearby.add(mesh, *t));
    }
}
