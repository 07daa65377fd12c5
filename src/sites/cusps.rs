//! Cusps: corners that two curves leave in nearly the same direction, as at the tip where a fillet runs out.
//! The shorter the first segments there, the smaller the angle between them.

use std::collections::HashMap;

use super::surface_curves::CurvePath;
use crate::mesh::polyline::Polyline;
use glam::DVec3;

/// Curves with a larger angle between them, in degrees, as seen from their corner, have opened.
const OPEN: f64 = 22.0;
/// First segments are at most this many spacings long.
const LONGEST: f64 = 1.6;
/// Curves that take more spacings to open are a wedge: longer segments help little there.
const WEDGE: f64 = 2.4;
/// Curves that open within fewer spacings need no such segments: those of arcs are at least as long.
const SHORTEST: f64 = 0.6;
/// A bend farther from a first segment than this many spacings, as in a notch, forbids it. An arc that opens
/// over [`LONGEST`] is nearly as far from it.
const MAX_STRAY: f64 = 0.16;

/// At corners of more curves, as at the apex of a cone of facets, no cusps are looked for: all pairs would
/// take too long.
const MOST_CURVES: usize = 16;

/// One end of a curve.
#[derive(Clone, Copy)]
struct End<'a> {
    line: &'a Polyline,
    is_last: bool,
}

impl End<'_> {
    /// The point at this distance along the curve from the end.
    fn at(&self, distance: f64) -> DVec3 {
        self.line.at(if self.is_last { self.line.length() - distance } else { distance }).0
    }

    /// The length of the edge at the end.
    fn first_edge(&self) -> f64 {
        let length = self.line.length();
        let [from, to] = self.line.edge(if self.is_last { length } else { 0.0 }).1;
        to - from
    }

    /// Distances of the curve's vertices from the end, ascending.
    fn vertices(&self) -> Vec<f64> {
        let length = self.line.length();
        let mut found = self.line.arc_lengths_between(0.0, length).to_vec();
        if self.is_last {
            found.reverse();
            found.iter_mut().for_each(|arc_length| *arc_length = length - *arc_length);
        }
        found
    }
}

/// Along both curves from their corner, how far they go until they have opened; `None` if they do so at once,
/// or never.
fn opened(corner: DVec3, ends: [End; 2]) -> Option<f64> {
    let most = ends[0].line.length().min(ends[1].line.length());
    let is_open = |distance: f64| {
        let [p, q] = ends.map(|end| end.at(distance) - corner);
        p.angle_between(q).to_degrees() >= OPEN
    };
    // Mostly they open at once.
    if is_open(ends.iter().map(End::first_edge).fold(most, f64::min)) {
        return None;
    }
    let mut distances = [ends[0].vertices(), ends[1].vertices()].concat();
    distances.retain(|distance| *distance <= most);
    distances.push(most);
    distances.sort_unstable_by(f64::total_cmp);
    distances.into_iter().find(|distance| is_open(*distance))
}

/// Finds the cusps among curves over these vertices.
pub(super) fn find(curves: &mut [CurvePath], vertices: &[DVec3]) {
    let mut at: HashMap<u32, Vec<(usize, bool)>> = HashMap::new();
    for (number, path) in curves.iter().enumerate().filter(|(_, path)| !path.line.is_closed()) {
        for (v, is_last) in [(path.vertices.first(), false), (path.vertices.last(), true)] {
            v.into_iter().for_each(|v| at.entry(*v).or_default().push((number, is_last)));
        }
    }
    let mut found = Vec::new();
    for (corner, ends) in at.iter().filter(|(_, ends)| ends.len() <= MOST_CURVES) {
        for (k, one) in ends.iter().enumerate() {
            for other in &ends[..k] {
                let pair =
                    [*one, *other].map(|(number, is_last)| End { line: &curves[number].line, is_last });
                let distance = opened(vertices[*corner as usize], pair);
                found
                    .extend(distance.into_iter().flat_map(|distance| [(*one, distance), (*other, distance)]));
            }
        }
    }
    for ((number, is_last), distance) in found {
        let opened = &mut curves[number].opened[usize::from(is_last)];
        *opened = opened.max(distance);
    }
}

impl CurvePath {
    /// The stretch between the segments at its cusps. Each of these is one segment that ends where the curves
    /// have opened, at most [`LONGEST`] spacings away.
    pub fn between_cusps(&self, spacing: f64) -> [f64; 2] {
        let length = self.line.length();
        let [first, last] = self.opened;
        let single = |opened: f64, at: f64| {
            let spacing = spacing * self.size(at);
            let counts = (SHORTEST * spacing..=WEDGE * spacing).contains(&opened);
            counts.then(|| (opened.min(LONGEST * spacing), MAX_STRAY * spacing))
        };
        let strays = |from: f64, to: f64| self.line.deviation(from, to);
        let from = single(first, first)
            .filter(|(long, most)| strays(0.0, *long) <= *most)
            .map_or(0.0, |(long, _)| long);
        let to = single(last, length - last)
            .filter(|(long, most)| strays(length - long, length) <= *most)
            .map_or(length, |(long, _)| length - long);
        // What is left must be a segment, too.
        if to - from >= SHORTEST * spacing * self.size(0.5 * (from + to)) {
            [from, to]
        } else {
            [0.0, length]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line from the origin along x, and an arc of radius 1 that leaves it there.
    fn line_and_arc() -> [Polyline; 2] {
        let arc = (0..=18).map(|k| 5.0 * f64::from(k)).map(|degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            DVec3::new(sin, 1.0 - cos, 0.0)
        });
        [vec![DVec3::ZERO, 3.0 * DVec3::X], arc.collect()].map(|points| Polyline::new(points, false))
    }

    fn opened_at_first_ends(lines: [&Polyline; 2]) -> Option<f64> {
        opened(DVec3::ZERO, lines.map(|line| End { line, is_last: false }))
    }

    #[test]
    fn an_arc_and_its_tangent_open_with_the_length() {
        let [line, arc] = line_and_arc();
        // The chord of an arc turns by half as much, and each edge of it by 5 degrees.
        let expected = (2.0 * OPEN).to_radians();
        let found = opened_at_first_ends([&line, &arc]).unwrap();
        assert!((expected..expected + 6f64.to_radians()).contains(&found), "{found} {expected}");
        let back = Polyline::new(vec![3.0 * DVec3::X, DVec3::ZERO], false);
        let ends = [End { line: &arc, is_last: false }, End { line: &back, is_last: true }];
        assert_eq!(opened(DVec3::ZERO, ends), Some(found));
    }

    #[test]
    fn wedges_and_wide_corners_are_no_cusps() {
        let [line, _] = line_and_arc();
        for degrees in [10.0, 60.0_f64] {
            let side = DVec3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0);
            let other = Polyline::new(vec![DVec3::ZERO, side, 2.0 * side], false);
            assert_eq!(opened_at_first_ends([&line, &other]), None);
        }
    }

    #[test]
    fn the_segment_at_a_cusp_is_as_long_as_it_opens() {
        let path = |opened: [f64; 2]| CurvePath {
            vertices: vec![0, 1],
            line: Polyline::new(vec![DVec3::ZERO, 10.0 * DVec3::X], false),
            sides: 2,
            fewest: 1,
            is_whole: false,
            opened,
            sizes: Vec::new(),
            measured: Vec::new(),
        };
        assert_eq!(path([1.2, 0.9]).between_cusps(1.0), [1.2, 9.1]);
        assert_eq!(path([2.0, 0.0]).between_cusps(1.0), [1.6, 10.0]);
        // Already long enough, a wedge, and nothing left between two.
        assert_eq!(path([0.5, 2.5]).between_cusps(1.0), [0.0, 10.0]);
        assert_eq!(path([6.0, 6.0]).between_cusps(5.0), [0.0, 10.0]);
        // The bend of a notch stays.
        let notch = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::new(9.0, 1.0, 0.0)];
        let bent = CurvePath { line: Polyline::new(notch.to_vec(), false), ..path([1.4, 0.0]) };
        assert_eq!(bent.between_cusps(1.0), [0.0, 10.0]);
    }
}
