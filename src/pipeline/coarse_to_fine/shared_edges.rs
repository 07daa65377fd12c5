//! Edges that two patches share, though no curve runs there.
//!
//! Where a layer becomes thinner than an edge is long, such as a label towards its rim, its sides have no
//! sites but those on the curves around, and the same triangles span both. A site in the middle of each such
//! edge, on one of the sides, tells them apart.

use crate::TriMesh;
use crate::mesh::half_edges::{EdgeSet, edge_key};
use crate::sites::cells::BrokenCell;
use glam::DVec3;
use std::collections::HashMap;

/// Where sites are missing in a mesh over sites: between the ends of edges that are shared by more than two
/// faces without being on a curve, and in the middle of faces that are there twice. `beside` gives a point of
/// the surface near another one, off the curves, and the triangle that it is on.
pub(super) fn missing_between_curves(
    mesh: &TriMesh,
    is_fixed: &[bool],
    curve_edges: &EdgeSet,
    beside: impl Fn(DVec3) -> Option<(DVec3, u32)>,
) -> Vec<BrokenCell> {
    let mut at_edge: HashMap<(u32, u32), u32> = HashMap::new();
    let mut at_face: HashMap<[u32; 3], u32> = HashMap::new();
    for face in &mesh.triangles {
        let [a, b, c] = *face;
        for (a, b) in [(a, b), (b, c), (c, a)] {
            let key = edge_key(a, b);
            if is_fixed[a as usize] && is_fixed[b as usize] && !curve_edges.contains(&key) {
                *at_edge.entry(key).or_default() += 1;
            }
        }
        if face.iter().all(|v| is_fixed[*v as usize]) {
            let mut sorted = *face;
            sorted.sort_unstable();
            *at_face.entry(sorted).or_default() += 1;
        }
    }
    let edges = at_edge.into_iter().filter(|(_, count)| *count > 2).map(|((a, b), _)| vec![a, b]);
    let faces = at_face.into_iter().filter(|(_, count)| *count > 1).map(|(face, _)| face.to_vec());
    let mut shared: Vec<Vec<u32>> = edges.chain(faces).collect();
    shared.sort_unstable();
    let middle = |of: &[u32]| of.iter().map(|v| mesh.vertices[*v as usize]).sum::<DVec3>() / of.len() as f64;
    let place = |of: Vec<u32>| Some(BrokenCell { site: of[0], farthest: beside(middle(&of))? });
    shared.into_iter().filter_map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two layers of a strip between the curves 0-1 and 2-3, which have all sites.
    #[test]
    fn layers_that_are_spanned_alike_get_sites() {
        let vertices = [[0.0, 0.0], [2.0, 0.0], [0.0, 1.0], [2.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        let layer = [[0, 1, 2], [1, 3, 2]];
        let curves = EdgeSet::from([(0, 1), (2, 3)]);
        let beside = |p: DVec3| Some((p, 7));
        let missing = |faces: &[[u32; 3]], is_fixed: &[bool; 4]| {
            let mesh = TriMesh { vertices: vertices.to_vec(), triangles: faces.to_vec() };
            missing_between_curves(&mesh, is_fixed, &curves, beside)
        };
        let both = [layer, layer].concat();
        let found: Vec<DVec3> =
            missing(&both, &[true; 4]).into_iter().map(|broken| broken.farthest.0).collect();
        let middle = |of: &[usize]| of.iter().map(|v| vertices[*v]).sum::<DVec3>() / of.len() as f64;
        assert_eq!(found, [middle(&[0, 1, 2]), middle(&[1, 2]), middle(&[1, 2, 3])]);
        assert!(
            missing(&both, &[true, false, true, true]).is_empty(),
            "a site off the curves tells them apart"
        );
        assert!(missing(&layer, &[true; 4]).is_empty());
        // Turned over, and spanned across.
        let across = [layer[0], layer[1], [3, 0, 1], [0, 3, 2]];
        assert!(missing(&across, &[true; 4]).is_empty());
    }
}
