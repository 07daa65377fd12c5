//! Patches: what is left of the surface between its curves.

use super::graph::Graph;
use super::surface::FeatureSurface;
use crate::mesh::NONE;

/// The patch of each triangle, in the order of the patches' first triangles, and how many there are.
pub(super) fn patches(graph: &Graph, surface: &FeatureSurface) -> (Vec<u32>, usize) {
    let mut is_curve = vec![false; surface.twins.len()];
    for edge in graph.edges.iter().filter(|edge| edge.on) {
        is_curve[edge.half as usize] = true;
        if let Some(twin) = is_curve.get_mut(surface.twins[edge.half as usize] as usize) {
            *twin = true;
        }
    }
    let mut patches = vec![u32::MAX; surface.triangles().len()];
    let mut count = 0;
    let mut waiting = Vec::new();
    for first in 0..patches.len() {
        if patches[first] != u32::MAX {
            continue;
        }
        patches[first] = count;
        waiting.push(first);
        while let Some(t) = waiting.pop() {
            for half in [3 * t, 3 * t + 1, 3 * t + 2] {
                let twin = surface.twins[half];
                if twin != NONE && !is_curve[half] && patches[twin as usize / 3] == u32::MAX {
                    patches[twin as usize / 3] = count;
                    waiting.push(twin as usize / 3);
                }
            }
        }
        count += 1;
    }
    (patches, count as usize)
}
