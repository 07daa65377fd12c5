//! Edits of a part of a mesh, and what follows from them.

use super::Mending;
use crate::local::collapse::Limits;
use crate::local::flip::Diamond;
use crate::local::star_mesh::{Place, StarMesh};
use crate::mesh::NONE;

/// Rounds of flips and moves after an edit.
const ROUNDS: u32 = 4;
/// Minimum gain of a flip.
const MIN_GAIN: f64 = 1e-4;
/// No edge shorter than this is made, in spacings.
const SHORTEST: f64 = 0.12;

/// A change of the connectivity at one edge, or none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Edit {
    None,
    Flip(u32, u32),
    Collapse(u32, u32),
    Split(u32, u32),
    /// In three.
    SplitTwice(u32, u32),
}

impl Edit {
    /// What may help a triangle, in groups: what helps most often comes first.
    pub fn at(mesh: &StarMesh, [a, b, c]: [u32; 3]) -> [Vec<Self>; 3] {
        let mut sides = [(a, b), (b, c), (c, a)].map(|(a, b)| {
            let length = mesh.points[a as usize].distance(mesh.points[b as usize]);
            (length, a, b)
        });
        sides.sort_by(|p, q| p.0.total_cmp(&q.0));
        let [short, middle, long] = sides.map(|(_, a, b)| (a, b));
        let flips = [long, middle, short].map(|(a, b)| Self::Flip(a, b));
        let collapses = [short, middle].map(|(a, b)| Self::Collapse(a, b));
        let splits = [long, middle].map(|(a, b)| Self::Split(a, b));
        let thirds = [long, middle].map(|(a, b)| Self::SplitTwice(a, b));
        [
            vec![Self::None, flips[0]],
            [&flips[1..], &collapses[..1], &splits].concat(),
            [&thirds[..], &collapses[1..]].concat(),
        ]
    }
}

impl Mending<'_> {
    /// Whether an edit could be done; flips and moves follow it.
    pub fn apply(&self, mesh: &mut StarMesh, edit: Edit) -> bool {
        let done = match edit {
            Edit::None => true,
            Edit::Flip(a, b) => mesh.turn_edge(a, b),
            Edit::Collapse(a, b) => self.collapse(mesh, a, b),
            Edit::Split(a, b) => self.split(mesh, a, b).is_some(),
            Edit::SplitTwice(a, b) => {
                self.split(mesh, a, b).is_some_and(|middle| self.split(mesh, middle, b).is_some())
            }
        };
        if done {
            self.settle(mesh);
        }
        done
    }

    fn collapse(&self, mesh: &mut StarMesh, a: u32, b: u32) -> bool {
        let limits = Limits::of_mending(self.spacing, self.stray(mesh.curves.get(a, b)));
        let Some(kept) = mesh.collapse_edge(a, b, &limits, self.polylines) else { return false };
        self.bring_down(mesh, kept);
        true
    }

    fn split(&self, mesh: &mut StarMesh, a: u32, b: u32) -> Option<u32> {
        if (mesh.is_frozen(a) && mesh.is_frozen(b))
            || mesh.relative_length(a, b) < 2.0 * SHORTEST * self.spacing
        {
            return None;
        }
        let new = mesh.split_edge(a, b, self.polylines);
        let heights =
            if self.deviation.is_some() { [a, b].map(|v| self.height_at(mesh, v)) } else { [0.0; 2] };
        self.bring_down(mesh, new);
        if heights != [0.0; 2] && mesh.places[new as usize] == Place::Inside {
            let (normal, _) = mesh.normal(new);
            mesh.points[new as usize] += 0.5 * (heights[0] + heights[1]) * normal.normalize_or_zero();
        }
        Some(new)
    }

    /// Moves a vertex inside a patch onto the surface.
    fn bring_down(&self, mesh: &mut StarMesh, v: u32) {
        if mesh.places[v as usize] != Place::Inside {
            return;
        }
        let (normal, _) = mesh.normal(v);
        let (at, patch) = (mesh.points[v as usize], mesh.patch_at(v));
        let rank = &mut mesh.ranks[v as usize];
        if let Some(to) = self.target.closest(at, normal.normalize_or_zero(), patch, rank)
            && !mesh.folds(v, to, normal)
        {
            mesh.points[v as usize] = to;
        }
    }

    /// Flips edges and moves vertices where that is better.
    pub fn settle(&self, mesh: &mut StarMesh) {
        // Around the others nothing has changed since they were tried in vain.
        let mut untried = vec![true; mesh.points.len()];
        for _ in 0..ROUNDS {
            let mut changes = 0;
            for t in 0..mesh.triangles.len() {
                let [a, b, c] = mesh.triangles[t];
                if a == NONE || self.cost.of(mesh.corners([a, b, c])) < MIN_GAIN {
                    continue;
                }
                for (a, b) in [(a, b), (b, c), (c, a)] {
                    if mesh.triangles[t].contains(&a)
                        && mesh.triangles[t].contains(&b)
                        && let Some(ring) = self.flip_if_better(mesh, a, b)
                    {
                        ring.into_iter().for_each(|v| untried[v as usize] = true);
                        changes += 1;
                    }
                }
            }
            changes += self.smooth(mesh, &mut untried);
            if changes == 0 {
                return;
            }
        }
    }

    /// Flips an edge where that is better; returns the four vertices then.
    fn flip_if_better(&self, mesh: &mut StarMesh, a: u32, b: u32) -> Option<[u32; 4]> {
        let Diamond { ring: ring @ [a, b, c, d], .. } = mesh.diamond(a, b)?;
        let cost = |pair: [[u32; 3]; 2]| {
            pair.iter().map(|triangle| self.cost.of(mesh.corners(*triangle))).sum::<f64>()
        };
        let is_better = cost([[d, c, a], [c, d, b]]) < cost([[a, b, c], [b, a, d]]) - MIN_GAIN;
        (is_better && mesh.turn_edge(a, b)).then_some(ring)
    }
}
