//! Polygons of mesh files, which become triangles.
//!
//! Readers split each into a fan around its first corner, which is right where the polygon is convex. Where
//! triangles of the fan face different ways, [`Fans::unfold`] splits the polygon by the constrained Delaunay
//! triangulation of its corners, seen along its normal, that `spade` makes.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use spade::handles::FixedFaceHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use crate::TriMesh;
use crate::grammar::counted;
use crate::mesh::attributes::CornerUv;

/// A triangle of a fan is turned or without an area if it faces the polygon's normal by less than this share
/// of the polygon's area.
const LEAST_SHARE: f64 = 1e-12;
/// Relative difference of areas that rounding explains.
const ROUNDING: f64 = 1e-9;
/// Below this share of a polygon's extent, coordinates are 0: `spade` refuses the smallest numbers.
const TINY: f64 = 1e-100;

/// Which triangles of a mesh are fans, each one polygon with more than three corners.
#[derive(Debug, Default)]
pub(crate) struct Fans {
    /// The first triangle and the number of corners.
    polygons: Vec<(usize, usize)>,
}

impl Fans {
    /// Adds a face with this number of corners, of which `first` is the first triangle; those with three
    /// corners are no fans.
    pub(crate) fn add(&mut self, first: usize, corners: usize) {
        if corners > 3 {
            self.polygons.push((first, corners));
        }
    }

    /// Removes all polygons.
    pub(crate) fn clear(&mut self) {
        self.polygons.clear();
    }

    /// The fan of a face with these corners.
    pub(crate) fn triangles<T: Copy>(corners: &[T]) -> impl Iterator<Item = [T; 3]> {
        let pairs = corners.get(1..).unwrap_or_default().windows(2);
        let first = corners.first().copied();
        pairs.filter_map(move |pair| Some([first?, *pair.first()?, *pair.get(1)?]))
    }

    /// How many polygons there are.
    pub(crate) fn count(&self) -> u64 {
        self.polygons.len() as u64
    }

    /// A note on the polygons that were split, if there were any.
    pub(crate) fn note(&self) -> Option<String> {
        let was_split = ["face with more than 3 vertices was", "faces with more than 3 vertices were"];
        (self.count() > 0).then(|| format!("{} split into triangles", counted(self.count(), was_split)))
    }

    /// Splits polygons of which fans are folded in another way. A polygon that crosses itself keeps its fan.
    pub(crate) fn unfold(&self, mesh: &mut TriMesh, mut uv: Option<&mut CornerUv>) {
        for &(first, count) in &self.polygons {
            let Some(fan) = mesh.triangles.get(first..first + count - 2) else { continue };
            let corners = corners_of(fan);
            let at = |corner: &u32| mesh.vertices.get(*corner as usize).copied().unwrap_or_default();
            let points: Vec<DVec3> = corners.iter().map(at).collect();
            let Some(split) = folded_normal(&points).and_then(|normal| split(&seen_along(&points, normal)))
            else {
                continue;
            };
            let numbers = first..first + count - 2;
            write_over(&mut mesh.triangles, numbers.clone(), &corners, &split);
            if let Some(uv) = &mut uv {
                let (triples, _) = uv.values.as_chunks_mut::<3>();
                let Some(fan) = triples.get(numbers.clone()) else { continue };
                let values = corners_of(fan);
                write_over(triples, numbers, &values, &split);
            }
        }
    }
}

/// A note on the faces that are none, if there were any.
pub(crate) fn short_faces_note(count: u64) -> Option<String> {
    let faces = ["face with fewer than 3 vertices was", "faces with fewer than 3 vertices were"];
    (count > 0).then(|| format!("{} ignored", counted(count, faces)))
}

/// The corners of a polygon, in order, by the triangles of its fan.
fn corners_of<T: Copy>(fan: &[[T; 3]]) -> Vec<T> {
    let first = fan.first().into_iter().flat_map(|[first, second, _]| [*first, *second]);
    first.chain(fan.iter().map(|[.., last]| *last)).collect()
}

fn write_over<T: Copy>(
    list: &mut [[T; 3]],
    numbers: std::ops::Range<usize>,
    corners: &[T],
    split: &[[usize; 3]],
) {
    for (triangle, local) in list.iter_mut().skip(numbers.start).zip(split) {
        *triangle = local.map(|corner| corners[corner]);
    }
}

/// The normal of a polygon, twice as long as its area, if a triangle of its fan does not face the same way.
fn folded_normal(points: &[DVec3]) -> Option<DVec3> {
    let scale = scale_of(points)?;
    let normals = || Fans::triangles(points).map(|[a, b, c]| ((b - a) * scale).cross((c - a) * scale));
    let normal: DVec3 = normals().sum();
    let least = LEAST_SHARE * normal.length_squared();
    (least > 0.0 && normals().any(|own| own.dot(normal) <= least)).then_some(normal)
}

/// What brings the extent of some points into the range from 1/2 to 1; `None` if there is no extent.
fn scale_of(points: &[DVec3]) -> Option<f64> {
    let low = points.iter().copied().reduce(DVec3::min)?;
    let high = points.iter().copied().reduce(DVec3::max)?;
    let extent = (high - low).max_element();
    // A power of two changes no digits.
    (extent > f64::MIN_POSITIVE && extent.is_finite()).then(|| (-extent.log2().ceil()).exp2())
}

/// The points without the coordinate in which the normal is longest, so that the polygon runs
/// counterclockwise.
fn seen_along(points: &[DVec3], normal: DVec3) -> Vec<DVec2> {
    let (scale, first) = (scale_of(points).unwrap_or(1.0), points.first().copied().unwrap_or_default());
    let steep = normal.abs();
    let axis = if steep.x >= steep.max_element() {
        0
    } else if steep.y >= steep.max_element() {
        1
    } else {
        2
    };
    let turned = normal[axis] < 0.0;
    let coordinate = |value: f64| if value.abs() < TINY { 0.0 } else { value };
    let flat = |p: &DVec3| {
        let p = (*p - first) * scale;
        let [u, v] = [p[(axis + 1) % 3], p[(axis + 2) % 3]].map(coordinate);
        if turned { DVec2::new(v, u) } else { DVec2::new(u, v) }
    };
    points.iter().map(flat).collect()
}

/// Triangles of a polygon, counterclockwise as itself, by its corners. An edge that it runs along twice, as
/// to a hole and back, is inside. `None` if it crosses itself.
fn split(points: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    // Corners at the same place are one vertex.
    let mut known = HashMap::new();
    let mut places: Vec<usize> = Vec::new();
    let vertex_of = |(corner, p): (usize, &DVec2)| {
        *known.entry(p.to_array().map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
            places.push(corner);
            places.len() - 1
        })
    };
    let vertices: Vec<usize> = points.iter().enumerate().map(vertex_of).collect();
    let next = |corner: usize| vertices[(corner + 1) % vertices.len()];
    let mut edges: Vec<[usize; 2]> = (0..vertices.len())
        .map(|corner| [vertices[corner].min(next(corner)), vertices[corner].max(next(corner))])
        .filter(|[from, to]| from != to)
        .collect();
    let repeats = points.len() - edges.len();
    edges.sort_unstable();
    let edges =
        edges.chunk_by(|a, b| a == b).filter(|same| same.len() % 2 == 1).map(|same| same[0]).collect();
    let positions = places.iter().map(|corner| Point2::new(points[*corner].x, points[*corner].y)).collect();
    let mut crosses = false;
    let cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(positions, edges, |_| {
        crosses = true;
    });
    let cdt = cdt.ok().filter(|cdt| !crosses && cdt.num_vertices() == places.len())?;
    let mut found = inner_faces(&cdt);
    // Corners that repeat the one before get triangles without an area.
    found.extend(std::iter::repeat_n([0; 3], repeats));
    let area = |[a, b, c]: [DVec2; 3]| (b - a).perp_dot(c - a);
    let whole: f64 = Fans::triangles(points).map(area).sum();
    let parts: f64 = found.iter().map(|corners| area(corners.map(|v| points[places[v]]))).sum();
    let is_whole = found.len() + 2 == points.len() && (whole - parts).abs() <= ROUNDING * parts;
    is_whole.then(|| found.into_iter().map(|corners| corners.map(|vertex| places[vertex])).collect())
}

/// The triangles that a ray from outside reaches through an odd number of constraints, in the order of
/// `spade`.
fn inner_faces(cdt: &ConstrainedDelaunayTriangulation<Point2<f64>>) -> Vec<[usize; 3]> {
    let mut is_inside: Vec<Option<bool>> = vec![None; cdt.num_all_faces()];
    let mut pending: Vec<(FixedFaceHandle<_>, bool)> = Vec::new();
    let outer = cdt.outer_face().fix();
    is_inside[outer.index()] = Some(false);
    pending.extend(cdt.convex_hull().map(|edge| (edge.rev().face().fix(), edge.is_constraint_edge())));
    while let Some((face, inside)) = pending.pop() {
        if is_inside[face.index()].is_some() {
            continue;
        }
        is_inside[face.index()] = Some(inside);
        for edge in cdt.face(face).as_inner().into_iter().flat_map(|face| face.adjacent_edges()) {
            pending.push((edge.rev().face().fix(), inside != edge.is_constraint_edge()));
        }
    }
    let inner = cdt.inner_faces().filter(|face| is_inside[face.fix().index()] == Some(true));
    inner.map(|face| face.vertices().map(|vertex| vertex.fix().index())).collect()
}
