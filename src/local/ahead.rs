//! What is refused, found for many operations ahead by all threads.
//!
//! Operations come one after the other, but most are refused, for what is around them alone. So the next ones
//! are tried ahead on the mesh as it is; where nothing has changed since, the answer is still right.

use super::star_mesh::StarMesh;
use rayon::prelude::*;

/// Operations tried ahead at a time.
const BATCH: usize = 1024;
/// Fewer are not worth the threads.
const FEW: usize = 64;

/// What is known of the next operations: what each does, or that it is refused.
pub(super) struct Ahead<T> {
    /// Of operations ahead, the next one last.
    found: Vec<Option<T>>,
    /// How many operations are left after these.
    after: usize,
    /// The batch in which the triangles around each vertex last changed.
    changed: Vec<u32>,
    batch: u32,
}

impl<T: Copy + Send> Ahead<T> {
    pub fn new(mesh: &StarMesh) -> Self {
        let after = usize::MAX;
        Self { found: Vec::new(), after, changed: vec![0; mesh.points.len()], batch: 0 }
    }

    /// What `find` has found for the last of the operations that are `left`, which is right unless the mesh
    /// has changed around it since; `None` if it was not tried.
    pub fn next<E: Sync>(&mut self, left: &[E], find: impl Fn(&E) -> Option<T> + Sync) -> Option<Option<T>> {
        if left.len() <= self.after {
            self.after = left.len().saturating_sub(BATCH);
            self.batch += 1;
            let next = &left[self.after..];
            self.found.clear();
            if next.len() >= FEW && rayon::current_num_threads() > 1 {
                self.found.par_extend(next.par_iter().with_min_len(FEW / 4).map(&find));
            }
        }
        self.found.get(left.len().checked_sub(self.after + 1)?).copied()
    }

    /// Whether the triangles around one of these vertices have changed since the next operations were tried.
    pub fn has_changed(&self, vertices: impl IntoIterator<Item = u32>) -> bool {
        vertices.into_iter().any(|v| self.changed[v as usize] == self.batch)
    }

    /// Notes that the triangles around these vertices have changed.
    pub fn note(&mut self, vertices: &[u32]) {
        vertices.iter().for_each(|v| self.changed[*v as usize] = self.batch);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ProgressToken;
    use crate::local::collapse::Limits;
    use crate::mesh::features::{FeatureOptions, find_features};
    use crate::mesh::samples::sample;

    #[test]
    fn what_is_tried_ahead_changes_nothing() {
        let surface = sample("torus").unwrap();
        let features = find_features(&surface, &FeatureOptions::new(0.1)).unwrap();
        let mut start = StarMesh::new(&surface, &features, &[], &[]);
        start.split_long(0.0, 8000, &[]);
        let progress = ProgressToken::default();
        let made = |threads: usize| {
            let mut mesh = start.clone();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                mesh.flip(&progress).unwrap();
                mesh.collapse_edges(0.1, 3000, &Limits::regular(0.1), &[], &progress).unwrap();
                mesh.flip(&progress).unwrap();
            });
            mesh.into_constrained(&[]).mesh
        };
        let (one, four) = (made(1), made(4));
        assert!(one.vertices.len() < 8000 && one == four, "{} vertices", one.vertices.len());
    }
}
