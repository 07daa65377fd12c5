//! Sites on the surface's curves: corners stay, and between them sites stand at equal distances along each curve, but for
//! bends that they would cut off.

use super::morton::morton_order;
use super::place::Place;
use super::seed::Seeds;
use super::surface_curves::{CurvePath, SurfaceCurves};
use crate::mesh::NONE;
use glam::DVec3;

/// A site closer to a vertex than this share of its segment stands at the vertex.
const SNAP: f64 = 1e-6;

/// A bend farther from the chord than this many spacings gets a site.
const MAX_STRAY: f64 = 0.03;
/// A bend nearer than this many spacings to another one with a site, or to an end of the curve, gets none,
const LEAST_GAP: f64 = 0.3;
/// unless it is farther from the chord than this many, as on ragged rims,
const FAR_STRAY: f64 = 0.045;
/// and no nearer than this many: what is left out there is no farther off.
const RAGGED_GAP: f64 = 0.05;

/// The sites on all curves for one spacing. They stay there until the polish.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CurveSites {
    /// Where they are, on the surface's edges and vertices: the corners in order, then curve after curve.
    pub positions: Vec<DVec3>,
    /// The edge or vertex of the surface that each is on.
    pub places: Vec<Place>,
    /// The curve that each is on and the way along it; [`NONE`] for corners.
    pub ways: Vec<(u32, f64)>,
    /// The edge length at each, relative to the spacing.
    pub sizes: Vec<f64>,
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
            let sites = if curve.line.is_closed() { segments } else { segments - 1 };
            counts.sites = counts.sites.saturating_add(sites);
            counts.segments = counts.segments.saturating_add(segments);
            counts.sides = counts.sides.saturating_add(curve.sides.saturating_mul(segments));
        }
        counts
    }

    /// Corners, and sites on each curve at equal distances along it, as near to `spacing` as can be, or at its bends.
    pub fn sites(&self, spacing: f64) -> CurveSites {
        let mut sites = CurveSites::default();
        for (k, corner) in self.corners.iter().enumerate() {
            sites.positions.push(self.vertices[*corner as usize]);
            sites.places.push(Place::Vertex(*corner));
            sites.ways.push((NONE, 0.0));
            sites.sizes.push(self.corner_size(k));
        }
        for (number, curve) in (0..).zip(&self.curves) {
            self.place_along(number, curve, &ways(curve, spacing), &mut sites);
        }
        sites
    }

    fn place_along(&self, number: u32, curve: &CurvePath, ways: &[f64], sites: &mut CurveSites) {
        let corner = |v: Option<&u32>| {
            v.and_then(|v| self.corners.binary_search(v).ok()).map_or(NONE, |place| place as u32)
        };
        let begin = sites.positions.len() as u32;
        let (segments, closed) = (ways.len() - 1, curve.line.is_closed());
        let inner = &ways[usize::from(!closed)..segments];
        for way in inner {
            let (position, place) = self.at(curve, *way, SNAP * curve.line.length() / segments as f64);
            sites.positions.push(position);
            sites.places.push(place);
            sites.ways.push((number, *way));
            sites.sizes.push(curve.size(*way));
        }
        let [first, last] = if closed {
            [begin, begin]
        } else {
            [corner(curve.vertices.first()), corner(curve.vertices.last())]
        };
        let middle = (begin + u32::from(closed))..(begin + inner.len() as u32);
        let chain: Vec<u32> = std::iter::once(first).chain(middle).chain([last]).collect();
        sites.segments.extend(chain.windows(2).map(|pair| [pair[0], pair[1]]));
    }

    /// The point at a way along the curve, at a vertex if that is within `snap`.
    fn at(&self, curve: &CurvePath, way: f64, snap: f64) -> (DVec3, Place) {
        let (edge, [from, to]) = curve.line.edge(way);
        let [a, b] = [edge, edge + 1].map(|k| curve.vertices[k]);
        let [p, q] = [a, b].map(|v| self.vertices[v as usize]);
        if way - from <= snap {
            return (p, Place::Vertex(a));
        }
        if to - way <= snap {
            return (q, Place::Vertex(b));
        }
        // Every curve edge has a half-edge.
        let half = self.half_edges(a, b).first().copied().unwrap_or(0);
        (p.lerp(q, (way - from) / (to - from)), Place::Edge(half / 3, (half % 3) as u8))
    }
}

/// The ways to the sites on a curve, from its beginning to its end, both included.
fn ways(curve: &CurvePath, spacing: f64) -> Vec<f64> {
    let mut ways = vec![0.0];
    stretches(curve, spacing, &mut |even| ways.extend((1..=even.count).map(|k| even.end(k))));
    ways
}

/// How many segments the [`ways`] make, in time that does not grow with their number.
fn segments(curve: &CurvePath, spacing: f64) -> usize {
    let mut count: usize = 0;
    stretches(curve, spacing, &mut |even| count = count.saturating_add(even.count));
    count
}

/// Shows the parts of a curve in which sites stand at equal distances, in their order.
fn stretches(curve: &CurvePath, spacing: f64, show: &mut impl FnMut(&Even)) {
    let whole = [0.0, curve.line.length()];
    let mut found = Vec::new();
    bent(curve, whole, spacing, &mut found);
    let count = found.iter().fold(0, |sum: usize, even| sum.saturating_add(even.count));
    if count >= curve.fewest {
        found.iter().for_each(show);
    } else {
        show(&Even::new(curve, whole, curve.fewest));
    }
}

/// A stretch of a curve in parts that are equal as measured.
struct Even<'a> {
    curve: &'a CurvePath,
    stretch: [f64; 2],
    measures: [f64; 2],
    count: usize,
}

impl<'a> Even<'a> {
    fn new(curve: &'a CurvePath, stretch: [f64; 2], count: usize) -> Self {
        Self { curve, stretch, measures: stretch.map(|way| curve.measure(way)), count }
    }

    /// The way to the end of part `k`, to the beginning of the first for 0.
    fn end(&self, k: usize) -> f64 {
        let [from, to] = self.measures;
        match k {
            0 => self.stretch[0],
            _ if k == self.count => self.stretch[1],
            _ => self.curve.way(from + (to - from) * k as f64 / self.count as f64),
        }
    }

    /// The parts with points of the curve inside, in their order.
    fn bent_parts(&self) -> impl Iterator<Item = [f64; 2]> {
        let [from, to] = self.measures;
        let mut last = 0;
        self.curve.line.ways_between(self.stretch[0], self.stretch[1]).iter().filter_map(move |way| {
            let share = (self.curve.measure(*way) - from) / (to - from);
            let mut k = ((share * self.count as f64).ceil() as usize).clamp(1, self.count);
            while k > 1 && self.end(k - 1) >= *way {
                k -= 1;
            }
            while k < self.count && self.end(k) < *way {
                k += 1;
            }
            (std::mem::replace(&mut last, k) != k).then(|| [self.end(k - 1), self.end(k)])
        })
    }
}

/// Adds a stretch, at equal distances, or if those cut off a bend, the stretches on both sides of it.
fn bent<'a>(curve: &'a CurvePath, [from, to]: [f64; 2], spacing: f64, found: &mut Vec<Even<'a>>) {
    let measured = curve.measure(to) - curve.measure(from);
    let even = Even::new(curve, [from, to], (measured / spacing).round().max(1.0) as usize);
    let cut_off = |way: f64, stray: f64| {
        let spacing = spacing * curve.size(way);
        let gap = spacing * if stray > FAR_STRAY * spacing { RAGGED_GAP } else { LEAST_GAP };
        stray > MAX_STRAY * spacing && way - from >= gap && to - way >= gap
    };
    let worst = even
        .bent_parts()
        .flat_map(|[a, b]| curve.line.strays(a, b))
        .filter(|(way, stray)| cut_off(*way, *stray))
        .reduce(|best, new| if new.1 > best.1 { new } else { best });
    match worst {
        Some((bend, _)) => {
            bent(curve, [from, bend], spacing, found);
            bent(curve, [bend, to], spacing, found);
        }
        None => found.push(even),
    }
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
