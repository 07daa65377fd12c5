//! Hidden components: those inside another, closed one.

use glam::DVec3;
use rayon::prelude::*;
use smallvec::SmallVec;
use std::sync::atomic::{AtomicBool, Ordering};

use super::components::{connected_components, keep_triangles};
use crate::mesh::bvh::{Aabb, Bvh};
use crate::mesh::half_edges::EdgeTable;
use crate::mesh::intersections::{mark_intersecting_parts, scaled};
use crate::{ProgressToken, Result, TriMesh};

/// So many closed components around one are remembered at most: nests may be deep.
const MOST_AROUND: usize = 8;

/// Removes components that lie inside closed ones without touching them, and returns how many. The patches,
/// from `first_patch` on, stay last, and that number is updated.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn drop_hidden(
    mesh: &mut TriMesh,
    origin: &mut Vec<u32>,
    first_patch: &mut usize,
    progress: &ProgressToken,
) -> Result<usize> {
    let (of_triangle, areas) = connected_components(mesh);
    let is_hidden = hidden_components(mesh, &of_triangle, areas.len(), progress)?;
    let removed = is_hidden.iter().filter(|hidden| **hidden).count();
    if removed > 0 {
        let kept = keep_triangles(mesh, origin, |t| !is_hidden[of_triangle[t] as usize]);
        *first_patch = kept.partition_point(|t| t < first_patch);
    }
    Ok(removed)
}

/// Of each component, whether it is inside a closed one. The answers are exact: numbers of crossings of a ray
/// by predicates, for components that do not intersect.
fn hidden_components(
    mesh: &TriMesh,
    of_triangle: &[u32],
    count: usize,
    progress: &ProgressToken,
) -> Result<Vec<bool>> {
    let mut is_closed = vec![true; count];
    let table = EdgeTable::new(&mesh.triangles);
    for sides in table.edges().filter(|sides| sides.len() % 2 == 1) {
        is_closed[of_triangle[sides[0].triangle()] as usize] = false;
    }
    if count < 2 || !is_closed.contains(&true) {
        return Ok(vec![false; count]);
    }
    let mesh = &scaled(mesh);
    let mut boxes = vec![Aabb::EMPTY; count];
    let mut first = vec![DVec3::ZERO; count];
    for (t, part) in of_triangle.iter().enumerate().rev() {
        let corners = mesh.corners(t);
        let own = Aabb::of(corners);
        let whole = &mut boxes[*part as usize];
        *whole = Aabb { min: whole.min.min(own.min), max: whole.max.max(own.max) };
        first[*part as usize] = corners[0];
    }
    let rays = Rays { mesh, tree: Bvh::new(mesh), of_triangle, closed: Closed::new(&boxes, &is_closed) };
    let around = (0..count as u32).into_par_iter().map(|part| {
        progress.poll()?;
        Ok(rays.around(part, first[part as usize], &boxes))
    });
    let around: Vec<Around> = around.collect::<Result<_>>()?;
    let pair = |part: u32, other: u32| [part.min(other), part.max(other)];
    let with_others = |(part, list): (u32, &Around)| list.iter().map(|other| pair(part, *other)).collect();
    let pairs: Vec<Vec<[u32; 2]>> = (0..).zip(&around).map(with_others).collect();
    if pairs.iter().all(Vec::is_empty) {
        return Ok(vec![false; count]);
    }
    let touch = pairs.iter().flatten().map(|pair| (*pair, AtomicBool::new(false))).collect();
    mark_intersecting_parts((rays.mesh, &rays.tree), of_triangle, &touch, progress)?;
    let is_apart = |pair: &[u32; 2]| touch.get(pair).is_some_and(|touch| !touch.load(Ordering::Relaxed));
    Ok(pairs.iter().map(|pairs| pairs.iter().any(is_apart)).collect())
}

/// Closed components around a point.
type Around = SmallVec<[u32; 4]>;

/// The boxes of closed components.
struct Closed {
    tree: Bvh,
    parts: Vec<u32>,
}

impl Closed {
    fn new(boxes: &[Aabb], is_closed: &[bool]) -> Self {
        let parts: Vec<u32> = (0..).zip(is_closed).filter(|(_, closed)| **closed).map(|(p, _)| p).collect();
        // A triangle with the box of each.
        let ends = parts.iter().map(|part| &boxes[*part as usize]).flat_map(|own| [own.min, own.max]);
        let triangles = (0..parts.len() as u32).map(|k| [2 * k, 2 * k, 2 * k + 1]).collect();
        Self { tree: Bvh::new(&TriMesh { vertices: ends.collect(), triangles }), parts }
    }

    /// Those whose box contains that of a component, ascending, without itself.
    fn containing(&self, part: u32, boxes: &[Aabb]) -> Vec<u32> {
        let own = &boxes[part as usize];
        let mut found = Vec::new();
        self.tree.overlapping(&Aabb { min: own.min, max: own.min }, |k| {
            let other = self.parts[k as usize];
            if other != part && own.max.cmple(boxes[other as usize].max).all() {
                found.push(other);
            }
        });
        found.sort_unstable();
        found
    }
}

/// Casts rays through a mesh.
struct Rays<'a> {
    mesh: &'a TriMesh,
    tree: Bvh,
    of_triangle: &'a [u32],
    closed: Closed,
}

impl Rays<'_> {
    /// Closed components around another one that has a vertex at `p`: those that a ray from there in the
    /// direction of x crosses an odd number of times.
    fn around(&self, part: u32, p: DVec3, boxes: &[Aabb]) -> Around {
        let others = self.closed.containing(part, boxes);
        let end = others.iter().map(|other| boxes[*other as usize].max.x).fold(p.x, f64::max);
        let mut crossed: Vec<u32> = Vec::new();
        if !others.is_empty() {
            self.tree.overlapping(&Aabb { min: p, max: p.with_x(end) }, |s| {
                let other = self.of_triangle[s as usize];
                if others.binary_search(&other).is_ok() && crosses(p, self.mesh.corners(s as usize)) {
                    crossed.push(other);
                }
            });
        }
        crossed.sort_unstable();
        let odd = crossed.chunk_by(|a, b| a == b).filter(|run| run.len() % 2 == 1).map(|run| run[0]);
        odd.take(MOST_AROUND).collect()
    }
}

/// Whether the ray from a point in the direction of x crosses a triangle. If it meets an edge, it counts as
/// if the point were moved by next to nothing in y, and by next to nothing of that in z: so that just one of
/// two triangles at an edge is crossed where the surface goes on.
fn crosses(p: DVec3, corners: [DVec3; 3]) -> bool {
    let flat = |q: DVec3| robust::Coord { x: q.y, y: q.z };
    let turn = |s: DVec3, e: DVec3| {
        let turn = robust::orient2d(flat(s), flat(e), flat(p));
        // Its derivatives by y and by z of the point.
        [turn, s.z - e.z, e.y - s.y].into_iter().find(|value| *value != 0.0).unwrap_or(0.0)
    };
    let [a, b, c] = corners;
    let turns = [turn(a, b), turn(b, c), turn(c, a)];
    let (left, right) = (turns.iter().all(|turn| *turn > 0.0), turns.iter().all(|turn| *turn < 0.0));
    let at = |q: DVec3| robust::Coord3D { x: q.x, y: q.y, z: q.z };
    let below = robust::orient3d(at(a), at(b), at(c), at(p));
    (left && below > 0.0) || (right && below < 0.0)
}
