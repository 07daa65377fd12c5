//! A part of a mesh, cut out to try changes on and put back.

use super::star_mesh::{Star, StarMesh};
use crate::mesh::NONE;
use crate::mesh::half_edges::edge_key;

/// Some triangles of a mesh as a mesh of their own. Vertices that other triangles share are frozen.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub mesh: StarMesh,
    /// The whole mesh's index of each vertex, ascending.
    vertices: Vec<u32>,
    /// The triangles of the whole mesh.
    triangles: Vec<u32>,
}

impl StarMesh {
    /// The triangles around some vertices and their neighbours.
    pub fn part_around(&self, centre: &[u32]) -> Part {
        let near = centre.iter().flat_map(|v| self.neighbours(*v)).chain(centre.iter().copied());
        let free = sorted(near.filter(|v| !self.is_frozen(*v)));
        let triangles = sorted(free.iter().flat_map(|v| self.star[*v as usize].iter().copied()));
        let vertices = sorted(triangles.iter().flat_map(|t| self.triangles[*t as usize]));
        let number = |v: u32| vertices.binary_search(&v).map_or(NONE, |k| k as u32);
        let of = |v: &u32| *v as usize;
        let mut mesh = Self {
            points: vertices.iter().map(|v| self.points[of(v)]).collect(),
            triangles: Vec::with_capacity(triangles.len() + 4),
            patches: Vec::with_capacity(triangles.len() + 4),
            star: vec![Star::new(); vertices.len()],
            places: vertices.iter().map(|v| self.places[of(v)]).collect(),
            sizes: if self.sizes.is_empty() {
                Vec::new()
            } else {
                vertices.iter().map(|v| self.sizes[of(v)]).collect()
            },
            ranks: vertices.iter().map(|v| self.ranks[of(v)]).collect(),
            frozen: vertices.iter().map(|v| free.binary_search(v).is_err()).collect(),
            used: vertices.len(),
            ..Self::default()
        };
        for t in &triangles {
            let triangle = self.triangles[of(t)];
            mesh.add_triangle(triangle.map(number), self.patches[of(t)]);
            for (a, b) in sides(triangle) {
                if let Some(part) = self.curves.get(a, b) {
                    mesh.curves.insert(number(a), number(b), part);
                }
            }
        }
        Part { mesh, vertices, triangles }
    }

    /// Puts a changed part back; returns its triangles. None, and nothing is changed, if it has an edge that
    /// is already elsewhere.
    pub fn put_back(&mut self, part: &Part) -> Option<Vec<u32>> {
        let Part { mesh, vertices, triangles } = part;
        let old: Vec<(u32, u32)> = sorted(
            triangles.iter().flat_map(|t| sides(self.triangles[*t as usize])).map(|(a, b)| edge_key(a, b)),
        );
        let given = |v: u32| vertices.get(v as usize).copied();
        let doubles = |(a, b): (u32, u32)| {
            let (Some(a), Some(b)) = (given(a), given(b)) else { return false };
            old.binary_search(&edge_key(a, b)).is_err() && self.has_edge(a, b)
        };
        if mesh.edges().into_iter().any(doubles) {
            return None;
        }
        for (a, b) in &old {
            self.curves.remove(*a, *b);
        }
        triangles.iter().for_each(|t| self.remove_triangle(*t));
        let mut names = vertices.clone();
        for v in 0..mesh.points.len() {
            if let Some(name) = names.get(v).copied() {
                let name = name as usize;
                self.points[name] = mesh.points[v];
                self.places[name] = mesh.places[v];
                self.ranks[name] = mesh.ranks[v];
                if !self.sizes.is_empty() {
                    self.sizes[name] = mesh.sizes[v];
                }
                if !mesh.is_used(v as u32) {
                    self.count_removed_vertex();
                }
            } else {
                let size = mesh.sizes.get(v).copied().unwrap_or(1.0);
                let name = self.add_vertex(mesh.points[v], mesh.places[v], size);
                self.ranks[name as usize] = mesh.ranks[v];
                names.push(name);
                // One that has come and gone.
                if !mesh.is_used(v as u32) {
                    self.count_removed_vertex();
                }
            }
        }
        let first = self.triangles.len() as u32;
        for (triangle, patch) in mesh.triangles.iter().zip(&mesh.patches).filter(|(t, _)| t[0] != NONE) {
            self.add_triangle(triangle.map(|v| names[v as usize]), *patch);
        }
        for (a, b) in mesh.edges() {
            if let Some(part) = mesh.curves.get(a, b) {
                self.curves.insert(names[a as usize], names[b as usize], part);
            }
        }
        Some((first..self.triangles.len() as u32).collect())
    }
}

impl Part {
    /// The corners, as numbered in the part, of a triangle of the whole mesh; `None` if the part does not
    /// have it.
    pub fn corners_of(&self, t: u32) -> Option<[u32; 3]> {
        let k = self.triangles.binary_search(&t).ok()?;
        self.mesh.triangles.get(k).copied()
    }

    /// The part's names of two vertices of the whole mesh.
    pub fn numbers(&self, vertices: [u32; 2]) -> Option<[u32; 2]> {
        let [a, b] = vertices.map(|v| self.number(v));
        Some([a?, b?])
    }

    /// Whether it has a triangle of the whole mesh.
    pub fn has(&self, t: u32) -> bool {
        self.triangles.binary_search(&t).is_ok()
    }

    /// The part's name of a vertex of the whole mesh.
    pub fn number(&self, v: u32) -> Option<u32> {
        self.vertices.binary_search(&v).ok().map(|k| k as u32)
    }

    /// The vertices of the whole mesh that it has, as it was cut out.
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// Whether no more triangles intersect than before.
    pub fn stays_apart_from(&self, before: &Self) -> bool {
        let [old, new] = [before, self].map(|part| part.mesh.alive().collect::<Vec<_>>());
        before.mesh.stays_apart(&old, &new, |v| self.mesh.points[v as usize])
    }
}

fn sides([a, b, c]: [u32; 3]) -> [(u32, u32); 3] {
    [(a, b), (b, c), (c, a)]
}

fn sorted<T: Ord>(list: impl Iterator<Item = T>) -> Vec<T> {
    let mut list: Vec<T> = list.collect();
    list.sort_unstable();
    list.dedup();
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::local::collapse::Limits;
    use crate::local::star_mesh::Place;
    use crate::mesh::polyline::Polyline;
    use crate::polish::{ConstrainedMesh, CurveEdge, SlidingCurve};
    use crate::{TriMesh, mesh::topology::topology};
    use glam::DVec3;

    /// A square of 6 x 6 cells, with a curve along its middle row that bends up sharply at its second vertex,
    /// close to its end.
    fn bent() -> (StarMesh, Vec<Polyline>) {
        let at = |i: u32, j: u32| match (i, j) {
            (2, 3) => DVec3::new(1.03, 3.0, 0.0),
            (3, 3) => DVec3::new(1.5, 3.7, 0.0),
            _ => DVec3::new(f64::from(i), f64::from(j), 0.0),
        };
        let vertices = (0..7).flat_map(|j| (0..7).map(move |i| at(i, j))).collect();
        let cell = |i: u32, j: u32| {
            [[i + 7 * j, i + 1 + 7 * j, i + 7 * j + 7], [i + 1 + 7 * j, i + 8 + 7 * j, i + 7 * j + 7]]
        };
        let triangles = (0..6).flat_map(|j| (0..6).flat_map(move |i| cell(i, j))).collect();
        let on_curve: Vec<u32> = (22..=26).collect();
        let mesh = TriMesh { vertices, triangles };
        let line = Polyline::new(on_curve.iter().map(|v| mesh.vertices[*v as usize]).collect(), false);
        let arc = |k: usize| line.arc_length_at(k);
        let edge = |k: usize| CurveEdge {
            ends: [on_curve[k], on_curve[k + 1]],
            curve: 0,
            from: arc(k),
            to: arc(k + 1),
        };
        let curve_edges = (0..4).map(edge).collect();
        let sliders = (1..4).map(|k| (on_curve[k], arc(k))).collect();
        let mut fixed = vec![false; 49];
        on_curve.iter().for_each(|v| fixed[*v as usize] = true);
        let sliding_curves = vec![SlidingCurve { line: line.clone(), sliders }];
        let local =
            ConstrainedMesh { mesh, fixed, curve_edges, sliding_curves, ..ConstrainedMesh::default() };
        (StarMesh::from_constrained(&local), vec![line])
    }

    #[test]
    fn an_unchanged_part_changes_nothing() {
        let (mut mesh, lines) = bent();
        let before = mesh.clone().into_constrained(&lines);
        let part = mesh.part_around(&[24]);
        let new = mesh.put_back(&part).unwrap();
        assert_eq!(new.len(), part.mesh.triangles.len());
        let after = mesh.into_constrained(&lines);
        assert_eq!(after.mesh.vertices, before.mesh.vertices);
        let in_order = |mesh: &TriMesh| sorted(mesh.triangles.iter().copied());
        assert_eq!(in_order(&after.mesh), in_order(&before.mesh));
        assert_eq!((after.curve_edges, after.fixed), (before.curve_edges, before.fixed));
    }

    #[test]
    fn a_vertex_that_takes_over_a_corner_is_one() {
        let (mut mesh, lines) = bent();
        let mut part = mesh.part_around(&[23]);
        let [corner, bend] = part.numbers([22, 23]).unwrap();
        assert_eq!([corner, bend].map(|v| part.mesh.places[v as usize]), [Place::Corner, Place::Curve]);
        let kept = part.mesh.collapse_edge(corner, bend, &Limits::of_mending(1.0, 1e-3), &lines);
        assert_eq!(kept, Some(bend));
        mesh.put_back(&part).unwrap();
        assert_eq!((mesh.places[23], mesh.used()), (Place::Corner, 48));
        let after = mesh.into_constrained(&lines);
        let topology = topology(&after.mesh);
        assert_eq!((topology.euler, topology.boundary_edges, topology.faces), (1, 24, 70));
        assert_eq!(after.sliding_curves[0].sliders.len(), 2);
        assert_eq!(after.curve_edges.len(), 3);
    }
}
