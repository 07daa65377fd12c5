//! The surface's features in the form that sites need: curves as polylines of its edges, and the triangles at
//! each edge.

use super::cusps;
use super::place::Place;
use crate::mesh::csr::{Csr, triangles_around};
use crate::mesh::features::{Curve, CurveKind, Features};
use crate::mesh::half_edges::{EdgeTable, edge_key};
use crate::mesh::polyline::Polyline;
use crate::mesh::sizing::{EVEN, SizeField, mean_inverse};
use crate::mesh::triangle::angle_at_first;
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// Curves, corners and patches over the vertices and triangles of a surface.
#[derive(Clone)]
pub struct SurfaceCurves {
    pub(crate) curves: Vec<CurvePath>,
    /// The curves of one edge.
    pub(crate) single_edges: Vec<SingleEdge>,
    /// The other curves, which may have bends.
    pub(crate) with_bends: Vec<u32>,
    pub(crate) corners: Vec<u32>,
    /// Corners on no curve that are there only because the user marked them; not among the others.
    pub(crate) points: Vec<u32>,
    /// The curves of all levels but the finest, if these are others.
    coarse: Option<Box<Self>>,
    /// Where edge lengths differ: that at each of the points.
    point_sizes: Vec<f64>,
    /// Corners that are there only because the user marked them: curves go on there.
    pub(crate) user_corners: Vec<u32>,
    /// Where edge lengths differ: that at each corner.
    corner_sizes: Vec<f64>,
    /// The patch of each triangle.
    pub patches: Vec<u32>,
    /// Whether each half-edge, `3 * triangle + side`, is on a curve.
    pub on_curve: Vec<bool>,
    /// Half-edges of each curve edge, by its vertices, the smaller one first.
    half_edges: HashMap<(u32, u32), Vec<u32>>,
    pub(crate) vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    star: Csr,
}

/// One curve from its first vertex to its last.
#[derive(Clone)]
pub(crate) struct CurvePath {
    /// A closed curve ends with its first vertex.
    pub vertices: Vec<u32>,
    /// The vertices' positions as a polyline.
    pub line: Polyline,
    /// Triangles at each of its edges: 1 at a boundary, 2 at a crease.
    pub sides: usize,
    /// Fewest segments that do not double an edge.
    pub fewest: usize,
    /// Whether it is one segment, whatever its length.
    pub is_whole: bool,
    /// The arc length from either end until the curves at a cusp there have opened; 0 if there is none.
    pub opened: [f64; 2],
    /// Where edge lengths differ: that at each point.
    pub sizes: Vec<f64>,
    /// Their [measures](CurvePath::measure).
    pub measured: Vec<f64>,
}

/// What decides the number of sites on a curve of one edge. Borders of labels may be hundreds of thousands of
/// such curves, and sites are counted at a thousand spacings.
#[derive(Clone)]
pub(crate) struct SingleEdge {
    /// The [measure](CurvePath::measure) of the whole curve.
    pub measure: f64,
    /// As for [`CurvePath`].
    pub sides: u32,
    /// As for [`CurvePath`].
    pub fewest: u32,
}

impl CurvePath {
    /// The edge length at an arc length, relative to the spacing.
    pub fn size(&self, arc_length: f64) -> f64 {
        if self.sizes.is_empty() {
            return 1.0;
        }
        let (edge, [from, to]) = self.line.edge(arc_length);
        let share = ((arc_length - from) / (to - from).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        self.sizes[edge] + share * (self.sizes[edge + 1] - self.sizes[edge])
    }

    /// The arc length weighted by the inverse of the sizes: proportional to the number of edges up to there,
    /// and the arc length itself where all sizes are 1.
    pub fn measure(&self, arc_length: f64) -> f64 {
        if self.sizes.is_empty() {
            return arc_length;
        }
        let (edge, [from, _]) = self.line.edge(arc_length);
        self.measured[edge] + (arc_length - from) * mean_inverse(self.sizes[edge], self.size(arc_length))
    }

    /// The arc length at a measure.
    pub fn arc_length(&self, measure: f64) -> f64 {
        if self.sizes.is_empty() {
            return measure;
        }
        let last = self.measured.len() - 1;
        let edge = self.measured.partition_point(|m| *m <= measure).clamp(1, last) - 1;
        let [from, to] = [edge, edge + 1].map(|k| self.line.arc_length_at(k));
        let (a, b) = (self.sizes[edge], self.sizes[edge + 1]);
        let (rest, length) = ((measure - self.measured[edge]).max(0.0), to - from);
        // The inverse of `measure`: the length grows by a constant share.
        let slope = (b - a) / length.max(f64::MIN_POSITIVE);
        let on =
            if (b - a).abs() < EVEN * a { rest * 0.5 * (a + b) } else { a * (slope * rest).exp_m1() / slope };
        from + on.clamp(0.0, length)
    }
}

impl SurfaceCurves {
    /// From the `features` of the mesh of these vertices and triangles; `None` if there are no curves and
    /// corners. Panics if they are of another mesh.
    pub fn new(vertices: &[DVec3], triangles: &[[u32; 3]], features: &Features) -> Option<Self> {
        if features.curves.is_empty() && features.corners.is_empty() {
            return None;
        }
        let mut half_edges: HashMap<(u32, u32), Vec<u32>> = HashMap::new();
        let polylines: Vec<Vec<u32>> = features
            .curves
            .iter()
            .map(|curve| {
                let again = curve.vertices.first().filter(|_| curve.closed);
                curve.vertices.iter().chain(again).copied().collect()
            })
            .collect();
        for polyline in &polylines {
            half_edges.extend(polyline.windows(2).map(|pair| (edge_key(pair[0], pair[1]), Vec::new())));
        }
        let mut on_curve = vec![false; 3 * triangles.len()];
        for edge in EdgeTable::new(triangles).edges() {
            if let Some(sides) = half_edges.get_mut(&edge[0].ends()) {
                sides.extend(edge.iter().map(|side| side.corners().0 as u32));
                sides.iter().for_each(|half| on_curve[*half as usize] = true);
            }
        }
        let star = triangles_around(vertices.len(), triangles);
        let ends: HashSet<u32> = half_edges.keys().flat_map(|(a, b)| [*a, *b]).collect();
        let is_point = |v: &u32| features.user_corners.binary_search(v).is_ok() && !ends.contains(v);
        let (points, corners) = features.corners.iter().copied().partition(is_point);
        let mut curves = Self {
            curves: Vec::new(),
            single_edges: Vec::new(),
            with_bends: Vec::new(),
            corners,
            points,
            coarse: None,
            point_sizes: Vec::new(),
            user_corners: features.user_corners.clone(),
            corner_sizes: Vec::new(),
            patches: features.patches.clone(),
            on_curve,
            half_edges,
            vertices: vertices.to_vec(),
            triangles: triangles.to_vec(),
            star,
        };
        curves.curves = (polylines.into_iter().zip(&features.curves))
            .map(|(polyline, curve)| curves.path(polyline, curve))
            .collect();
        curves.curves.iter_mut().zip(&features.whole).for_each(|(path, whole)| path.is_whole = *whole);
        curves.forbid_doubled_edges();
        curves.keep_slits_open();
        cusps::find(&mut curves.curves, vertices);
        curves.list_single_edges();
        Some(curves)
    }

    /// With other curves for coarser levels than the finest.
    #[must_use]
    pub(crate) fn with_coarse(self, coarse: Option<Self>) -> Self {
        Self { coarse: coarse.map(Box::new), ..self }
    }

    /// The curves of all levels but the finest.
    pub(crate) fn coarse(&self) -> &Self {
        self.coarse.as_deref().unwrap_or(self)
    }

    /// How many curves there are.
    pub fn curve_count(&self) -> usize {
        self.curves.len()
    }

    /// How many corners there are.
    pub fn corner_count(&self) -> usize {
        self.corners.len()
    }

    /// Lengths of the curves, measured by the edge lengths along them.
    pub fn lengths(&self) -> impl Iterator<Item = f64> {
        self.curves.iter().map(|path| path.measure(path.line.length()))
    }

    /// With the edge lengths of this field over the same surface.
    #[must_use]
    pub fn with_sizes(mut self, field: &SizeField) -> Self {
        if field.is_uniform() {
            return self;
        }
        self.coarse = self.coarse.map(|coarse| Box::new(coarse.with_sizes(field)));
        for path in &mut self.curves {
            path.sizes = path.vertices.iter().map(|v| field.at_vertex(*v)).collect();
            let mut measure = 0.0;
            let steps = (1..path.vertices.len()).map(|k| {
                let length = path.line.arc_length_at(k) - path.line.arc_length_at(k - 1);
                measure += length * mean_inverse(path.sizes[k - 1], path.sizes[k]);
                measure
            });
            path.measured = std::iter::once(0.0).chain(steps).collect();
        }
        self.point_sizes = self.points.iter().map(|v| field.at_vertex(*v)).collect();
        self.corner_sizes = self.corners.iter().map(|v| field.at_vertex(*v)).collect();
        self.list_single_edges();
        self
    }

    /// The edge length at point `point`, relative to the spacing.
    pub(crate) fn point_size(&self, point: usize) -> f64 {
        self.point_sizes.get(point).copied().unwrap_or(1.0)
    }

    /// The edge length at corner `corner`, relative to the spacing.
    pub(crate) fn corner_size(&self, corner: usize) -> f64 {
        self.corner_sizes.get(corner).copied().unwrap_or(1.0)
    }

    /// The curves in order.
    pub fn polylines(&self) -> impl Iterator<Item = &Polyline> {
        self.curves.iter().map(|path| &path.line)
    }

    /// The vertices of each curve from its first to its last, which is the first if it is closed.
    pub fn vertices(&self) -> impl Iterator<Item = &[u32]> {
        self.curves.iter().map(|path| path.vertices.as_slice())
    }

    fn path(&self, vertices: Vec<u32>, curve: &Curve) -> CurvePath {
        let points = vertices.iter().map(|v| self.vertices[*v as usize]).collect();
        let line = Polyline::new(points, curve.closed).drawn(curve.kind == CurveKind::User);
        let sides = vertices.get(..2).map_or(0, |pair| self.half_edges(pair[0], pair[1]).len());
        let loops = vertices.first() == vertices.last();
        CurvePath {
            vertices,
            line,
            sides,
            fewest: if loops { 3 } else { 1 },
            is_whole: false,
            opened: [0.0; 2],
            sizes: Vec::new(),
            measured: Vec::new(),
        }
    }

    /// A curve with no other at either end, such as a short line of the user's, gets a site in between: with
    /// the two ends alone, no cell has it on its left and on its right.
    fn keep_slits_open(&mut self) {
        let mut ends: HashMap<u32, u32> = HashMap::new();
        let of = |path: &CurvePath| [path.vertices.first().copied(), path.vertices.last().copied()];
        self.curves.iter().flat_map(of).flatten().for_each(|v| *ends.entry(v).or_default() += 1);
        for path in self.curves.iter_mut().filter(|path| !path.is_whole) {
            if of(path).into_iter().flatten().all(|v| ends[&v] == 1) {
                path.fewest = path.fewest.max(2);
            }
        }
    }

    /// Curves between the same two corners get a site in between: two edges between them would be one.
    fn forbid_doubled_edges(&mut self) {
        let key = |path: &CurvePath| {
            let (first, last) = (path.vertices.first().copied(), path.vertices.last().copied());
            (first.min(last), first.max(last))
        };
        let mut count: HashMap<_, u32> = HashMap::new();
        self.curves.iter().for_each(|path| *count.entry(key(path)).or_default() += 1);
        for path in self.curves.iter_mut().filter(|path| !path.is_whole) {
            if count[&key(path)] > 1 {
                path.fewest = path.fewest.max(2);
            }
        }
    }

    fn list_single_edges(&mut self) {
        self.single_edges.clear();
        self.with_bends.clear();
        for (number, path) in (0..).zip(&self.curves) {
            if path.line.is_closed() || path.line.bends() > 0 || path.opened != [0.0; 2] {
                self.with_bends.push(number);
            } else {
                let length = path.measure(path.line.length()) - path.measure(0.0);
                // Too short for more than one segment.
                let measure = if path.is_whole { 0.0 } else { length };
                let (sides, fewest) = (path.sides as u32, path.fewest as u32);
                self.single_edges.push(SingleEdge { measure, sides, fewest });
            }
        }
    }

    /// The half-edges on the edge of two vertices; none if it is not on a curve.
    pub(crate) fn half_edges(&self, a: u32, b: u32) -> &[u32] {
        self.half_edges.get(&edge_key(a, b)).map_or(&[], Vec::as_slice)
    }

    /// The triangles at a place, rising.
    pub fn around(&self, place: Place) -> Vec<u32> {
        match place {
            Place::Inside(t) => vec![t],
            Place::Edge(t, side) => {
                let corners = self.triangles[t as usize];
                let side = usize::from(side);
                let mut list: Vec<u32> =
                    self.half_edges(corners[side], corners[(side + 1) % 3]).iter().map(|h| h / 3).collect();
                if list.is_empty() {
                    list.push(t);
                }
                list.sort_unstable();
                list
            }
            Place::Vertex(v) => self.star.of(v).to_vec(),
        }
    }

    /// The corners of a triangle.
    pub fn corners_of(&self, t: u32) -> [DVec3; 3] {
        self.triangles[t as usize].map(|v| self.vertices[v as usize])
    }

    /// The angle at the place in one of its triangles, in radians; 1 on an edge.
    pub(crate) fn angle_at(&self, place: Place, t: u32) -> f64 {
        let Place::Vertex(v) = place else { return 1.0 };
        let k = self.triangles[t as usize].iter().position(|w| *w == v).unwrap_or(0);
        let corners = self.corners_of(t);
        let [p, q, r] = [k, (k + 1) % 3, (k + 2) % 3].map(|c| corners[c]);
        angle_at_first([p, q, r])
    }
}
