//! The components of the input: how many vertices each gets, and which of them are too small for cells.

use super::spare::{Wish, coarsened, spare};
use crate::mesh::coarsen::Site;
use crate::mesh::repair::parts;
use crate::mesh::topology::{Topology, topology};
use crate::{Error, Result, TriMesh};

/// A component with a smaller share of the vertices than this is made by collapsing edges, unless it is the largest.
const SMALL: f64 = 32.0;
/// Vertices of the smallest other component on the coarsest level.
const ON_COARSEST: f64 = 12.0;

/// The components of a mesh, in the unit-diagonal frame.
pub(super) struct Parts {
    /// The component of each triangle.
    of_triangle: Vec<u32>,
    areas: Vec<f64>,
}

/// What is too small for cells, and the rest.
pub(super) struct Divided {
    /// The triangles, by number, that are not in small components.
    pub large: Vec<u32>,
    /// The small components, done.
    pub small: Vec<TriMesh>,
    /// Vertices left for the large ones.
    pub left: usize,
    /// The least that the coarsest level needs.
    pub coarsest: usize,
}

impl Parts {
    pub fn new(mesh: &TriMesh) -> Self {
        let (of_triangle, areas) = parts(mesh);
        Self { of_triangle, areas }
    }

    pub fn count(&self) -> usize {
        self.areas.len()
    }

    /// The area of all.
    pub fn area(&self) -> f64 {
        self.areas.iter().sum()
    }

    /// The triangles of a component.
    pub fn triangles(&self, part: usize) -> Vec<u32> {
        (0..).zip(&self.of_triangle).filter(|(_, p)| **p as usize == part).map(|(t, _)| t).collect()
    }

    /// Makes the small components and counts what is left.
    ///
    /// # Errors
    /// [`Error::Usage`] with the least number of vertices if there are too few.
    pub fn divide(&self, mesh: &TriMesh, wish: &Wish) -> Result<Divided> {
        let whole: f64 = self.areas.iter().sum();
        let share = |part: usize| wish.vertices as f64 * self.areas[part] / whole;
        let largest = (0..self.count()).max_by(|a, b| self.areas[*a].total_cmp(&self.areas[*b])).unwrap_or(0);
        let is_small = |part: usize| part != largest && share(part) < SMALL;
        let mut left = wish.vertices;
        let mut small = Vec::new();
        for part in (0..self.count()).filter(|part| is_small(*part)) {
            let own = extract(mesh, &self.triangles(part));
            let made = spare(&own, &[], &Wish { vertices: (share(part).round() as usize).max(3), ..*wish });
            left = left.saturating_sub(made.vertices.len());
            small.push(made);
        }
        let least = if small.is_empty() { 1 } else { 4 };
        if left < least {
            return Err(self.too_few(mesh, wish));
        }
        let large: Vec<usize> = (0..self.count()).filter(|part| !is_small(*part)).collect();
        let area: f64 = large.iter().map(|part| self.areas[*part]).sum();
        let smallest = large.iter().map(|part| self.areas[*part]).fold(area, f64::min);
        let coarsest = if large.len() > 1 { (ON_COARSEST * area / smallest) as usize } else { 0 };
        let triangles = (0..).zip(&self.of_triangle).filter(|(_, part)| !is_small(**part as usize));
        Ok(Divided { large: triangles.map(|(t, _)| t).collect(), small, left, coarsest })
    }

    /// The error that names a number of vertices that would do.
    fn too_few(&self, mesh: &TriMesh, wish: &Wish) -> Error {
        let none = Wish { vertices: 0, ..*wish };
        let least = |part| coarsened(&extract(mesh, &self.triangles(part)), &[], &none).mesh.vertices.len();
        let needed: usize = (0..self.count()).map(least).sum();
        Error::usage(
            format!(
                "{} vertices are too few for the {} components of this surface",
                wish.vertices,
                self.count()
            ),
            format!("ask for more vertices, {} would do", needed.max(wish.vertices + 1)),
        )
    }
}

impl Parts {
    /// Replaces the components of a result that are not what they are in the surface `mesh`, with as many vertices in
    /// all. `sites` are where its vertices were on the surface. How many were replaced; without enough vertices for
    /// that, none.
    pub fn mend(&self, mesh: &TriMesh, result: &mut TriMesh, sites: &[Site], wish: &Wish) -> usize {
        let part_of = |v: u32| self.of_triangle[sites[v as usize].triangle as usize] as usize;
        let mut triangles = vec![Vec::new(); self.count()];
        let mut right = vec![true; self.count()];
        for (t, triangle) in (0..).zip(&result.triangles) {
            let [a, b, c] = triangle.map(part_of);
            triangles[a].push(t);
            if a != b || b != c {
                [a, b, c].iter().for_each(|part| right[*part] = false);
            }
        }
        let mut vertices = vec![0; self.count()];
        (0..sites.len() as u32).for_each(|v| vertices[part_of(v)] += 1);
        let own: Vec<TriMesh> = (0..self.count()).map(|part| extract(mesh, &self.triangles(part))).collect();
        for (part, right) in right.iter_mut().enumerate().filter(|(_, right)| **right) {
            let got = topology(&extract(result, &triangles[part]));
            *right = got.vertices == vertices[part] && is_as_good(&got, &topology(&own[part]));
        }
        let wrong: Vec<usize> = (0..self.count()).filter(|part| !right[*part]).collect();
        if wrong.is_empty() {
            return 0;
        }
        let kept: usize = (0..self.count()).filter(|part| right[*part]).map(|part| vertices[part]).sum();
        let list: Vec<&TriMesh> = wrong.iter().map(|part| &own[*part]).collect();
        let areas: Vec<f64> = wrong.iter().map(|part| self.areas[*part]).collect();
        // Triangles by their number in their component.
        let mut number = vec![0; self.of_triangle.len()];
        for part in &wrong {
            (0..).zip(self.triangles(*part)).for_each(|(new, t)| number[t as usize] = new);
        }
        let own_sites = |part: &usize| {
            let there = (0..).zip(sites).filter(|(v, _)| part_of(*v) == *part);
            there.map(|(_, s)| Site { triangle: number[s.triangle as usize], ..*s }).collect()
        };
        let sites: Vec<Vec<Site>> = wrong.iter().map(own_sites).collect();
        let wish = Wish { vertices: result.vertices.len() - kept, ..*wish };
        let Some(made) = all(&list, &areas, &sites, &wish) else { return 0 };
        let keep: Vec<u32> =
            (0..self.count()).filter(|part| right[*part]).flat_map(|part| triangles[part].clone()).collect();
        *result = extract(result, &keep);
        made.iter().for_each(|part| append(result, part));
        wrong.len()
    }

    /// The whole surface by collapsing edges.
    ///
    /// # Errors
    /// [`Error::Usage`] with the least number of vertices if there are too few.
    pub fn whole(&self, mesh: &TriMesh, wish: &Wish) -> Result<TriMesh> {
        let own: Vec<TriMesh> = (0..self.count()).map(|part| extract(mesh, &self.triangles(part))).collect();
        let made = all(&own.iter().collect::<Vec<_>>(), &self.areas, &[], wish);
        let Some(made) = made else { return Err(self.too_few(mesh, wish)) };
        let mut result = TriMesh::default();
        made.iter().for_each(|part| append(&mut result, part));
        Ok(result)
    }
}

/// Components with their shares of the vertices, the smallest first, so that the largest gives what they lack; `None` if
/// there are too few.
fn all(parts: &[&TriMesh], areas: &[f64], sites: &[Vec<Site>], wish: &Wish) -> Option<Vec<TriMesh>> {
    let mut order: Vec<usize> = (0..parts.len()).collect();
    order.sort_by(|a, b| areas[*a].total_cmp(&areas[*b]));
    let (mut left, mut area) = (wish.vertices, areas.iter().sum::<f64>());
    let mut made = vec![TriMesh::default(); parts.len()];
    for (rank, part) in order.iter().enumerate() {
        let last = rank + 1 == parts.len();
        let share = (left as f64 * areas[*part] / area).round() as usize;
        let vertices = if last { left } else { share.clamp(3, left.max(3)) };
        let new =
            spare(parts[*part], sites.get(*part).map_or(&[], Vec::as_slice), &Wish { vertices, ..*wish });
        left = left.checked_sub(new.vertices.len())?;
        area -= areas[*part];
        made[*part] = new;
    }
    (left == 0).then_some(made)
}

/// Whether a mesh has the topology of another, and no defects that this has not.
pub(super) fn is_as_good(got: &Topology, want: &Topology) -> bool {
    let same = |t: &Topology| (t.components, t.euler, t.boundary_loops);
    let needless = |got: usize, want: usize| got > 0 && want == 0;
    same(got) == same(want)
        && got.duplicate_faces == 0
        && !needless(got.nonmanifold_edges, want.nonmanifold_edges)
        && !needless(got.inconsistent_edges, want.inconsistent_edges)
        && got.nonmanifold_vertices <= want.nonmanifold_vertices
}

/// The mesh of some triangles.
pub(super) fn extract(mesh: &TriMesh, triangles: &[u32]) -> TriMesh {
    let mut renamed = vec![u32::MAX; mesh.vertices.len()];
    let mut part = TriMesh::default();
    for t in triangles {
        let triangle = mesh.triangles[*t as usize].map(|v| {
            let new = &mut renamed[v as usize];
            if *new == u32::MAX {
                *new = part.vertices.len() as u32;
                part.vertices.push(mesh.vertices[v as usize]);
            }
            *new
        });
        part.triangles.push(triangle);
    }
    part
}

/// Adds another mesh.
pub(super) fn append(mesh: &mut TriMesh, other: &TriMesh) {
    let offset = mesh.vertices.len() as u32;
    mesh.vertices.extend_from_slice(&other.vertices);
    mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + offset)));
}
