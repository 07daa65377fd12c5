//! The number of vertices restored after edits have changed it.

use super::edits::Edit;
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};

use super::{Mending, State};
use crate::Result;
use crate::local::part::Part;
use crate::local::star_mesh::{Place, StarMesh};

/// Costs of angles that taking a vertex away, or adding one, may lead to; those without come first.
const COSTS: [f64; 4] = [0.003, 0.02, 0.1, 0.4];
/// Relaxations around a changed edge.
const RELAXATIONS: u32 = 2;
/// Edges that are tried at a time by all threads.
const BATCH: usize = 64;
/// Batches that are still tried once the work is to finish early, since without them all edits are lost.
const LATE: usize = 16;

/// An edge taken away or split, on the part of the mesh around it.
struct Trial {
    before: Part,
    after: Part,
    /// What the angles cost more than before.
    harm: f64,
}

/// What is known of edges that were tried.
#[derive(Default)]
struct Known {
    /// How many changes had been made before an edge was last tried, and its harm: infinite if it could not
    /// be done.
    harms: HashMap<(u32, u32), (usize, f64)>,
    /// The number of the last change at each vertex.
    changed: HashMap<u32, usize>,
    changes: usize,
}

impl Known {
    /// The harm of an edge with this part around it, unless something has changed there since it was tried.
    fn harm(&self, edge: (u32, u32), part: &Part) -> Option<f64> {
        let (at, harm) = self.harms.get(&edge)?;
        self.is_unchanged(part, *at).then_some(*harm)
    }

    /// Whether nothing has changed in a part since so many changes had been made.
    fn is_unchanged(&self, part: &Part, since: usize) -> bool {
        part.vertices().iter().all(|v| self.changed.get(v).is_none_or(|changed| *changed <= since))
    }

    fn record_trial(&mut self, edge: (u32, u32), trial: Option<&Trial>) {
        let harm = trial.map_or(f64::INFINITY, |trial| trial.harm);
        self.harms.insert(edge, (self.changes, harm));
    }

    fn record_change(&mut self, part: &Part) {
        self.changes += 1;
        self.changed.extend(part.vertices().iter().map(|v| (*v, self.changes)));
    }
}

impl Mending<'_> {
    /// Collapses the shortest edges inside patches, or splits the longest, where it does the least harm,
    /// until there are as many vertices as before, or the work should long have finished.
    pub fn balance(&self, mesh: &mut StarMesh, state: &mut State) -> Result<()> {
        let mut known = Known::default();
        let mut late = 0;
        for cost in COSTS {
            if self.surplus(mesh) == 0 {
                break;
            }
            let too_many = self.surplus(mesh) > 0;
            let mut edges: Vec<(f64, u32, u32)> = mesh
                .edges()
                .into_iter()
                .filter(|(a, b)| [a, b].iter().any(|v| mesh.places[**v as usize] == Place::Inside))
                .map(|(a, b)| (mesh.relative_length(a, b), a, b))
                .collect();
            edges.sort_by(|p, q| p.0.total_cmp(&q.0).then((p.1, p.2).cmp(&(q.1, q.2))));
            if !too_many {
                edges.reverse();
            }
            let edges: Vec<(u32, u32)> = edges.into_iter().map(|(_, a, b)| (a, b)).collect();
            let mut touched: HashSet<u32> = HashSet::new();
            for batch in edges.chunks(BATCH) {
                late += usize::from(self.progress.leave_out());
                if self.surplus(mesh) == 0 || late > LATE {
                    return Ok(());
                }
                self.progress.poll()?;
                self.balance_by((mesh, state), (batch, cost), &mut known, &mut touched)?;
            }
        }
        Ok(())
    }

    /// Goes through some edges in order. All are tried at first; those around which others have changed
    /// something, once more.
    fn balance_by(
        &self,
        (mesh, state): (&mut StarMesh, &mut State),
        (batch, cost): (&[(u32, u32)], f64),
        known: &mut Known,
        touched: &mut HashSet<u32>,
    ) -> Result<()> {
        let too_many = self.surplus(mesh) > 0;
        let since = known.changes;
        let is_left = |mesh: &StarMesh, touched: &HashSet<u32>, (a, b): (u32, u32)| {
            !touched.contains(&a) && !touched.contains(&b) && mesh.has_edge(a, b)
        };
        let (whole, before, now) = (&*mesh, &*known, &*touched);
        let ahead = |edge: &(u32, u32)| -> Result<Option<Option<Trial>>> {
            if !is_left(whole, now, *edge) {
                return Ok(None);
            }
            let part = whole.part_around(&[edge.0, edge.1]);
            let is_refused = before.harm(*edge, &part).is_some_and(|harm| harm > cost);
            if is_refused { Ok(None) } else { self.try_edge(part, *edge, too_many).map(Some) }
        };
        let found: Vec<Option<Option<Trial>>> = batch.par_iter().map(ahead).collect::<Result<_>>()?;
        for (edge, trial) in batch.iter().zip(&found) {
            if let Some(trial) = trial {
                known.harms.insert(*edge, (since, trial.as_ref().map_or(f64::INFINITY, |trial| trial.harm)));
            }
        }
        for (edge, trial) in batch.iter().zip(found) {
            if self.surplus(mesh) == 0 {
                break;
            }
            if !is_left(mesh, touched, *edge) {
                continue;
            }
            let part = mesh.part_around(&[edge.0, edge.1]);
            if known.harm(*edge, &part).is_some_and(|harm| harm > cost) {
                continue;
            }
            let trial = match trial.flatten().filter(|_| known.is_unchanged(&part, since)) {
                Some(trial) => Some(trial),
                None => {
                    let trial = self.try_edge(part, *edge, too_many)?;
                    known.record_trial(*edge, trial.as_ref());
                    trial
                }
            };
            let Some(Trial { before, after, harm }) = trial else { continue };
            if harm > cost || !self.is_sound(mesh, &state.nearby, &before, &after) {
                continue;
            }
            if let Some(new) = mesh.put_back(&after) {
                new.iter().for_each(|t| state.nearby.add(mesh, *t));
                touched.extend(after.vertices());
                known.record_change(&after);
            }
        }
        Ok(())
    }

    /// An edge inside a part of the mesh collapsed or split, with the flips and moves that follow; `None` if
    /// that cannot be.
    fn try_edge(&self, before: Part, (a, b): (u32, u32), too_many: bool) -> Result<Option<Trial>> {
        let mut after = before.clone();
        let Some([p, q]) = before.numbers([a, b]) else { return Ok(None) };
        let edit = if too_many { Edit::Collapse(p, q) } else { Edit::Split(p, q) };
        if !self.apply(&mut after.mesh, edit) {
            return Ok(None);
        }
        for _ in 0..RELAXATIONS {
            after.mesh.flip(self.progress)?;
            self.relax(&mut after.mesh);
        }
        self.settle(&mut after.mesh);
        let harm = self.cost.of_all(&after.mesh) - self.cost.of_all(&before.mesh);
        Ok(Some(Trial { before, after, harm }))
    }

    /// Moves the vertices inside patches towards the mean of their neighbours.
    fn relax(&self, mesh: &mut StarMesh) {
        for v in 0..mesh.points.len() as u32 {
            if mesh.is_used(v) && !mesh.is_frozen(v) && mesh.places[v as usize] == Place::Inside {
                mesh.relax_inside(v, self.target);
            }
        }
    }
}
