//! Tangents, in whose space the pictures of normals are: without them, each viewer would make its own.

use glam::{DVec2, DVec3};
use serde_json::Value;

use crate::mesh::attributes::Materials;

/// Bytes of the tangent of a vertex.
pub(super) const VERTEX_BYTES: u64 = 16;

/// A mesh whose vertices each have one texture coordinate.
pub(super) struct TexturedMesh<'a> {
    pub positions: &'a [DVec3],
    /// Of length 1.
    pub normals: &'a [DVec3],
    /// v grows upwards.
    pub uv: &'a [[f64; 2]],
    pub triangles: &'a [[u32; 3]],
}

/// Whether a material has a picture of normals.
pub(super) fn needs_tangents(materials: &Materials) -> bool {
    materials.materials.iter().any(|material| material.get("normalTexture").is_some_and(Value::is_object))
}

/// For each vertex the unit direction in which u grows, and 1 or -1 for the side of the third axis: like
/// MikkTSpace, the mean of the triangles around by their angles, in the plane of the normal.
pub(super) fn tangents(mesh: &TexturedMesh) -> Vec<[f32; 4]> {
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    let mut sides = vec![0.0; mesh.positions.len()];
    for triangle in mesh.triangles {
        let corners = triangle.map(|v| mesh.positions[v as usize]);
        let [a, b, c] = triangle.map(|v| DVec2::from_array(mesh.uv[v as usize]));
        let (along, up) = gradients(corners, [b - a, c - a]);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let side = if along.cross(up).dot(normal) < 0.0 { -1.0 } else { 1.0 };
        for (k, v) in triangle.iter().enumerate() {
            let [p, q, r] = [k, k + 1, k + 2].map(|k| corners[k % 3]);
            let v = *v as usize;
            let angle = (q - p).angle_between(r - p);
            if angle.is_finite() {
                sums[v] += angle * in_plane(along, mesh.normals[v]);
                sides[v] += angle * side;
            }
        }
    }
    let tangent = |((sum, side), normal): ((&DVec3, &f64), &DVec3)| {
        // Where no triangle has an area in the picture, any direction will do.
        let own = in_plane(*sum, *normal);
        let own = if own == DVec3::ZERO { normal.any_orthonormal_vector() } else { own };
        let [x, y, z] = own.as_vec3().to_array();
        [x, y, z, if *side < 0.0 { -1.0 } else { 1.0 }]
    };
    sums.iter().zip(&sides).zip(mesh.normals).map(tangent).collect()
}

/// The direction of a vector in the plane of a unit normal; zero if it has none there.
fn in_plane(vector: DVec3, normal: DVec3) -> DVec3 {
    let vector = vector.normalize_or_zero();
    (vector - vector.dot(normal) * normal).normalize_or_zero()
}

/// How a triangle lies along u and v; zero if it has no area in the picture.
fn gradients([a, b, c]: [DVec3; 3], [to_b, to_c]: [DVec2; 2]) -> (DVec3, DVec3) {
    let area = to_b.perp_dot(to_c);
    if area == 0.0 {
        return (DVec3::ZERO, DVec3::ZERO);
    }
    let (p, q) = (b - a, c - a);
    ((p * to_c.y - q * to_b.y) / area, (q * to_b.x - p * to_c.x) / area)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square in the plane of x and y that faces up, with these texture coordinates.
    fn of_square(uv: [[f64; 2]; 4]) -> Vec<[f32; 4]> {
        let positions = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        tangents(&TexturedMesh {
            positions: &positions,
            normals: &[DVec3::Z; 4],
            uv: &uv,
            triangles: &[[0, 1, 2], [0, 2, 3]],
        })
    }

    #[test]
    fn tangents_go_where_u_grows() {
        let plain = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert_eq!(of_square(plain), [[1.0, 0.0, 0.0, 1.0]; 4]);
        assert_eq!(of_square(plain.map(|[u, v]| [-u, v])), [[-1.0, 0.0, 0.0, -1.0]; 4], "mirrored");
        assert_eq!(of_square(plain.map(|[u, v]| [v, -u])), [[0.0, 1.0, 0.0, 1.0]; 4], "turned");
        let [x, y, z, _] = of_square([[0.0; 2]; 4])[0];
        assert!((x * x + y * y - 1.0).abs() < 1e-6 && z == 0.0, "no area in the picture");
    }
}
