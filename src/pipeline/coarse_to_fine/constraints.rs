//! The constraints of a connected level: patches, curves, and the lengths that edges are to have.

use super::level_mesh::{LevelCurves, LevelMesh};
use super::shared::CoarseToFine;
use crate::mesh::NONE;
use crate::mesh::half_edges::{EdgeSet, edge_key};
use crate::mesh::polyline::Polyline;
use crate::polish::{ConstrainedMesh, CurveEdge, SlidingCurve};
use crate::sites::curve_sites::CurvePosition;
use crate::sites::place::Place;
use std::collections::HashMap;

impl CoarseToFine<'_> {
    /// The mesh of a level with all that its improvement must keep. Vertices on curves stay on their curve.
    pub(super) fn constrained(&self, level: &LevelMesh) -> ConstrainedMesh {
        let lengths = self.model.sizes.at_all(&level.sites.positions, &level.sites.triangles);
        let mut constrained = ConstrainedMesh { lengths, ..level.mesh.par_clone().into() };
        if let (Some(on_curves), Some(curves)) = (&level.on_curves, &self.model.curves) {
            constrained.fixed = on_curves.fixed();
            constrained.pinned = self.pinned(on_curves);
            constrained.curve_edges = on_curves.curve_edges(curves.polylines());
            constrained.sliding_curves = on_curves.sliding_curves(curves.polylines());
            constrained.patches = patches(level, &curves.patches, &constrained);
        }
        constrained
    }

    /// Whether each vertex is one that the user wants where it is; empty if there are none.
    fn pinned(&self, on_curves: &LevelCurves) -> Vec<bool> {
        let pinned = &self.context.plan.pinned;
        if pinned.is_empty() {
            return Vec::new();
        }
        let wanted = self.model.pinned.as_slice();
        let is_it = |pin: &u32| match on_curves.sites.places[*pin as usize] {
            Place::Vertex(v) => {
                on_curves.sites.curve_positions[*pin as usize].curve == NONE
                    && wanted.binary_search(&v).is_ok()
            }
            _ => false,
        };
        on_curves.pins.iter().map(|pin| *pin != NONE && is_it(pin)).collect()
    }
}

impl LevelCurves {
    /// The edges along these curves, with the arc lengths of the sites before they slide.
    fn curve_edges<'a>(&self, polylines: impl Iterator<Item = &'a Polyline>) -> Vec<CurveEdge> {
        let mut vertices = vec![NONE; self.sites.positions.len()];
        self.pinned().for_each(|(v, pin)| vertices[pin] = v as u32);
        let lines: Vec<&Polyline> = polylines.collect();
        let mut inner = vec![0usize; lines.len()];
        for position in &self.sites.curve_positions {
            if let Some(count) = inner.get_mut(position.curve as usize) {
                *count += 1;
            }
        }
        let mut edges: Vec<CurveEdge> = Vec::with_capacity(self.sites.segments.len());
        let mut segments = self.sites.segments.iter();
        for ((curve, line), inner) in (0..).zip(lines).zip(inner) {
            let count = if line.is_closed() { inner } else { inner + 1 };
            let mut from = 0.0;
            for (k, pair) in segments.by_ref().take(count).enumerate() {
                let end = self.sites.curve_positions[pair[1] as usize].arc_length;
                let to = if k + 1 < count { end } else { line.length() };
                edges.push(CurveEdge { ends: pair.map(|site| vertices[site as usize]), curve, from, to });
                from = to;
            }
        }
        edges
    }

    /// The curves with the sites that slide along them.
    fn sliding_curves<'a>(&self, polylines: impl Iterator<Item = &'a Polyline>) -> Vec<SlidingCurve> {
        let sliding_curve = |line: &Polyline| SlidingCurve { line: line.clone(), sliders: Vec::new() };
        let mut sliding_curves: Vec<SlidingCurve> = polylines.map(sliding_curve).collect();
        let mut sliders: Vec<(usize, usize)> = self.pinned().map(|(v, pin)| (pin, v)).collect();
        // The curve sites are in order along each curve.
        sliders.sort_unstable();
        for (pin, v) in sliders {
            let CurvePosition { curve, arc_length } = self.sites.curve_positions[pin];
            if let Some(sliding_curve) = sliding_curves.get_mut(curve as usize) {
                sliding_curve.sliders.push((v as u32, arc_length));
            }
        }
        sliding_curves
    }
}

/// The patch of every face. Faces with all corners on curves have the patch of the faces next to them, or
/// [`NONE`] if these also have all corners on curves.
fn patches(level: &LevelMesh, of_surface: &[u32], constrained: &ConstrainedMesh) -> Vec<u32> {
    let faces = &level.mesh.triangles;
    let patch = |face: &[u32; 3]| {
        let interior = face.iter().find(|v| !constrained.fixed[**v as usize]);
        interior.map_or(NONE, |v| of_surface[level.sites.triangles[*v as usize] as usize])
    };
    let mut patches: Vec<u32> = faces.iter().map(patch).collect();
    spread(&mut patches, faces, &constrained.edge_set());
    patches
}

/// Gives faces without a patch that of the faces next to them, across edges that are not on curves.
fn spread(patches: &mut [u32], faces: &[[u32; 3]], curve_edges: &EdgeSet) {
    let mut unknown: Vec<usize> = (0..faces.len()).filter(|t| patches[*t] == NONE).collect();
    if unknown.is_empty() {
        return;
    }
    let edges = |t: usize| {
        let [a, b, c] = faces[t];
        [(a, b), (b, c), (c, a)].map(|(a, b)| edge_key(a, b))
    };
    let mut beside: HashMap<(u32, u32), Vec<usize>> = HashMap::new();
    for edge in unknown.iter().flat_map(|t| edges(*t)).filter(|edge| !curve_edges.contains(edge)) {
        beside.entry(edge).or_default();
    }
    for t in 0..faces.len() {
        for edge in edges(t) {
            if let Some(list) = beside.get_mut(&edge) {
                list.push(t);
            }
        }
    }
    loop {
        let known = |t: &usize| {
            let around = edges(*t).into_iter().filter_map(|edge| beside.get(&edge)).flatten();
            around.map(|s| patches[*s]).find(|patch| *patch != NONE).map(|patch| (*t, patch))
        };
        let found: Vec<(usize, u32)> = unknown.iter().filter_map(known).collect();
        if found.is_empty() {
            return;
        }
        found.into_iter().for_each(|(t, patch)| patches[t] = patch);
        unknown.retain(|t| patches[*t] == NONE);
    }
}
