//! Narrow notches in the ends of a surface, which gaps between random points leave there.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::TriMesh;
use crate::mesh::csr::Csr;

/// What the vertices of a mesh are to the points of a cloud: beyond their ends or not.
pub(super) struct Ends<'a> {
    mesh: &'a TriMesh,
    neighbours: Csr,
    /// The vertices at the boundary of the mesh.
    boundary: &'a [u32],
    /// Whether each vertex is beyond an end.
    beyond: Vec<bool>,
}

impl<'a> Ends<'a> {
    pub fn new(mesh: &'a TriMesh, boundary: &'a [u32], beyond: Vec<bool>) -> Self {
        // Both ways, since a boundary edge has a single triangle.
        let sides = mesh.triangles.iter().flat_map(|[a, b, c]| [(*a, *b), (*b, *c), (*c, *a)]);
        let both = sides.flat_map(|(a, b)| [(a, b), (b, a)]);
        Self { mesh, neighbours: Csr::group(mesh.vertices.len(), both), boundary, beyond }
    }

    /// The vertices beyond the ends that lie in notches no wider than `width`, from `depth` behind their
    /// mouths on: what is left of a closing by half the width.
    pub fn in_notches(&self, width: f64, depth: f64) -> Vec<u32> {
        let reach = 0.5 * width;
        let is_beyond = |v: u32| self.beyond[v as usize];
        let is_end = |v: &u32| !is_beyond(*v) && self.neighbours.of(*v).iter().any(|w| is_beyond(*w));
        let from_within = self.distances(self.vertices().filter(is_end), reach);
        let mut is_far: Vec<bool> =
            from_within.iter().zip(&self.beyond).map(|(far, beyond)| *beyond && *far > reach).collect();
        self.boundary.iter().for_each(|v| is_far[*v as usize] |= is_beyond(*v));
        let from_far = self.distances(self.vertices().filter(|v| is_far[*v as usize]), reach + depth);
        self.vertices().filter(|v| is_beyond(*v) && from_far[*v as usize].is_infinite()).collect()
    }

    fn vertices(&self) -> impl Iterator<Item = u32> {
        0..self.mesh.vertices.len() as u32
    }

    /// The length of the shortest way along edges to each vertex from any of some; infinite beyond `most`.
    fn distances(&self, from: impl Iterator<Item = u32>, most: f64) -> Vec<f64> {
        let mut distances = vec![f64::INFINITY; self.mesh.vertices.len()];
        let mut queue = BinaryHeap::new();
        for v in from {
            distances[v as usize] = 0.0;
            queue.push((Reverse(0.0_f64.to_bits()), v));
        }
        while let Some((Reverse(far), v)) = queue.pop() {
            // The bits of numbers that are not negative have their order.
            let far = f64::from_bits(far);
            if far > distances[v as usize] {
                continue;
            }
            for w in self.neighbours.of(v) {
                let [p, q] = [v, *w].map(|v| self.mesh.vertices[v as usize]);
                let next = far + p.distance(q);
                if next <= most && next < distances[*w as usize] {
                    distances[*w as usize] = next;
                    queue.push((Reverse(next.to_bits()), *w));
                }
            }
        }
        distances
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::trim::boundary_of;
    use glam::DVec3;

    #[test]
    fn narrow_notches_are_filled_and_nothing_else() {
        // A grid of 61 by 41 vertices, a unit apart. Points reach up to x = 45 but in two notches, 10 deep, 3
        // and 9 wide.
        let at = |x: u32, y: u32| 41 * x + y;
        let place = |v: u32| [v / 41, v % 41];
        let vertices = (0..61 * 41).map(|v| DVec3::new(f64::from(v / 41), f64::from(v % 41), 0.0)).collect();
        let squares = (0..60).flat_map(|x| (0..40).map(move |y| (x, y)));
        let triangles = squares.flat_map(|(x, y)| {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            if (x + y) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
        });
        let mesh = TriMesh { vertices, triangles: triangles.collect() };
        let [narrow, wide] = [9..=10, 20..=27];
        let beyond = |v: u32| {
            let [x, y] = place(v);
            x > 45 || (x > 35 && (narrow.contains(&y) || wide.contains(&y)))
        };
        let boundary = boundary_of(&mesh);
        let ends = Ends::new(&mesh, &boundary, (0..mesh.vertices.len() as u32).map(beyond).collect());
        let filled = ends.in_notches(5.0, 1.4);
        assert!(filled.iter().all(|v| beyond(*v) && narrow.contains(&place(*v)[1]) && place(*v)[0] < 46));
        // All of the narrow one but what is near its mouth.
        let missing =
            (36..=43).flat_map(|x| narrow.clone().map(move |y| at(x, y))).find(|v| !filled.contains(v));
        assert_eq!(missing.map(place), None);
        // Without an end there is nothing to fill; beyond everything neither.
        assert!(
            Ends::new(&mesh, &boundary, vec![false; mesh.vertices.len()]).in_notches(5.0, 1.4).is_empty()
        );
        assert!(Ends::new(&mesh, &boundary, vec![true; mesh.vertices.len()]).in_notches(1e3, 1.4).is_empty());
    }
}
