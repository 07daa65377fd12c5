//! How far a mesh and a surface are from each other: at samples of both, and at the most.

use std::cell::Cell;

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::bvh::Bvh;
use crate::mesh::hausdorff::{Effort, Indexed, one_sided};
use crate::{ProgressToken, Result, TriMesh};

/// Samples of a face of the mesh lie on a grid with this many steps along each side.
const STEPS: u32 = 4;
/// Samples of a triangle of the surface are at most this fraction of the edge length there apart, unless
/// that takes more than [`MOST_STEPS`].
const APART: f64 = 0.25;
/// Maximum number of steps along each side in the samples of a triangle of the surface.
const MOST_STEPS: u32 = 24;
/// Where a sample is far away, the triangle is sampled again with this many times as many steps.
const FINER: u32 = 4;
/// Triangles that one thread takes in a row, each starting its search where the last one ended.
const CHUNK: usize = 256;
/// Gap between the ends of the largest distance, relative to the upper one.
pub(crate) const ACCURACY: f64 = 0.002;
/// A gap between the ends of the largest distance that is always small enough, in diagonals.
const LEAST_GAP: f64 = 5e-7;

/// The surface that a mesh may not be far from.
#[derive(Clone, Copy)]
pub(crate) struct Reference<'a> {
    pub surface: &'a TriMesh,
    /// Over the surface's triangles.
    pub bvh: &'a Bvh,
    /// The largest deviation, in the unit of the surface.
    pub most: f64,
}

/// Where more samples are taken.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Depth {
    /// Where a sample is almost as far away as it may be.
    Coarse,
    /// Where one is not close.
    Fine,
}

impl Depth {
    /// As a share of the largest deviation.
    fn far(self) -> f64 {
        match self {
            Self::Coarse => 0.9,
            Self::Fine => 0.5,
        }
    }
}

/// A sample of a face, or one of the surface that is nearest to the face.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Farthest {
    pub distance: f64,
    /// On the face.
    pub at: DVec3,
}

/// What was measured at samples.
pub(crate) struct Measured {
    /// For each face of the mesh, the farthest sample on it, or of the surface nearest to it.
    pub of_face: Vec<Farthest>,
    /// For each vertex of the surface, the nearest face.
    pub(super) nearest_face: Vec<u32>,
}

/// The largest distance of all.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Largest {
    /// No point is farther away.
    pub upper: f64,
    /// The face at the farthest point, or nearest to it.
    pub face: u32,
    /// The farthest point, on the face.
    pub at: DVec3,
}

impl Farthest {
    fn join(&mut self, other: Self) {
        if other.distance > self.distance {
            *self = other;
        }
    }
}

impl Measured {
    /// For each vertex of the surface, the largest distance of a face around the nearest one.
    pub fn near_vertices(&self, mesh: &TriMesh) -> Vec<f64> {
        let mut around = vec![0.0f64; mesh.vertices.len()];
        for (triangle, farthest) in mesh.triangles.iter().zip(&self.of_face) {
            for v in triangle {
                around[*v as usize] = around[*v as usize].max(farthest.distance);
            }
        }
        let near = |t: &u32| {
            let corners = mesh.triangles[*t as usize];
            corners.iter().map(|v| around[*v as usize]).fold(0.0, f64::max)
        };
        self.nearest_face.iter().map(near).collect()
    }
}

impl Reference<'_> {
    /// Measures a mesh at samples. `lengths` are its edge lengths at the surface's vertices.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn measured(
        &self,
        mesh: &TriMesh,
        lengths: &[f64],
        depth: Depth,
        progress: &ProgressToken,
    ) -> Result<Measured> {
        let Self { surface, bvh, most } = *self;
        let far = depth.far() * most;
        let mesh_bvh = Bvh::new(mesh);
        let inward = each_triangle(bvh, progress, |t, rank| {
            let mut found: Vec<(u32, Farthest)> = Vec::new();
            let farthest = Cell::new(0.0f64);
            let mut look = |p: DVec3| {
                let Some(closest) = mesh_bvh.closest_from(p, rank) else { return 0 };
                let sample = Farthest { distance: closest.distance_sq.sqrt(), at: closest.point };
                farthest.set(farthest.get().max(sample.distance));
                match found.iter_mut().find(|(face, _)| *face == closest.triangle) {
                    Some((_, farthest)) => farthest.join(sample),
                    None => found.push((closest.triangle, sample)),
                }
                closest.triangle
            };
            let corners = surface.corners(t as usize);
            let at_corners = corners.map(&mut look);
            let steps = steps(corners, surface.triangles[t as usize].map(|v| lengths[v as usize]));
            if steps > 1 {
                for p in grid(corners, steps) {
                    look(p);
                }
            }
            if farthest.get() > far {
                for p in grid(corners, FINER * steps) {
                    look(p);
                }
            }
            (t, at_corners, found)
        })?;
        let outward = each_triangle(&mesh_bvh, progress, |t, rank| {
            let mut farthest = Farthest::default();
            for steps in [STEPS, FINER * STEPS] {
                for at in grid(mesh.corners(t as usize), steps) {
                    if let Some(closest) = bvh.closest_from(at, rank) {
                        farthest.join(Farthest { distance: closest.distance_sq.sqrt(), at });
                    }
                }
                if farthest.distance <= far {
                    break;
                }
            }
            (t, farthest)
        })?;
        let mut of_face = vec![Farthest::default(); mesh.triangles.len()];
        let mut nearest_face = vec![0; surface.vertices.len()];
        outward.into_iter().for_each(|(t, farthest)| of_face[t as usize] = farthest);
        for (t, at_corners, found) in inward {
            for (v, face) in surface.triangles[t as usize].iter().zip(at_corners) {
                nearest_face[*v as usize] = face;
            }
            for (face, farthest) in found {
                of_face[face as usize].join(farthest);
            }
        }
        Ok(Measured { of_face, nearest_face })
    }

    /// The largest distance of a mesh and the surface from each other, in every point of both.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn largest(&self, mesh: &TriMesh, progress: &ProgressToken) -> Result<Largest> {
        let bvh = Bvh::new(mesh);
        let [from, to] = [Indexed { mesh, bvh: &bvh }, Indexed { mesh: self.surface, bvh: self.bvh }];
        let steps = Effort::usual_steps(from.mesh, to.mesh);
        let effort = Effort { relative: ACCURACY, absolute: LEAST_GAP, steps };
        let outward = one_sided(from, to, effort, progress)?;
        let inward = one_sided(to, from, effort, progress)?;
        let found = if inward.upper > outward.upper { inward } else { outward };
        let on_mesh = bvh.closest(found.farthest);
        Ok(Largest {
            upper: found.upper,
            face: on_mesh.map_or(0, |closest| closest.triangle),
            at: on_mesh.map_or(found.farthest, |closest| closest.point),
        })
    }
}

/// Steps of the grid on a triangle of the surface, at whose corners edges have these lengths.
fn steps([a, b, c]: [DVec3; 3], lengths: [f64; 3]) -> u32 {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let length = lengths.into_iter().fold(f64::INFINITY, f64::min);
    ((longest / (APART * length)).ceil() as u32).clamp(1, MOST_STEPS)
}

/// What `work` makes of each triangle, which starts its searches where the last one's ended: in the order of
/// the hierarchy, and alike for every number of threads.
fn each_triangle<T: Send>(
    bvh: &Bvh,
    progress: &ProgressToken,
    work: impl Fn(u32, &mut usize) -> T + Sync,
) -> Result<Vec<T>> {
    let chunks: Vec<Vec<T>> = (bvh.leaf_order().par_chunks(CHUNK))
        .map(|chunk| {
            progress.poll()?;
            let mut rank = 0;
            Ok(chunk.iter().map(|t| work(*t, &mut rank)).collect())
        })
        .collect::<Result<_>>()?;
    Ok(chunks.into_iter().flatten().collect())
}

/// The points of a triangular grid with this many steps along each side.
fn grid([a, b, c]: [DVec3; 3], steps: u32) -> impl Iterator<Item = DVec3> {
    let at = move |i: u32, j: u32| {
        let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(steps));
        a + (b - a) * u + (c - a) * v
    };
    (0..=steps).flat_map(move |i| (0..=steps - i).map(move |j| at(i, j)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RAISED: u32 = 24;

    /// A square of 6 x 6 cells, or of fewer of them that are larger.
    fn square(cells: u32) -> TriMesh {
        let row = cells + 1;
        let at = |i: u32, j: u32| DVec3::new(f64::from(i), f64::from(j), 0.0) * 6.0 / f64::from(cells);
        let vertices = (0..row).flat_map(|j| (0..row).map(move |i| at(i, j))).collect();
        let cell = |i: u32, j: u32| {
            let a = i + row * j;
            [[a, a + 1, a + row], [a + 1, a + row + 1, a + row]]
        };
        let triangles = (0..cells).flat_map(|j| (0..cells).flat_map(move |i| cell(i, j))).collect();
        TriMesh { vertices, triangles }
    }

    /// With the middle vertex, which is [`RAISED`], this far up.
    fn raised(height: f64) -> TriMesh {
        let mut mesh = square(6);
        mesh.vertices[RAISED as usize].z = height;
        mesh
    }

    fn measured(mesh: &TriMesh, surface: &TriMesh) -> (Measured, Largest) {
        let bvh = Bvh::new(surface);
        let reference = Reference { surface, bvh: &bvh, most: 0.1 };
        let lengths = vec![1.0; surface.vertices.len()];
        let progress = ProgressToken::default();
        let found = reference.measured(mesh, &lengths, Depth::Coarse, &progress).unwrap();
        (found, reference.largest(mesh, &progress).unwrap())
    }

    fn is_largest(largest: &Largest, distance: f64) {
        assert!(largest.upper >= distance - 1e-12, "{} < {distance}", largest.upper);
        assert!(largest.upper <= distance * (1.0 + ACCURACY) + 2.0 * LEAST_GAP, "{}", largest.upper);
    }

    #[test]
    fn a_vertex_off_the_surface_counts_at_the_faces_around_it() {
        for height in [0.05, 0.4] {
            let (mesh, surface) = (raised(height), square(6));
            let (found, largest) = measured(&mesh, &surface);
            is_largest(&largest, height);
            assert!(mesh.triangles[largest.face as usize].contains(&RAISED));
            assert!(largest.at.distance(mesh.vertices[RAISED as usize]) < 0.05, "{}", largest.at);
            for (triangle, farthest) in mesh.triangles.iter().zip(&found.of_face) {
                let distance = if triangle.contains(&RAISED) { height } else { 0.0 };
                assert!((farthest.distance - distance).abs() < 1e-12, "{triangle:?}: {farthest:?}");
            }
            // A face away from it touches one of those around it.
            let near = found.near_vertices(&mesh);
            assert!((near[RAISED as usize] - height).abs() < 1e-12 && near[0] < 1e-12, "{near:?}");
        }
    }

    #[test]
    fn what_the_mesh_leaves_out_counts_at_the_face_below_it() {
        for height in [0.05, 0.4] {
            let (mesh, surface) = (square(2), raised(height));
            let (found, largest) = measured(&mesh, &surface);
            is_largest(&largest, height);
            let most = found.of_face.iter().map(|farthest| farthest.distance).fold(0.0, f64::max);
            assert!((most - height).abs() < 1e-12, "{most}");
            assert!(found.near_vertices(&mesh)[RAISED as usize] >= height - 1e-12);
        }
    }

    #[test]
    fn a_spike_between_samples_is_certified() {
        // A narrow pyramid on one face of the surface, where no grid point of a face of the mesh is.
        let mut surface = square(1);
        let [a, b, c] = surface.triangles[0];
        let first = surface.vertices.len() as u32;
        let at = DVec3::new(2.011, 1.013, 0.0);
        let foot = [DVec3::new(-0.01, -0.01, 0.0), DVec3::new(0.01, 0.0, 0.0), DVec3::new(0.0, 0.01, 0.0)];
        surface.vertices.extend(foot.map(|offset| at + offset));
        surface.vertices.push(at + 0.3 * DVec3::Z);
        let [p, q, r, tip] = [0, 1, 2, 3].map(|k| first + k);
        surface.triangles[0] = [p, q, tip];
        surface.triangles.extend([[q, r, tip], [r, p, tip]]);
        surface.triangles.extend([[a, b, q], [a, q, p], [b, c, r], [b, r, q], [c, a, p], [c, p, r]]);
        let (found, largest) = measured(&square(1), &surface);
        is_largest(&largest, 0.3);
        assert_eq!(largest.face, 0);
        assert!(found.of_face[0].distance > 0.29 && found.of_face[1].distance == 0.0);
    }
}
