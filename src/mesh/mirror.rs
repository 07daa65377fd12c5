//! Planes of symmetry: how far a mesh is off its mirror image, one half of it, and a whole made of a half.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::TriMesh;
use super::bvh::Bvh;
use super::half_edges::{EdgeTable, edge_key};

/// Vertices nearer to the plane than this fraction of the diagonal are on it.
const ON_PLANE: f64 = 1e-6;

/// A plane across an axis, through the middle of a bounding box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mirror {
    /// 0 to 2.
    pub axis: usize,
    centre: f64,
    /// Of the box.
    diagonal: f64,
}

impl Mirror {
    /// Across this axis, 0 to 2; `None` without vertices.
    pub fn of(mesh: &TriMesh, axis: usize) -> Option<Self> {
        let [low, high] = mesh.bounds()?;
        Some(Self { axis, centre: 0.5 * low[axis] + 0.5 * high[axis], diagonal: low.distance(high) })
    }

    /// The mirror image of a point.
    fn image(&self, mut p: DVec3) -> DVec3 {
        p[self.axis] = self.centre + (self.centre - p[self.axis]);
        p
    }

    /// How far the vertices and the middles of triangles are from the surface once mirrored, at most, as a
    /// fraction of the diagonal.
    pub fn asymmetry(&self, mesh: &TriMesh) -> f64 {
        let tree = Bvh::new(mesh);
        let off = |p: DVec3| tree.closest(self.image(p)).map_or(0.0, |found| found.distance_sq);
        let middle = |t: usize| off(mesh.corners(t).into_iter().sum::<DVec3>() / 3.0);
        let of_vertices = mesh.vertices.par_iter().map(|p| off(*p)).reduce(|| 0.0, f64::max);
        let of_triangles = (0..mesh.triangles.len()).into_par_iter().map(middle).reduce(|| 0.0, f64::max);
        of_vertices.max(of_triangles).sqrt() / self.diagonal
    }

    /// The part of a mesh above the plane, with the length of the cut. Vertices near the plane move onto it.
    pub fn half(&self, mesh: &TriMesh) -> (TriMesh, f64) {
        let mut points = mesh.vertices.clone();
        points.iter_mut().filter(|p| self.is_near(**p)).for_each(|p| p[self.axis] = self.centre);
        let height = |v: u32| points[v as usize][self.axis] - self.centre;
        let mut half = TriMesh::default();
        let mut numbers: HashMap<(u32, u32), u32> = HashMap::new();
        let mut length = 0.0;
        for triangle in mesh.triangles.iter().filter(|triangle| triangle.iter().any(|v| height(*v) > 0.0)) {
            // A vertex by its number twice, a point on an edge by its ends.
            let mut corners = Vec::with_capacity(4);
            for k in 0..3 {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                if height(a) >= 0.0 {
                    corners.push((a, a));
                }
                if height(a) * height(b) < 0.0 {
                    corners.push(edge_key(a, b));
                }
            }
            let place = |(a, b): (u32, u32)| {
                let [p, q] = [a, b].map(|v| points[v as usize]);
                if a == b {
                    return p;
                }
                let mut cut = p.lerp(q, height(a) / (height(a) - height(b)));
                cut[self.axis] = self.centre;
                cut
            };
            let is_on = |key: (u32, u32)| place(key)[self.axis] == self.centre;
            for m in 0..corners.len() {
                let (from, to) = (corners[m], corners[(m + 1) % corners.len()]);
                if is_on(from) && is_on(to) {
                    length += place(from).distance(place(to));
                }
            }
            let numbered: Vec<u32> = corners
                .iter()
                .map(|key| {
                    *numbers.entry(*key).or_insert_with(|| {
                        half.vertices.push(place(*key));
                        half.vertices.len() as u32 - 1
                    })
                })
                .collect();
            half.triangles.extend((2..numbered.len()).map(|m| [numbered[0], numbered[m - 1], numbered[m]]));
        }
        (half, length)
    }

    fn is_near(&self, p: DVec3) -> bool {
        (p[self.axis] - self.centre).abs() <= ON_PLANE * self.diagonal
    }

    /// A half with its mirror image: the vertices of its boundary that are on the plane are shared, all
    /// others follow once more.
    pub fn whole(&self, mut half: TriMesh) -> TriMesh {
        let mut is_shared = vec![false; half.vertices.len()];
        let table = EdgeTable::new(&half.triangles);
        for (a, b) in table.edges().filter(|sides| sides.len() == 1).map(|sides| sides[0].ends()) {
            [a, b].iter().for_each(|v| is_shared[*v as usize] = self.is_near(half.vertices[*v as usize]));
        }
        let mut images: Vec<u32> = (0..half.vertices.len() as u32).collect();
        for v in 0..images.len() {
            if is_shared[v] {
                half.vertices[v][self.axis] = self.centre;
            } else {
                images[v] = half.vertices.len() as u32;
                half.vertices.push(self.image(half.vertices[v]));
            }
        }
        let mirrored: Vec<[u32; 3]> =
            half.triangles.iter().map(|&[a, b, c]| [a, c, b].map(|v| images[v as usize])).collect();
        half.triangles.extend(mirrored);
        half
    }
}
