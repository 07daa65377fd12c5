//! The distance that interior sites keep from the sites on curves.

use super::curve_sites::CurveSites;
use super::on_surface::SitesOnSurface;
use super::seed::stratified;
use super::surface::Surface;
use super::surface_curves::SurfaceCurves;
use crate::mesh::NONE;
use crate::mesh::features::LONGEST_RIM;
use crate::mesh::hash_grid::HashGrid;
use crate::mesh::sizing::SizeField;
use glam::DVec3;
use std::collections::BTreeMap;

/// Minimum distance, in spacings, of an interior site from a curve site. A closer one would lie inside the
/// circle over two neighbouring curve sites; a strip too narrow for this clearance is filled by the sites on
/// its boundary.
const CLEARANCE: f64 = 0.6;
/// Minimum distance from a point of the user's, as a fraction of that. In an even layout, one site is closer,
/// whose place the point takes.
const OF_POINT: f64 = 0.875;
/// Attempts to scatter more seeds where many fall near curves.
const TRIES: u32 = 4;

/// The curve sites, filed by position.
pub struct CurveClearance<'a> {
    curves: &'a SurfaceCurves,
    sites: &'a CurveSites,
    radius: f64,
    /// The length that each site's distance is relative to, in spacings.
    sizes: Vec<f64>,
    /// Sites by the power of two of that length, and by grid cell.
    grids: BTreeMap<i32, HashGrid<u32>>,
}

impl<'a> CurveClearance<'a> {
    /// Around `sites` of this spacing.
    pub fn new(curves: &'a SurfaceCurves, sites: &'a CurveSites, spacing: f64) -> Self {
        let radius = CLEARANCE * spacing;
        let sizes = sizes_by_segments(curves, sites, spacing);
        let mut grids = BTreeMap::new();
        for (i, (position, size)) in (0..).zip(sites.positions.iter().zip(&sizes)) {
            let power = size.log2().ceil() as i32;
            let new = || HashGrid::new(radius * f64::from(power).exp2(), sites.positions.len());
            grids.entry(power).or_insert_with(new).insert(*position, i);
        }
        Self { curves, sites, radius, sizes, grids }
    }

    /// Whether a site at `point`, on or near triangle `t`, keeps its distance from all curve sites of its
    /// patch.
    pub fn is_clear(&self, point: DVec3, t: u32) -> bool {
        let patch = self.curves.patches[t as usize];
        let close = |i: u32| {
            let site = i as usize;
            self.sites.positions[site].distance(point) < self.radius * self.sizes[site]
                && self
                    .curves
                    .around(self.sites.places[site])
                    .iter()
                    .any(|t| self.curves.patches[*t as usize] == patch)
        };
        !self.grids.values().any(|grid| grid.any(point, close))
    }

    /// `count` scattered sites that are clear of the curves, as far as there is space for so many.
    pub fn scattered(&self, surface: &Surface, sizes: &SizeField, count: usize, seed: u64) -> SitesOnSurface {
        let mut tried = count;
        for _ in 0..TRIES {
            let all = stratified(surface, sizes, tried, seed);
            let is_clear = |i: &u32| self.is_clear(all.positions[*i as usize], all.triangles[*i as usize]);
            let clear: Vec<u32> = (0..tried as u32).filter(is_clear).collect();
            if clear.len() >= count && count > 0 {
                // The surplus is left out evenly in Morton order, and so evenly in space.
                let kept: Vec<u32> = (0..count).map(|k| clear[k * clear.len() / count]).collect();
                return all.select(&kept);
            }
            // As many more as were too close, and some for chance.
            tried = (tried * count).div_ceil(clear.len().max(1 + count / 4)) + count / 50 + 1;
        }
        stratified(surface, sizes, count, seed)
    }
}

/// The edge length at each site, on a small rim that of its longer segment, so that sites find space between
/// two rims; in spacings.
fn sizes_by_segments(curves: &SurfaceCurves, sites: &CurveSites, spacing: f64) -> Vec<f64> {
    let mut longest = vec![0.0_f64; sites.positions.len()];
    for [a, b] in sites.segments.iter().map(|pair| pair.map(|i| i as usize)) {
        let length = sites.positions[a].distance(sites.positions[b]) / spacing;
        [a, b].iter().for_each(|i| longest[*i] = longest[*i].max(length));
    }
    let is_rim = |i: usize| {
        let curve = curves.curves.get(sites.curve_positions[i].curve as usize);
        curve.is_some_and(|curve| {
            let line = &curve.line;
            line.is_closed() && curve.sides == 2 && line.length() < LONGEST_RIM * spacing * sites.sizes[i]
        })
    };
    let is_point = |i: usize| i >= curves.corners.len() && sites.curve_positions[i].curve == NONE;
    let size = |i: usize| {
        if is_point(i) {
            OF_POINT * sites.sizes[i]
        } else if is_rim(i) {
            longest[i].min(sites.sizes[i])
        } else {
            sites.sizes[i]
        }
    };
    (0..sites.sizes.len()).map(size).collect()
}
