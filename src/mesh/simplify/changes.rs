//! When the triangles around each vertex last changed: what was tried since need not be tried again.

use super::graph::Graph;

/// Times are numbers of changes.
pub(super) struct Changes {
    now: u32,
    /// When the triangles around each vertex last changed.
    of_vertex: Vec<u32>,
    /// When the sides of each triangle were last looked at for a flip.
    looked_at: Vec<u32>,
}

impl Changes {
    pub fn new(graph: &Graph) -> Self {
        // What has never been looked at counts as changed since.
        Self { now: 1, of_vertex: vec![1; graph.points.len()], looked_at: vec![0; graph.triangles.len()] }
    }

    pub fn now(&self) -> u32 {
        self.now
    }

    /// Notes that the triangles around these vertices change.
    pub fn note(&mut self, vertices: impl IntoIterator<Item = u32>) {
        self.now += 1;
        vertices.into_iter().for_each(|v| self.of_vertex[v as usize] = self.now);
    }

    /// Whether the triangles around none of these vertices have changed after a time.
    pub fn none_since(&self, time: u32, vertices: &[u32]) -> bool {
        vertices.iter().all(|v| self.of_vertex[*v as usize] <= time)
    }

    /// Whether the sides of a triangle must be looked at for flips. If so, it counts as looked at now.
    pub fn must_look_at(&mut self, t: u32, triangle: [u32; 3]) -> bool {
        let before = std::mem::replace(&mut self.looked_at[t as usize], self.now);
        !self.none_since(before, &triangle)
    }
}
