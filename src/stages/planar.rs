//! Restricted tangent faces in the plane, by intervals: the default pipeline's faces, centroids and targets.

use crate::Result;
use crate::gpu::kernels::face::{planar, planar_rest, polygons};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use glam::{Vec2, Vec4};

/// Neighbours that the first round looks at: more than the faces of relaxed sites need.
pub const NEAR: u32 = 14;

/// What the kernels read of the sites.
#[derive(Clone, Copy)]
pub struct PlanarInputs<'a> {
    /// Positions; w = 0, or the marks of [`super::pins`].
    pub sites: &'a Buffer<Vec4>,
    /// Unit normals of the tangent planes, packed as in `glsl/common/octahedral.glsl`.
    pub normals: &'a Buffer<u32>,
    /// Lists, nearest first: `neighbours[slot * sites + site]`.
    pub neighbours: &'a Buffer<u32>,
    /// How near the sites after the first [`NEAR`] (x) and outside the list (y) may be, had only the site itself moved
    /// since the list was made.
    pub away: &'a Buffer<Vec2>,
    /// Word 1 has the bits of rho, the largest way gone since then relative to a site's own reach.
    pub status: &'a Buffer<u32>,
}

/// The size of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarMove {
    /// Number of this iteration.
    pub iteration: u32,
    /// Share of the last motion that is added, 0 to 1.
    pub momentum: f32,
    /// Longest step, in the unit-diagonal frame.
    pub largest_move: f32,
    /// No face reaches farther from its site.
    pub widest: f32,
}

/// Faces, their centroids, and where momentum leads.
pub struct PlanarFaces {
    near: Pipeline<planar::Shader>,
    rest: Pipeline<planar_rest::Shader>,
    /// Where each site wants to go, w = squared distance to its centroid.
    pub targets: Buffer<Vec4>,
    /// The area centroids of the last iteration; w = 0 before the first.
    centroids: Buffer<Vec4>,
    /// For each iteration the sites that the first [`NEAR`] do not decide, then for each those that the list does not.
    pub insecure: Buffer<u32>,
    iterations: u32,
}

impl PlanarFaces {
    /// For `sites` sites with lists of `k`, and at most `iterations` iterations. The sites bear the marks of
    /// [`super::pins`] if there are `curves`.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(
        device: &Device,
        sites: usize,
        k: u32,
        iterations: u32,
        curves: bool,
        workgroup: Option<u32>,
    ) -> Result<Self> {
        let curves = u32::from(curves);
        let mut constants = planar::Constants { k: NEAR.min(k), curves, ..Default::default() };
        let mut rest = planar_rest::Constants { k, curves, ..Default::default() };
        constants.workgroup = workgroup.unwrap_or(constants.workgroup);
        rest.workgroup = workgroup.unwrap_or(rest.workgroup);
        Ok(Self {
            near: Pipeline::new(device, constants)?,
            rest: Pipeline::new(device, rest)?,
            targets: Buffer::new(device, "default.face.targets", sites)?,
            centroids: Buffer::from_slice(device, "default.face.centroids", &vec![Vec4::ZERO; sites])?,
            insecure: Buffer::from_slice(
                device,
                "default.face.insecure",
                &vec![0; 2 * iterations as usize + sites],
            )?,
            iterations,
        })
    }

    /// Records both rounds of one iteration.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        inputs: &PlanarInputs<'_>,
        step: &PlanarMove,
    ) -> Result<()> {
        let sites = inputs.sites.len();
        let push = planar::Push {
            site_count: sites as u32,
            iteration: step.iteration,
            iterations: self.iterations,
            momentum: step.momentum,
            largest_move: step.largest_move,
            widest: step.widest,
        };
        let bindings = planar::Bindings {
            sites: inputs.sites,
            normals: inputs.normals,
            neighbours: inputs.neighbours,
            away: inputs.away,
            status: inputs.status,
            targets: &self.targets,
            centroids: &self.centroids,
            insecure: &self.insecure,
        };
        recorder.dispatch(&self.near, Threads(sites), &push, &bindings)?;
        let planar::Push { site_count, iteration, iterations, momentum, largest_move, widest } = push;
        let push = planar_rest::Push { site_count, iteration, iterations, momentum, largest_move, widest };
        let bindings = planar_rest::Bindings {
            sites: inputs.sites,
            normals: inputs.normals,
            neighbours: inputs.neighbours,
            away: inputs.away,
            status: inputs.status,
            targets: &self.targets,
            centroids: &self.centroids,
            insecure: &self.insecure,
        };
        // Few sites are left, and the kernel's loop takes them all however many there are.
        recorder.dispatch(&self.rest, Threads(sites.div_ceil(64)), &push, &bindings)
    }
}

/// Faces as ordered polygons, as [`super::face::CellFaces`] has them.
pub struct PlanarPolygons {
    pipeline: Pipeline<polygons::Shader>,
    /// Corners of each face; 0 or fewer than 3 where lines leave it open.
    pub corner_count: Buffer<u32>,
    /// `corners[slot * sites + site]`, counter-clockwise in the frame of the tangent plane.
    pub corners: Buffer<Vec2>,
    /// The site behind the edge that ends in the corner.
    pub fan: Buffer<u32>,
    /// 1 where no site outside the list can cut the face.
    pub secure: Buffer<u32>,
}

impl PlanarPolygons {
    /// For `sites` sites with lists of `k`.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, sites: usize, k: u32, workgroup: Option<u32>) -> Result<Self> {
        let mut constants = polygons::Constants { k, ..Default::default() };
        constants.workgroup = workgroup.unwrap_or(constants.workgroup);
        let slots = sites * k as usize;
        Ok(Self {
            pipeline: Pipeline::new(device, constants)?,
            corner_count: Buffer::new(device, "default.polygons.corner_count", sites)?,
            corners: Buffer::new(device, "default.polygons.corners", slots)?,
            fan: Buffer::new(device, "default.polygons.fan", slots)?,
            secure: Buffer::new(device, "default.polygons.secure", sites)?,
        })
    }

    /// Records the faces; none reaches farther than `widest` from its site.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(&self, recorder: &mut Recorder, inputs: &PlanarInputs<'_>, widest: f32) -> Result<()> {
        let bindings = polygons::Bindings {
            sites: inputs.sites,
            normals: inputs.normals,
            neighbours: inputs.neighbours,
            reach: inputs.away,
            corner_count: &self.corner_count,
            corners: &self.corners,
            fan: &self.fan,
            secure: &self.secure,
        };
        let push = polygons::Push { site_count: inputs.sites.len() as u32, widest };
        recorder.dispatch(&self.pipeline, Threads(inputs.sites.len()), &push, &bindings)
    }
}
