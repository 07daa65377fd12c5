//! The surface reaches beyond the points where they end; what has none around it is cut off.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use super::notches::Ends;
use crate::TriMesh;
use crate::mesh::half_edges::{EdgeTable, edge_key};
use crate::mesh::repair::connected_components;
use crate::mesh::submesh::without_unused_vertices;
use crate::mesh::topology::Partition;

/// The surface ends where the offset is this large: the points then lie on one side. A half-plane of even
/// points, weighted by (1 - r^2)^4, has 0.235 at its end.
pub(super) const AT_END: f32 = 0.235;
/// A new vertex keeps this share of its edge away from the ends.
const CLEARANCE: f32 = 0.05;

/// Notches in the ends that are at most this wide are filled, in spacings.
const NOTCH: f64 = 5.0;
/// Notches are filled from this depth on, in spacings: ends are known only to within a side of the grid's
/// cells.
const NOTCH_DEPTH: f64 = 1.4;

/// Cuts off what lies beyond the ends of the points, which the `offset` of each vertex tells. Gaps between
/// points whose other side was reached stay filled, and so do narrow notches; `spacing` is that of the
/// points, or more with noise. Then drops components of less than `least_area`, and what hangs on by a single
/// vertex. Returns the number of components dropped.
pub(super) fn trim(mesh: &TriMesh, offset: &[f32], spacing: f64, least_area: f64) -> (TriMesh, usize) {
    let mut inside: Vec<f32> = offset.iter().map(|offset| AT_END - offset).collect();
    let boundary = boundary_of(mesh);
    fill_gaps(mesh, &boundary, &mut inside);
    let beyond: Vec<bool> = inside.iter().map(|inside| *inside <= 0.0).collect();
    if beyond.contains(&true) {
        let notches = Ends::new(mesh, &boundary, beyond).in_notches(NOTCH * spacing, NOTCH_DEPTH * spacing);
        notches.into_iter().for_each(|v| inside[v as usize] = AT_END);
    }
    let mesh = clip(mesh, &inside);
    let (of_triangle, areas) = connected_components(&mesh);
    let is_small = |t: usize| areas[of_triangle[t] as usize] < least_area;
    let kept = (0..mesh.triangles.len()).filter(|t| !is_small(*t)).map(|t| mesh.triangles[t]).collect();
    let dropped = areas.iter().filter(|area| **area < least_area).count();
    (without_unused_vertices(&mesh, without_pinches(mesh.vertices.len(), kept)), dropped)
}

/// The vertices at boundary edges of the mesh, each once for each of them.
pub(super) fn boundary_of(mesh: &TriMesh) -> Vec<u32> {
    let table = EdgeTable::new(&mesh.triangles);
    let ends = table.edges().filter_map(|edge| if let [one] = edge { Some(one.ends()) } else { None });
    ends.flat_map(|(a, b)| [a, b]).collect()
}

/// Parts without points that do not meet the boundary of the mesh are gaps inside it, and count as inside.
fn fill_gaps(mesh: &TriMesh, boundary: &[u32], inside: &mut [f32]) {
    let is_out = |v: u32| inside[v as usize] <= 0.0;
    let mut parts = Partition::new(inside.len());
    for [a, b, c] in &mesh.triangles {
        for (v, w) in [(*a, *b), (*b, *c), (*c, *a)] {
            if is_out(v) && is_out(w) {
                parts.join(v, w);
            }
        }
    }
    let mut meets = vec![false; inside.len()];
    boundary.iter().for_each(|v| meets[parts.root(*v) as usize] = true);
    for (v, inside) in (0..).zip(inside.iter_mut()) {
        if *inside <= 0.0 && !meets[parts.root(v) as usize] {
            *inside = AT_END;
        }
    }
}

/// Cuts triangles along the line where `inside` is 0 and drops those below.
fn clip(mesh: &TriMesh, inside: &[f32]) -> TriMesh {
    let mut cut = TriMesh { vertices: mesh.vertices.clone(), triangles: Vec::new() };
    let mut known: HashMap<(u32, u32), u32> = HashMap::new();
    for corners in &mesh.triangles {
        let is_in = corners.map(|v| inside[v as usize] > 0.0);
        let count = is_in.iter().filter(|is_in| **is_in).count();
        if count == 3 {
            cut.triangles.push(*corners);
        }
        if count == 0 || count == 3 {
            continue;
        }
        // The corner that differs comes first.
        let first = (0..3).find(|k| is_in[*k] == (count == 1)).unwrap_or(0);
        let [a, b, c] = [0, 1, 2].map(|k| corners[(first + k) % 3]);
        let mut on = |v: u32, w: u32| match known.entry(edge_key(v, w)) {
            Entry::Occupied(known) => *known.get(),
            Entry::Vacant(new) => {
                let (v, w) = edge_key(v, w);
                let [from, to] = [v, w].map(|v| inside[v as usize]);
                let share = (from / (from - to)).clamp(CLEARANCE, 1.0 - CLEARANCE);
                let [p, q] = [v, w].map(|v| mesh.vertices[v as usize]);
                cut.vertices.push(p.lerp(q, share.into()));
                *new.insert(cut.vertices.len() as u32 - 1)
            }
        };
        let (ab, ac) = (on(a, b), on(a, c));
        if count == 1 {
            cut.triangles.push([a, ab, ac]);
        } else {
            cut.triangles.extend([[ab, b, c], [ab, c, ac]]);
        }
    }
    cut
}

/// The triangles without those at vertices where several fans meet, until there is none.
pub(super) fn without_pinches(vertices: usize, mut triangles: Vec<[u32; 3]>) -> Vec<[u32; 3]> {
    loop {
        // A fan of triangles around a vertex has at most one boundary edge that leaves it.
        let mut leaving = vec![0_u8; vertices];
        let table = EdgeTable::new(&triangles);
        for edge in table.edges() {
            if let [one] = edge {
                let from = triangles.as_flattened()[one.corners().0];
                leaving[from as usize] = leaving[from as usize].saturating_add(1);
            }
        }
        let before = triangles.len();
        triangles.retain(|corners| corners.iter().all(|v| leaving[*v as usize] < 2));
        if triangles.len() == before {
            return triangles;
        }
    }
}
