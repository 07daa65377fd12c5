//! Triangles that can be collapsed, split and flipped, with their curves.

use glam::DVec3;
use smallvec::SmallVec;

use crate::TriMesh;
use crate::mesh::half_edges::{EdgeTable, twin_pair};
use crate::mesh::submesh::renumber;
use crate::mesh::topology::Partition;
use crate::mesh::triangle::corners_at;

/// What is preserved besides the topology.
#[derive(Debug, Clone, Copy, Default)]
pub struct Preserved<'a> {
    /// Of each half-edge `3 * triangle + side` whether it lies on a curve; marking one half-edge of an edge
    /// is enough. Empty if there are no curves but boundaries and junctions.
    pub curves: &'a [bool],
    /// Vertices that stay where they are.
    pub corners: &'a [u32],
    /// Whether every change is checked for new intersections, not only those that change the shape or are
    /// among few vertices; takes longer.
    pub apart: bool,
    /// Whether faces may come to intersect where the number of vertices is not reached otherwise.
    pub may_intersect: bool,
}

/// A mesh from [`with_vertices`].
#[derive(Debug, Clone, PartialEq)]
pub struct Simplified {
    /// The mesh.
    pub mesh: TriMesh,
    /// The triangle of the input that each triangle comes from.
    pub origin: Vec<u32>,
    /// Of each vertex, whether it is on a curve, a boundary or a junction.
    pub fixed: Vec<bool>,
}

/// With more triangles around it, a vertex is a hub.
const HUB: usize = 500;

/// Vertices or triangles around a vertex: mostly few enough to need no allocation.
pub(super) type Around = SmallVec<[u32; 24]>;

/// Triangles with their connectivity.
pub(super) struct Graph {
    pub points: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    pub alive: Vec<bool>,
    pub origin: Vec<u32>,
    /// The triangles left around each vertex.
    pub star: Vec<SmallVec<[u32; 8]>>,
    /// The vertices that each is joined with by an edge on a curve, boundary or junction, ascending.
    pub along_curves: Vec<SmallVec<[u32; 2]>>,
    /// Vertices that stay.
    pub fixed: Vec<bool>,
    /// Vertices with triangles.
    pub used: usize,
}

impl Graph {
    pub fn new(mesh: &TriMesh, preserved: Preserved) -> Self {
        let mut star = vec![SmallVec::new(); mesh.vertices.len()];
        for (t, triangle) in (0..).zip(&mesh.triangles) {
            triangle.iter().for_each(|v| star[*v as usize].push(t));
        }
        let corners = mesh.triangles.as_flattened();
        let mut along_curves = vec![SmallVec::new(); mesh.vertices.len()];
        let mut fans = Partition::new(corners.len());
        // Faces at the curve edges of each vertex; a curve goes on only where they are as many.
        let mut ends: Vec<SmallVec<[usize; 2]>> = vec![SmallVec::new(); mesh.vertices.len()];
        for sides in EdgeTable::new(&mesh.triangles).edges() {
            let (a, b) = sides[0].ends();
            let half = |k: usize| sides[k].corners();
            let plain = twin_pair(&mesh.triangles, sides).is_some();
            let named = sides.iter().any(|side| preserved.curves.get(side.corners().0).is_some_and(|on| *on));
            if !plain || named {
                along_curves[a as usize].push(b);
                along_curves[b as usize].push(a);
                [a, b].iter().for_each(|v| ends[*v as usize].push(sides.len()));
            }
            let at_ends = |k: usize| {
                let (from, to) = half(k);
                if corners[from] == a { (from, to) } else { (to, from) }
            };
            for k in 1..sides.len() {
                fans.join(at_ends(0).0 as u32, at_ends(k).0 as u32);
                fans.join(at_ends(0).1 as u32, at_ends(k).1 as u32);
            }
        }
        along_curves.iter_mut().for_each(|list: &mut SmallVec<[u32; 2]>| list.sort_unstable());
        let mut fixed: Vec<bool> = ends
            .iter()
            .map(|ends| !matches!(ends.as_slice(), [] | [_, _]) || ends.windows(2).any(|e| e[0] != e[1]))
            .collect();
        preserved.corners.iter().for_each(|v| fixed[*v as usize] = true);
        let mut met = vec![false; mesh.vertices.len()];
        for (corner, v) in (0..).zip(corners) {
            if fans.root(corner) == corner {
                fixed[*v as usize] |= std::mem::replace(&mut met[*v as usize], true);
            }
        }
        let used = star.iter().filter(|star| !star.is_empty()).count();
        Self {
            points: mesh.vertices.clone(),
            triangles: mesh.triangles.clone(),
            alive: vec![true; mesh.triangles.len()],
            origin: (0..mesh.triangles.len() as u32).collect(),
            star,
            along_curves,
            fixed,
            used,
        }
    }

    pub fn is_curve(&self, a: u32, b: u32) -> bool {
        self.along_curves[a as usize].contains(&b)
    }

    /// Makes an edge one on a curve.
    pub fn add_to_curve(&mut self, a: u32, b: u32) {
        for (v, w) in [(a, b), (b, a)] {
            let list = &mut self.along_curves[v as usize];
            if let Err(place) = list.binary_search(&w) {
                list.insert(place, w);
            }
        }
    }

    /// Takes an edge off its curve; returns whether it was on one.
    pub fn take_off_curve(&mut self, a: u32, b: u32) -> bool {
        let was = self.is_curve(a, b);
        self.along_curves[a as usize].retain(|w| *w != b);
        self.along_curves[b as usize].retain(|w| *w != a);
        was
    }

    /// The other vertices of the triangles around one, ascending.
    pub fn neighbours(&self, v: u32) -> Around {
        let around = self.star[v as usize].iter().flat_map(|t| self.triangles[*t as usize]);
        let mut list: Around = around.filter(|w| *w != v).collect();
        list.sort_unstable();
        list.dedup();
        list
    }

    pub fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        corners_at(triangle, |v| self.points[v as usize])
    }

    /// The triangles left at both vertices.
    pub fn at_edge(&self, a: u32, b: u32) -> impl Iterator<Item = u32> {
        self.star[a as usize].iter().copied().filter(move |t| self.triangles[*t as usize].contains(&b))
    }

    /// As [`Graph::at_edge`], in any order: in the time that the vertex with fewer triangles takes.
    pub fn around_edge(&self, a: u32, b: u32) -> impl Iterator<Item = u32> {
        let is_less = self.star[a as usize].len() <= self.star[b as usize].len();
        if is_less { self.at_edge(a, b) } else { self.at_edge(b, a) }
    }

    /// Whether so many triangles are around a vertex that work on all of them with each change near it would
    /// take too long: as at the middle of a fan over a polygon of many corners.
    pub fn is_hub(&self, v: u32) -> bool {
        self.star[v as usize].len() > HUB
    }

    pub fn into_mesh(self) -> Simplified {
        let mut on_curve = self.fixed;
        on_curve.iter_mut().zip(&self.along_curves).for_each(|(on, along)| *on |= !along.is_empty());
        let used: Vec<bool> = self.star.iter().map(|star| !star.is_empty()).collect();
        let (new, old) = renumber(&used);
        let left = (0..self.triangles.len()).filter(|t| self.alive[*t]);
        let (triangles, origin) =
            left.map(|t| (self.triangles[t].map(|v| new[v as usize]), self.origin[t])).unzip();
        let vertices = old.iter().map(|v| self.points[*v as usize]).collect();
        let fixed = old.iter().map(|v| on_curve[*v as usize]).collect();
        Simplified { mesh: TriMesh { vertices, triangles }, origin, fixed }
    }
}
