//! Edges where attributes are discontinuous: texture seams and boundaries between labels.

use std::collections::{HashMap, HashSet};

use super::{Attributes, CornerUv, Role};
use crate::mesh::half_edges::{EdgeTable, HalfEdge};
use crate::mesh::{TriMesh, position_key};

/// Texture coordinates nearer than this, in textures, are the same.
const SAME_UV: f64 = 1e-6;
/// A pole has at least this many edges with a discontinuity there and none at their other ends. A cut that
/// ends inside the texture has one; the tip of a pyramid unfolded as a star has three or four.
const POLE: usize = 5;

/// The triangles over the first vertex at each place, so that triangles with vertices of their own are
/// joined.
pub(crate) fn join_coincident(mesh: &TriMesh) -> Vec<[u32; 3]> {
    let mut firsts = HashMap::with_capacity(mesh.vertices.len());
    let first_there =
        |(own, position): (u32, &glam::DVec3)| *firsts.entry(position_key(*position)).or_insert(own);
    let first: Vec<u32> = (0..).zip(&mesh.vertices).map(first_there).collect();
    mesh.triangles.iter().map(|triangle| triangle.map(|v| first[v as usize])).collect()
}

/// Half-edges across which `breaks` holds, in ascending order. `triangles` are [`join_coincident`]
/// ones.
fn half_edges_where(triangles: &[[u32; 3]], breaks: impl Fn(HalfEdge, HalfEdge) -> bool) -> Vec<u32> {
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

/// Whether the texture is discontinuous at the ends of an edge, in the order of its first half-edge.
fn broken_ends(triangles: &[[u32; 3]], uv: &CornerUv, one: HalfEdge, other: HalfEdge) -> [bool; 2] {
    let corners = triangles.as_flattened();
    let differ = |a: usize, b: usize| {
        let [p, q] = [uv.values[a], uv.values[b]];
        let size = p.iter().chain(&q).fold(1.0, |size: f64, value| size.max(value.abs()));
        (p[0] - q[0]).abs().max((p[1] - q[1]).abs()) > SAME_UV * size
    };
    let ((a, b), (c, d)) = (one.corners(), other.corners());
    let (c, d) = if corners[a] == corners[c] { (c, d) } else { (d, c) };
    [differ(a, c), differ(b, d)]
}

/// The half-edges across which the texture is discontinuous.
pub(crate) fn seams_of(triangles: &[[u32; 3]], uv: &CornerUv) -> Vec<u32> {
    half_edges_where(triangles, |one, other| broken_ends(triangles, uv, one, other).contains(&true))
}

/// The vertices at which the texture is discontinuous across all edges, many of which it crosses smoothly at
/// their other ends.
fn poles(triangles: &[[u32; 3]], uv: &CornerUv) -> HashSet<u32> {
    let corners = triangles.as_flattened();
    let mut ends = HashMap::<u32, usize>::new();
    let mut whole = HashSet::new();
    for sides in EdgeTable::new(triangles).edges() {
        let [one, other] = sides else { continue };
        let (a, b) = one.corners();
        let broken = broken_ends(triangles, uv, *one, *other);
        for (end, here, there) in [(a, broken[0], broken[1]), (b, broken[1], broken[0])] {
            if !here {
                whole.insert(corners[end]);
            } else if !there {
                *ends.entry(corners[end]).or_default() += 1;
            }
        }
    }
    let is_pole = |(vertex, count): &(u32, usize)| *count >= POLE && !whole.contains(vertex);
    ends.into_iter().filter(is_pole).map(|(vertex, _)| vertex).collect()
}

/// Half-edges `3 * triangle + k` of `mesh` along which its texture is cut, for
/// [`crate::CoarseToFineOptions::fixed_half_edges`].
///
/// Edges that end at a pole, where a texture is drawn together in a point, are not seams if the texture is
/// continuous at their other ends: they would cut the surface into as many wedges as there are triangles
/// around the pole.
pub fn uv_seams(mesh: &TriMesh, attributes: &Attributes) -> Vec<u32> {
    let Some(uv) = &attributes.uv else { return Vec::new() };
    let triangles = join_coincident(mesh);
    let poles = poles(&triangles, uv);
    let at_pole = |corner: usize| poles.contains(&triangles.as_flattened()[corner]);
    half_edges_where(&triangles, |one, other| {
        let (a, b) = one.corners();
        match broken_ends(&triangles, uv, one, other) {
            [false, false] => false,
            [true, true] => true,
            [true, false] => !at_pole(a),
            [false, true] => !at_pole(b),
        }
    })
}

/// Half-edges `3 * triangle + k` of `mesh` between triangles with different labels, for
/// [`crate::CoarseToFineOptions::fixed_half_edges`].
pub fn label_boundaries(mesh: &TriMesh, attributes: &Attributes) -> Vec<u32> {
    let labels: Vec<_> = attributes.face.iter().filter(|attribute| attribute.role == Role::Label).collect();
    if labels.is_empty() {
        return Vec::new();
    }
    let differ = |a: usize, b: usize| labels.iter().any(|label| label.at(a) != label.at(b));
    half_edges_where(&join_coincident(mesh), |one, other| differ(one.triangle(), other.triangle()))
}
