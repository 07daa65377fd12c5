//! The fit from its definition: a sum of squares over all samples, and moves that must not spoil triangles.

use glam::{DMat3, DVec3};
use rtfmesh::TriMesh;

/// Weight of squared moves, and of squared differences of moves.
const STIFFNESS: f64 = 1e-2;
const COUPLING: f64 = 0.07;

pub fn corners(mesh: &TriMesh, t: usize) -> [DVec3; 3] {
    mesh.triangles[t].map(|v| mesh.vertices[v as usize])
}

pub fn doubled_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

pub fn area(mesh: &TriMesh, t: usize) -> f64 {
    0.5 * doubled_normal(corners(mesh, t)).length()
}

/// A third of the area of the triangles around each vertex.
pub fn thirds(mesh: &TriMesh) -> Vec<f64> {
    let mut thirds = vec![0.0; mesh.vertices.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        triangle.iter().for_each(|v| thirds[*v as usize] += area(mesh, t) / 3.0);
    }
    thirds
}

/// A squared distance along a direction, both times the root of a weight, of a point with these weights of
/// vertices.
pub struct Term {
    pub direction: DVec3,
    pub distance: f64,
    pub of: Vec<(usize, f64)>,
}

/// The matrix of the sum of squares, as dense blocks, and its right-hand side: of `terms`, of the moves
/// themselves and of their differences along each triangle. Rows of fixed vertices are 0.
pub fn equations(mesh: &TriMesh, terms: &[Term], fixed: &[bool]) -> (Vec<Vec<DMat3>>, Vec<DVec3>) {
    let n = mesh.vertices.len();
    let mut matrix = vec![vec![DMat3::ZERO; n]; n];
    let mut right = vec![DVec3::ZERO; n];
    for Term { direction, distance, of } in terms {
        let square =
            DMat3::from_cols(*direction * direction.x, *direction * direction.y, *direction * direction.z);
        for (v, weight) in of {
            right[*v] += *direction * (distance * weight);
            of.iter().for_each(|(w, other)| matrix[*v][*w] += square * (weight * other));
        }
    }
    for (v, third) in thirds(mesh).into_iter().enumerate() {
        matrix[v][v] += DMat3::IDENTITY * (STIFFNESS * third);
    }
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let coupling = DMat3::IDENTITY * (COUPLING * area(mesh, t));
        for k in 0..3 {
            let [v, w] = [triangle[k], triangle[(k + 1) % 3]].map(|v| v as usize);
            matrix[v][v] += coupling;
            matrix[w][w] += coupling;
            matrix[v][w] -= coupling;
            matrix[w][v] -= coupling;
        }
    }
    for v in (0..n).filter(|v| fixed[*v]) {
        matrix[v].fill(DMat3::ZERO);
        right[v] = DVec3::ZERO;
    }
    (matrix, right)
}

/// The product of a matrix of blocks with a vector.
pub fn product(matrix: &[Vec<DMat3>], x: &[DVec3]) -> Vec<DVec3> {
    matrix.iter().map(|row| row.iter().zip(x).map(|(block, x)| *block * *x).sum()).collect()
}

/// The smallest and the largest angle of a triangle, in radians.
pub fn extreme_angles([a, b, c]: [DVec3; 3]) -> [f64; 2] {
    let all = [(b - a).angle_between(c - a), (c - b).angle_between(a - b), (a - c).angle_between(b - c)];
    [all.into_iter().fold(f64::INFINITY, f64::min), all.into_iter().fold(0.0, f64::max)]
}

/// Moves no longer than half the size of the faces around, halved up to four times and then set to 0 where a
/// triangle would fold, become flat, or get worse angles than `least` and a right angle allow.
pub fn limited(mesh: &TriMesh, moves: &[DVec3], least: f64) -> Vec<DVec3> {
    let mut moves: Vec<DVec3> = moves
        .iter()
        .zip(thirds(mesh))
        .map(|(step, third)| step.clamp_length_max(0.5 * third.sqrt()))
        .collect();
    let all = || (0..mesh.triangles.len()).map(|t| extreme_angles(corners(mesh, t)));
    let smallest = all().map(|angles| angles[0]).fold(f64::INFINITY, f64::min);
    let right_angle = std::f64::consts::FRAC_PI_2;
    let largest = all().map(|angles| angles[1]).fold(right_angle, f64::max);
    let loss = 0.5_f64.to_radians();
    let cosine = |a: DVec3, b: DVec3| a.normalize_or_zero().dot(b.normalize_or_zero());
    let height = |t: [DVec3; 3]| {
        let sides = [t[0].distance(t[1]), t[1].distance(t[2]), t[2].distance(t[0])];
        doubled_normal(t).length() / sides.into_iter().fold(0.0, f64::max).powi(2)
    };
    let spoiled = |t: usize, moves: &[DVec3]| {
        let old = corners(mesh, t);
        let new = mesh.triangles[t].map(|v| mesh.vertices[v as usize] + moves[v as usize]);
        let ([was_small, was_large], [small, large]) = (extreme_angles(old), extreme_angles(new));
        let narrow = small < smallest.max(least) && small < smallest.max(was_small - loss).min(was_small);
        let wide = large > right_angle && large > largest.min(was_large + loss).max(was_large);
        let turned = cosine(doubled_normal(new), doubled_normal(old)) < 0.5;
        let flat = height(new) < 0.2 && height(new) <= height(old);
        new != old && (narrow || wide || turned || flat)
    };
    for round in 0.. {
        let bad: Vec<usize> = (0..mesh.triangles.len()).filter(|t| spoiled(*t, &moves)).collect();
        if bad.is_empty() {
            break;
        }
        let mut vertices: Vec<u32> = bad.into_iter().flat_map(|t| mesh.triangles[t]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices.iter().for_each(|v| moves[*v as usize] *= if round < 4 { 0.5 } else { 0.0 });
    }
    moves
}
