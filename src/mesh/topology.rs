//! Topology of a mesh: components, boundaries, handles, and the defects that keep it from being a manifold.

use rayon::prelude::*;
use serde::Serialize;
use std::sync::atomic::{AtomicU32, Ordering};

use super::chunks::CHUNK;
use super::half_edges::{EdgeTable, HalfEdge, edge_key, par_fold_corners, previous, twin_pair};
use super::submesh::used_vertices;
use super::{NONE, TriMesh};

/// A surface with at least this many handles may be noise.
const MANY_HANDLES: usize = 1000;
/// With fewer vertices for each of these, all that a mesh can show is its topology: a handle needs two.
const CROWDED: usize = 8;

/// The topology of a mesh as its index list has it; positions play no part.
///
/// All numbers are counts. A triangle that repeats a vertex has an edge from that vertex to itself, which
/// counts as an edge like any other.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Topology {
    /// Vertices that some triangle uses.
    pub vertices: usize,
    /// Undirected edges.
    pub edges: usize,
    /// Triangles.
    pub faces: usize,
    /// Components: faces connected by shared vertices.
    pub components: usize,
    /// `vertices - edges + faces`.
    pub euler: i64,
    /// Handles, summed over all components, once each boundary loop is capped. `None` where the mesh is not
    /// an orientable, consistently oriented manifold, since the formula then says nothing.
    pub genus: Option<i64>,
    /// Edges with one face.
    pub boundary_edges: usize,
    /// Connected parts of the graph that the boundary edges form.
    pub boundary_loops: usize,
    /// Edges with more than two faces.
    pub nonmanifold_edges: usize,
    /// Vertices whose faces form more than one fan connected by shared edges.
    pub nonmanifold_vertices: usize,
    /// Directed edges that more than one face passes in the same direction.
    pub inconsistent_edges: usize,
    /// Faces beyond the first on the same three vertices, in whatever order.
    pub duplicate_faces: usize,
}

impl Topology {
    /// Whether the mesh is a surface, with or without boundary: no defect of any kind counted here.
    pub fn is_manifold(&self) -> bool {
        self.faces > 0
            && self.nonmanifold_edges == 0
            && self.nonmanifold_vertices == 0
            && self.inconsistent_edges == 0
            && self.duplicate_faces == 0
    }

    /// Vertices without which loops and handles can hardly be: three for each boundary loop, and two for each
    /// handle, with which twelve or more edges meet at each vertex.
    pub(crate) fn vertices_needed(&self) -> usize {
        3 * self.boundary_loops + 2 * self.genus.unwrap_or(0).max(0) as usize
    }

    /// Whether handles are thousands, and so many vertices hardly more than they need: as in noise.
    pub(crate) fn is_crowded(&self, vertices: usize) -> bool {
        let handles = self.genus.unwrap_or(0).max(0) as usize;
        handles >= MANY_HANDLES && vertices < CROWDED * handles
    }

    /// Whether so many vertices are fewer than handles and loops need, or hardly more than thousands of
    /// handles do.
    pub(crate) fn is_much_for(&self, vertices: usize) -> bool {
        vertices < self.vertices_needed() || self.is_crowded(vertices)
    }

    /// Whether the mesh has the same components, handles and boundary loops as `other`, and no kind of defect
    /// that this has not.
    pub(crate) fn matches(&self, other: &Self) -> bool {
        let counts = |t: &Self| (t.components, t.euler, t.boundary_loops);
        let is_new = |own: usize, others: usize| own > 0 && others == 0;
        counts(self) == counts(other)
            && self.duplicate_faces == 0
            && !is_new(self.nonmanifold_edges, other.nonmanifold_edges)
            && !is_new(self.inconsistent_edges, other.inconsistent_edges)
            && self.nonmanifold_vertices <= other.nonmanifold_vertices
    }

    /// Whether the mesh bounds a solid: faces, no boundary, no defect of any kind counted here.
    pub fn is_closed_manifold(&self) -> bool {
        self.is_manifold() && self.boundary_edges == 0
    }
}

/// Counts what [`Topology`] lists. Panics if a triangle's index is out of range.
pub fn topology(mesh: &TriMesh) -> Topology {
    let table = EdgeTable::new(&mesh.triangles);
    topology_of(mesh, &table, is_closed(mesh, &table))
}

/// [`topology`] of a mesh that is known to be a closed manifold, consistently oriented, with all vertices in
/// use: only its components need to be counted. Panics if a triangle's index is out of range.
pub(crate) fn closed_topology(mesh: &TriMesh) -> Topology {
    let components = SharedPartition::new(mesh.vertices.len());
    mesh.triangles.par_iter().with_min_len(CHUNK).for_each(|&[a, b, c]| {
        components.join(a, b);
        components.join(b, c);
    });
    let (vertices, faces) = (mesh.vertices.len(), mesh.triangles.len());
    let edges = 3 * faces / 2;
    let mut topology = Topology {
        vertices,
        edges,
        faces,
        components: components.count(|_| true),
        euler: vertices as i64 - edges as i64 + faces as i64,
        genus: None,
        boundary_edges: 0,
        boundary_loops: 0,
        nonmanifold_edges: 0,
        nonmanifold_vertices: 0,
        inconsistent_edges: 0,
        duplicate_faces: 0,
    };
    topology.genus = genus(&topology);
    topology
}

/// Whether each edge has two faces, which run it against each other and are not on the same vertices.
pub(crate) fn is_closed(mesh: &TriMesh, table: &EdgeTable) -> bool {
    let is_pair = |edge: &[HalfEdge]| match edge {
        [one, two] => {
            twin_pair(&mesh.triangles, edge).is_some() && opposite(mesh, one) != opposite(mesh, two)
        }
        _ => false,
    };
    table.par_edges().all(is_pair)
}

/// [`topology`] with the edge table already at hand, and whether the mesh [`is_closed`].
pub(crate) fn topology_of(mesh: &TriMesh, table: &EdgeTable, is_closed: bool) -> Topology {
    let (connected, (nonmanifold_vertices, duplicate_faces)) = rayon::join(
        || if is_closed { Connected::closed(mesh) } else { Connected::new(mesh, table) },
        || match is_closed {
            true => (split_vertices_of_pairs(mesh, table), 0),
            false => rayon::join(|| split_vertices(mesh, table), || duplicates(mesh, table)),
        },
    );
    let Connected { vertices, counts, components, boundary_loops } = connected;
    let faces = mesh.triangles.len();
    let mut topology = Topology {
        vertices,
        edges: counts.edges,
        faces,
        components,
        euler: vertices as i64 - counts.edges as i64 + faces as i64,
        genus: None,
        boundary_edges: counts.boundary,
        boundary_loops,
        nonmanifold_edges: counts.nonmanifold,
        nonmanifold_vertices,
        inconsistent_edges: counts.inconsistent,
        duplicate_faces,
    };
    topology.genus = genus(&topology);
    topology
}

/// What edges connect.
struct Connected {
    /// In use.
    vertices: usize,
    counts: EdgeCounts,
    components: usize,
    boundary_loops: usize,
}

impl Connected {
    /// Like [`Connected::new`], for a mesh that [`is_closed`].
    fn closed(mesh: &TriMesh) -> Self {
        let used = used_vertices(mesh.vertices.len(), &mesh.triangles);
        let components = SharedPartition::new(mesh.vertices.len());
        mesh.triangles.par_iter().with_min_len(CHUNK).for_each(|&[a, b, c]| {
            components.join(a, b);
            components.join(b, c);
        });
        Self {
            vertices: used.iter().filter(|&&u| u).count(),
            counts: EdgeCounts { edges: 3 * mesh.triangles.len() / 2, ..EdgeCounts::default() },
            components: components.count(|v| used[v as usize]),
            boundary_loops: 0,
        }
    }

    fn new(mesh: &TriMesh, table: &EdgeTable) -> Self {
        let used = used_vertices(mesh.vertices.len(), &mesh.triangles);
        let mut counts = EdgeCounts::default();
        let mut components = Partition::new(mesh.vertices.len());
        let mut loops = Partition::new(mesh.vertices.len());
        let mut on_boundary = vec![false; mesh.vertices.len()];
        for edge in table.edges() {
            let (a, b) = edge[0].ends();
            counts.add(mesh, edge);
            components.join(a, b);
            if edge.len() == 1 {
                loops.join(a, b);
                on_boundary[a as usize] = true;
                on_boundary[b as usize] = true;
            }
        }
        Self {
            vertices: used.iter().filter(|&&u| u).count(),
            counts,
            components: components.count(&used),
            boundary_loops: loops.count(&on_boundary),
        }
    }
}

#[derive(Default)]
struct EdgeCounts {
    edges: usize,
    boundary: usize,
    nonmanifold: usize,
    inconsistent: usize,
}

impl EdgeCounts {
    fn add(&mut self, mesh: &TriMesh, edge: &[HalfEdge]) {
        let corners = mesh.triangles.as_flattened();
        let low = edge[0].ends().0;
        let upward = edge.iter().filter(|side| corners[side.corners().0] == low).count();
        self.edges += 1;
        self.boundary += usize::from(edge.len() == 1);
        self.nonmanifold += usize::from(edge.len() > 2);
        self.inconsistent += usize::from(upward > 1) + usize::from(edge.len() - upward > 1);
    }
}

/// Joins, at either end of an edge, the corners of the faces that meet there.
fn join_fans(mesh: &TriMesh, edge: &[HalfEdge], fans: &mut Partition) {
    let corners = mesh.triangles.as_flattened();
    let low = edge[0].ends().0;
    let at_ends = |side: &HalfEdge| {
        let (from, to) = side.corners();
        if corners[from] == low { (from, to) } else { (to, from) }
    };
    let (first_low, first_high) = at_ends(&edge[0]);
    for side in &edge[1..] {
        let (at_low, at_high) = at_ends(side);
        fans.join(first_low as u32, at_low as u32);
        fans.join(first_high as u32, at_high as u32);
    }
}

/// Vertices whose corners fall into more than one fan.
fn split_vertices(mesh: &TriMesh, table: &EdgeTable) -> usize {
    if are_pairs(mesh, table) {
        split_vertices_of_pairs(mesh, table)
    } else {
        split_vertices_of_any(mesh, table)
    }
}

/// Whether no edge has more than two faces, and two run against each other.
fn are_pairs(mesh: &TriMesh, table: &EdgeTable) -> bool {
    table.edges().all(|edge| edge.len() == 1 || twin_pair(&mesh.triangles, edge).is_some())
}

/// Like [`split_vertices`], for any mesh: corners are joined across edges.
fn split_vertices_of_any(mesh: &TriMesh, table: &EdgeTable) -> usize {
    let mut fans = Partition::new(3 * mesh.triangles.len());
    for edge in table.edges().filter(|edge| edge[0].ends().0 != edge[0].ends().1) {
        join_fans(mesh, edge, &mut fans);
    }
    let mut fans_at = vec![0u8; mesh.vertices.len()];
    for (corner, &v) in (0u32..).zip(mesh.triangles.as_flattened()) {
        if fans.root(corner) == corner {
            let count = &mut fans_at[v as usize];
            *count = count.saturating_add(1);
        }
    }
    fans_at.iter().filter(|&&count| count > 1).count()
}

/// Like [`split_vertices`], for a mesh whose edges [`are_pairs`]: one fan is walked around, from any corner,
/// or on the boundary from the first.
fn split_vertices_of_pairs(mesh: &TriMesh, table: &EdgeTable) -> usize {
    let twins = table.twins(&mesh.triangles);
    let mut corners_at = vec![(0u32, NONE); mesh.vertices.len()];
    par_fold_corners(mesh.triangles.as_flattened(), &mut corners_at, |(count, first), h| {
        *count += 1;
        if *first == NONE || twins[h as usize] == NONE {
            *first = h;
        }
    });
    let is_split = |&&(count, first): &&(u32, u32)| {
        let mut h = first;
        // A walk through all corners does not end before as many steps.
        (1..count).any(|_| {
            h = twins[previous(h) as usize];
            h == NONE || h == first
        })
    };
    corners_at.par_iter().with_min_len(CHUNK).filter(is_split).count()
}

/// The vertex that the triangle of a half-edge has opposite it.
fn opposite(mesh: &TriMesh, side: &HalfEdge) -> u32 {
    mesh.triangles.as_flattened()[previous(side.corners().0 as u32) as usize]
}

fn duplicates(mesh: &TriMesh, table: &EdgeTable) -> usize {
    // Two faces on the same vertices share an edge, and are opposite the same vertex there.
    let may_be_doubled = |edge: &[HalfEdge]| match edge {
        [_] => false,
        [one, two] => opposite(mesh, one) == opposite(mesh, two),
        _ => true,
    };
    if !table.edges().any(may_be_doubled) {
        return 0;
    }
    let mut sorted: Vec<[u32; 3]> = mesh
        .triangles
        .iter()
        .map(|&triangle| {
            let mut key = triangle;
            key.sort_unstable();
            key
        })
        .collect();
    sorted.par_sort_unstable();
    sorted.windows(2).filter(|pair| pair[0] == pair[1]).count()
}

/// Solves `euler = 2 * components - 2 * genus - loops`, which holds for orientable manifolds only.
fn genus(topology: &Topology) -> Option<i64> {
    let defects = topology.nonmanifold_edges + topology.nonmanifold_vertices + topology.inconsistent_edges;
    let twice = 2 * topology.components as i64 - topology.boundary_loops as i64 - topology.euler;
    (defects == 0 && twice >= 0 && twice % 2 == 0).then_some(twice / 2)
}

/// Disjoint sets over `0..n`; the root of a set is its smallest member, whatever the order of the joins.
pub(crate) struct Partition {
    parent: Vec<u32>,
}

impl Partition {
    pub(crate) fn new(n: usize) -> Self {
        Self { parent: (0u32..).take(n).collect() }
    }

    pub(crate) fn root(&mut self, mut x: u32) -> u32 {
        while self.parent[x as usize] != x {
            let above = self.parent[self.parent[x as usize] as usize];
            self.parent[x as usize] = above;
            x = above;
        }
        x
    }

    pub(crate) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }

    /// Sets with at least one member; `members` is closed under the joins made.
    fn count(&self, members: &[bool]) -> usize {
        (0u32..)
            .zip(&self.parent)
            .zip(members)
            .filter(|((x, parent), member)| **member && x == *parent)
            .count()
    }
}

/// Like [`Partition`], for all threads to join sets at the same time.
struct SharedPartition {
    parent: Vec<AtomicU32>,
}

impl SharedPartition {
    fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).into_par_iter().with_min_len(CHUNK).map(AtomicU32::new).collect() }
    }

    fn parent(&self, x: u32) -> u32 {
        self.parent[x as usize].load(Ordering::Relaxed)
    }

    fn root(&self, mut x: u32) -> u32 {
        loop {
            let parent = self.parent(x);
            let above = self.parent(parent);
            if above == parent {
                return parent;
            }
            // What was above a member once is smaller and in the same set for good, so any thread may write
            // last.
            self.parent[x as usize].store(above, Ordering::Relaxed);
            x = above;
        }
    }

    fn join(&self, a: u32, b: u32) {
        loop {
            let (a, b) = (self.root(a), self.root(b));
            let (low, high) = edge_key(a, b);
            let own = &self.parent[high as usize];
            // Another thread may have joined the larger root meanwhile, which is then no root.
            if low == high || own.compare_exchange(high, low, Ordering::Relaxed, Ordering::Relaxed).is_ok() {
                return;
            }
        }
    }

    /// Sets with at least one member, as [`Partition::count`].
    fn count(&self, is_member: impl Fn(u32) -> bool + Sync) -> usize {
        let all = (0..self.parent.len() as u32).into_par_iter().with_min_len(CHUNK);
        all.filter(|x| is_member(*x) && *x == self.parent(*x)).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn fans_that_are_walked_around_are_those_that_edges_join() {
        let sphere = sample("sphere").unwrap_or_default();
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(5);
        let (mut most_split, mut compared) = (0, 0);
        for round in 0..40 {
            let mut mesh = sphere.clone();
            // Holes that touch, and vertices that are merged.
            mesh.triangles.retain(|_| round % 2 == 0 || rng.random_range(0..8) > 0);
            let count = mesh.vertices.len() as u32;
            let merged: Vec<[u32; 2]> =
                (0..round % 5).map(|_| std::array::from_fn(|_| rng.random_range(0..count))).collect();
            for [one, other] in merged {
                mesh.triangles.as_flattened_mut().iter_mut().filter(|v| **v == one).for_each(|v| *v = other);
            }
            let table = EdgeTable::new(&mesh.triangles);
            let joined = split_vertices_of_any(&mesh, &table);
            if are_pairs(&mesh, &table) {
                assert_eq!(split_vertices_of_pairs(&mesh, &table), joined, "round {round}");
                (most_split, compared) = (most_split.max(joined), compared + 1);
            }
        }
        assert!(most_split > 3 && compared > 20, "{most_split}, {compared}");
    }

    #[test]
    fn of_closed_meshes_no_edges_are_counted() {
        for name in ["sphere", "genus3", "two-components", "open-hemisphere"] {
            let mut mesh = sample(name).unwrap_or_default();
            for round in 0..4 {
                let table = EdgeTable::new(&mesh.triangles);
                let closed = is_closed(&mesh, &table);
                let counted = topology_of(&mesh, &table, false);
                assert_eq!(closed, counted.is_closed_manifold() || (name != "open-hemisphere" && round == 1));
                assert_eq!(topology_of(&mesh, &table, closed), counted, "{name}, {round}");
                let last = mesh.vertices.len() as u32 - 1;
                match round {
                    // Two fans share a vertex, and one is not used.
                    0 => mesh
                        .triangles
                        .as_flattened_mut()
                        .iter_mut()
                        .filter(|v| **v == last)
                        .for_each(|v| *v = 0),
                    // A face twice, each way round.
                    1 => {
                        let [a, b, c] = mesh.triangles[5];
                        mesh.triangles.extend([[a, b, c], [a, c, b]]);
                    }
                    _ => drop(mesh.triangles.swap_remove(7)),
                }
            }
        }
    }

    #[test]
    fn sets_that_threads_join_are_those_that_one_joins() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(6);
        let count = 60_000;
        for most in [1_000, 20_000, 200_000] {
            let mut vertex = || rng.random_range(0..count);
            let pairs: Vec<[u32; 2]> = (0..most).map(|_| [vertex(), vertex()]).collect();
            let mut alone = Partition::new(count as usize);
            pairs.iter().for_each(|[a, b]| alone.join(*a, *b));
            let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build().unwrap();
            let shared = SharedPartition::new(count as usize);
            pool.install(|| pairs.par_iter().with_max_len(16).for_each(|[a, b]| shared.join(*a, *b)));
            assert!((0..count).all(|v| shared.root(v) == alone.root(v)), "{most} pairs");
            assert_eq!(shared.count(|v| v % 2 == 0), {
                let is_even: Vec<bool> = (0..count).map(|v| v % 2 == 0).collect();
                alone.count(&is_even)
            });
        }
    }

    #[test]
    fn of_closed_manifolds_no_more_than_components_are_counted() {
        for name in ["sphere", "genus3", "two-components"] {
            let mesh = sample(name).unwrap_or_default();
            assert_eq!(closed_topology(&mesh), topology(&mesh), "{name}");
        }
    }
}
