//! Optimization-based smoothing: vertices move to where the triangles around them have the highest mean
//! quality, without any other loss.
//!
//! Centroids of cells make even triangles where the surface is smooth; between sharp edges, where most
//! triangles have vertices that cannot leave their curves, a search for the mean quality itself finds more.
//! After Freitag, Jones and Plassmann, "An efficient parallel algorithm for mesh smoothing" (1995), which
//! maximizes the smallest angle; here it may not become smaller.

use glam::DVec3;
use rayon::prelude::*;

use super::relax::{folds_or_flattens, vertex_normal};
use super::slide::{Aim, SlidingCurves};
use super::star::Star;
use super::{ConstrainedMesh, Target, is_fixed, turn_cosine};
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::half_edges::{next, previous};
use crate::mesh::quality::smallest_angle;
use crate::mesh::triangle::doubled_normal;
use crate::{ProgressToken, Result};

/// Passes over all vertices whose neighbours have moved.
const PASSES: u32 = 4;
/// Directions that are tried from a position.
const DIRECTIONS: usize = 8;
/// Length of the first trial steps over that of the shortest edge; halved between series of trials.
const FIRST_STEP: f64 = 0.16;
/// Series of trials.
const SERIES: u32 = 3;
/// Angles above this many degrees may become smaller.
const LARGE_ANGLE: f64 = 42.0;
/// So may those above this many in a mesh that has smaller ones.
const FAIR_ANGLE: f64 = 36.0;
/// A vertex whose triangles have a higher mean quality stays.
const EVEN: f64 = 0.97;
/// Around a vertex, the mesh is flat if no triangle turns by more against it: the cosine of 0.008 degrees.
const PLANE: f64 = 1.0 - 1e-8;
/// Minimum gain of a move, in the sum of the qualities.
const MIN_GAIN: f64 = 1e-3;
/// Vertices at edges where the mesh turns by more move along these: the cosine of 18 degrees.
const FLAT: f64 = 0.95;
/// The two edges of a vertex at which the mesh turns are a straight line up to this negated cosine between
/// them: that of 4 degrees.
const STRAIGHT: f64 = 0.9976;
/// Vertices between two looks at the progress.
const CHUNK: usize = 1024;
/// Meshes with more vertices are not smoothed, since one thread does it.
const MOST: usize = 50_000;

/// Whether a mesh is smoothed: with curves or ridges, and of no more than 50,000 vertices.
pub(crate) fn is_to_be_smoothed(constrained: &ConstrainedMesh) -> bool {
    !constrained.curve_edges.is_empty() && constrained.mesh.vertices.len() <= MOST
}

/// Moves vertices so that the mean quality of the triangles rises.
///
/// Vertices in smooth parts and on straight ridges move at the same distance from the surface, those on
/// curves along these. Around no vertex do more triangles get an angle above 90 or below 30 degrees, does an
/// angle below 36 degrees get smaller than all were, or does a triangle fold or leave a curved surface; nor
/// does the mesh's smallest angle become smaller, up to 42 degrees. To finish early, passes are left out.
/// Returns whether a vertex has moved.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn smooth(
    constrained: &mut ConstrainedMesh,
    target: &Target,
    progress: &ProgressToken,
) -> Result<bool> {
    let half_edges = constrained.take_half_edges();
    let done = smooth_half_edges(&half_edges, constrained, target, progress);
    constrained.keep_half_edges(half_edges);
    done
}

fn smooth_half_edges(
    half_edges: &HalfEdgeMesh,
    constrained: &mut ConstrainedMesh,
    target: &Target,
    progress: &ProgressToken,
) -> Result<bool> {
    let ConstrainedMesh { mesh, fixed, cache, sliding_curves, .. } = &mut *constrained;
    let points = &mut mesh.vertices;
    let count = points.len();
    let mut curves = SlidingCurves::new(sliding_curves.clone(), count);
    let ranks = &mut cache.ranks.take(count);
    let is_free: Vec<bool> = (0..count).map(|v| !is_fixed(half_edges, fixed, v)).collect();
    let mut is_due = is_free.clone();
    let mut has_any_moved = false;
    let smallest = half_edges.triangles.par_iter().map(|t| smallest_angle(t.map(|v| points[v as usize])));
    let most_cosine = smallest.reduce(|| LARGE_ANGLE, f64::min).max(FAIR_ANGLE).to_radians().cos();
    for _ in 0..PASSES {
        if progress.leave_out() {
            break;
        }
        let mut has_moved = vec![false; count];
        for v in 0..count {
            if v % CHUNK == 0 {
                progress.poll()?;
            }
            if std::mem::take(&mut is_due[v]) {
                has_moved[v] = improve((half_edges, points), v as u32, most_cosine, (target, &mut ranks[v]));
            }
        }
        let slid = curves.slide(&half_edges.triangles, points, &[], Aim::Mean(target, most_cosine));
        slid.into_iter().for_each(|v| has_moved[v as usize] = true);
        let is_touched = |t: &&[u32; 3]| t.iter().any(|v| has_moved[*v as usize]);
        for v in half_edges.triangles.iter().filter(is_touched).flatten() {
            is_due[*v as usize] = is_free[*v as usize];
            has_any_moved = true;
        }
    }
    cache.ranks.keep(std::mem::take(ranks));
    if !curves.curves.is_empty() {
        constrained.slide_to(curves.curves);
    }
    Ok(has_any_moved)
}

/// Where a vertex may move.
enum Freedom {
    Anywhere,
    /// In this direction and back.
    Along(DVec3),
    Nowhere,
}

/// Moves a vertex to a better position, if there is one; returns whether it moved.
fn improve(
    (half_edges, points): (&HalfEdgeMesh, &mut [DVec3]),
    v: u32,
    most_cosine: f64,
    (target, rank): (&Target, &mut usize),
) -> bool {
    let here = points[v as usize];
    let ring =
        half_edges.ring(v).map(|h| [next(h), previous(h)].map(|h| points[half_edges.origin(h) as usize]));
    let star = Star::new(ring, here, most_cosine);
    let normal = vertex_normal(half_edges, points, v);
    if normal == DVec3::ZERO || star.quality() > EVEN * star.len() as f64 {
        return false;
    }
    let patch = half_edges.patch_at(v);
    let mut closest = |p: DVec3| target.closest_with_normal(p, normal, patch, rank);
    let found = match freedom(half_edges, points, v) {
        Freedom::Nowhere => None,
        Freedom::Along(direction) => search(&star, here, &[direction, -direction]).and_then(|to| {
            let ((from, _), (onto, _)) = (closest(here)?, closest(to)?);
            Some(onto + (here - from))
        }),
        Freedom::Anywhere => search(&star, here, &around(normal)).and_then(|to| {
            let ((from, up), (onto, new_up)) = (closest(here)?, closest(to)?);
            Some(onto + new_up * (here - from).dot(up))
        }),
    };
    let Some(to) = found else { return false };
    let is_better = star.quality_at(to).is_some_and(|quality| quality >= star.quality() + MIN_GAIN)
        && !star.any([here, to], |old, new| folds_or_flattens(old, new, normal))
        && (is_flat(&star, here, normal) || !star.is_farther([here, to], |p| Some(closest(p)?.0)));
    if is_better {
        points[v as usize] = to;
    }
    is_better
}

/// Whether no triangle turns against the normal of their vertex, so that all of them stay in their plane.
fn is_flat(star: &Star, p: DVec3, normal: DVec3) -> bool {
    !star.any([p, p], |triangle, _| doubled_normal(triangle).normalize_or_zero().dot(normal) < PLANE)
}

/// Where a vertex may move: on a straight ridge along that, on another one nowhere.
fn freedom(half_edges: &HalfEdgeMesh, points: &[DVec3], v: u32) -> Freedom {
    let turns = |h: &u32| turn_cosine(half_edges, points, *h).is_some_and(|cosine| cosine < FLAT);
    let ends = half_edges.ring(v).filter(turns).map(|h| points[half_edges.origin(next(h)) as usize]);
    let ends: Vec<DVec3> = ends.collect();
    match ends[..] {
        [] => Freedom::Anywhere,
        [one, other] => {
            let [u, w] = [one, other].map(|end| (end - points[v as usize]).normalize_or_zero());
            if u.dot(w) < -STRAIGHT { Freedom::Along((u - w).normalize_or_zero()) } else { Freedom::Nowhere }
        }
        _ => Freedom::Nowhere,
    }
}

/// Directions in the plane perpendicular to a unit normal.
fn around(normal: DVec3) -> [DVec3; DIRECTIONS] {
    let across = normal.any_orthonormal_vector();
    let along = normal.cross(across);
    std::array::from_fn(|k| {
        let angle = k as f64 * std::f64::consts::TAU / DIRECTIONS as f64;
        across * angle.cos() + along * angle.sin()
    })
}

/// The position with the highest sum of qualities that trial steps in these directions find.
fn search(star: &Star, here: DVec3, directions: &[DVec3]) -> Option<DVec3> {
    let (mut position, mut best) = (here, star.quality());
    let mut step = FIRST_STEP * star.shortest(here);
    for _ in 0..SERIES {
        for direction in directions {
            let trial = position + *direction * step;
            if let Some(quality) = star.quality_at(trial).filter(|quality| *quality > best) {
                (position, best) = (trial, quality);
            }
        }
        step *= 0.5;
    }
    (best >= star.quality() + MIN_GAIN).then_some(position)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TriMesh;
    use crate::mesh::polyline::Polyline;
    use crate::mesh::quality::{Quality, quality};
    use crate::mesh::samples::sample;
    use crate::polish::{CurveEdge, SlidingCurve};
    use rand::{RngExt, SeedableRng};

    const SIDE: u32 = 20;

    /// A grid of right triangles over [-10, 10]², folded by `fold`, with its vertices moved at random by up
    /// to 0.3: those at x = 0 along the fold only.
    fn uneven_grid(fold: impl Fn(f64) -> f64) -> TriMesh {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(7);
        let mut shift = |moves: bool| if moves { random.random_range(-0.3..0.3) } else { 0.0 };
        let at = |i: u32| f64::from(i) - f64::from(SIDE) / 2.0;
        let mut vertices = Vec::new();
        for (i, j) in (0..=SIDE).flat_map(|j| (0..=SIDE).map(move |i| (i, j))) {
            let is_inner = (1..SIDE).contains(&i) && (1..SIDE).contains(&j);
            let (x, y) = (at(i) + shift(is_inner && at(i) != 0.0), at(j) + shift(is_inner));
            vertices.push(DVec3::new(x, y, fold(x)));
        }
        let square = |(i, j): (u32, u32)| {
            let [a, b] = [j, j + 1].map(|j| j * (SIDE + 1) + i);
            [[a, a + 1, b + 1], [a, b + 1, b]]
        };
        let triangles = (0..SIDE).flat_map(|j| (0..SIDE).map(move |i| (i, j))).flat_map(square).collect();
        TriMesh { vertices, triangles }
    }

    /// The mesh smoothed against a surface, with the qualities of both.
    fn smoothed(mesh: &TriMesh, surface: &TriMesh) -> (TriMesh, [Quality; 2]) {
        let mut constrained = ConstrainedMesh::from(mesh.clone());
        smooth(&mut constrained, &Target::new(surface), &ProgressToken::default()).unwrap();
        let after = constrained.mesh;
        assert_eq!(after.triangles, mesh.triangles);
        let qualities = [mesh, &after].map(|mesh| quality(mesh).unwrap());
        let [before, now] = &qualities;
        assert!(now.min_angle >= before.min_angle.min(42.0) - 1e-9, "{now:?}");
        assert!(now.fraction_above_90 <= before.fraction_above_90, "{now:?}");
        assert!(now.fraction_below_30 <= before.fraction_below_30, "{now:?}");
        (after, qualities)
    }

    #[test]
    fn vertices_in_a_plane_move_in_it_and_those_of_its_boundary_stay() {
        let uneven = uneven_grid(|_| 0.0);
        let (after, [before, now]) = smoothed(&uneven, &uneven);
        assert!(
            now.mean_quality > before.mean_quality + 0.04,
            "{} to {}",
            before.mean_quality,
            now.mean_quality
        );
        for (p, q) in after.vertices.iter().zip(&uneven.vertices) {
            let is_inner = q.x.abs() < 9.5 && q.y.abs() < 9.5;
            assert!(p.z.abs() < 1e-12 && (is_inner || p == q), "{q} to {p}");
        }
    }

    #[test]
    fn vertices_on_a_straight_ridge_move_along_it() {
        let roof = uneven_grid(|x| -x.abs());
        let (after, [before, now]) = smoothed(&roof, &roof);
        assert!(
            now.mean_quality > before.mean_quality + 0.02,
            "{} to {}",
            before.mean_quality,
            now.mean_quality
        );
        let mut along = 0;
        for (p, q) in after.vertices.iter().zip(&roof.vertices) {
            assert!((p.z + p.x.abs()).abs() < 1e-12, "{p} is off the roof");
            if q.x == 0.0 {
                assert!(p.x.abs() < 1e-12, "{p} is off the ridge");
                along += usize::from(p.y != q.y);
            }
        }
        assert!(along > 5, "{along}");
    }

    #[test]
    fn vertices_on_a_shallow_crease_stay_on_it() {
        let slope = 0.03;
        let roof = uneven_grid(|x| -slope * x.abs());
        let (after, [before, now]) = smoothed(&roof, &roof);
        assert!(now.mean_quality > before.mean_quality + 0.02, "{now:?}");
        for (p, q) in after.vertices.iter().zip(&roof.vertices) {
            assert!((p.z + slope * p.x.abs()).abs() < 1e-9, "{p} is off the roof");
            assert!(q.x != 0.0 || p.x.abs() < 1e-3, "{q} left the crease for {p}");
        }
    }

    #[test]
    fn vertices_on_a_curve_slide_along_it() {
        let roof = uneven_grid(|x| -x.abs());
        let on_ridge = |v: &u32| roof.vertices[*v as usize].x == 0.0;
        let ridge: Vec<u32> = (0..roof.vertices.len() as u32).filter(on_ridge).collect();
        let line = Polyline::new(vec![DVec3::new(0.0, -10.0, 0.0), DVec3::new(0.0, 10.0, 0.0)], false);
        let arc_length = |v: u32| roof.vertices[v as usize].y + 10.0;
        let sliders = ridge[1..ridge.len() - 1].iter().map(|v| (*v, arc_length(*v))).collect();
        let edge =
            |[a, b]: [u32; 2]| CurveEdge { ends: [a, b], curve: 0, from: arc_length(a), to: arc_length(b) };
        let mut constrained = ConstrainedMesh {
            fixed: (0..roof.vertices.len() as u32).map(|v| on_ridge(&v)).collect(),
            curve_edges: ridge.windows(2).map(|pair| edge([pair[0], pair[1]])).collect(),
            sliding_curves: vec![SlidingCurve { line, sliders }],
            ..roof.clone().into()
        };
        assert!(is_to_be_smoothed(&constrained));
        assert!(smooth(&mut constrained, &Target::new(&roof), &ProgressToken::default()).unwrap());
        let after = &constrained.mesh.vertices;
        let slid = ridge.iter().filter(|v| after[**v as usize] != roof.vertices[**v as usize]).count();
        assert!(slid > 5, "{slid}");
        for CurveEdge { ends, from, to, .. } in &constrained.curve_edges {
            for (v, arc_length) in ends.iter().zip([from, to]) {
                let on = DVec3::new(0.0, arc_length - 10.0, 0.0);
                assert!(after[*v as usize].distance(on) < 1e-12, "{} is not at {on}", after[*v as usize]);
            }
        }
        let [before, now] = [&roof, &constrained.mesh].map(|mesh| quality(mesh).unwrap().mean_quality);
        assert!(now > before + 0.02, "{before} to {now}");
    }

    #[test]
    fn meshes_of_curved_surfaces_come_no_farther_from_them() {
        let surface = sample("sphere").unwrap();
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(9);
        // At other distances from the surface, as the fit leaves them.
        let mut mesh = surface.clone();
        let edge = (4.0 * std::f64::consts::PI / mesh.vertices.len() as f64).sqrt();
        for p in &mut mesh.vertices {
            let shift = DVec3::from_array(std::array::from_fn(|_| random.random_range(-0.25..0.25)));
            *p = (*p + shift * edge).normalize() * (1.0 + 0.1 * edge * edge);
        }
        let (after, [before, now]) = smoothed(&mesh, &surface);
        assert!(
            now.mean_quality > before.mean_quality + 0.01,
            "{} to {}",
            before.mean_quality,
            now.mean_quality
        );
        let rms = |mesh: &TriMesh| {
            let off = |t: usize| (mesh.corners(t).into_iter().sum::<DVec3>() / 3.0).length() - 1.0;
            let count = mesh.triangles.len();
            ((0..count).map(|t| off(t).powi(2)).sum::<f64>() / count as f64).sqrt()
        };
        assert!(rms(&after) <= rms(&mesh), "{} to {}", rms(&mesh), rms(&after));
    }
}
