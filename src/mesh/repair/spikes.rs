//! Spikes: single vertices that stick out of the surface, or into it, like needles.

use glam::DVec3;
use smallvec::SmallVec;
use std::collections::{HashMap, HashSet};
use std::f64::consts::FRAC_PI_2;

use super::is_flat;
use crate::mesh::csr::{Csr, triangles_around};
use crate::mesh::half_edges::EdgeTable;
use crate::mesh::triangle::{angle_at_first, doubled_normal};
use crate::mesh::{TriMesh, position_key};
use crate::{ProgressToken, Result};

/// A vertex is a spike if the angles around it sum to less than this, as at the tip of a cone of 29 degrees.
const SPIKE: f64 = FRAC_PI_2;
/// Spikes that are neighbours depend on each other, and are moved this many times.
const ROUNDS: usize = 20;
/// How a spike is placed does not depend on the surroundings of vertices with more triangles.
const HUB: usize = 100;

/// Moves spikes to where the surface around them bends least, and returns how many. Boundary and non-manifold
/// vertices are not spikes. A spike stays if the surface would be folded without it, as at the tip of a cone
/// on a disc, or if it would come to where another vertex is.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn smooth_spikes(
    mesh: &mut TriMesh,
    table: &EdgeTable,
    progress: &ProgressToken,
) -> Result<usize> {
    let mut is_inner = vec![true; mesh.vertices.len()];
    for sides in table.edges().filter(|sides| sides.len() != 2) {
        <[u32; 2]>::from(sides[0].ends()).iter().for_each(|v| is_inner[*v as usize] = false);
    }
    let sums = angle_sums(mesh);
    let is_spike: Vec<bool> = sums.iter().zip(&is_inner).map(|(sum, inner)| *inner && *sum < SPIKE).collect();
    if !is_spike.contains(&true) {
        return Ok(0);
    }
    let around = triangles_around(mesh.vertices.len(), &mesh.triangles);
    let spikes = (0..).zip(&is_spike).filter(|(_, is)| **is).map(|(v, _)| v);
    let spikes: Vec<u32> = spikes.filter(|v| is_one_fan(*v, mesh, around.of(*v))).collect();
    let neighbours = |v: u32| {
        let of = around.of(v).iter().flat_map(|t| mesh.triangles[*t as usize]);
        let mut list: Vec<u32> = of.filter(|w| *w != v).collect();
        list.sort_unstable();
        list.dedup();
        list
    };
    let is_smooth = |w: u32| is_inner[w as usize] && around.of(w).len() <= HUB;
    let places: Vec<Place> = spikes.iter().map(|v| Place::of(*v, is_smooth, neighbours)).collect();
    let before: Vec<DVec3> = spikes.iter().map(|v| mesh.vertices[*v as usize]).collect();
    let mut taken: HashSet<[u64; 3]> = mesh.vertices.iter().map(|p| position_key(*p)).collect();
    for (v, place) in spikes.iter().zip(&places) {
        // First without the others, which may be far away.
        let rest: Vec<u32> = place.ring.iter().copied().filter(|w| !is_spike[*w as usize]).collect();
        if !rest.is_empty() {
            mesh.vertices[*v as usize] = mean(&rest, &mesh.vertices);
        }
    }
    for _ in 0..ROUNDS {
        progress.poll()?;
        for (v, place) in spikes.iter().zip(&places) {
            mesh.vertices[*v as usize] = place.fair(&mesh.vertices);
        }
    }
    let mut moved: Vec<usize> = (0..spikes.len()).collect();
    let mut is_free =
        |k: &usize, mesh: &TriMesh| taken.insert(position_key(mesh.vertices[spikes[*k] as usize]));
    let mut back: Vec<usize> = moved.extract_if(.., |k| !is_free(k, mesh)).collect();
    // What goes back may leave others beside it unsound.
    loop {
        progress.poll()?;
        back.extend(moved.extract_if(.., |k| !is_sound(spikes[*k], mesh, &around)));
        if back.is_empty() {
            return Ok(moved.len());
        }
        back.drain(..).for_each(|k| mesh.vertices[spikes[k] as usize] = before[k]);
    }
}

/// Whether the triangles around a vertex are one closed fan, each joined to the next by an edge.
fn is_one_fan(v: u32, mesh: &TriMesh, star: &[u32]) -> bool {
    let after = |t: &u32| {
        let triangle = mesh.triangles[*t as usize];
        let own = triangle.iter().position(|w| *w == v).unwrap_or(0);
        (triangle[(own + 1) % 3], triangle[(own + 2) % 3])
    };
    let next: HashMap<u32, u32> = star.iter().map(after).collect();
    let Some(first) = star.first().map(|t| after(t).0) else { return false };
    let walk = std::iter::successors(next.get(&first), |w| next.get(w));
    walk.take(star.len()).position(|w| *w == first) == Some(star.len() - 1)
}

/// The sum of the angles around each vertex.
fn angle_sums(mesh: &TriMesh) -> Vec<f64> {
    let mut sums = vec![0.0; mesh.vertices.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(t);
        let angles = [[a, b, c], [b, c, a], [c, a, b]].map(angle_at_first);
        triangle.iter().zip(angles).for_each(|(v, angle)| sums[*v as usize] += angle);
    }
    sums
}

/// Whether the triangles around a vertex have an area, and face as those beside them do, in the mean.
fn is_sound(v: u32, mesh: &TriMesh, around: &Csr) -> bool {
    let normal = |t: u32| doubled_normal(mesh.corners(t as usize)).normalize_or_zero();
    let turn = |t: &u32| {
        let ring = mesh.triangles[*t as usize].into_iter().filter(|w| *w != v);
        let ring: SmallVec<[u32; 2]> = ring.collect();
        // Around the one with fewer triangles, since the other one may be the middle of a large fan.
        let first = ring.iter().min_by_key(|w| around.of(**w).len())?;
        let has_ring = |s: &&u32| *s != t && ring.iter().all(|w| mesh.triangles[**s as usize].contains(w));
        let beside = around.of(*first).iter().find(has_ring)?;
        Some(normal(*t).dot(normal(*beside)))
    };
    let star = around.of(v);
    star.iter().all(|t| !is_flat(mesh.corners(*t as usize)))
        && star.iter().filter_map(turn).sum::<f64>() > 0.0
}

/// What the place of a vertex depends on.
struct Place {
    /// The vertices around it.
    ring: Vec<u32>,
    /// Those on no boundary and in the middle of no large fan, with the others around each.
    inner: Vec<(u32, Vec<u32>)>,
}

impl Place {
    fn of(v: u32, is_smooth: impl Fn(u32) -> bool, neighbours: impl Fn(u32) -> Vec<u32>) -> Self {
        let ring = neighbours(v);
        let others = |w: u32| neighbours(w).into_iter().filter(|u| *u != v).collect();
        let inner = ring.iter().filter(|w| is_smooth(**w)).map(|w| (*w, others(*w))).collect();
        Self { ring, inner }
    }

    /// Where the vertex's distance from the mean of its ring is the mean of that of the ring's vertices: the
    /// discrete form of a surface that bends least.
    fn fair(&self, vertices: &[DVec3]) -> DVec3 {
        let (mut bends, mut shares) = (DVec3::ZERO, 0.0);
        for (w, others) in &self.inner {
            let share = 1.0 / (others.len() + 1) as f64;
            bends +=
                share * others.iter().map(|u| vertices[*u as usize]).sum::<DVec3>() - vertices[*w as usize];
            shares += share;
        }
        let count = self.inner.len().max(1) as f64;
        (mean(&self.ring, vertices) - bends / count) / (1.0 + shares / count)
    }
}

fn mean(of: &[u32], vertices: &[DVec3]) -> DVec3 {
    of.iter().map(|w| vertices[*w as usize]).sum::<DVec3>() / of.len() as f64
}
