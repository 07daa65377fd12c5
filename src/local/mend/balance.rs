//! The number of vertices restored after edits have changed it.

use super::edits::Edit;
use std::collections::HashSet;

use super::{Mending, State};
use crate::Result;
use crate::local::star_mesh::{Place, StarMesh};

/// Costs of angles that taking a vertex away, or adding one, may lead to; those without come first.
const COSTS: [f64; 4] = [0.003, 0.02, 0.1, 0.4];
/// Relaxations around a changed edge.
const RELAXATIONS: u32 = 2;

impl Mending<'_> {
    /// Collapses the shortest edges inside patches, or splits the longest, where it does the least harm,
    /// until there are as many vertices as before.
    pub fn balance(&self, mesh: &mut StarMesh, state: &mut State) -> Result<()> {
        for cost in COSTS {
            if self.surplus(mesh) == 0 {
                return Ok(());
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
            let mut touched: HashSet<u32> = HashSet::new();
            for (_, a, b) in edges {
                if self.surplus(mesh) == 0 {
                    return Ok(());
                }
                if touched.contains(&a) || touched.contains(&b) || !mesh.has_edge(a, b) {
                    continue;
                }
                self.progress.poll()?;
                let ends = [a, b];
                let part = mesh.part_around(&ends);
                let mut trial = part.clone();
                let Some([p, q]) = part.numbers(ends) else { continue };
                let edit = if too_many { Edit::Collapse(p, q) } else { Edit::Split(p, q) };
                if !self.apply(&mut trial.mesh, edit) {
                    continue;
                }
                for _ in 0..RELAXATIONS {
                    trial.mesh.flip(self.progress)?;
                    self.relax(&mut trial.mesh);
                }
                self.settle(&mut trial.mesh);
                let harm = self.cost.of_all(&trial.mesh) - self.cost.of_all(&part.mesh);
                if harm > cost || !self.is_sound(mesh, &state.nearby, &part, &trial) {
                    continue;
                }
                if let Some(new) = mesh.put_back(&trial) {
                    new.iter().for_each(|t| state.nearby.add(mesh, *t));
                    touched.extend(part.vertices());
                }
            }
        }
        Ok(())
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
