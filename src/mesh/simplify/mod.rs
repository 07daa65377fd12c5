//! Meshes of fewer vertices by edge collapses that preserve the topology.
//!
//! Slower than cells and with worse triangles, but the result has the topology of the input, however few
//! vertices it gets: components, handles, boundaries and junctions smaller than an edge survive.

use super::TriMesh;
use super::half_edges::{EdgeTable, edge_key, twin_pair};
use super::submesh::renumbered;
use super::topology::Partition;
use crate::{ProgressToken, Result};
use collapse::Collapser;
use glam::DVec3;
use std::collections::HashSet;

mod collapse;
mod flip;
mod insert;
mod split;

/// What is preserved besides the topology.
#[derive(Debug, Clone, Copy, Default)]
pub struct Preserved<'a> {
    /// Of each half-edge `3 * triangle + side` whether it lies on a curve; marking one half-edge of an edge
    /// is enough. Empty if there are no curves but boundaries and junctions.
    pub curves: &'a [bool],
    /// Vertices that stay where they are.
    pub corners: &'a [u32],
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

/// The surface with `count` vertices, all of them vertices of `mesh` if that has as many; else the longest
/// edges are halved. If no mesh of so few vertices can be reached without changing the topology or running
/// through itself, one with more comes back. Vertices move along curves only, and corners not at all. Panics
/// if an index is out of range.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub fn with_vertices(
    mesh: &TriMesh,
    preserved: Preserved,
    count: usize,
    progress: &ProgressToken,
) -> Result<Simplified> {
    let mut graph = Graph::new(mesh, preserved);
    graph.reach(count, progress)?;
    Ok(graph.into_mesh())
}

/// A point on a triangle of the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    /// Where it is; what is off the triangle is moved onto it.
    pub at: DVec3,
    /// The triangle.
    pub triangle: u32,
}

/// As [`with_vertices`], but vertices are at `sites` as far as the topology allows: where it needs others, as
/// at handles smaller than an edge, some sites are left out for them.
///
/// # Errors
/// As [`with_vertices`].
pub fn at_sites(
    mesh: &TriMesh,
    preserved: Preserved,
    sites: &[Site],
    count: usize,
    progress: &ProgressToken,
) -> Result<Simplified> {
    let mut graph = Graph::new(mesh, preserved);
    let fixed = graph.fixed.clone();
    for v in insert::insert(&mut graph, sites) {
        graph.fixed[v as usize] = true;
    }
    let inserted = graph.fixed.len();
    Collapser::new(&mut graph, progress).collapse(count)?;
    graph.fixed = fixed;
    graph.fixed.resize(inserted, false);
    graph.reach(count, progress)?;
    Ok(graph.into_mesh())
}

/// Triangles with their connectivity.
struct Graph {
    points: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    alive: Vec<bool>,
    origin: Vec<u32>,
    /// The triangles left around each vertex.
    star: Vec<Vec<u32>>,
    /// Edges on curves, boundaries and junctions, the smaller vertex first.
    curves: HashSet<(u32, u32)>,
    /// Vertices that stay.
    fixed: Vec<bool>,
    /// Vertices with triangles.
    used: usize,
}

impl Graph {
    fn new(mesh: &TriMesh, preserved: Preserved) -> Self {
        let mut star = vec![Vec::new(); mesh.vertices.len()];
        for (t, triangle) in (0..).zip(&mesh.triangles) {
            triangle.iter().for_each(|v| star[*v as usize].push(t));
        }
        let corners = mesh.triangles.as_flattened();
        let mut curves = HashSet::new();
        let mut fans = Partition::new(corners.len());
        // Faces at the curve edges of each vertex; a curve goes on only where they are as many.
        let mut ends: Vec<Vec<usize>> = vec![Vec::new(); mesh.vertices.len()];
        for sides in EdgeTable::new(&mesh.triangles).edges() {
            let (a, b) = sides[0].ends();
            let half = |k: usize| sides[k].corners();
            let plain = twin_pair(&mesh.triangles, sides).is_some();
            let named = sides.iter().any(|side| preserved.curves.get(side.corners().0).is_some_and(|on| *on));
            if !plain || named {
                curves.insert((a, b));
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
            curves,
            fixed,
            used,
        }
    }

    /// Removes or adds vertices until there are `count`.
    fn reach(&mut self, count: usize, progress: &ProgressToken) -> Result<()> {
        if self.used > count {
            return Collapser::new(self, progress).collapse(count);
        }
        split::split(self, count);
        Ok(())
    }

    fn is_curve(&self, a: u32, b: u32) -> bool {
        self.curves.contains(&edge_key(a, b))
    }

    /// The other vertices of the triangles around one, ascending.
    fn neighbours(&self, v: u32) -> Vec<u32> {
        let around = self.star[v as usize].iter().flat_map(|t| self.triangles[*t as usize]);
        let mut list: Vec<u32> = around.filter(|w| *w != v).collect();
        list.sort_unstable();
        list.dedup();
        list
    }

    fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|v| self.points[v as usize])
    }

    /// The triangles left at both vertices.
    fn at_edge(&self, a: u32, b: u32) -> impl Iterator<Item = u32> {
        self.star[a as usize].iter().copied().filter(move |t| self.triangles[*t as usize].contains(&b))
    }

    fn into_mesh(self) -> Simplified {
        let mut on_curve = self.fixed;
        self.curves.iter().for_each(|(a, b)| [a, b].iter().for_each(|v| on_curve[**v as usize] = true));
        let used: Vec<bool> = self.star.iter().map(|star| !star.is_empty()).collect();
        let (new, old) = renumbered(&used);
        let left = (0..self.triangles.len()).filter(|t| self.alive[*t]);
        let (triangles, origin) =
            left.map(|t| (self.triangles[t].map(|v| new[v as usize]), self.origin[t])).unzip();
        let vertices = old.iter().map(|v| self.points[*v as usize]).collect();
        let fixed = old.iter().map(|v| on_curve[*v as usize]).collect();
        Simplified { mesh: TriMesh { vertices, triangles }, origin, fixed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;
    use crate::mesh::samples::sample;

    #[test]
    fn cancelled_work_gives_no_mesh() {
        let mesh = sample("torus").unwrap();
        let progress = ProgressToken::default();
        progress.cancel();
        let made = with_vertices(&mesh, Preserved::default(), 50, &progress);
        assert_eq!(made, Err(Error::Cancelled));
        let site = Site { at: mesh.corners(0).iter().sum::<DVec3>() / 3.0, triangle: 0 };
        let made = at_sites(&mesh, Preserved::default(), &[site], 50, &progress);
        assert_eq!(made, Err(Error::Cancelled));
    }
}
