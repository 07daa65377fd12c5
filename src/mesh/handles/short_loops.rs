//! A shortest loop in a region that does not divide it: of a tree of shortest paths and a tree of the faces
//! across the other edges, those with the longest loops first, the edges in neither have the shortest loops
//! (Erickson and Whittlesey, "Greedy optimal homotopy and homology generators", SODA 2005).

use super::region::Region;
use crate::mesh::TriMesh;
use crate::mesh::half_edges::{edge_key, next};
use crate::mesh::topology::Partition;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

/// Loops found, at most.
const LOOPS: usize = 6;
/// Paths begin at this many vertices of a region, then at those of the best loop.
const ROOTS: usize = 16;

/// The region as a graph, its vertices and triangles by their places in its lists.
struct Graph {
    /// The edges at each vertex: the other end, the length, the number of the edge.
    at: Vec<Vec<(u32, f64, u32)>>,
    /// The ends of each edge, its length, and the faces on both sides; a boundary loop counts as one.
    edges: Vec<([u32; 2], f64, [u32; 2])>,
    faces: usize,
}

impl Graph {
    fn new(mesh: &TriMesh, region: &Region) -> Self {
        let place: HashMap<u32, u32> = region.vertices.iter().copied().zip(0..).collect();
        let mut graph = Self {
            at: vec![Vec::new(); region.vertices.len()],
            edges: Vec::with_capacity(2 * region.triangles.len()),
            faces: region.triangles.len() + region.boundary.len(),
        };
        let corners = mesh.triangles.as_flattened();
        let from_to = |h: u32| [h, next(h)].map(|c| corners[c as usize]);
        let inside =
            (0..).zip(&region.triangles).flat_map(|(face, t)| (3 * t..3 * t + 3).map(move |h| (h, face)));
        let caps = (region.triangles.len() as u32..).zip(&region.boundary);
        let caps = caps.flat_map(|(face, around)| around.iter().map(move |h| (*h, face)));
        let mut known: HashMap<(u32, u32), u32> = HashMap::new();
        for (half_edge, face) in inside.chain(caps) {
            let [v, w] = from_to(half_edge);
            if let Some(edge) = known.get(&edge_key(v, w)) {
                graph.edges[*edge as usize].2[1] = face;
                continue;
            }
            let number = graph.edges.len() as u32;
            known.insert(edge_key(v, w), number);
            let length = mesh.vertices[v as usize].distance(mesh.vertices[w as usize]);
            let ends = [v, w].map(|v| place[&v]);
            graph.edges.push((ends, length, [face; 2]));
            graph.at[ends[0] as usize].push((ends[1], length, number));
            graph.at[ends[1] as usize].push((ends[0], length, number));
        }
        graph
    }

    /// The distance of each vertex from a root, and the vertex and edge before it on the way.
    fn paths(&self, root: u32) -> (Vec<f64>, Vec<Option<(u32, u32)>>) {
        let mut distance = vec![f64::INFINITY; self.at.len()];
        let mut before = vec![None; self.at.len()];
        distance[root as usize] = 0.0;
        // Bits of positive numbers are ordered as the numbers.
        let mut queue = BinaryHeap::from([Reverse((0_u64, root))]);
        while let Some(Reverse((bits, v))) = queue.pop() {
            let so_far = f64::from_bits(bits);
            if so_far > distance[v as usize] {
                continue;
            }
            for (w, length, edge) in &self.at[v as usize] {
                let far = so_far + length;
                if far < distance[*w as usize] {
                    distance[*w as usize] = far;
                    before[*w as usize] = Some((v, *edge));
                    queue.push(Reverse((far.to_bits(), *w)));
                }
            }
        }
        (distance, before)
    }

    /// The shortest loop through a root that does not divide the region, except for the way to it and back;
    /// with its length.
    fn loop_through(&self, root: u32) -> Option<(f64, Vec<u32>)> {
        let (distance, before) = self.paths(root);
        let mut in_tree = vec![false; self.edges.len()];
        before.iter().flatten().for_each(|(_, edge)| in_tree[*edge as usize] = true);
        let length = |edge: &usize| {
            let ([v, w], length, _) = self.edges[*edge];
            distance[v as usize] + distance[w as usize] + length
        };
        let mut rest: Vec<usize> = (0..self.edges.len()).filter(|edge| !in_tree[*edge]).collect();
        rest.sort_by(|a, b| length(b).total_cmp(&length(a)));
        let mut faces = Partition::new(self.faces);
        let mut last = None;
        for edge in rest {
            let [one, two] = self.edges[edge].2;
            if faces.root(one) == faces.root(two) {
                last = Some(edge);
            }
            faces.join(one, two);
        }
        let ([v, w], own, _) = self.edges[last?];
        let way = |mut v: u32| {
            let mut way = vec![v];
            while let Some((b, _)) = before[v as usize] {
                way.push(b);
                v = b;
            }
            way
        };
        let (mut one, mut two) = (way(v), way(w));
        while one.len() > 1 && two.len() > 1 && one[one.len() - 2] == two[two.len() - 2] {
            one.pop();
            two.pop();
        }
        let common = distance[*one.last()? as usize];
        two.pop();
        one.extend(two.into_iter().rev());
        Some((distance[v as usize] + distance[w as usize] + own - 2.0 * common, one))
    }
}

/// Loops of vertices with complete fans that do not divide the region, the first about as short as there is;
/// none where all of them pass the region's boundary.
pub(super) fn short_loops(mesh: &TriMesh, region: &Region) -> Vec<Vec<u32>> {
    let graph = Graph::new(mesh, region);
    let mut loops: Vec<(f64, Vec<u32>)> = Vec::new();
    let mut try_roots = |roots: Vec<u32>| -> Vec<u32> {
        for found in roots.into_iter().filter_map(|root| graph.loop_through(root)) {
            if found.1.iter().all(|v| region.is_inside[*v as usize]) {
                loops.push(found);
            }
        }
        loops.sort_by(|a, b| a.0.total_cmp(&b.0));
        loops.first().map_or(Vec::new(), |(_, around)| around.clone())
    };
    let inside: Vec<u32> =
        (0..region.vertices.len() as u32).filter(|v| region.is_inside[*v as usize]).collect();
    let step = inside.len().div_ceil(ROOTS).max(1);
    let best = try_roots(inside.into_iter().step_by(step).collect());
    try_roots(best);
    // The same loop is found from each of its vertices.
    loops.dedup_by(|a, b| a.0.to_bits() == b.0.to_bits());
    let of_mesh =
        |(_, around): (f64, Vec<u32>)| around.into_iter().map(|v| region.vertices[v as usize]).collect();
    loops.into_iter().take(LOOPS).map(of_mesh).collect()
}
