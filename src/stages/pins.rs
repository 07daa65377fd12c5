//! Marks of sites on surfaces with curves: pinned sites, and the patches of the others.
//!
//! A mark is the fourth component of a site's position (see `glsl/common/pins.glsl`): for an interior site
//! the number of its patch, which never changes, since no walk crosses a curve; for a curve site a negative
//! number, which codes the direction of the curve. Curve sites are pinned: they keep position and normal.

use super::octahedral::pack;
use crate::mesh::NONE;
use crate::sites::curve_sites::CurveSites;
use crate::sites::on_surface::SitesOnSurface;
use crate::sites::place::Place;
use crate::sites::surface_curves::SurfaceCurves;
use glam::{DVec3, Vec4};

/// In the code of a curve site: its normal says nothing of its patches, as at the corner of a box or the edge
/// of a blade.
const ANYWHERE: u32 = 1 << 20;
/// The place of the number of quarters of a spacing that the curve goes on, and the largest such number.
const REACH_SHIFT: u32 = 21;
const MOST_QUARTERS: f64 = 7.0;
/// Cosine of the largest angle between the normal of a curve site and those of its patches.
const LEAST_COSINE: f64 = -0.05;
/// Whole numbers below this are exact in an `f32`.
const PATCHES: u32 = 1 << 24;

/// Sites as the device starts with them.
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
    /// Of merged sites: those with an entry in `pins` are these `curve_sites` (see [`CurveSites::merge`]).
    /// `normals` are those of the surface's triangles. Panics if these do not belong together.
    pub fn new(
        curves: &SurfaceCurves,
        normals: &[DVec3],
        sites: &SitesOnSurface,
        (curve_sites, pins): (&CurveSites, &[u32]),
        spacing: f64,
    ) -> Self {
        let goes_on = |corner: &u32| curves.user_corners.binary_search(corner).is_ok();
        let goes_on: Vec<bool> = curves.corners.iter().map(goes_on).collect();
        let lines = lines(curve_sites, &goes_on, spacing);
        let mut result = Self::default();
        for (i, pin) in pins.iter().enumerate() {
            let at = sites.positions[i].as_vec3();
            if *pin == NONE {
                let patch = curves.patches[sites.triangles[i] as usize] % PATCHES;
                result.sites.push(at.extend(patch as f32));
                result.normals.push(0);
                result.moving += 1;
            } else {
                let (normal, certain) = normal_at(curves, normals, curve_sites.places[*pin as usize]);
                let code = lines[*pin as usize] | if certain { 0 } else { ANYWHERE };
                // Whole numbers up to 2^24, which an f32 has exactly.
                result.sites.push(at.extend(-((1 + code) as f32)));
                result.normals.push(pack(normal));
            }
        }
        result
    }
}

/// For each site the code of its curve: the direction, and how far it goes on; 0 where it has no direction,
/// and at corners, which come first, unless the curve `goes_on` there.
fn lines(sites: &CurveSites, goes_on: &[bool], spacing: f64) -> Vec<u32> {
    let mut beside = vec![Vec::new(); sites.positions.len()];
    for [a, b] in &sites.segments {
        beside[*a as usize].push(*b);
        beside[*b as usize].push(*a);
    }
    let code = |(i, beside): (usize, &Vec<u32>)| {
        let &[a, b] = beside.as_slice() else { return 0 };
        let [at, a, b] = [i as u32, a, b].map(|site| sites.positions[site as usize]);
        let direction = (b - a).normalize_or_zero();
        if goes_on.get(i).is_some_and(|goes_on| !goes_on) || direction == DVec3::ZERO {
            return 0;
        }
        let quarters = (2.0 * (a.distance(at) + at.distance(b)) / (spacing * sites.sizes[i]))
            .round()
            .clamp(1.0, MOST_QUARTERS);
        coarse_direction(direction) | (quarters as u32) << REACH_SHIFT
    };
    beside.iter().enumerate().map(code).collect()
}

/// A direction by 10 bits an axis: the octahedral map as in [`pack`], off by at most 4e-3.
fn coarse_direction(direction: DVec3) -> u32 {
    let fine = pack(direction);
    let bits = |short: u32| {
        let value = f64::from(short as u16 as i16) / 32767.0;
        ((value + 1.0) * 511.0).round() as u32
    };
    bits(fine & 0xffff) | bits(fine >> 16) << 10
}

/// The mean of the normals of the patches at a place, each once, and whether it is on the side of all of
/// them.
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
