//! How sharp edges are: by the two triangles at an edge, and by normals averaged over half a spacing on
//! either side.

use glam::DVec3;
use rayon::prelude::*;

use super::curve::CurveKind;
use super::graph::CurveEdge;
use super::scale::Scale;
use super::surface::{FeatureSurface, degrees_between};
use crate::mesh::NONE;

/// Sharp chains are extended as long as their angle is at least this share of the feature angle.
const FADE: f64 = 0.4;

/// Normals are averaged this far from the edge's middle, in spacings.
const REACH: f64 = 0.5;
/// Normals are averaged over at least this many lengths of the edge: where the output is finer than the
/// input, noise is of the input's size.
const REACH_OF_EDGE: f64 = 1.5;
/// An edge counts as at most this many times as long as the larger height of its two triangles: long edges
/// between narrow triangles, as CAD programs make them, say nothing about noise, and reached far around a
/// bore. On scans one of the two may be narrow.
const MOST_HEIGHTS: f64 = 2.0;
/// Triangles that are averaged on either side, at most: fine inputs do not need all of theirs.
const MOST: usize = 48;

/// Half-edges, one of each edge, that may become sharp, with the edge's turn in degrees: at least [`FADE`] of
/// the feature angle.
pub(super) fn turns(surface: &FeatureSurface, scale: Scale) -> Vec<(u32, f64)> {
    if scale.feature >= 180.0 {
        return Vec::new();
    }
    // Most of the surface is smooth; the angle itself is computed for the rest only.
    let smooth = (FADE * scale.feature).to_radians().cos();
    (0..surface.twins.len())
        .into_par_iter()
        .filter(|&half| {
            let twin = surface.twins[half];
            twin != NONE
                && (half as u32) < twin
                && !surface.is_fixed[half]
                && surface.normals[half / 3].dot(surface.normals[twin as usize / 3]) < smooth
        })
        .map(|half| (half as u32, surface.turn(half as u32)))
        .collect()
}

/// All fixed curve edges, and those edges that may become sharp.
pub(super) fn candidates(
    points: &[DVec3],
    surface: &FeatureSurface,
    turns: &[(u32, f64)],
    scale: Scale,
) -> Vec<CurveEdge> {
    let fixed = surface.fixed.iter().map(|&(half, kind)| CurveEdge::fixed(surface.ends(half), half, kind));
    let mut edges: Vec<CurveEdge> = fixed.collect();
    if turns.is_empty() {
        return edges;
    }
    let mut stops = surface.is_fixed.clone();
    for &(half, _) in turns.iter().filter(|(_, turn)| *turn >= scale.feature) {
        stops[half as usize] = true;
        stops[surface.twins[half as usize] as usize] = true;
    }
    let sharp: Vec<CurveEdge> = turns
        .par_iter()
        .map(|&(half, turn)| {
            let seen = seen_turn(points, surface, &stops, half, scale.spacing);
            let strong = turn >= scale.feature && seen >= scale.feature;
            CurveEdge {
                ends: surface.ends(half),
                half,
                kind: CurveKind::Sharp,
                turn,
                seen,
                on: strong,
                strong,
            }
        })
        .collect();
    edges.extend(sharp);
    edges
}

/// The angle in degrees between the mean normals on the two sides of an edge, within [`REACH`] and up to the
/// next crease.
fn seen_turn(points: &[DVec3], surface: &FeatureSurface, stops: &[bool], half: u32, spacing: f64) -> f64 {
    let [a, b] = surface.ends(half).map(|v| points[v as usize]);
    let length = a.distance(b);
    let middle = 0.5 * (a + b);
    let (one, other) = (half as usize / 3, surface.twins[half as usize] as usize / 3);
    let height = 2.0 * surface.areas[one].max(surface.areas[other]) / length.max(f64::MIN_POSITIVE);
    let reach = (REACH * spacing).max(REACH_OF_EDGE * length.min(MOST_HEIGHTS * height));
    // Points from the other side to this one, along the surface.
    let across = (surface.normals[one] + surface.normals[other]).cross(b - a);
    let mean = |start: usize, across: DVec3| {
        let mut reached = Vec::with_capacity(MOST);
        reached.push(start as u32);
        let mut sum = DVec3::ZERO;
        let mut next = 0;
        while next < reached.len() {
            let t = reached[next] as usize;
            next += 1;
            sum += surface.areas[t] * surface.normals[t];
            for half in [3 * t, 3 * t + 1, 3 * t + 2] {
                let twin = surface.twins[half];
                if twin == NONE || stops[half] {
                    continue;
                }
                let t = twin / 3;
                if reached.len() == MOST || reached.contains(&t) {
                    continue;
                }
                let [p, q, r] = surface.triangles()[t as usize].map(|v| points[v as usize]);
                let from_middle = (p + q + r) / 3.0 - middle;
                if from_middle.dot(across) > 0.0 && from_middle.length() < reach {
                    reached.push(t);
                }
            }
        }
        sum
    };
    degrees_between(mean(one, across), mean(other, -across))
}
