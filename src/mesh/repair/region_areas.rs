//! Areas of the regions between borders, which the vertices of the borders restore by moving in the surface.

use glam::DVec3;

use crate::mesh::csr::triangles_around;
use crate::mesh::{NONE, TriMesh};

/// Steps of the conjugate gradients.
const STEPS: usize = 200;
/// The residual at which they end, relative to the first.
const TOLERANCE: f64 = 1e-6;
/// Added to the diagonal, relative to it: what all regions lack together cannot be restored.
const DAMPING: f64 = 1e-6;
/// A region whose diagonal is smaller cannot change its area.
const LEAST_DIAGONAL: f64 = 1e-200;

/// A vertex of a border that may move.
#[derive(Debug, Clone, Copy)]
pub(super) struct FreeVertex {
    pub vertex: u32,
    /// The maximum length of its move.
    pub max_move: f64,
}

/// The sum of the areas of the triangles in each region; there are at most as many regions as triangles.
pub(super) fn region_areas(mesh: &TriMesh, region: &[u32]) -> Vec<f64> {
    let mut areas = vec![0.0; region.len()];
    region.iter().enumerate().for_each(|(t, region)| areas[*region as usize] += mesh.triangle_area(t));
    areas
}

/// The moves of free vertices after which regions have these areas, to first order; those with the least sum
/// of squares, weighted by the length of border that each vertex stands for.
pub(super) fn restoring_moves(
    mesh: &TriMesh,
    region: &[u32],
    areas: &[f64],
    free: &[FreeVertex],
) -> Vec<DVec3> {
    let gradients = Gradients::new(mesh, region, free);
    let now = region_areas(mesh, region);
    let lacking: Vec<f64> = gradients.regions.iter().map(|r| areas[*r as usize] - now[*r as usize]).collect();
    gradients.moves(&gradients.solve(lacking))
}

/// How the areas of regions change with the places of free vertices.
struct Gradients {
    /// The regions that change.
    regions: Vec<u32>,
    of_vertices: Vec<OfVertex>,
}

/// How they change with the place of one.
struct OfVertex {
    /// The place of a region in the list of those that change, and the gradient of its area.
    gradients: Vec<(u32, DVec3)>,
    /// The length of the borders that the vertex stands for.
    length: f64,
}

impl Gradients {
    fn new(mesh: &TriMesh, region: &[u32], free: &[FreeVertex]) -> Self {
        let around = triangles_around(mesh.vertices.len(), &mesh.triangles);
        let mut place = vec![NONE; region.len()];
        let mut regions = Vec::new();
        let mut of_vertices = Vec::with_capacity(free.len());
        for FreeVertex { vertex, .. } in free {
            let mut own: Vec<(u32, DVec3)> = Vec::new();
            let mut normal = DVec3::ZERO;
            for t in around.of(*vertex) {
                let across = mesh.doubled_normal(*t as usize);
                normal += across;
                let triangle = mesh.triangles[*t as usize];
                let k = triangle.iter().position(|v| v == vertex).unwrap_or(0);
                let [p, q] = [1, 2].map(|next| mesh.vertices[triangle[(k + next) % 3] as usize]);
                let gradient = 0.5 * across.normalize_or_zero().cross(q - p);
                let region = region[*t as usize];
                match own.iter_mut().find(|(other, _)| *other == region) {
                    Some((_, sum)) => *sum += gradient,
                    None => own.push((region, gradient)),
                }
            }
            let normal = normal.normalize_or_zero();
            // Inside a region, a vertex changes no area but by leaving the surface.
            if own.len() < 2 {
                own.clear();
            }
            // The area of all regions together does not change: what seems to is the mesh's unevenness.
            let mean = own.iter().map(|(_, gradient)| *gradient).sum::<DVec3>() / own.len().max(1) as f64;
            for (region, gradient) in &mut own {
                *gradient = (*gradient - mean).reject_from_normalized(normal);
                let place = &mut place[*region as usize];
                if *place == NONE {
                    *place = regions.len() as u32;
                    regions.push(*region);
                }
                *region = *place;
            }
            // Those of the two sides of a border are opposite and as long as half of the edges at the vertex.
            let length = 0.5 * own.iter().map(|(_, gradient)| gradient.length()).sum::<f64>();
            of_vertices.push(OfVertex { gradients: own, length: length.max(f64::MIN_POSITIVE) });
        }
        Self { regions, of_vertices }
    }

    /// The moves of the free vertices under these pressures of the regions: the Lagrange multipliers of their
    /// areas.
    fn moves(&self, pressures: &[f64]) -> Vec<DVec3> {
        let of_vertex = |own: &OfVertex| {
            let pull = |(r, gradient): &(u32, DVec3)| pressures[*r as usize] * *gradient;
            own.gradients.iter().map(pull).sum::<DVec3>() / own.length
        };
        self.of_vertices.iter().map(of_vertex).collect()
    }

    /// How the areas of the regions change by these moves.
    fn changes(&self, moves: &[DVec3]) -> Vec<f64> {
        let mut changes = vec![0.0; self.regions.len()];
        for (own, by) in self.of_vertices.iter().zip(moves) {
            own.gradients.iter().for_each(|(r, gradient)| changes[*r as usize] += gradient.dot(*by));
        }
        changes
    }

    /// The pressures under which the areas change by `lacking`, by conjugate gradients.
    fn solve(&self, lacking: Vec<f64>) -> Vec<f64> {
        let mut diagonal = vec![0.0; lacking.len()];
        for OfVertex { gradients, length } in &self.of_vertices {
            for (r, gradient) in gradients {
                diagonal[*r as usize] += gradient.length_squared() / length;
            }
        }
        let precondition = |residual: &[f64]| -> Vec<f64> {
            let scaled = |(r, d): (&f64, &f64)| if *d > LEAST_DIAGONAL { r / d } else { 0.0 };
            residual.iter().zip(&diagonal).map(scaled).collect()
        };
        let mut pressures = vec![0.0; lacking.len()];
        let mut residual = lacking;
        let mut direction = precondition(&residual);
        let mut rho = dot(&residual, &direction);
        let enough = TOLERANCE * TOLERANCE * rho;
        for _ in 0..STEPS {
            let mut product = self.changes(&self.moves(&direction));
            add(&mut product, DAMPING, diagonal.iter().zip(&direction).map(|(a, b)| a * b));
            let curvature = dot(&direction, &product);
            if rho <= enough || curvature <= 0.0 {
                break;
            }
            let step = rho / curvature;
            add(&mut pressures, step, direction.iter().copied());
            add(&mut residual, -step, product.into_iter());
            let before = rho;
            let scaled = precondition(&residual);
            rho = dot(&residual, &scaled);
            let onward = |(d, r): (&mut f64, &f64)| *d = r + *d * rho / before;
            direction.iter_mut().zip(&scaled).for_each(onward);
        }
        pressures
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Adds multiples of numbers to others.
fn add(to: &mut [f64], factor: f64, numbers: impl Iterator<Item = f64>) {
    to.iter_mut().zip(numbers).for_each(|(to, number)| *to += factor * number);
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: u32 = 9;

    /// A grid of unit squares, and for each of its triangles one of three stripes of three squares.
    fn stripes() -> (TriMesh, Vec<u32>) {
        let at = |i: u32, j: u32| j * (SIDE + 1) + i;
        let places = (0..=SIDE).flat_map(|j| (0..=SIDE).map(move |i| (i, j)));
        let vertices = places.map(|(i, j)| DVec3::new(f64::from(i), f64::from(j), 0.0)).collect();
        let squares = (0..SIDE).flat_map(|j| (0..SIDE).map(move |i| (i, j)));
        let halves =
            |(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]];
        let region = squares.clone().flat_map(|(i, _)| [i / 3; 2]).collect();
        (TriMesh { vertices, triangles: squares.flat_map(halves).collect() }, region)
    }

    fn free(vertices: impl Iterator<Item = u32>) -> Vec<FreeVertex> {
        vertices.map(|vertex| FreeVertex { vertex, max_move: 1.0 }).collect()
    }

    /// The areas after the moves that restore those of `mesh` once `by` has moved its vertices.
    fn restored(mesh: &TriMesh, region: &[u32], free: &[FreeVertex], by: impl Fn(DVec3) -> DVec3) -> TriMesh {
        let areas = region_areas(mesh, region);
        let mut moved = mesh.clone();
        moved.vertices.iter_mut().for_each(|p| *p += by(*p));
        let moves = restoring_moves(&moved, region, &areas, free);
        assert!(moves.iter().all(|by| by.is_finite()), "{moves:?}");
        free.iter().zip(moves).for_each(|(v, by)| moved.vertices[v.vertex as usize] += by);
        moved
    }

    #[test]
    fn regions_get_their_areas_back() {
        let (mesh, region) = stripes();
        let inner_rows = SIDE + 1..SIDE * (SIDE + 1);
        let borders = inner_rows.filter(|v| [3, 6].contains(&(v % (SIDE + 1))));
        let bulge = |p: DVec3| DVec3::X * if p.x == 3.0 { 0.3 * (p.y * 0.6).sin() + 0.1 } else { 0.0 };
        let after = restored(&mesh, &region, &free(borders), bulge);
        for (now, before) in region_areas(&after, &region).iter().zip(region_areas(&mesh, &region)) {
            assert!((now - before).abs() < 5e-3, "{now} {before}");
        }
        assert!(after.vertices.iter().any(|p| p.x > 3.0 && p.x < 3.4));
    }

    #[test]
    fn a_region_without_a_border_keeps_others_as_they_are() {
        let (mut mesh, mut region) = stripes();
        // Another grid apart, with one free vertex inside that was moved out of its plane.
        let (count, triangles) = (mesh.vertices.len() as u32, mesh.triangles.len());
        mesh.vertices.extend(mesh.vertices.clone().iter().map(|p| *p + DVec3::Y * 20.0));
        mesh.triangles.extend(mesh.triangles.clone().iter().map(|t| t.map(|v| v + count)));
        region.resize(2 * triangles, 3);
        let inner = count + 4 * (SIDE + 1) + 4;
        let borders = (0..count).filter(|v| [3, 6].contains(&(v % (SIDE + 1))));
        let out = |p: DVec3| DVec3::Z * if p == DVec3::new(4.0, 24.0, 0.0) { 0.5 } else { 0.0 };
        let after = restored(&mesh, &region, &free(borders.chain([inner])), out);
        let moved = after.vertices.iter().zip(&mesh.vertices).filter(|(p, q)| p.distance(**q) > 1e-9);
        assert_eq!(moved.count(), 1);
    }
}
