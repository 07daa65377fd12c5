//! Outliers: the few places where mesh and surface are still far apart after the fit, one by one.
//!
//! Evenly spread vertices meet a corner or the bottom of a fold only by chance. At each outlier a few edits
//! are tried: a vertex moves there, or an edge flips, and the vertices around are relaxed. The best edit
//! stays if it reduces the deviations nearby without a larger maximum or a worse triangle. Several outliers
//! are edited at the same time; where two edits overlap, the second is tried again.

mod context;
mod edit;
mod find;
mod known;
mod mesh_copy;
mod region;

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::{ConstrainedMesh, Target};
use crate::mesh::NONE;
use crate::{ProgressToken, Result};
use context::OutlierContext;
pub use context::OutlierOptions;
use edit::Change;
use find::{FarPlace, Found, find};
use known::{Known, KnownTriangles};
use mesh_copy::MeshCopy;
use region::Region;

/// Maximum number of edits in a row at one outlier, since one may not suffice.
const STEPS: u32 = 4;
/// Outliers that are edited at the same time; a constant, since the result must not depend on the number of
/// threads.
const TOGETHER: usize = 8;
/// Fewer triangles than this are looked at by one thread.
const FEW: usize = 32;

/// What [`reduce_outliers`] did.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReducedOutliers {
    /// Edits that were made.
    pub edits: usize,
    /// The places of the surface that are farther from the mesh than tolerated still, of those that were
    /// looked at.
    pub left: Vec<Outlier>,
}

/// A place of the surface that is far from the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlier {
    /// On the surface.
    pub at: DVec3,
    /// From the mesh.
    pub distance: f64,
}

/// Brings mesh and `target` closer where they are farthest apart. To finish early, the remaining outliers are
/// left as they are.
///
/// `edge` is the typical edge length of the mesh. The topology stays. Of the cache, only the tree is of use
/// afterwards. Panics if an index is out of range.
///
/// # Errors
/// [`crate::Error::Cancelled`]; the mesh is then as before.
pub fn reduce_outliers(
    constrained: &mut ConstrainedMesh,
    target: &Target,
    edge: f64,
    options: &OutlierOptions,
    progress: &ProgressToken,
) -> Result<ReducedOutliers> {
    if progress.leave_out() {
        return Ok(ReducedOutliers::default());
    }
    let curve_edges = &constrained.kept_edges(options.keeps_chords);
    let ConstrainedMesh { mesh, patches, fixed, lengths, cache, .. } = constrained;
    let context = OutlierContext { target, options, curve_edges, lengths, edge, progress };
    let Found { places: outliers, closest, ranks } = find(mesh, &context, cache)?;
    if outliers.is_empty() {
        return Ok(ReducedOutliers::default());
    }
    let mut points_of = vec![Vec::new(); mesh.triangles.len()];
    for (p, t) in (0..).zip(closest).filter(|(_, t)| *t != NONE) {
        points_of[t as usize].push(p);
    }
    let half_edges = cache.take(mesh.triangles.clone(), mesh.vertices.len(), patches);
    let first = MeshCopy::new(half_edges, mesh.vertices.clone(), fixed, context);
    let copies = rayon::current_num_threads().clamp(1, TOGETHER.min(outliers.len()));
    let mut reducer = OutlierReducer {
        changed: vec![1; mesh.triangles.len()],
        edits: 0,
        points_of,
        outliers,
        known: KnownTriangles::new(ranks),
        copies: Vec::new(),
    };
    reducer.copies.extend((1..copies).map(|_| first.clone()));
    reducer.copies.push(first);
    let all = (options.passes as usize * reducer.outliers.len()) as f64;
    let mut tried = vec![0; reducer.outliers.len()];
    'passes: for pass in 0..options.passes as usize {
        let before = reducer.edits;
        let mut tasks: Vec<Task> =
            (0..reducer.outliers.len()).map(|outlier| Task { outlier, step: 0 }).collect();
        while !tasks.is_empty() {
            let done = (pass + 1) * reducer.outliers.len() - tasks.len();
            progress.done(done as f64 / all)?;
            if progress.leave_out() {
                break 'passes;
            }
            reducer.round(&mut tasks, &mut tried);
        }
        if reducer.edits == before {
            break;
        }
    }
    let reduced = ReducedOutliers { edits: reducer.edits, left: reducer.left() };
    if let Some(copy) = reducer.copies.pop() {
        copy.into_mesh(mesh);
    }
    Ok(reduced)
}

/// An outlier that waits for its next edit.
struct Task {
    outlier: usize,
    /// Edits made so far.
    step: u32,
}

/// The mesh that is edited.
struct OutlierReducer<'a> {
    outliers: Vec<FarPlace>,
    /// For each triangle, the surface's vertices to which it is the closest.
    points_of: Vec<Vec<u32>>,
    known: KnownTriangles,
    /// Copies of the same mesh, for edits that are tried at the same time.
    copies: Vec<MeshCopy<'a>>,
    /// The number of the last edit that changed each triangle. If none did since an outlier was tried, trying
    /// it again is of no use.
    changed: Vec<usize>,
    edits: usize,
}

impl OutlierReducer<'_> {
    /// Makes one edit at each of the first outliers. They leave `tasks` unless another edit may follow.
    fn round(&mut self, tasks: &mut Vec<Task>, tried: &mut [usize]) {
        let later = tasks.split_off(tasks.len().min(TOGETHER));
        let mut chosen = Vec::new();
        let (copy, outliers, points_of) = (&self.copies[0], &self.outliers, &self.points_of);
        let region = |task: &Task| copy.region(outliers[task.outlier].triangle, points_of);
        let regions: Vec<Region> = tasks.par_iter().with_max_len(1).map(region).collect();
        for (task, region) in tasks.drain(..).zip(regions) {
            if task.step > 0 || !self.unchanged_since(&region.triangles, tried[task.outlier]) {
                chosen.push((task, region));
            }
        }
        let start = self.edits + 1;
        self.find_out(&chosen);
        let changes = self.changes(&chosen);
        for ((task, region), change) in chosen.into_iter().zip(changes) {
            if !self.unchanged_since(&region.triangles, start)
                || !self.unchanged_since(&region.adjacent, start)
            {
                tasks.push(task);
                continue;
            }
            tried[task.outlier] = start;
            if let Some(change) = change {
                self.commit(&region, &change);
                if task.step + 1 < STEPS {
                    tasks.push(Task { outlier: task.outlier, step: task.step + 1 });
                }
            }
        }
        tasks.extend(later);
    }

    /// Makes known what is needed of the triangles of some regions. What that is depends neither on the
    /// number of threads nor on who does it.
    fn find_out(&mut self, chosen: &[(Task, Region)]) {
        let mut needed: Vec<(u32, u16, f64)> = Vec::new();
        for (_, region) in chosen {
            let of_region = region.triangles.iter().zip(&region.owned);
            needed.extend(of_region.map(|(t, owned)| (*t, *owned, region.tolerance_sq)));
        }
        needed.sort_unstable_by_key(|(t, ..)| *t);
        needed.dedup_by(|next, one| {
            let is_same = next.0 == one.0;
            if is_same {
                *one = (one.0, one.1 | next.1, one.2.min(next.2));
            }
            is_same
        });
        let Some(copy) = self.copies.first() else { return };
        let of = |(t, owned, tolerance_sq): &(u32, u16, f64)| {
            let mut known = self.known.incomplete(*t, *owned, *tolerance_sq)?;
            copy.complete(&mut known, *t, *owned, *tolerance_sq);
            Some((*t, known))
        };
        let found: Vec<Option<(u32, Known)>> = needed.par_iter().with_min_len(FEW).map(of).collect();
        found.into_iter().flatten().for_each(|(t, known)| self.known.set(t, known));
    }

    /// Whether no edit after the one with the number `edit` changed any of the triangles.
    fn unchanged_since(&self, triangles: &[u32], edit: usize) -> bool {
        triangles.iter().all(|t| self.changed[*t as usize] <= edit)
    }

    /// The best change at each outlier, each as if it were the only one.
    fn changes(&mut self, chosen: &[(Task, Region)]) -> Vec<Option<Change>> {
        let (outliers, known, next) = (&self.outliers, &self.known, AtomicUsize::new(0));
        let best_changes = |copy: &mut MeshCopy| {
            let mut found = Vec::new();
            loop {
                let k = next.fetch_add(1, Ordering::Relaxed);
                let Some((task, region)) = chosen.get(k) else { break found };
                found.push((k, copy.best_change(&outliers[task.outlier], region, known)));
            }
        };
        let mut found: Vec<_> = self.copies.par_iter_mut().flat_map_iter(best_changes).collect();
        found.sort_unstable_by_key(|(k, _)| *k);
        found.into_iter().map(|(_, change)| change).collect()
    }

    /// The outliers that are beyond the tolerance still.
    fn left(&self) -> Vec<Outlier> {
        let Some(copy) = self.copies.last() else { return Vec::new() };
        let left = |far: &FarPlace| {
            let region = copy.region(far.triangle, &self.points_of);
            let distance = copy.distance_to(&region, far.at);
            (distance.powi(2) > region.tolerance_sq).then_some(Outlier { at: far.at, distance })
        };
        self.outliers.iter().filter_map(left).collect()
    }

    fn commit(&mut self, region: &Region, change: &Change) {
        self.edits += 1;
        region.triangles.iter().for_each(|t| self.changed[*t as usize] = self.edits + 1);
        self.copies[0].forget(region, change, &mut self.known);
        self.copies.iter_mut().for_each(|copy| copy.apply_change(region, change));
        self.copies[0].share_points(change, &mut self.points_of);
    }
}
