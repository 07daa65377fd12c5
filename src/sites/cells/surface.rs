//! The surface and the sites in the form that cells need.

use crate::mesh::NONE;
use crate::mesh::half_edges::{edge_key, next, twins};
use crate::mesh::triangle::closest_on_triangle;
use crate::sites::place::Place;
use glam::{DVec3, DVec4};
use std::sync::OnceLock;

/// The surface with the connectivity that cells need.
pub struct CellSurface<'a> {
    pub(crate) vertices: &'a [DVec3],
    pub(crate) triangles: &'a [[u32; 3]],
    pub(crate) normals: &'a [DVec3],
    /// The half-edges across; [`NONE`] on the boundary of a patch.
    pub(crate) twins: Vec<u32>,
    /// One a triangle; empty if there is one patch.
    pub(crate) patches: &'a [u32],
    pub(crate) has_boundary: bool,
    /// See [`CellSurface::is_within`].
    balls: OnceLock<Vec<DVec4>>,
}

/// Sites on the surface.
pub struct CellSites<'a> {
    /// Positions of the sites.
    pub positions: &'a [DVec3],
    /// The triangle, edge or vertex that each lies on.
    pub places: &'a [Place],
    /// Near sites of each, nearest first: entry `slot` of site i at `slot * sites + i`, `u32::MAX` after the
    /// last. A cell that needs more looks at all sites.
    pub near: &'a [u32],
    /// Edge length of a perfect layout.
    pub spacing: f64,
    /// Edge length at each site from the size field, relative to the spacing; empty if all are equal.
    pub lengths: &'a [f64],
}

impl CellSites<'_> {
    /// The edge length at a site.
    pub(crate) fn spacing_at(&self, site: u32) -> f64 {
        self.spacing * self.lengths.get(site as usize).copied().unwrap_or(1.0)
    }
}

impl<'a> CellSurface<'a> {
    /// Of a clean mesh with the unit normals of its triangles.
    pub fn new(vertices: &'a [DVec3], triangles: &'a [[u32; 3]], normals: &'a [DVec3]) -> Self {
        let twins = twins(triangles);
        let has_boundary = twins.contains(&NONE);
        let balls = OnceLock::new();
        Self { vertices, triangles, normals, twins, patches: &[], has_boundary, balls }
    }

    /// The same surface cut along curves: `curves` tells of each half-edge `3 * triangle + side` whether it
    /// lies on one; one half-edge of an edge suffices. `patches` has the patch of each triangle.
    #[must_use]
    pub fn cut_along(mut self, curves: &[bool], patches: &'a [u32]) -> Self {
        for half in (0..curves.len()).filter(|half| curves[*half]) {
            if let Some(twin) = self.twins.get_mut(half).map(|twin| std::mem::replace(twin, NONE))
                && let Some(back) = self.twins.get_mut(twin as usize)
            {
                *back = NONE;
            }
        }
        self.has_boundary = self.twins.contains(&NONE);
        self.patches = patches;
        self
    }

    /// The triangle across a side.
    pub(crate) fn across(&self, t: u32, side: u8) -> Option<u32> {
        Some(self.twins[3 * t as usize + usize::from(side)]).filter(|twin| *twin != NONE).map(|twin| twin / 3)
    }

    pub(crate) fn is_boundary(&self, half: u32) -> bool {
        self.twins[half as usize] == NONE
    }

    pub(crate) fn corners(&self, t: u32) -> [DVec3; 3] {
        self.triangles[t as usize].map(|v| self.vertices[v as usize])
    }

    /// Whether a triangle comes within this distance of a point. For most triangles their centres tell, with
    /// the radii around them that hold their corners, which takes one look at memory instead of three.
    pub(crate) fn is_within(&self, distance: f64, at: DVec3, t: u32) -> bool {
        // By one thread: one that waits for others may take up a cell, which would wait for this.
        let ball =
            self.balls.get_or_init(|| (0..self.triangles.len() as u32).map(|t| self.ball(t)).collect());
        let ball = ball[t as usize];
        let from_centre = ball.truncate().distance_squared(at);
        if from_centre <= distance * distance {
            return true;
        }
        if from_centre > (distance + ball.w).powi(2) {
            return false;
        }
        let is_near = |p: DVec3| p.distance_squared(at) <= distance * distance;
        let corners = self.corners(t);
        corners.into_iter().any(is_near) || is_near(closest_on_triangle(at, corners).point)
    }

    fn ball(&self, t: u32) -> DVec4 {
        let corners = self.corners(t);
        let centre = corners.iter().sum::<DVec3>() / 3.0;
        let radius_sq = corners.iter().map(|p| p.distance_squared(centre)).fold(0.0, f64::max);
        // Rounded up, so that the corners are inside.
        centre.extend(radius_sq.sqrt() * (1.0 + 1e-9))
    }

    /// The points that a half-edge runs from and to.
    pub(crate) fn ends(&self, half: u32) -> [DVec3; 2] {
        [half, next(half)].map(|corner| self.vertices[self.vertex(corner) as usize])
    }

    /// The vertices of a half-edge, the smaller index first.
    pub(crate) fn edge(&self, half: u32) -> (u32, u32) {
        edge_key(self.vertex(half), self.vertex(next(half)))
    }

    pub(crate) fn vertex(&self, corner: u32) -> u32 {
        self.triangles[corner as usize / 3][corner as usize % 3]
    }

    pub(crate) fn patch(&self, t: u32) -> u32 {
        self.patches.get(t as usize).copied().unwrap_or(0)
    }

    /// The half-edge after one along the boundary of its patch.
    pub(crate) fn next_on_boundary(&self, half: u32) -> u32 {
        let mut half = next(half);
        while !self.is_boundary(half) {
            half = next(self.twins[half as usize]);
        }
        half
    }
}
