//! The input as a point cloud with normals.

use super::spatial::morton_order;
use super::surface::Surface;
use glam::DVec3;

/// Points of a surface in Morton order, with unit normals: its vertices and, where those are farther apart than sites are,
/// as many more as it takes, since a plane that fits points beside a gap has nothing to do with what is in it.
pub struct Cloud {
    /// Positions in the unit-diagonal frame.
    pub points: Vec<DVec3>,
    /// Those of vertices are the sums of their triangles' by area, or, where those cancel, that of the last triangle; those
    /// of the other points are their triangles'.
    pub normals: Vec<DVec3>,
}

impl Cloud {
    /// Triangles with sides longer than `spacing`, above 0, get a point in each of the halves of halves without such.
    pub fn new(surface: &Surface, spacing: f64) -> Self {
        let mut points = surface.vertices.clone();
        let mut normals = vertex_normals(surface);
        let mut left: Vec<[DVec3; 3]> = Vec::new();
        for (triangle, normal) in surface.triangles.iter().zip(&surface.normals) {
            let whole = triangle.map(|v| surface.vertices[v as usize]);
            left.extend(halves(whole, spacing).into_iter().flatten());
            while let Some(part) = left.pop() {
                match halves(part, spacing) {
                    Some(parts) => left.extend(parts),
                    None => {
                        points.push(part.iter().sum::<DVec3>() / 3.0);
                        normals.push(*normal);
                    }
                }
            }
        }
        if points.len() == surface.vertices.len() {
            return Self { points, normals };
        }
        let order = morton_order(&points);
        Self {
            points: order.iter().map(|i| points[*i as usize]).collect(),
            normals: order.iter().map(|i| normals[*i as usize]).collect(),
        }
    }
}

/// The triangle cut in the middle of its longest side, if that is longer than `length`.
fn halves([a, b, c]: [DVec3; 3], length: f64) -> Option<[[DVec3; 3]; 2]> {
    let turned = [[a, b, c], [b, c, a], [c, a, b]];
    let [p, q, r] = turned
        .into_iter()
        .max_by(|x, y| x[0].distance_squared(x[1]).total_cmp(&y[0].distance_squared(y[1])))?;
    let middle = 0.5 * (p + q);
    (p.distance_squared(q) > length * length).then_some([[p, middle, r], [middle, q, r]])
}

fn vertex_normals(surface: &Surface) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; surface.vertices.len()];
    let mut last = vec![DVec3::Z; surface.vertices.len()];
    for (t, triangle) in surface.triangles.iter().enumerate() {
        for v in triangle {
            sums[*v as usize] += surface.areas[t] * surface.normals[t];
            if surface.normals[t] != DVec3::ZERO {
                last[*v as usize] = surface.normals[t];
            }
        }
    }
    sums.iter().zip(last).map(|(sum, last)| sum.try_normalize().unwrap_or(last)).collect()
}
