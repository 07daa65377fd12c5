//! The new vertices of a patch moved to where the surface bends least.

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;

use super::{Hole, patch::Patch};
use crate::mesh::TriMesh;
use crate::mesh::csr::Csr;
use crate::{ProgressToken, Result};

/// Steps of the conjugate gradients at most, and those of each solution in between.
const STEPS: [usize; 2] = [60, 600];
/// They end when the residual is this small, relative to the first.
const TOLERANCE: [f64; 2] = [1e-5, 1e-8];
/// Edges count as no shorter than this share of their mean length.
const SHORTEST: f64 = 1e-3;

/// Moves the new vertices so that the sum of the squares of the umbrella vectors (each the weighted mean of a
/// vertex's neighbours less its position) is least over the patch and the hole's vertices; these, and those
/// around the hole, stay. The patch then goes on as the surface does. Weights are 1 over edge lengths.
/// `around` lists the mesh's triangles around each vertex.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn fair(
    patch: &mut Patch,
    hole: &Hole,
    (mesh, around): (&TriMesh, &Csr),
    progress: &ProgressToken,
) -> Result<()> {
    let fixed = patch.vertices.len() - patch.inner().len();
    if patch.inner().is_empty() {
        return Ok(());
    }
    let found = System::new(patch, hole, mesh, around).solve(patch.inner(), progress)?;
    if found.iter().all(|p| p.is_finite()) {
        patch.vertices[fixed..].copy_from_slice(&found);
    }
    Ok(())
}

/// What the umbrella vector of a vertex of the patch depends on.
struct Row {
    /// New vertices, and the share of each.
    shares: Vec<(u32, f64)>,
    /// The sum of all weights.
    weight: f64,
    /// The shares of the others, and the vertex itself if it is not new.
    rest: DVec3,
}

/// A row for each vertex of the patch, those of the hole first.
struct System {
    rows: Vec<Row>,
    /// How many vertices the hole has.
    around: usize,
}

impl System {
    fn new(patch: &Patch, hole: &Hole, mesh: &TriMesh, around: &Csr) -> Self {
        let mut edges: Vec<BTreeMap<u32, DVec3>> = vec![BTreeMap::new(); patch.vertices.len()];
        for [a, b, c] in &patch.triangles {
            for (v, w) in [(*a, *b), (*b, *c), (*c, *a)] {
                edges[v as usize].insert(w, patch.vertices[w as usize]);
                edges[w as usize].insert(v, patch.vertices[v as usize]);
            }
        }
        let new = patch.vertices.len() as u32;
        let place: HashMap<u32, u32> = hole.vertices.iter().copied().zip(0..).collect();
        // Vertices around the hole have numbers behind all others.
        let at_hole = hole.vertices.iter().flat_map(|v| around.of(*v));
        for [a, b, c] in at_hole.map(|t| mesh.triangles[*t as usize]) {
            for (v, w) in [(a, b), (b, c), (c, a), (b, a), (c, b), (a, c)] {
                if let Some(k) = place.get(&v) {
                    let number = place.get(&w).copied().unwrap_or(new + w);
                    edges[*k as usize].insert(number, mesh.vertices[w as usize]);
                }
            }
        }
        let first = new - patch.inner().len() as u32;
        let lengths = (0..).zip(&edges).flat_map(|(v, neighbours): (usize, _)| {
            neighbours.values().map(move |p| p.distance(patch.vertices[v]))
        });
        let (sum, count) = lengths.fold((0.0, 0), |(sum, count), length| (sum + length, count + 1));
        let shortest = (SHORTEST * sum / f64::from(count)).max(f64::MIN_POSITIVE);
        let row = |(v, neighbours): (u32, BTreeMap<u32, DVec3>)| {
            let own = patch.vertices[v as usize];
            let weight_of = |p: DVec3| 1.0 / p.distance(own).max(shortest);
            let weight: f64 = neighbours.values().map(|p| weight_of(*p)).sum();
            let mut row = Row { shares: Vec::new(), weight, rest: DVec3::ZERO };
            for (w, p) in neighbours {
                let share = weight_of(p) / weight;
                if (first..new).contains(&w) {
                    row.shares.push((w - first, share));
                } else {
                    row.rest += share * p;
                }
            }
            if patch.is_around(v) {
                row.rest -= own;
            } else {
                row.shares.push((v - first, -1.0));
            }
            row
        };
        Self { rows: (0..).zip(edges).map(row).collect(), around: first as usize }
    }

    /// The umbrella vectors for these places of the new vertices, without the rest.
    fn applied(&self, to: &[DVec3]) -> Vec<DVec3> {
        self.rows.iter().map(|row| row.of(to)).collect()
    }

    /// The transposed matrix times values of the rows.
    fn transposed(&self, values: &[DVec3], count: usize) -> Vec<DVec3> {
        let mut sums = vec![DVec3::ZERO; count];
        for (row, value) in self.rows.iter().zip(values) {
            row.shares.iter().for_each(|(w, x)| sums[*w as usize] += *x * *value);
        }
        sums
    }

    /// The places with the least sum. The gradients are those of the new vertices' own umbrella vectors but
    /// for the hole's, so two solutions with the weighted Laplacian nearly give the step.
    fn solve(&self, start: &[DVec3], progress: &ProgressToken) -> Result<Vec<DVec3>> {
        let left: Vec<DVec3> = self.rows.iter().map(|row| -(row.of(start) + row.rest)).collect();
        let residual = self.transposed(&left, start.len());
        let inner = &self.rows[self.around..];
        let laplacian =
            |x: &[DVec3]| -> Vec<DVec3> { inner.iter().map(|row| -row.weight * row.of(x)).collect() };
        let by_diagonal = |x: &[DVec3]| Ok(inner.iter().zip(x).map(|(row, x)| *x / row.weight).collect());
        let solved = |x: Vec<DVec3>| conjugate_gradients(laplacian, by_diagonal, x, STEPS[1], TOLERANCE[1]);
        let twice_solved = |x: &[DVec3]| {
            progress.poll()?;
            let once = solved(x.to_vec())?;
            solved(once.iter().zip(inner).map(|(x, row)| row.weight * row.weight * *x).collect())
        };
        let squared = |x: &[DVec3]| self.transposed(&self.applied(x), x.len());
        let step = conjugate_gradients(squared, twice_solved, residual, STEPS[0], TOLERANCE[0])?;
        Ok(start.iter().zip(step).map(|(p, step)| *p + step).collect())
    }
}

impl Row {
    fn of(&self, places: &[DVec3]) -> DVec3 {
        self.shares.iter().map(|(w, share)| *share * places[*w as usize]).sum()
    }
}

/// Solves `apply(x) = residual` for each coordinate, beginning at 0; `near` is about the inverse of `apply`.
fn conjugate_gradients(
    apply: impl Fn(&[DVec3]) -> Vec<DVec3>,
    near: impl Fn(&[DVec3]) -> Result<Vec<DVec3>>,
    mut residual: Vec<DVec3>,
    steps: usize,
    tolerance: f64,
) -> Result<Vec<DVec3>> {
    let mut x = vec![DVec3::ZERO; residual.len()];
    let mut conditioned = near(&residual)?;
    let mut direction = conditioned.clone();
    let mut product = products(&residual, &conditioned);
    let least = tolerance * tolerance * product;
    for _ in 0..steps {
        if product.cmple(least).all() {
            break;
        }
        let applied = apply(&direction);
        let step = ratio(product, products(&direction, &applied));
        for (k, applied) in applied.into_iter().enumerate() {
            x[k] += step * direction[k];
            residual[k] -= step * applied;
        }
        conditioned = near(&residual)?;
        let after = products(&residual, &conditioned);
        let share = ratio(after, product);
        product = after;
        direction.iter_mut().zip(&conditioned).for_each(|(way, new)| *way = *new + share * *way);
    }
    Ok(x)
}

/// Sums of the products of each coordinate.
fn products(of: &[DVec3], by: &[DVec3]) -> DVec3 {
    of.iter().zip(by).map(|(p, q)| *p * *q).sum()
}

/// The quotients; 0 where nothing is to be divided.
fn ratio(of: DVec3, by: DVec3) -> DVec3 {
    DVec3::select(by.cmpgt(DVec3::ZERO), of / by, DVec3::ZERO)
}
