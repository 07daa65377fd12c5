//! Comparisons that several kernels share.

use crate::context::Context;
use crate::polygons::frame;
use crate::reference::closest::onto_triangle;
use crate::reference::face::{Face, face};
use anyhow::{Result, ensure};
use glam::{DVec3, Vec4};

/// What f32 does to positions in a frame of diagonal 1.
pub const ROUNDING: f64 = 1e-6;

pub use crate::reference::octahedral::unpack as unpack_normal;

/// Checks that samples of `points` lie on the triangles `under` them.
pub fn landed(context: &Context, points: &[Vec4], under: &[u32]) -> Result<()> {
    for &i in &context.samples {
        let at = points[i].truncate().as_dvec3();
        let off = onto_triangle(at, context.model.corners[under[i] as usize]).distance(at);
        ensure!(off < ROUNDING, "site {i} is {off} off triangle {}", under[i]);
    }
    Ok(())
}

/// Checks that the neighbours of a sample are as far away as its nearest sites.
pub fn near_list(context: &Context, sample: usize, got: &[u32]) -> Result<()> {
    let (site, want) = (context.samples[sample], &context.near[sample]);
    let far = |j: u32| context.points[j as usize].distance(context.points[site]);
    let mut once = got.to_vec();
    once.sort_unstable();
    once.dedup();
    ensure!(once.len() == got.len() && !got.contains(&(site as u32)), "site {site} lists {got:?}");
    for (g, w) in got.iter().zip(want) {
        let (g, w) = (far(*g), far(*w));
        ensure!((g - w).abs() <= 1e-6 * w, "site {site}: a neighbour is {g} away instead of {w}");
    }
    Ok(())
}

/// The face of a sample, cut by its known neighbours for which `counts` holds and by a cube of half edge
/// `far`, and its frame. None if an unknown site might cut it.
pub fn known_face(
    context: &Context,
    site: usize,
    near: &[u32],
    normal: DVec3,
    far: f64,
    counts: &dyn Fn(u32) -> bool,
) -> Option<(Face, [DVec3; 2])> {
    let listed: Vec<u32> =
        std::iter::once(site as u32).chain(near.iter().copied().filter(|j| counts(*j))).collect();
    let positions: Vec<DVec3> = listed.iter().map(|j| context.points[*j as usize]).collect();
    let (u, v) = frame(normal);
    let mut found = face(&positions, 0, u, v, far);
    found.behind.iter_mut().flatten().for_each(|j| *j = listed[*j as usize]);
    let reach = near.last().map_or(0.0, |j| context.points[*j as usize].distance(context.points[site]));
    let closed = !found.corners.is_empty() && 2.0 * found.radius() < reach;
    closed.then_some((found, [u, v]))
}
