//! Sites on the surface's curves: corners stay, and between them sites stand at equal distances along each curve.

use super::place::Place;
use super::seed::Seeds;
use super::spatial::morton_order;
use super::surface_curves::{CurvePath, SurfaceCurves};
use crate::gpu::NONE;
use glam::DVec3;

/// A site closer to a vertex than this share of its segment stands at the vertex.
const SNAP: f64 = 1e-6;

/// Sites that do not move, for one spacing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CurveSites {
    /// Where they are, on the surface's edges and vertices: the corners in order, then curve after curve.
    pub positions: Vec<DVec3>,
    /// The edge or vertex of the surface that each is on.
    pub places: Vec<Place>,
    /// The curve that each is on and the way along it; [`NONE`] for corners.
    pub ways: Vec<(u32, f64)>,
    /// Neighbours along the curves, as pairs of these sites.
    pub segments: Vec<[u32; 2]>,
}

/// How many sites and segments the curves get.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CurveCounts {
    /// Sites, corners included.
    pub sites: usize,
    /// Segments between them.
    pub segments: usize,
    /// Sides of the segments: one for each triangle that will lie at them.
    pub sides: usize,
}

impl SurfaceCurves {
    /// The counts of [`SurfaceCurves::sites`] at this spacing.
    pub fn count(&self, spacing: f64) -> CurveCounts {
        let mut counts = CurveCounts { sites: self.corners.len(), ..Default::default() };
        for curve in &self.curves {
            let segments = segments(curve, spacing);
            counts.sites += if curve.closed { segments } else { segments - 1 };
            counts.segments += segments;
            counts.sides += curve.sides * segments;
        }
        counts
    }

    /// Corners, and sites on each curve at equal distances along it, as near to `spacing` as can be.
    pub fn sites(&self, spacing: f64) -> CurveSites {
        let mut sites = CurveSites::default();
        for corner in &self.corners {
            sites.positions.push(self.vertices[*corner as usize]);
            sites.places.push(Place::Vertex(*corner));
            sites.ways.push((NONE, 0.0));
        }
        for (number, curve) in (0..).zip(&self.curves) {
            self.place_along(number, curve, segments(curve, spacing), &mut sites);
        }
        sites
    }

    fn place_along(&self, number: u32, curve: &CurvePath, segments: usize, sites: &mut CurveSites) {
        let corner = |v: Option<&u32>| {
            v.and_then(|v| self.corners.binary_search(v).ok()).map_or(NONE, |place| place as u32)
        };
        let begin = sites.positions.len() as u32;
        let inner = if curve.closed { segments } else { segments - 1 } as u32;
        let first_step = usize::from(!curve.closed);
        for s in first_step..segments {
            let (position, place) = self.at(curve, s as f64 / segments as f64, SNAP / segments as f64);
            sites.positions.push(position);
            sites.places.push(place);
            sites.ways.push((number, s as f64 / segments as f64 * curve.length()));
        }
        let [first, last] = if curve.closed {
            [begin, begin]
        } else {
            [corner(curve.vertices.first()), corner(curve.vertices.last())]
        };
        let middle = (begin + u32::from(curve.closed))..(begin + inner);
        let chain: Vec<u32> = std::iter::once(first).chain(middle).chain([last]).collect();
        sites.segments.extend(chain.windows(2).map(|pair| [pair[0], pair[1]]));
    }

    /// The point at a share of the curve's length, at a vertex if that is within `snap` of the length.
    fn at(&self, curve: &CurvePath, share: f64, snap: f64) -> (DVec3, Place) {
        let way = share * curve.length();
        let edges = curve.along.len() - 1;
        let edge = curve.along.partition_point(|a| *a <= way).clamp(1, edges) - 1;
        let [from, to] = [edge, edge + 1].map(|k| curve.along[k]);
        let [a, b] = [edge, edge + 1].map(|k| curve.vertices[k]);
        let [p, q] = [a, b].map(|v| self.vertices[v as usize]);
        let near = snap * curve.length();
        if way - from <= near {
            return (p, Place::Vertex(a));
        }
        if to - way <= near {
            return (q, Place::Vertex(b));
        }
        // Every curve edge has a half-edge.
        let half = self.half_edges(a, b).first().copied().unwrap_or(0);
        (p.lerp(q, (way - from) / (to - from)), Place::Edge(half / 3, (half % 3) as u8))
    }
}

fn segments(curve: &CurvePath, spacing: f64) -> usize {
    ((curve.length() / spacing).round() as usize).max(curve.fewest)
}

impl CurveSites {
    /// These and the `interior` sites together in Morton order, and for each which of these it is, [`NONE`] for an
    /// interior one. A curve site gets one of the triangles at its place.
    pub fn merge(&self, curves: &SurfaceCurves, interior: Seeds) -> (Seeds, Vec<u32>) {
        let first = interior.sites.len();
        let mut sites = interior.sites;
        let mut triangles = interior.triangles;
        sites.extend_from_slice(&self.positions);
        triangles.extend(self.places.iter().map(|place| curves.around(*place).first().copied().unwrap_or(0)));
        let order = morton_order(&sites);
        let curve_site = |i: u32| (i as usize).checked_sub(first).map_or(NONE, |c| c as u32);
        let pins = order.iter().map(|i| curve_site(*i)).collect();
        let seeds = Seeds {
            sites: order.iter().map(|i| sites[*i as usize]).collect(),
            triangles: order.iter().map(|i| triangles[*i as usize]).collect(),
        };
        (seeds, pins)
    }
}
