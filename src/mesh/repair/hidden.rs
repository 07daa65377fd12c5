//! Hidden components: those inside another, closed one.

use glam::DVec3;
use rayon::prelude::*;
use smallvec::SmallVec;
use std::sync::atomic::{AtomicBool, Ordering};

use super::connected_components;
use crate::mesh::bvh::{Aabb, Bvh};
use crate::mesh::half_edges::EdgeTable;
use crate::mesh::intersections::{mark_intersecting_parts, scaled};
use crate::mesh::submesh::without_unused_vertices;
use crate::{ProgressToken, Result, TriMesh};

/// Rays are cast from points with these weights for a triangle's corners, which lie on no line of symmetry.
const WEIGHTS: DVec3 = DVec3::new(0.217, 0.331, 0.452);
/// As many triangles of a component are tried until a ray meets no edge.
const RAYS: usize = 8;

/// Drops components that lie inside closed ones without touching them, and returns how many. The last
/// triangles, from `first_patch` on, stay the last; that number is brought up to date.
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
        let stays = |t: usize| !is_hidden[of_triangle[t] as usize];
        let kept: Vec<usize> = (0..mesh.triangles.len()).filter(|t| stays(*t)).collect();
        *first_patch = kept.partition_point(|t| t < first_patch);
        *mesh = without_unused_vertices(mesh, kept.iter().map(|t| mesh.triangles[*t]).collect());
        *origin = kept.iter().map(|t| origin[*t]).collect();
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
    let rays = Rays { mesh, tree: Bvh::new(mesh), of_triangle, is_closed: &is_closed };
    let mut triangles = vec![SmallVec::<[u32; RAYS]>::new(); count];
    for (t, part) in (0..).zip(of_triangle) {
        let first = &mut triangles[*part as usize];
        if first.len() < RAYS {
            first.push(t);
        }
    }
    let around: Vec<Around> = (0..count as u32)
        .into_par_iter()
        .map(|part| {
            progress.poll()?;
            let found = triangles[part as usize].iter().find_map(|t| rays.around(*t));
            Ok(found.unwrap_or_default())
        })
        .collect::<Result<_>>()?;
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

/// What rays through a mesh meet.
struct Rays<'a> {
    mesh: &'a TriMesh,
    tree: Bvh,
    of_triangle: &'a [u32],
    is_closed: &'a [bool],
}

impl Rays<'_> {
    /// The closed components, other than its own, around a point of a triangle: those that a ray in the
    /// direction of x crosses an odd number of times. `None` if it meets an edge.
    fn around(&self, t: u32) -> Option<Around> {
        let own = self.of_triangle[t as usize];
        let [a, b, c] = self.mesh.corners(t as usize);
        let p = WEIGHTS.x * a + WEIGHTS.y * b + WEIGHTS.z * c;
        let ray = Aabb { min: p, max: p.with_x(self.tree.bounds().max.x.max(p.x)) };
        let (mut crossed, mut is_clear) = (Around::new(), true);
        self.tree.overlapping(&ray, |s| {
            let part = self.of_triangle[s as usize];
            if part != own && self.is_closed[part as usize] {
                match crosses(p, self.mesh.corners(s as usize)) {
                    Some(true) => crossed.push(part),
                    Some(false) => {}
                    None => is_clear = false,
                }
            }
        });
        crossed.sort_unstable();
        let odd = crossed.chunk_by(|a, b| a == b).filter(|run| run.len() % 2 == 1).map(|run| run[0]);
        is_clear.then(|| odd.collect())
    }
}

/// Whether the ray from a point in the direction of x crosses a triangle; `None` if it meets its rim, or if
/// the point is on it.
fn crosses(p: DVec3, corners: [DVec3; 3]) -> Option<bool> {
    let flat = |q: DVec3| robust::Coord { x: q.y, y: q.z };
    let [a, b, c] = corners;
    let turns = [[a, b], [b, c], [c, a]].map(|[s, e]| robust::orient2d(flat(s), flat(e), flat(p)));
    let (left, right) = (turns.iter().any(|turn| *turn > 0.0), turns.iter().any(|turn| *turn < 0.0));
    if left && right {
        return Some(false);
    }
    let at = |q: DVec3| robust::Coord3D { x: q.x, y: q.y, z: q.z };
    let below = robust::orient3d(at(a), at(b), at(c), at(p));
    if turns.contains(&0.0) || below == 0.0 {
        return None;
    }
    Some((below > 0.0) == left)
}
