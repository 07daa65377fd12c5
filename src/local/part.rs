//! A part of a mesh, cut out to try changes on and put back.

use super::star_mesh::StarMesh;
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
            star: vec![Vec::new(); vertices.len()],
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
            old.binary_search(&edge_key(a, b)).is_err() && self.at_edge(a, b).next().is_some()
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
                self.ranks[name] = mesh.ranks[v];
                if !self.sizes.is_empty() {
                    self.sizes[name] = mesh.sizes[v];
                }
                if !mesh.is_used(v as u32) {
                    self.vertex_removed();
                }
            } else {
                let size = mesh.sizes.get(v).copied().unwrap_or(1.0);
                let name = self.add_vertex(mesh.points[v], mesh.places[v], size);
                self.ranks[name as usize] = mesh.ranks[v];
                names.push(name);
                // One that has come and gone.
                if !mesh.is_used(v as u32) {
                    self.vertex_removed();
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
    /// The index in the part of one of its triangles of the whole mesh, as its vertices.
    pub fn find(&self, t: u32) -> Option<[u32; 3]> {
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
        let alive = |mesh: &StarMesh| -> Vec<[u32; 3]> {
            mesh.triangles.iter().filter(|t| t[0] != NONE).copied().collect()
        };
        before.mesh.stays_apart(&alive(&before.mesh), &alive(&self.mesh), |v| self.mesh.points[v as usize])
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
