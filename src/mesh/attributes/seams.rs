//! Edges where what is carried over breaks off: seams of the texture, borders between labels.

use std::collections::HashMap;

use super::{Attributes, CornerUv, Role};
use crate::mesh::TriMesh;
use crate::mesh::edges::{EdgeTable, Side};

/// Texture coordinates nearer than this, in textures, are the same.
const SAME_UV: f64 = 1e-6;

/// The triangles over the first vertex at each place, so that triangles with vertices of their own are joined.
pub(super) fn joined(mesh: &TriMesh) -> Vec<[u32; 3]> {
    let mut firsts = HashMap::with_capacity(mesh.vertices.len());
    let first_there = |(own, position): (u32, &glam::DVec3)| {
        // Adding zero turns -0.0 into 0.0.
        *firsts.entry(position.to_array().map(|value| (value + 0.0).to_bits())).or_insert(own)
    };
    let first: Vec<u32> = (0..).zip(&mesh.vertices).map(first_there).collect();
    mesh.triangles.iter().map(|triangle| triangle.map(|v| first[v as usize])).collect()
}

/// Sides of triangles, `3 * triangle + k`, across which `breaks` holds, rising. `triangles` are [`joined`] ones.
fn sides_where(triangles: &[[u32; 3]], breaks: impl Fn(Side, Side) -> bool) -> Vec<u32> {
    let mut found = Vec::new();
    for sides in EdgeTable::new(triangles).edges() {
        let [first, others @ ..] = sides else { continue };
        if others.iter().any(|other| breaks(*first, *other)) {
            found.extend(sides.iter().map(|side| side.corners().0 as u32));
        }
    }
    found.sort_unstable();
    found
}

/// The sides across which the texture does not go on.
pub(super) fn seams_of(triangles: &[[u32; 3]], uv: &CornerUv) -> Vec<u32> {
    let corners = triangles.as_flattened();
    let near = |a: usize, b: usize| {
        let [p, q] = [uv.values[a], uv.values[b]];
        let size = p.iter().chain(&q).fold(1.0, |size: f64, value| size.max(value.abs()));
        (p[0] - q[0]).abs().max((p[1] - q[1]).abs()) <= SAME_UV * size
    };
    sides_where(triangles, |one, other| {
        let ((a, b), (c, d)) = (one.corners(), other.corners());
        let (c, d) = if corners[a] == corners[c] { (c, d) } else { (d, c) };
        !near(a, c) || !near(b, d)
    })
}

/// Sides `3 * triangle + k` of `mesh` along which its texture is cut, for [`crate::Options::held_sides`].
pub fn uv_seams(mesh: &TriMesh, attributes: &Attributes) -> Vec<u32> {
    attributes.uv.as_ref().map_or_else(Vec::new, |uv| seams_of(&joined(mesh), uv))
}

/// Sides `3 * triangle + k` of `mesh` between triangles with different labels, for [`crate::Options::held_sides`].
pub fn label_borders(mesh: &TriMesh, attributes: &Attributes) -> Vec<u32> {
    let labels: Vec<_> = attributes.face.iter().filter(|attribute| attribute.role == Role::Label).collect();
    if labels.is_empty() {
        return Vec::new();
    }
    let differ = |a: usize, b: usize| labels.iter().any(|label| label.at(a) != label.at(b));
    sides_where(&joined(mesh), |one, other| differ(one.triangle(), other.triangle()))
}
