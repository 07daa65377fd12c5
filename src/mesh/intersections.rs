//! Self-intersections: faces of a mesh that intersect other faces of it, decided by exact predicates.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::{DVec3, Vec3Swizzles};
use rayon::prelude::*;
use robust::{Coord, Coord3D};

use super::TriMesh;
use super::bvh::{Aabb, Bvh};
use super::quality::scale_of;
use super::submesh::extract;
use super::triangle::corners_at;
use crate::{ProgressToken, Result};

type Triangle = [DVec3; 3];

/// Pairs of boxes from which on they are compared in parallel, as around the tip of a long needle.
const PARALLEL: usize = 1 << 15;

/// Beyond this share of the sum of its terms' sizes, the sign of a product is certain: that of three terms
/// has an error of at most 5 times 2^-53.
const ROUNDING: f64 = 1e-15;
/// The same for the height of a point over a plane.
const PLANE_ROUNDING: f64 = 2e-15;

/// The faces that intersect another face, in ascending order. Panics if an index is out of range.
///
/// Two faces without a common vertex intersect if they have a point in common. With one common vertex they
/// must meet beyond it, other than by edges at that vertex that lie on each other; with two they must be
/// folded onto each other in one plane; with three they always intersect. The answers are exact for
/// coordinates as given. Faces that repeat a vertex are left out, and so are pairs of which both have no
/// area, or one has none and they share a vertex.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub fn intersecting_faces(mesh: &TriMesh, progress: &ProgressToken) -> Result<Vec<u32>> {
    intersecting_faces_by(mesh, None, progress)
}

/// Like [`intersecting_faces`], with a hierarchy over the same triangles, if there is one; their vertices may
/// have been elsewhere when it was made.
pub(crate) fn intersecting_faces_by(
    mesh: &TriMesh,
    tree: Option<Bvh>,
    progress: &ProgressToken,
) -> Result<Vec<u32>> {
    let mesh = scaled(mesh);
    let bvh = match tree {
        Some(mut tree) => {
            tree.refit(&mesh);
            tree
        }
        None => Bvh::new(&mesh),
    };
    let hits = Hits::of(&mesh);
    bvh.overlapping_pairs(progress, |s, t| hits.look_at(s, t))?;
    Ok(hits.faces())
}

/// Like [`intersecting_faces`], if no faces but some of these pairs intersect.
pub(crate) fn intersecting_among(mesh: &TriMesh, pairs: &[[u32; 2]]) -> Vec<u32> {
    if pairs.is_empty() {
        return Vec::new();
    }
    let mesh = scaled(mesh);
    let hits = Hits::of(&mesh);
    pairs.par_iter().for_each(|[s, t]| hits.look_at(*s, *t));
    hits.faces()
}

/// Whether one of the faces `some` intersects any other face of the mesh, as [`intersecting_faces`] has it.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn any_of_faces_intersects(
    mesh: &TriMesh,
    some: &[u32],
    progress: &ProgressToken,
) -> Result<bool> {
    progress.poll()?;
    let mesh = scaled(mesh);
    let at = |v: u32| mesh.vertices[v as usize];
    let triangles = some.iter().map(|t| mesh.triangles[*t as usize]).collect();
    let tree = Bvh::new(&TriMesh { vertices: mesh.vertices.clone(), triangles });
    let runs_into_some = |t: usize| {
        let (face, mut found) = (mesh.triangles[t], false);
        tree.overlapping(&Aabb::of(corners_at(face, at)), |k| {
            let s = some[k as usize] as usize;
            found = found || (s != t && faces_intersect(mesh.triangles[s], face, at));
        });
        found
    };
    Ok((0..mesh.triangles.len()).into_par_iter().any(runs_into_some))
}

/// The faces that intersect one of the faces `some`, with these, in ascending order, as
/// [`intersecting_faces`] has it.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn intersecting_with(mesh: &TriMesh, some: &[u32], progress: &ProgressToken) -> Result<Vec<u32>> {
    progress.poll()?;
    let mesh = scaled(mesh);
    let tree = Bvh::new(&extract(&mesh, some));
    let hits = Hits::of(&mesh);
    (0..mesh.triangles.len() as u32).into_par_iter().for_each(|t| {
        let look_at = |k: u32| {
            if some[k as usize] != t {
                hits.look_at(some[k as usize], t)
            }
        };
        tree.overlapping(&Aabb::of(mesh.corners(t as usize)), look_at);
    });
    Ok(hits.faces())
}

/// Marks those of the pairs of parts, lower number first, of which faces intersect. The hierarchy is one over
/// the mesh, which must be [`scaled`]; `parts` has the part of each face.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn mark_intersecting_parts(
    (mesh, tree): (&TriMesh, &Bvh),
    parts: &[u32],
    pairs: &HashMap<[u32; 2], AtomicBool>,
    progress: &ProgressToken,
) -> Result<()> {
    let at = |v: u32| mesh.vertices[v as usize];
    tree.overlapping_pairs(progress, |s, t| {
        let [one, two] = [s, t].map(|face| parts[face as usize]);
        if one != two
            && let Some(is_hit) = pairs.get(&[one.min(two), one.max(two)])
            && !is_hit.load(Ordering::Relaxed)
            && faces_intersect(mesh.triangles[s as usize], mesh.triangles[t as usize], at)
        {
            is_hit.store(true, Ordering::Relaxed);
        }
    })
}

/// The mesh times a power of two, which changes no answer and keeps the products in the predicates within
/// range.
pub(crate) fn scaled(mesh: &TriMesh) -> TriMesh {
    let scale = scale_of(mesh);
    let vertices = mesh.vertices.iter().map(|&v| v * scale).collect();
    TriMesh { vertices, triangles: mesh.triangles.clone() }
}

/// Faces that intersect another, as far as pairs have been looked at.
struct Hits<'a> {
    mesh: &'a TriMesh,
    hit: Vec<AtomicBool>,
}

impl<'a> Hits<'a> {
    fn of(mesh: &'a TriMesh) -> Self {
        Self { mesh, hit: mesh.triangles.iter().map(|_| AtomicBool::new(false)).collect() }
    }

    fn look_at(&self, s: u32, t: u32) {
        let Self { mesh, hit } = self;
        let (s, t, known) = (s as usize, t as usize, |t: usize| hit[t].load(Ordering::Relaxed));
        let at = |v: u32| mesh.vertices[v as usize];
        if !(known(s) && known(t)) && faces_intersect(mesh.triangles[s], mesh.triangles[t], at) {
            hit[s].store(true, Ordering::Relaxed);
            hit[t].store(true, Ordering::Relaxed);
        }
    }

    /// In ascending order.
    fn faces(&self) -> Vec<u32> {
        (0u32..).zip(&self.hit).filter(|(_, hit)| hit.load(Ordering::Relaxed)).map(|(t, _)| t).collect()
    }
}

/// How many of a few triangles intersect others of them, as [`intersecting_faces`] has it. `at` is where the
/// vertices are. Takes the square of their number in time.
pub(crate) fn count_intersecting(triangles: &[[u32; 3]], at: impl Fn(u32) -> DVec3 + Copy) -> usize {
    let boxes: Vec<Aabb> = triangles.iter().map(|t| Aabb::of(corners_at(*t, at))).collect();
    let mut hit = vec![false; triangles.len()];
    for s in 0..triangles.len() {
        for t in 0..s {
            if !(hit[s] && hit[t])
                && boxes[s].overlaps(&boxes[t])
                && faces_intersect(triangles[s], triangles[t], at)
            {
                (hit[s], hit[t]) = (true, true);
            }
        }
    }
    hit.into_iter().filter(|hit| *hit).count()
}

/// How many pairs of triangles, two of `some` or one of them and one of `others`, intersect as
/// [`intersecting_faces`] has it. `at` is where the vertices are. Takes their product in time.
pub(crate) fn count_crossings(
    some: &[[u32; 3]],
    others: &[[u32; 3]],
    at: impl Fn(u32) -> DVec3 + Copy + Sync,
) -> usize {
    let boxes = |list: &[[u32; 3]]| list.iter().map(|t| Aabb::of(corners_at(*t, at))).collect::<Vec<Aabb>>();
    let (of_some, of_others) = (boxes(some), boxes(others));
    let with = |s: usize, list: &[[u32; 3]], boxes: &[Aabb]| {
        let near = list.iter().zip(boxes).filter(|(_, bounds)| of_some[s].overlaps(bounds));
        near.filter(|(t, _)| faces_intersect(some[s], **t, at)).count()
    };
    let of = |s: usize| with(s, &some[..s], &of_some[..s]) + with(s, others, &of_others);
    if some.len() * (some.len() + others.len()) < PARALLEL {
        return (0..some.len()).map(of).sum();
    }
    (0..some.len()).into_par_iter().map(of).sum()
}

/// Whether one of a few triangles with the indices `some` intersects any other of them, as
/// [`intersecting_faces`] has it. `at` is where the vertices are.
pub(crate) fn any_intersects(
    triangles: &[[u32; 3]],
    some: &[usize],
    at: impl Fn(u32) -> DVec3 + Copy,
) -> bool {
    let boxes: Vec<Aabb> = triangles.iter().map(|t| Aabb::of(corners_at(*t, at))).collect();
    some.iter().any(|&s| {
        (0..triangles.len()).any(|t| {
            t != s && boxes[s].overlaps(&boxes[t]) && faces_intersect(triangles[s], triangles[t], at)
        })
    })
}

fn faces_intersect(first: [u32; 3], second: [u32; 3], at: impl Fn(u32) -> DVec3) -> bool {
    if repeats_vertex(first) || repeats_vertex(second) {
        return false;
    }
    let is_shared = |v: u32| v == second[0] || v == second[1] || v == second[2];
    let shared = [is_shared(first[0]), is_shared(first[1]), is_shared(first[2])];
    // A corner with the two after it.
    let from = |corners: Triangle, k: usize| [corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]];
    let (first_corners, second_corners) = (corners_at(first, &at), corners_at(second, &at));
    match shared.iter().filter(|shared| **shared).count() {
        0 => apart_intersect(first_corners, second_corners),
        1 => {
            let k = shared.iter().position(|shared| *shared).unwrap_or(0);
            let j = second.iter().position(|v| *v == first[k]).unwrap_or(0);
            let [v, p, q] = from(first_corners, k);
            let [_, r, s] = from(second_corners, j);
            vertex_sharing_intersect(v, [p, q], [r, s])
        }
        2 => {
            let k = shared.iter().position(|shared| !*shared).unwrap_or(0);
            let j = second.iter().position(|v| !first.contains(v)).unwrap_or(0);
            let [c, a, b] = from(first_corners, k);
            are_folded([a, b], c, second_corners[j])
        }
        _ => true,
    }
}

fn repeats_vertex([a, b, c]: [u32; 3]) -> bool {
    a == b || b == c || c == a
}

/// Closed triangles without a common vertex.
fn apart_intersect(first: Triangle, second: Triangle) -> bool {
    if is_beside_plane(first, second) || is_beside_plane(second, first) {
        return false;
    }
    let second_sides = second.map(|p| side(first, p));
    if one_sided(second_sides) {
        return false;
    }
    let first_sides = first.map(|p| side(second, p));
    !one_sided(first_sides)
        && (edges_meet(second, second_sides, first) || edges_meet(first, first_sides, second))
}

/// Whether all points lie on one side of a triangle's plane, by so much that rounding cannot tell otherwise.
/// As most near triangles do, this saves a predicate for each of the points.
fn is_beside_plane([a, b, c]: Triangle, points: Triangle) -> bool {
    let (u, v) = (b - a, c - a);
    let (normal, sizes) = (u.cross(v), u.abs().yzx() * v.abs().zxy() + u.abs().zxy() * v.abs().yzx());
    let is_beyond = |p: DVec3, towards: f64| {
        let from = p - a;
        // Of three terms of three products: an error of at most 8 times 2^-53 of their sizes.
        towards * normal.dot(from) > PLANE_ROUNDING * sizes.dot(from.abs()) + f64::MIN_POSITIVE
    };
    let [p, q, r] = points;
    let towards = if normal.dot(p - a) > 0.0 { 1.0 } else { -1.0 };
    is_beyond(p, towards) && is_beyond(q, towards) && is_beyond(r, towards)
}

fn one_sided(sides: [i8; 3]) -> bool {
    sides == [1; 3] || sides == [-1; 3]
}

/// Whether an edge of `edges`, whose corners lie on the given `sides` of `triangle`, meets the closed
/// `triangle`; never if that one has no area.
fn edges_meet(edges: Triangle, sides: [i8; 3], triangle: Triangle) -> bool {
    let Some(view) = View::onto(triangle) else { return false };
    (0..3).any(|k| {
        let next = (k + 1) % 3;
        segment_meets([edges[k], edges[next]], [sides[k], sides[next]], triangle, view)
    })
}

/// Whether a closed segment with its ends on the given `sides` of a triangle meets the closed triangle.
fn segment_meets([p, q]: [DVec3; 2], sides: [i8; 2], triangle: Triangle, view: View) -> bool {
    let [a, b, c] = triangle;
    match sides {
        [0, 0] => {
            view.inside(triangle, p)
                || view.inside(triangle, q)
                || [[a, b], [b, c], [c, a]].iter().any(|&edge| view.segments_meet([p, q], edge))
        }
        [1, 1] | [-1, -1] => false,
        _ => {
            let around = [orient(p, q, a, b), orient(p, q, b, c), orient(p, q, c, a)];
            around.iter().all(|&o| o >= 0) || around.iter().all(|&o| o <= 0)
        }
    }
}

/// Triangles `v, p, q` and `v, r, s` that have just `v` in common.
fn vertex_sharing_intersect(v: DVec3, first: [DVec3; 2], second: [DVec3; 2]) -> bool {
    !are_separated(v, first, second) && corners_intersect(v, first, second)
}

/// Like [`vertex_sharing_intersect`], by exact predicates alone.
fn corners_intersect(v: DVec3, [p, q]: [DVec3; 2], [r, s]: [DVec3; 2]) -> bool {
    let (first, second) = ([v, p, q], [v, r, s]);
    let first_sides = [side(second, p), side(second, q)];
    // Beyond the plane of the one, the other only touches it in the vertex; mostly so between neighbours.
    if first_sides[0] * first_sides[1] > 0 {
        return false;
    }
    let second_sides = [side(first, r), side(first, s)];
    if second_sides[0] * second_sides[1] > 0 {
        return false;
    }
    let (Some(first_view), Some(second_view)) = (View::onto(first), View::onto(second)) else { return false };
    if first_sides == [0, 0] {
        return first_view.wedges_overlap(v, [p, q], [r, s]);
    }
    // Both edges then lie on the line where the planes meet: neighbours around a vertex that touch, not
    // intersect.
    let only_edges_touch = first_sides.contains(&0) && second_sides.contains(&0);
    !only_edges_touch
        && (segment_meets([p, q], first_sides, second, second_view)
            || segment_meets([r, s], second_sides, first, first_view))
}

/// Whether both points of `first` lie on one side of a plane through `v`, and those of `second` on the other,
/// for the plane that separates most neighbours around a vertex. If so, that is certain: any normal will do
/// as it is rounded, and the products' signs are beyond their rounding, also that of the smallest numbers.
fn are_separated(v: DVec3, first: [DVec3; 2], second: [DVec3; 2]) -> bool {
    let normal = (first[0] - second[0]) + (first[1] - second[1]);
    let is_beyond = |p: DVec3, towards: f64| {
        let from = p - v;
        towards * normal.dot(from) > ROUNDING * normal.abs().dot(from.abs()) + f64::MIN_POSITIVE
    };
    first.iter().all(|p| is_beyond(*p, 1.0)) && second.iter().all(|p| is_beyond(*p, -1.0))
}

/// Whether triangles on a common edge, with apexes `c` and `d`, lie on each other.
fn are_folded([a, b]: [DVec3; 2], c: DVec3, d: DVec3) -> bool {
    side([a, b, c], d) == 0
        && View::onto([a, b, c]).is_some_and(|view| view.turn(a, b, c) == view.turn(a, b, d))
}

/// 0 for `p` in the plane of a triangle, else 1 on one side and -1 on the other; 0 if the triangle has no
/// area.
fn side([a, b, c]: Triangle, p: DVec3) -> i8 {
    orient(a, b, c, p)
}

fn orient(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> i8 {
    let coord = |p: DVec3| Coord3D { x: p.x, y: p.y, z: p.z };
    sign(robust::orient3d(coord(a), coord(b), coord(c), coord(d)))
}

fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}

/// A view of a plane along a coordinate axis in which no two of its points coincide.
#[derive(Clone, Copy)]
struct View {
    dropped_axis: usize,
}

impl View {
    /// The view of a triangle's plane; `None` if the triangle has no area.
    fn onto([a, b, c]: Triangle) -> Option<Self> {
        let steepness = (b - a).cross(c - a).abs();
        let mut axes = [0, 1, 2];
        axes.sort_by(|&i, &j| steepness[j].total_cmp(&steepness[i]));
        axes.into_iter().map(|dropped_axis| Self { dropped_axis }).find(|view| view.turn(a, b, c) != 0)
    }

    /// 1, 0 or -1 for a left turn, a straight line or a right turn from `a` over `b` to `c`.
    fn turn(self, a: DVec3, b: DVec3, c: DVec3) -> i8 {
        let coord = |p: DVec3| match self.dropped_axis {
            0 => Coord { x: p.y, y: p.z },
            1 => Coord { x: p.z, y: p.x },
            _ => Coord { x: p.x, y: p.y },
        };
        sign(robust::orient2d(coord(a), coord(b), coord(c)))
    }

    /// Whether `p` is in the closed triangle.
    fn inside(self, [a, b, c]: Triangle, p: DVec3) -> bool {
        let turns = [self.turn(a, b, p), self.turn(b, c, p), self.turn(c, a, p)];
        turns.iter().all(|&t| t >= 0) || turns.iter().all(|&t| t <= 0)
    }

    /// Whether two closed segments have a point in common.
    fn segments_meet(self, [p, q]: [DVec3; 2], [a, b]: [DVec3; 2]) -> bool {
        let (pq_a, pq_b) = (self.turn(p, q, a), self.turn(p, q, b));
        let (ab_p, ab_q) = (self.turn(a, b, p), self.turn(a, b, q));
        if [pq_a, pq_b, ab_p, ab_q] == [0; 4] {
            // On one line, the boxes overlap just if the segments do.
            return p.min(q).cmple(a.max(b)).all() && a.min(b).cmple(p.max(q)).all();
        }
        pq_a * pq_b <= 0 && ab_p * ab_q <= 0
    }

    /// Whether the angles `p, v, q` and `r, v, s` have more than a ray in common.
    fn wedges_overlap(self, v: DVec3, first: [DVec3; 2], second: [DVec3; 2]) -> bool {
        let leftward = |[a, b]: [DVec3; 2]| if self.turn(v, a, b) > 0 { [a, b] } else { [b, a] };
        let ([p, q], [r, s]) = (leftward(first), leftward(second));
        let between = |x: DVec3, [a, b]: [DVec3; 2]| self.turn(v, a, x) > 0 && self.turn(v, x, b) > 0;
        // The sign of the dot product is sure on a line, where its terms do not cancel.
        let same_ray = |x: DVec3, y: DVec3| self.turn(v, x, y) == 0 && (x - v).dot(y - v) > 0.0;
        // Of two angles below 180 degrees that overlap, one begins within the other, or both begin alike.
        between(r, [p, q]) || between(p, [r, s]) || same_ray(p, r)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn triangles_that_a_plane_separates_do_not_intersect() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(8);
        let (mut separated, mut intersecting) = (0, 0);
        for round in 0..40_000 {
            let most = [1, 2, 5, 1 << 20][round % 4];
            let mut point =
                || DVec3::from_array(std::array::from_fn(|_| f64::from(rng.random_range(-most..=most))));
            // Also far from the origin, where differences of coordinates are rounded, and flat.
            let far = [0.0, 1e9 / 3.0][round / 4 % 2];
            let [v, p, q, r, s] = std::array::from_fn(|_| {
                let at = point();
                (if round % 3 == 0 { at.with_z(0.0) } else { at }) * 0.1 + DVec3::splat(far)
            });
            if are_separated(v, [p, q], [r, s]) {
                assert!(!corners_intersect(v, [p, q], [r, s]), "{v} {p} {q} {r} {s}");
                separated += 1;
            }
            intersecting += usize::from(corners_intersect(v, [p, q], [r, s]));
        }
        assert!(separated > 2000 && intersecting > 2000, "{separated}, {intersecting}");
        // Those of a fan that are not next to each other.
        let ring: Vec<DVec3> = (0..6)
            .map(|k| f64::from(k).to_radians() * 60.0)
            .map(|angle| DVec3::new(angle.cos(), angle.sin(), 0.2 * (3.0 * angle).sin()))
            .collect();
        for k in 0..6 {
            for j in [2, 3, 4] {
                let side = |k: usize| [ring[k % 6], ring[(k + 1) % 6]];
                assert!(are_separated(DVec3::ZERO, side(k), side(k + j)), "{k}, {j}");
            }
        }
    }

    #[test]
    fn few_triangles_are_told_one_by_one_and_together() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(5);
        for vertices in [6, 12, 30] {
            let points: Vec<DVec3> = (0..vertices)
                .map(|_| DVec3::from_array(std::array::from_fn(|_| rng.random_range(0.0..1.0))))
                .collect();
            let mut vertex = || rng.random_range(0..vertices as u32);
            let triangles: Vec<[u32; 3]> = (0..12).map(|_| std::array::from_fn(|_| vertex())).collect();
            let at = |v: u32| points[v as usize];
            let one_by_one = (0..triangles.len()).filter(|t| any_intersects(&triangles, &[*t], at)).count();
            let mesh = TriMesh { vertices: points.clone(), triangles: triangles.clone() };
            let all = intersecting_faces(&mesh, &ProgressToken::default()).unwrap().len();
            assert!(all > 0, "{vertices} vertices");
            assert_eq!([one_by_one, count_intersecting(&triangles, at)], [all; 2]);
            assert!(!any_intersects(&triangles, &[], at));
            let (some, others) = triangles.split_at(5);
            let pair = |s: usize, t: usize| faces_intersect(triangles[s], triangles[t], at);
            let pairs = (0..5).flat_map(|s| (0..s).chain(5..12).map(move |t| (s, t)));
            let crossings = pairs.filter(|(s, t)| pair(*s, *t)).count();
            assert_eq!(count_crossings(some, others, at), crossings);
            let few = [3, 8];
            let with_few = |t: usize| few.iter().any(|s| *s != t && pair(*s, t));
            let with_few: Vec<u32> = (0..12)
                .filter(|t| with_few(*t) || few.contains(t) && (0..12).any(|s| s != *t && pair(s, *t)))
                .map(|t| t as u32)
                .collect();
            let found = intersecting_with(&mesh, &few.map(|t| t as u32), &ProgressToken::default()).unwrap();
            assert_eq!(found, with_few);
            for t in 0..12 {
                let any = any_of_faces_intersects(&mesh, &[t as u32], &ProgressToken::default()).unwrap();
                assert_eq!(any, any_intersects(&triangles, &[t], at));
            }
        }
    }
}
