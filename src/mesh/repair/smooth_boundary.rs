//! Ragged boundaries made smooth: every boundary curve is filtered along its length, no vertex of it moves
//! farther than a tolerance, and the surface next to it follows.

use glam::DVec3;

use super::boundary::boundary_edges;
use crate::TriMesh;
use crate::mesh::NONE;
use crate::mesh::half_edges::EdgeTable;
use crate::mesh::triangle::doubled_normal;

/// Standard deviation of the filter, in tolerances, but no less than the curve's mean edge: teeth up to twice
/// as long vanish.
const WIDTH: f64 = 2.0;
/// The filter ends this many standard deviations away.
const REACH: f64 = 3.0;
/// The standard deviation is at most this share of a curve's length, so that small holes keep their size.
const SHARE_OF_LENGTH: f64 = 1.0 / 12.0;
/// Rings of vertices that follow the boundary.
const RINGS: usize = 8;
/// A triangle may turn by 60 degrees, and keeps a tenth of its area.
const LIMITS: Limits = Limits { factor: 0.5, rounds: 6, least_cosine: 0.5, least_area: 0.1 };

/// How far the triangles at a curve may change.
pub(super) struct Limits {
    /// The moves at triangles that change too much are multiplied by this factor in each round.
    pub factor: f64,
    /// Maximum number of rounds; then the vertices of triangles that change too much stay.
    pub rounds: usize,
    /// The cosine of the angle by which a triangle may turn.
    pub least_cosine: f64,
    /// The fraction of its area that a triangle keeps.
    pub least_area: f64,
}

/// Moves boundary vertices by at most `tolerance`, in the mesh's unit. Vertices where more than one curve
/// passes stay. Returns how many boundary vertices moved.
pub(super) fn smooth_boundary(mesh: &mut TriMesh, table: &EdgeTable, tolerance: f64) -> usize {
    let curves = boundary_curves(mesh, table);
    let mut moves = vec![DVec3::ZERO; mesh.vertices.len()];
    let mut is_fixed = vec![false; mesh.vertices.len()];
    for curve in &curves {
        let points: Vec<DVec3> = curve.vertices.iter().map(|v| mesh.vertices[*v as usize]).collect();
        let smooth = Filter::new(&points, curve.is_closed, WIDTH * tolerance).smooth(&points);
        for ((v, p), q) in curve.vertices.iter().zip(&points).zip(smooth) {
            moves[*v as usize] = (q - *p).clamp_length_max(tolerance);
        }
        curve.vertices.iter().for_each(|v| is_fixed[*v as usize] = true);
    }
    follow(mesh, &is_fixed, &mut moves);
    unfold(mesh, &mut moves, &LIMITS);
    mesh.vertices.iter_mut().zip(&moves).for_each(|(p, by)| *p += *by);
    is_fixed.iter().zip(&moves).filter(|(fixed, by)| **fixed && **by != DVec3::ZERO).count()
}

/// A curve of boundary edges. The ends of an open one are the places where several curves meet.
struct BoundaryCurve {
    vertices: Vec<u32>,
    is_closed: bool,
}

fn boundary_curves(mesh: &TriMesh, table: &EdgeTable) -> Vec<BoundaryCurve> {
    let edges = boundary_edges(mesh, table);
    let mut next = vec![NONE; mesh.vertices.len()];
    let mut counts = vec![[0_u32; 2]; mesh.vertices.len()];
    for edge in &edges {
        next[edge.from as usize] = edge.to;
        counts[edge.from as usize][0] += 1;
        counts[edge.to as usize][1] += 1;
    }
    let is_inner = |v: u32| counts[v as usize] == [1, 1];
    let mut is_done = vec![false; mesh.vertices.len()];
    let mut curves = Vec::new();
    let mut trace = |from: u32, to: u32, is_done: &mut Vec<bool>| {
        let (mut vertices, mut at) = (vec![from], to);
        while is_inner(at) && !is_done[at as usize] {
            is_done[at as usize] = true;
            vertices.push(at);
            at = next[at as usize];
        }
        let is_closed = is_inner(from);
        if !is_closed {
            vertices.push(at);
        }
        curves.push(BoundaryCurve { vertices, is_closed });
    };
    edges.iter().filter(|edge| !is_inner(edge.from)).for_each(|e| trace(e.from, e.to, &mut is_done));
    for edge in &edges {
        if !is_done[edge.from as usize] && is_inner(edge.from) {
            is_done[edge.from as usize] = true;
            trace(edge.from, edge.to, &mut is_done);
        }
    }
    curves
}

/// A Gaussian along the arc length of a curve, for values at its points.
struct Filter {
    /// Arc length to each point; of a closed curve also back to the first.
    along: Vec<f64>,
    is_closed: bool,
    width: f64,
}

impl Filter {
    fn new(points: &[DVec3], is_closed: bool, width: f64) -> Self {
        let mut along = vec![0.0];
        let back = is_closed.then(|| points[0]);
        let ends = points.iter().skip(1).copied().chain(back);
        for (p, q) in points.iter().zip(ends) {
            along.push(along[along.len() - 1] + p.distance(q));
        }
        let length = along[along.len() - 1];
        // A filter that reaches no neighbour would do nothing.
        let width = width.max(length / (along.len() - 1) as f64).min(SHARE_OF_LENGTH * length);
        Self { along, is_closed, width }
    }

    /// Twice: what the first pass takes away is filtered and given back, so that circles hardly shrink.
    fn smooth(&self, points: &[DVec3]) -> Vec<DVec3> {
        let once = self.apply(points);
        let lost: Vec<DVec3> = points.iter().zip(&once).map(|(p, q)| *p - *q).collect();
        self.apply(&lost).iter().zip(once).map(|(back, q)| q + *back).collect()
    }

    fn apply(&self, values: &[DVec3]) -> Vec<DVec3> {
        (0..values.len()).map(|k| self.mean(values, k)).collect()
    }

    /// The mean around point `k`. Near the ends of an open curve the filter is narrower, so that they stay.
    fn mean(&self, values: &[DVec3], k: usize) -> DVec3 {
        let length = self.along[self.along.len() - 1];
        let at = self.along[k];
        let width = if self.is_closed { self.width } else { self.width.min(at.min(length - at) / REACH) };
        if width <= 0.0 {
            return values[k];
        }
        let mut sum = DVec3::ZERO;
        let mut weights = 0.0;
        let mut add = |j: usize, distance: f64| {
            let weight = self.share(j) * (-0.5 * (distance / width).powi(2)).exp();
            sum += weight * values[j];
            weights += weight;
        };
        add(k, 0.0);
        for forwards in [true, false] {
            let (mut j, mut turns) = (k, 0.0);
            loop {
                let last = if forwards { values.len() - 1 } else { 0 };
                if j == last {
                    if !self.is_closed {
                        break;
                    }
                    turns += length;
                    j = values.len() - 1 - last;
                } else if forwards {
                    j += 1;
                } else {
                    j -= 1;
                }
                let distance = (self.along[j] - at + if forwards { turns } else { -turns }).abs();
                if distance > REACH * width {
                    break;
                }
                add(j, distance);
            }
        }
        if weights > 0.0 { sum / weights } else { values[k] }
    }

    /// The length of curve that point `k` stands for.
    fn share(&self, k: usize) -> f64 {
        let before = if k > 0 {
            self.along[k] - self.along[k - 1]
        } else if self.is_closed {
            self.along[self.along.len() - 1] - self.along[self.along.len() - 2]
        } else {
            0.0
        };
        let after = self.along.get(k + 1).map_or(0.0, |next| next - self.along[k]);
        0.5 * (before + after)
    }
}

/// Vertices near the boundary move with it, within the surface, less the farther they are.
pub(super) fn follow(mesh: &TriMesh, is_fixed: &[bool], moves: &mut [DVec3]) {
    let mut normals = vec![DVec3::ZERO; moves.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let across = mesh.doubled_normal(t);
        triangle.iter().for_each(|v| normals[*v as usize] += across);
    }
    for _ in 0..RINGS {
        let mut sums = vec![(DVec3::ZERO, 0.0); moves.len()];
        for triangle in &mesh.triangles {
            for k in 0..3 {
                let (v, to) = (triangle[k] as usize, triangle[(k + 1) % 3] as usize);
                for (v, to) in [(v, to), (to, v)] {
                    sums[v].0 += moves[to];
                    sums[v].1 += 1.0;
                }
            }
        }
        for (v, (sum, count)) in sums.into_iter().enumerate() {
            if !is_fixed[v] && sum != DVec3::ZERO {
                moves[v] = (sum / count).reject_from_normalized(normals[v].normalize_or_zero());
            }
        }
    }
}

/// Where triangles would fold or vanish, their vertices move less far, and in the end not at all.
pub(super) fn unfold(mesh: &TriMesh, moves: &mut [DVec3], limits: &Limits) {
    for round in 0..=limits.rounds {
        let factor = if round < limits.rounds { limits.factor } else { 0.0 };
        loop {
            let mut bad = vec![false; moves.len()];
            let mut found = false;
            for (t, triangle) in mesh.triangles.iter().enumerate() {
                let by = triangle.map(|v| moves[v as usize]);
                if by.iter().any(|by| *by != DVec3::ZERO) && folds(mesh.corners(t), by, limits) {
                    triangle.iter().for_each(|v| bad[*v as usize] = true);
                    found = true;
                }
            }
            moves.iter_mut().zip(bad).filter(|(_, bad)| *bad).for_each(|(by, _)| *by *= factor);
            if !found {
                return;
            }
            if factor > 0.0 {
                break;
            }
        }
    }
}

fn folds(corners: [DVec3; 3], by: [DVec3; 3], limits: &Limits) -> bool {
    let before = doubled_normal(corners);
    let after = doubled_normal([0, 1, 2].map(|k| corners[k] + by[k]));
    let cosine = before.dot(after) / (before.length() * after.length()).max(f64::MIN_POSITIVE);
    cosine < limits.least_cosine || after.length() < limits.least_area * before.length()
}
