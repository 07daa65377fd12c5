//! What the device knows of sites on surfaces with curves: who stays, and who is in which patch.
//!
//! It is all in the fourth component of a site's position (see `glsl/common/pins.glsl`). For an interior site that is the
//! number of its patch, which never changes, since no site walks over a curve; a curve site has one of two negative
//! numbers and keeps its place and its normal.

use super::curve_sites::CurveSites;
use super::place::Place;
use super::records::octahedral;
use super::seed::Seeds;
use super::surface_curves::SurfaceCurves;
use crate::gpu::NONE;
use glam::{DVec3, Vec4};

/// A curve site whose normal turns away from none of its patches.
const PINNED: f32 = -1.0;
/// A curve site where the normals of the patches say nothing, as at the corner of a box or the edge of a blade.
const PINNED_ANYWHERE: f32 = -2.0;
/// Cosine of the largest angle between the normal of a curve site and those of its patches.
const LEAST_COSINE: f64 = -0.05;
/// Numbers that an `f32` has exactly.
const PATCHES: u32 = 1 << 24;

/// Sites as the device begins with them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PinnedSites {
    /// Positions and marks.
    pub sites: Vec<Vec4>,
    /// Normals of the curve sites, packed as in `glsl/common/octahedral.glsl`; 0 for others.
    pub normals: Vec<u32>,
    /// How many sites move.
    pub moving: usize,
}

impl PinnedSites {
    /// Of merged sites: those with an entry in `pins` are these `curve_sites` (see [`CurveSites::merge`]). `normals` are
    /// those of the surface's triangles. Panics if the three do not belong together.
    pub fn new(
        curves: &SurfaceCurves,
        normals: &[DVec3],
        seeds: &Seeds,
        curve_sites: &CurveSites,
        pins: &[u32],
    ) -> Self {
        let mut result = Self::default();
        for (i, pin) in pins.iter().enumerate() {
            let at = seeds.sites[i].as_vec3();
            if *pin == NONE {
                let patch = curves.patches[seeds.triangles[i] as usize] % PATCHES;
                result.sites.push(at.extend(patch as f32));
                result.normals.push(0);
                result.moving += 1;
            } else {
                let (normal, certain) = normal_at(curves, normals, curve_sites.places[*pin as usize]);
                result.sites.push(at.extend(if certain { PINNED } else { PINNED_ANYWHERE }));
                result.normals.push(octahedral(normal));
            }
        }
        result
    }
}

/// The mean of the normals of the patches at a place, each once, and whether it is on the side of all of them.
fn normal_at(curves: &SurfaceCurves, normals: &[DVec3], place: Place) -> (DVec3, bool) {
    let mut sums: Vec<(u32, DVec3)> = Vec::new();
    // On a crease within one patch the triangles stand for themselves.
    let apart = matches!(place, Place::Edge(..));
    for t in curves.around(place) {
        let normal = normals[t as usize] * curves.angle_at(place, t);
        let patch = curves.patches[t as usize];
        match sums.iter_mut().find(|(p, _)| !apart && *p == patch) {
            Some((_, sum)) => *sum += normal,
            None => sums.push((patch, normal)),
        }
    }
    let parts: Vec<DVec3> = sums.iter().map(|(_, sum)| sum.normalize_or_zero()).collect();
    let mean = parts.iter().sum::<DVec3>().normalize_or_zero();
    (mean, mean != DVec3::ZERO && parts.iter().all(|n| n.dot(mean) > LEAST_COSINE))
}
