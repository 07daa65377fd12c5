//! Outliers: what the fit leaves, the few places where mesh and surface are farthest apart, one by one.
//!
//! Evenly spread vertices meet a corner or the bottom of a fold by chance only. At each such place a few
//! edits are tried: a vertex goes there, or an edge turns; the vertices around make room; and the best edit
//! stays if what is far nearby becomes less, the largest distance does not grow, and no triangle suffers.
//! Several spots are looked at together; where two get in each other's way, the second is looked at again.

mod edit;
mod find;
mod region;

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::Target;
use crate::{ProgressToken, Result, TriMesh};
use edit::{Change, Ground, Work};
use find::{Outlier, find};
use region::Region;

/// Distances below this share of the typical edge are left.
const FAR: f64 = 0.15;
/// Edits in a row at one spot: what is too far for one, some can do.
const STEPS: u32 = 4;
/// Outliers that are looked at together; a constant, for the result must not depend on the number of threads.
const TOGETHER: usize = 8;

/// Settings of [`reduce_outliers`].
#[derive(Debug, Clone, PartialEq)]
pub struct OutlierOptions {
    /// Times that all spots are tried; those around which nothing has changed since are left out.
    pub passes: u32,
    /// No angle may fall below this many degrees, unless it was smaller before.
    pub min_angle: f64,
    /// Vertices that stay where they are, besides those on a boundary; vertices beyond the end of the list
    /// are free.
    pub fixed: Vec<bool>,
    /// The patch of each triangle, in which it stays; nothing if there is but one.
    pub patches: Vec<u32>,
    /// The edge length wanted at each vertex, relative to the typical one; nothing if they are equal.
    pub lengths: Vec<f64>,
}

impl Default for OutlierOptions {
    fn default() -> Self {
        Self { passes: 2, min_angle: 38.0, fixed: Vec::new(), patches: Vec::new(), lengths: Vec::new() }
    }
}

/// Brings `mesh` and `target` closer where they are farthest apart, and returns the number of edits. To
/// finish early, it leaves out the edits that are left.
///
/// `edge` is the typical length of the mesh's edges. Keeps the topology. Panics if an index is out of range.
///
/// # Errors
/// [`crate::Error::Cancelled`]; `mesh` is then as before.
pub fn reduce_outliers(
    mesh: &mut TriMesh,
    target: &Target,
    edge: f64,
    options: &OutlierOptions,
    progress: &ProgressToken,
) -> Result<usize> {
    if progress.leave_out() {
        return Ok(0);
    }
    let ground = Ground { target, options, edge, progress };
    let (spots, points_of) = find(mesh, &ground)?;
    if spots.is_empty() {
        return Ok(0);
    }
    let first = Work::new(mesh, &ground);
    let copies = rayon::current_num_threads().clamp(1, TOGETHER.min(spots.len()));
    let mut mender =
        Mender { changed: vec![1; mesh.triangles.len()], edits: 0, points_of, spots, copies: Vec::new() };
    mender.copies.extend((1..copies).map(|_| first.clone()));
    mender.copies.push(first);
    let all = (options.passes as usize * mender.spots.len()) as f64;
    let mut tried = vec![0; mender.spots.len()];
    'passes: for pass in 0..options.passes as usize {
        let before = mender.edits;
        let mut tasks: Vec<Task> = (0..mender.spots.len()).map(|spot| Task { spot, step: 0 }).collect();
        while !tasks.is_empty() {
            let done = (pass + 1) * mender.spots.len() - tasks.len();
            progress.done(done as f64 / all)?;
            if progress.leave_out() {
                break 'passes;
            }
            mender.round(&mut tasks, &mut tried)?;
        }
        if mender.edits == before {
            break;
        }
    }
    let edits = mender.edits;
    if let Some(work) = mender.copies.pop() {
        work.into_mesh(mesh);
    }
    Ok(edits)
}

/// A spot that waits for its next edit.
struct Task {
    spot: usize,
    /// Edits made so far.
    step: u32,
}

/// The mesh under repair.
struct Mender<'a> {
    spots: Vec<Outlier>,
    /// The surface's vertices nearest to each triangle.
    points_of: Vec<Vec<u32>>,
    /// The same mesh many times over.
    copies: Vec<Work<'a>>,
    /// The number of the edit that last changed each triangle. Where nothing changed since a spot was tried,
    /// nothing can be done.
    changed: Vec<usize>,
    edits: usize,
}

impl Mender<'_> {
    /// Tries one edit at each of the first spots. Those leave `tasks` unless there is more to do.
    fn round(&mut self, tasks: &mut Vec<Task>, tried: &mut [usize]) -> Result<()> {
        let later = tasks.split_off(tasks.len().min(TOGETHER));
        let mut chosen = Vec::new();
        for task in tasks.drain(..) {
            let region = self.copies[0].region(self.spots[task.spot].triangle, &self.points_of);
            if task.step > 0 || !self.as_before(&region.triangles, tried[task.spot]) {
                chosen.push((task, region));
            }
        }
        let start = self.edits + 1;
        let changes = self.changes(&chosen)?;
        for ((task, region), change) in chosen.into_iter().zip(changes) {
            if !self.as_before(&region.triangles, start) || !self.as_before(&region.rim, start) {
                tasks.push(task);
                continue;
            }
            tried[task.spot] = start;
            if let Some(change) = change {
                self.commit(&region, &change);
                if task.step + 1 < STEPS {
                    tasks.push(Task { spot: task.spot, step: task.step + 1 });
                }
            }
        }
        tasks.extend(later);
        Ok(())
    }

    /// Whether triangles were last changed by an edit up to one of that number.
    fn as_before(&self, triangles: &[u32], edit: usize) -> bool {
        triangles.iter().all(|t| self.changed[*t as usize] <= edit)
    }

    /// What is to be changed at each spot, as if it were the only one.
    fn changes(&mut self, chosen: &[(Task, Region)]) -> Result<Vec<Option<Change>>> {
        let (spots, next) = (&self.spots, AtomicUsize::new(0));
        let mend = |work: &mut Work| {
            let mut found = Vec::new();
            loop {
                let k = next.fetch_add(1, Ordering::Relaxed);
                let Some((task, region)) = chosen.get(k) else { break found };
                found.push((k, work.mend(&spots[task.spot], region)));
            }
        };
        let mut found: Vec<_> = self.copies.par_iter_mut().flat_map_iter(mend).collect();
        found.sort_unstable_by_key(|(k, _)| *k);
        found.into_iter().map(|(_, change)| change).collect()
    }

    fn commit(&mut self, region: &Region, change: &Change) {
        self.edits += 1;
        region.triangles.iter().for_each(|t| self.changed[*t as usize] = self.edits + 1);
        self.copies.iter_mut().for_each(|work| work.change(region, change));
        self.copies[0].share_points(change, &mut self.points_of);
    }
}
