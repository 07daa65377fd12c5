//! The boundary loops of a mesh.

use glam::DVec3;

use super::triangulate::normal;
use crate::mesh::half_edges::{EdgeTable, next, previous};
use crate::mesh::{NONE, TriMesh};

/// A rim's normal and those of the triangles at it are opposite: the cosine is at most this, on average.
const FLAT: f64 = -0.9;

/// A boundary loop in which no vertex occurs twice, in the order that triangles filling it have.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Hole {
    /// Its vertices.
    pub vertices: Vec<u32>,
    /// For each vertex the boundary half-edge that leaves it, for the vertex before it.
    pub half_edges: Vec<u32>,
}

impl Hole {
    /// How many vertices it has.
    pub fn len(&self) -> u32 {
        self.vertices.len() as u32
    }

    /// The diagonal of its bounding box.
    pub fn width(&self, mesh: &TriMesh) -> f64 {
        let vertices = self.vertices.iter().map(|v| mesh.vertices[*v as usize]).collect();
        let [low, high] = TriMesh { vertices, triangles: Vec::new() }.bounds().unwrap_or_default();
        high.distance(low)
    }

    /// Whether it runs around a flat part instead of a hole in one.
    pub fn is_rim(&self, mesh: &TriMesh) -> bool {
        let beside = self.half_edges.iter().map(|half| mesh.doubled_normal(*half as usize / 3));
        let outwards: DVec3 = beside.map(DVec3::normalize_or_zero).sum();
        let inside = normal(&self.vertices, &mesh.vertices).normalize_or_zero();
        outwards.dot(inside) < FLAT * self.vertices.len() as f64
    }

    /// Turns it so that its least vertex is the first.
    fn begin_at_least(&mut self) {
        let least = (0..self.vertices.len()).min_by_key(|k| self.vertices[*k]).unwrap_or(0);
        self.vertices.rotate_left(least);
        self.half_edges.rotate_left(least);
    }

    fn push(&mut self, vertex: u32, half_edge: u32) {
        self.vertices.push(vertex);
        self.half_edges.push(half_edge);
    }

    /// Cuts off what follows the first `length` vertices.
    fn split_off(&mut self, length: usize) -> Self {
        Self { vertices: self.vertices.split_off(length), half_edges: self.half_edges.split_off(length) }
    }
}

/// The boundary of a mesh.
pub(crate) struct Boundary {
    /// Its loops. Where one touches itself at a vertex, it is cut there.
    pub holes: Vec<Hole>,
    /// Whether there is more: chains that end at edges of more than two triangles.
    pub is_open: bool,
}

/// The boundary of an oriented mesh, of which `table` has the edges.
pub(crate) fn boundary_of(mesh: &TriMesh, table: &EdgeTable) -> Boundary {
    let corners = mesh.triangles.as_flattened();
    let twins = table.twins(&mesh.triangles);
    let mut is_boundary = vec![false; corners.len()];
    for edge in table.edges() {
        if let [one] = edge {
            is_boundary[one.corners().0] = true;
        }
    }
    // The boundary half-edge that ends where another one begins, in the same fan of triangles.
    let before = |half: u32| {
        let mut edge = previous(half);
        while !is_boundary[edge as usize] {
            match twins[edge as usize] {
                NONE => return None,
                twin => edge = previous(twin),
            }
        }
        Some(edge)
    };
    let mut is_done = vec![false; corners.len()];
    let mut place = vec![NONE; mesh.vertices.len()];
    let (mut holes, mut is_open) = (Vec::new(), false);
    for first in (0..corners.len() as u32).filter(|half| is_boundary[*half as usize]) {
        if is_done[first as usize] {
            continue;
        }
        let (mut hole, mut half, mut found) = (Hole::default(), Some(first), Vec::new());
        while let Some(own) = half.filter(|own| !is_done[*own as usize]) {
            is_done[own as usize] = true;
            let vertex = corners[own as usize];
            if place[vertex as usize] != NONE {
                // The cut-off loop begins here, with this half-edge to its last vertex.
                let mut closed = hole.split_off(place[vertex as usize] as usize);
                closed.vertices.iter().for_each(|v| place[*v as usize] = NONE);
                let outer = std::mem::replace(&mut closed.half_edges[0], own);
                found.push(closed);
                place[vertex as usize] = hole.len();
                hole.push(vertex, outer);
            } else {
                place[vertex as usize] = hole.len();
                hole.push(vertex, own);
            }
            half = before(own);
        }
        hole.vertices.iter().for_each(|v| place[*v as usize] = NONE);
        // A chain that ends at an edge of more triangles is no loop, and neither is what was begun within it.
        if half == Some(first) {
            found.push(hole);
        } else {
            is_open = true;
        }
        holes.extend(found.into_iter().filter(|hole| hole.len() > 2));
    }
    debug_assert!(holes.iter().all(|hole| is_closed(hole, corners)));
    holes.iter_mut().for_each(Hole::begin_at_least);
    holes.sort_by(|a, b| a.vertices.cmp(&b.vertices));
    Boundary { holes, is_open }
}

/// Whether each half-edge leads to the vertex before its own.
fn is_closed(hole: &Hole, corners: &[u32]) -> bool {
    let before = hole.vertices.iter().cycle().skip(hole.vertices.len() - 1);
    let ends = hole.half_edges.iter().map(|half| corners[next(*half) as usize]);
    ends.zip(before).all(|(end, before)| end == *before)
}
