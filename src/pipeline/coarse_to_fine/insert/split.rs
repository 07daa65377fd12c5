//! Which edges are split for faces that are too far from the surface, and what is around them.

use crate::TriMesh;
use crate::mesh::NONE;
use crate::mesh::submesh::used_vertices;
use crate::pipeline::deviation::measured::Farthest;

/// What is tried to bring a face closer: which of its edges is split, the one nearest to the farthest point
/// being the first, and how many rings of vertices around the new one make room for it.
pub(super) const WAYS: [(usize, u32); 6] = [(0, 2), (0, 1), (0, 0), (1, 2), (1, 0), (0, 3)];

/// An edge to split.
#[derive(Debug, Clone, Copy)]
pub(super) struct Way {
    pub edge: [u32; 2],
    /// Of vertices around the new one that move.
    pub rings: u32,
}

/// A face that is too far away.
#[derive(Debug, Clone)]
pub(super) struct Split {
    /// What is left to try, the best last; not empty.
    pub ways: Vec<Way>,
}

impl Split {
    /// What to try now.
    pub fn way(&self) -> Way {
        self.ways[self.ways.len() - 1]
    }
}

/// What to try at each of these faces. Those that have a vertex in common with an earlier one wait for the
/// next pass.
pub(super) fn splits_at(mesh: &TriMesh, far: &[(u32, Farthest)]) -> Vec<Split> {
    let mut is_touched = vec![false; mesh.vertices.len()];
    let mut splits = Vec::new();
    for (t, farthest) in far {
        let triangle @ [a, b, c] = mesh.triangles[*t as usize];
        if triangle.iter().any(|v| is_touched[*v as usize]) {
            continue;
        }
        triangle.iter().for_each(|v| is_touched[*v as usize] = true);
        // From the middle, for its length.
        let distance = |[a, b]: &[u32; 2]| {
            let [p, q] = [*a, *b].map(|v| mesh.vertices[v as usize]);
            p.midpoint(q).distance(farthest.at) / p.distance(q)
        };
        let mut edges = [[a, b], [b, c], [c, a]];
        edges.sort_by(|p, q| distance(p).total_cmp(&distance(q)));
        let way = |(k, rings): &(usize, u32)| Way { edge: edges[*k], rings: *rings };
        splits.push(Split { ways: WAYS.iter().rev().map(way).collect() });
    }
    splits
}

/// Which vertices may move after these splits, whose new vertices are those from `first` on.
pub(super) fn free_vertices(mesh: &TriMesh, first: u32, splits: &[Split]) -> Vec<bool> {
    let mut is_free = vec![false; mesh.vertices.len()];
    let most = splits.iter().map(|split| split.way().rings).max().unwrap_or(0);
    for rings in (0..=most).rev() {
        if rings < most {
            spread(mesh, &mut is_free);
        }
        for (v, split) in (first as usize..).zip(splits) {
            is_free[v] |= split.way().rings == rings;
        }
    }
    is_free
}

/// The faces at vertices within a number of rings around the given ones.
pub(super) fn faces_near(mesh: &TriMesh, around: &[u32], rings: u32) -> Vec<u32> {
    let mut is_near = vec![false; mesh.vertices.len()];
    around.iter().for_each(|v| is_near[*v as usize] = true);
    (0..rings).for_each(|_| spread(mesh, &mut is_near));
    let all = (0..).zip(&mesh.triangles);
    all.filter(|(_, triangle)| triangle.iter().any(|v| is_near[*v as usize])).map(|(t, _)| t).collect()
}

/// Marks the neighbours of the marked vertices.
fn spread(mesh: &TriMesh, is_marked: &mut [bool]) {
    let now = is_marked.to_vec();
    for triangle in mesh.triangles.iter().filter(|triangle| triangle.iter().any(|v| now[*v as usize])) {
        triangle.iter().for_each(|v| is_marked[*v as usize] = true);
    }
}

/// Where the vertices come from after edges of a mesh were split: first its own that have triangles.
pub(super) fn origins_after(mesh: &TriMesh, splits: usize) -> Vec<u32> {
    let is_used = used_vertices(mesh.vertices.len(), &mesh.triangles);
    let used = (0..).zip(is_used).filter(|(_, used)| *used).map(|(v, _)| v);
    used.chain(std::iter::repeat_n(NONE, splits)).collect()
}
