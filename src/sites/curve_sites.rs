//! Sites on the surface's curves: one at each corner, and between corners at equal distances along each
//! curve, except where that would cut off a bend.

use super::morton::morton_order;
use super::on_surface::SitesOnSurface;
use super::place::Place;
use super::surface_curves::{CurvePath, SingleEdge, SurfaceCurves};
use crate::mesh::NONE;
use glam::DVec3;
use rayon::prelude::*;

/// A site closer to a vertex than this fraction of its segment is moved onto the vertex.
const SNAP: f64 = 1e-6;

/// A bend farther from the chord than this many spacings gets a site.
const MAX_STRAY: f64 = 0.03;
/// A bend nearer than this many spacings to another bend with a site or to an end of the curve gets no site.
/// Shorter segments make slivers, and many of them, as around small holes, leave too few sites elsewhere.
const LEAST_GAP: f64 = 0.5;
/// For a bend farther from the chord than this many spacings, as in a notch, [`NOTCH_GAP`] replaces
/// [`LEAST_GAP`].
const FAR_STRAY: f64 = 0.15;
/// The smaller gap, in spacings, that bends beyond [`FAR_STRAY`] must keep.
const NOTCH_GAP: f64 = 0.25;
/// If segments cut off bends in at least this share of a stretch, it is an arc, and all become shorter.
const ARC: f64 = 0.75;
/// How far an arc may be from its chords, in spacings, as long as these are not shorter than [`ARC_GAP`].
const ARC_STRAY: f64 = 0.05;
/// The shortest chords of an arc, in spacings.
const ARC_GAP: f64 = 0.6;
/// Where more than two sheets meet, a bend may be this many times farther from the chord: borders of labels
/// are round, and sites at all their bends would leave too few for the sheets.
const AT_JUNCTIONS: f64 = 4.0;
/// Fewer curves than this are counted by one thread.
const FEW: usize = 256;

/// A point on a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePosition {
    /// The curve; [`NONE`] at a corner and at a point of the user's.
    pub curve: u32,
    /// Arc length from the curve's beginning; 0 at a corner.
    pub arc_length: f64,
}

/// The sites on all curves for one spacing. They do not move before the polish.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CurveSites {
    /// Positions on the surface's edges and vertices: the corners in order, then curve after curve, then the
    /// user's points.
    pub positions: Vec<DVec3>,
    /// The edge or vertex of the surface that each is on.
    pub places: Vec<Place>,
    /// Where each is on its curve.
    pub curve_positions: Vec<CurvePosition>,
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
    /// Sides of the segments: one for each triangle that will be at a segment.
    pub sides: usize,
}

impl CurveCounts {
    fn plus(self, other: Self) -> Self {
        Self {
            sites: self.sites.saturating_add(other.sites),
            segments: self.segments.saturating_add(other.segments),
            sides: self.sides.saturating_add(other.sides),
        }
    }
}

impl SurfaceCurves {
    /// The counts of [`SurfaceCurves::sites`] at this spacing.
    pub fn count(&self, spacing: f64) -> CurveCounts {
        let of_curve = |number: &u32| {
            let curve = &self.curves[*number as usize];
            let segments = segments(curve, spacing);
            let sides = curve.sides.saturating_mul(segments);
            CurveCounts { sites: inner_sites(curve, segments), segments, sides }
        };
        let of_edge = |edge: &SingleEdge| {
            let segments = even_segments(edge.measure, spacing).max(edge.fewest as usize);
            let sides = (edge.sides as usize).saturating_mul(segments);
            CurveCounts { sites: segments - 1, segments, sides }
        };
        let corners = CurveCounts { sites: self.corners.len(), ..Default::default() };
        let bent = self.with_bends.par_iter().with_min_len(FEW).map(of_curve);
        let single = self.single_edges.par_iter().with_min_len(64 * FEW).map(of_edge);
        let [bent, single] = [
            bent.reduce(CurveCounts::default, CurveCounts::plus),
            single.reduce(CurveCounts::default, CurveCounts::plus),
        ];
        bent.plus(single).plus(corners)
    }

    /// The sites on each curve at this spacing, corners not included.
    pub fn counts_by_curve(&self, spacing: f64) -> Vec<usize> {
        self.curves.iter().map(|curve| inner_sites(curve, segments(curve, spacing))).collect()
    }

    /// The corners, and on each curve sites at its bends and between them at equal distances close to
    /// `spacing`.
    pub fn sites(&self, spacing: f64) -> CurveSites {
        let mut sites = CurveSites::default();
        for (k, corner) in self.corners.iter().enumerate() {
            sites.positions.push(self.vertices[*corner as usize]);
            sites.places.push(Place::Vertex(*corner));
            sites.curve_positions.push(CurvePosition { curve: NONE, arc_length: 0.0 });
            sites.sizes.push(self.corner_size(k));
        }
        for (number, curve) in (0..).zip(&self.curves) {
            self.place_along(number, curve, &arc_lengths(curve, spacing), &mut sites);
        }
        sites
    }

    /// Those, and the user's points behind them.
    pub fn sites_and_points(&self, spacing: f64) -> CurveSites {
        let mut sites = self.sites(spacing);
        for (k, point) in self.points.iter().enumerate() {
            sites.positions.push(self.vertices[*point as usize]);
            sites.places.push(Place::Vertex(*point));
            sites.curve_positions.push(CurvePosition { curve: NONE, arc_length: 0.0 });
            sites.sizes.push(self.point_size(k));
        }
        sites
    }

    /// Adds the inner sites of a curve at these arc lengths, and the segments between all of them.
    fn place_along(&self, number: u32, curve: &CurvePath, arc_lengths: &[f64], sites: &mut CurveSites) {
        let corner = |v: Option<&u32>| {
            v.and_then(|v| self.corners.binary_search(v).ok()).map_or(NONE, |place| place as u32)
        };
        let begin = sites.positions.len() as u32;
        let (segments, closed) = (arc_lengths.len() - 1, curve.line.is_closed());
        let inner = &arc_lengths[usize::from(!closed)..segments];
        for &arc_length in inner {
            let (position, place) = self.at(curve, arc_length, SNAP * curve.line.length() / segments as f64);
            sites.positions.push(position);
            sites.places.push(place);
            sites.curve_positions.push(CurvePosition { curve: number, arc_length });
            sites.sizes.push(curve.size(arc_length));
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

    /// The point at an arc length, moved onto a vertex that is within `snap`.
    fn at(&self, curve: &CurvePath, arc_length: f64, snap: f64) -> (DVec3, Place) {
        let (edge, [from, to]) = curve.line.edge(arc_length);
        let [a, b] = [edge, edge + 1].map(|k| curve.vertices[k]);
        let [p, q] = [a, b].map(|v| self.vertices[v as usize]);
        if arc_length - from <= snap {
            return (p, Place::Vertex(a));
        }
        if to - arc_length <= snap {
            return (q, Place::Vertex(b));
        }
        // Every curve edge has a half-edge.
        let half = self.half_edges(a, b).first().copied().unwrap_or(0);
        (p.lerp(q, (arc_length - from) / (to - from)), Place::Edge(half / 3, (half % 3) as u8))
    }
}

/// The number of segments close to `spacing` on a stretch of this measure.
fn even_segments(measure: f64, spacing: f64) -> usize {
    let ratio = measure / spacing;
    // Most short stretches are one segment, and rounding is slow without the instruction for it.
    if ratio < 1.5 { 1 } else { ratio.round().max(1.0) as usize }
}

/// Sites between this many segments of a curve, except for corners at its ends.
fn inner_sites(curve: &CurvePath, segments: usize) -> usize {
    if curve.line.is_closed() { segments } else { segments - 1 }
}

/// Arc lengths of the sites on a curve, from its beginning to its end, both included.
fn arc_lengths(curve: &CurvePath, spacing: f64) -> Vec<f64> {
    let mut arc_lengths = vec![0.0];
    for_each_stretch(curve, spacing, &mut |even| arc_lengths.extend((1..=even.count).map(|k| even.end(k))));
    arc_lengths
}

/// Number of segments between the [`arc_lengths`], in constant time.
fn segments(curve: &CurvePath, spacing: f64) -> usize {
    let mut count: usize = 0;
    for_each_stretch(curve, spacing, &mut |even| count = count.saturating_add(even.count));
    count
}

/// Calls `visit` for the stretches of a curve in which sites have equal distances, in order.
fn for_each_stretch(curve: &CurvePath, spacing: f64, visit: &mut impl FnMut(&EvenStretch)) {
    let whole = [0.0, curve.line.length()];
    if curve.is_whole {
        return visit(&EvenStretch::new(curve, whole, 1));
    }
    let mut stretches = Vec::new();
    let [from, to] = curve.between_cusps(spacing);
    if from > whole[0] {
        stretches.push(EvenStretch::new(curve, [whole[0], from], 1));
    }
    split_at_bends(curve, [from, to], spacing, &mut stretches);
    if to < whole[1] {
        stretches.push(EvenStretch::new(curve, [to, whole[1]], 1));
    }
    let count = stretches.iter().fold(0, |sum: usize, even| sum.saturating_add(even.count));
    if count >= curve.fewest {
        stretches.iter().for_each(visit);
    } else {
        visit(&EvenStretch::new(curve, whole, curve.fewest));
    }
}

/// A stretch of a curve, divided into segments of equal measure.
struct EvenStretch<'a> {
    curve: &'a CurvePath,
    stretch: [f64; 2],
    measures: [f64; 2],
    count: usize,
}

impl<'a> EvenStretch<'a> {
    fn new(curve: &'a CurvePath, stretch: [f64; 2], count: usize) -> Self {
        Self { curve, stretch, measures: stretch.map(|arc_length| curve.measure(arc_length)), count }
    }

    /// Arc length of the end of segment `k`, counted from 1; for 0 of the beginning of the first.
    fn end(&self, k: usize) -> f64 {
        let [from, to] = self.measures;
        match k {
            0 => self.stretch[0],
            _ if k == self.count => self.stretch[1],
            _ => self.curve.arc_length(from + (to - from) * k as f64 / self.count as f64),
        }
    }

    /// The segments with vertices of the curve inside, in order.
    fn bent_segments(&self) -> impl Iterator<Item = [f64; 2]> {
        let [from, to] = self.measures;
        let mut last = 0;
        self.curve.line.arc_lengths_between(self.stretch[0], self.stretch[1]).iter().filter_map(
            move |arc_length| {
                let share = (self.curve.measure(*arc_length) - from) / (to - from);
                let mut k = ((share * self.count as f64).ceil() as usize).clamp(1, self.count);
                while k > 1 && self.end(k - 1) >= *arc_length {
                    k -= 1;
                }
                while k < self.count && self.end(k) < *arc_length {
                    k += 1;
                }
                (std::mem::replace(&mut last, k) != k).then(|| [self.end(k - 1), self.end(k)])
            },
        )
    }
}

/// Adds an even stretch. If that cuts off bends nearly everywhere, as on an arc, it is finer; if it does in
/// places, it ends at the worst bend, and another begins there.
fn split_at_bends<'a>(
    curve: &'a CurvePath,
    [from, to]: [f64; 2],
    spacing: f64,
    stretches: &mut Vec<EvenStretch<'a>>,
) {
    let measured = curve.measure(to) - curve.measure(from);
    let even = EvenStretch::new(curve, [from, to], even_segments(measured, spacing));
    let junctions = if curve.sides > 2 { AT_JUNCTIONS } else { 1.0 };
    // In spacings.
    let stray_at = |(arc_length, stray): (f64, f64)| {
        (arc_length, stray / (spacing * curve.size(arc_length) * junctions))
    };
    let (mut worst, mut cut): (Option<(f64, f64)>, usize) = (None, 0);
    let mut largest = 0.0_f64;
    for [a, b] in even.bent_segments() {
        let mut most = 0.0_f64;
        for (arc_length, stray) in curve.line.deviations(a, b).map(stray_at) {
            most = most.max(stray);
            let gap = (arc_length - from).min(to - arc_length) / (spacing * curve.size(arc_length));
            let least = if stray > FAR_STRAY { NOTCH_GAP } else { LEAST_GAP };
            let counts = stray > MAX_STRAY && gap >= least;
            if counts && worst.is_none_or(|(_, worst)| stray > worst) {
                worst = Some((arc_length, stray));
            }
        }
        cut += usize::from(most > MAX_STRAY);
        largest = largest.max(most);
    }
    if even.count > 1 && cut as f64 >= ARC * even.count as f64 && largest <= FAR_STRAY {
        // The distance of a chord goes with the square of its length.
        let finer = even.count as f64 * (largest / ARC_STRAY).sqrt();
        let most = (measured / (ARC_GAP * spacing)).floor();
        let count = (finer.ceil().min(most) as usize).max(even.count);
        stretches.push(EvenStretch::new(curve, [from, to], count));
        return;
    }
    match worst {
        Some((bend, _)) => {
            split_at_bends(curve, [from, bend], spacing, stretches);
            split_at_bends(curve, [bend, to], spacing, stretches);
        }
        None => stretches.push(even),
    }
}

impl CurveSites {
    /// These and the `interior` sites together in Morton order, and for each its index among these, [`NONE`]
    /// for an interior one. A curve site gets one of the triangles at its place.
    pub fn merge(&self, curves: &SurfaceCurves, interior: SitesOnSurface) -> (SitesOnSurface, Vec<u32>) {
        let first = interior.len();
        let mut sites = interior;
        sites.positions.extend_from_slice(&self.positions);
        sites
            .triangles
            .extend(self.places.iter().map(|place| curves.around(*place).first().copied().unwrap_or(0)));
        let order = morton_order(&sites.positions);
        let curve_site = |i: u32| (i as usize).checked_sub(first).map_or(NONE, |c| c as u32);
        let pins = order.iter().map(|i| curve_site(*i)).collect();
        (sites.select(&order), pins)
    }
}
