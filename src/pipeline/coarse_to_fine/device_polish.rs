//! The polish and the fit of a whole mesh by the device.

use super::shared::CoarseToFine;
use crate::gpu::{Buffer, Device};
use crate::mesh::NONE;
use crate::mesh::chunks::{CHUNK, par_clone};
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::spacing;
use crate::pipeline::submission::Submissions;
use crate::polish::{
    ANGLE_ROUNDS, ConstrainedMesh, FEW_FIT_ROUNDS, FEW_ROUNDS, FitOptions, PolishOptions, Polished,
    SOLVER_STEPS, SurfaceVertex, improve_worst, is_fixed,
};
use crate::sites::nearby::sites_near_vertices;
use crate::stages::fit::equations::Equations;
use crate::stages::fit::inward::{InwardSamples, SurfacePoint};
use crate::stages::fit::limit::Limits;
use crate::stages::fit::mesh::FitMesh;
use crate::stages::fit::samples::FaceSamples;
use crate::stages::intersect::IntersectingPairs;
use crate::stages::polish::flip::{Flips, PASSES};
use crate::stages::polish::mesh::{DeviceMesh, read_positions};
use crate::stages::polish::relax::Relaxation;
use crate::{ProgressToken, Result, TriMesh};
use glam::DVec3;
use rayon::prelude::*;

/// Maximum number of bytes of one buffer, for each triangle: a link for each half-edge.
const LARGEST_BYTES: usize = 24;
/// Device memory that the fit takes for each triangle, and for each vertex of the surface.
const TRIANGLE_BYTES: usize = 300;
const SURFACE_BYTES: usize = 200;

/// Distance from the surface, over the shortest edge length, from which on a closest point is searched for in
/// all of it. Most samples are nearer by far.
const FAR: f64 = 0.1;

/// A mesh on host and device.
pub(super) struct MeshOnDevice {
    pub half_edges: HalfEdgeMesh,
    mesh: DeviceMesh,
    /// Triangles of the surface near the vertices.
    under: Buffer<u32>,
    fixed: Vec<bool>,
}

impl MeshOnDevice {
    /// Uploads a mesh, whose vertices are near these triangles of the surface.
    fn new(device: &Device, constrained: &mut ConstrainedMesh, under: &[u32]) -> Result<Self> {
        let ConstrainedMesh { mesh: TriMesh { vertices, triangles }, patches, fixed, lengths, cache, .. } =
            constrained;
        let half_edges = cache.take(par_clone(triangles), vertices.len(), patches);
        let all = (0..vertices.len()).into_par_iter().with_min_len(CHUNK);
        Ok(Self {
            mesh: DeviceMesh::of(device, &half_edges, vertices, (fixed, lengths))?,
            under: Buffer::from_slice(device, "polish.site_triangle", under)?,
            fixed: all.map(|v| is_fixed(&half_edges, fixed, v)).collect(),
            half_edges,
        })
    }
}

/// Compiles all kernels of the polish, the fit and the check, in parallel.
///
/// # Errors
/// Those of the device.
pub(crate) fn compile(device: &Device) -> Result<()> {
    let half_edges = HalfEdgeMesh::new(Vec::new(), 0, &[]);
    let none = DeviceMesh::of(device, &half_edges, &[], (&[], &[]))?;
    let fit = FitMesh::of(device, &none, &half_edges, Vec::new(), None)?;
    let parts: [&(dyn Fn() -> Result<()> + Sync); 7] = [
        &|| Flips::new(device, 0, 0, None).map(drop),
        &|| Relaxation::new(device, 0, None).map(drop),
        &|| FaceSamples::new(device, (&fit, &fit.ground), None, None).map(drop),
        &|| InwardSamples::new(device, &[], 0, None).map(drop),
        &|| Equations::new(device, 0, 0, None).map(drop),
        &|| Limits::new(device, 0, None).map(drop),
        &|| IntersectingPairs::new(device, &TriMesh::default(), 0.0, None).map(drop),
    ];
    parts.par_iter().try_for_each(|part| part())
}

impl CoarseToFine<'_> {
    /// The mesh of a level on the device, if that is to polish and fit whole meshes, and if it has the
    /// memory; otherwise the host does it. `under` has the triangles of the surface that the sites were on.
    pub(super) fn on_device(
        &self,
        constrained: &mut ConstrainedMesh,
        under: &[u32],
    ) -> Result<Option<MeshOnDevice>> {
        let TriMesh { vertices, triangles } = &constrained.mesh;
        let (vertices, triangles) = (vertices.len(), triangles.len());
        let largest = self.context.device.info().limits.storage_buffer_bytes;
        let bytes = TRIANGLE_BYTES * triangles + SURFACE_BYTES * self.context.surface.vertices.len();
        let fits = (LARGEST_BYTES * triangles) as u64 <= largest
            && bytes as u64 <= self.context.device.available_bytes();
        let polishes = self.context.device.polishes(vertices) && fits;
        polishes.then(|| MeshOnDevice::new(self.context.device, constrained, under)).transpose()
    }

    /// Like [`crate::polish::polish`], for a mesh without curves, along which vertices would slide one after
    /// the other. The host does no more than to improve the worst triangles at the end.
    pub(super) fn polish_on_device(
        &self,
        on: &mut MeshOnDevice,
        mesh: &mut TriMesh,
        options: &PolishOptions,
        progress: &ProgressToken,
    ) -> Result<Polished> {
        let device = self.context.device;
        let surface = self.model.on_device().records;
        let flips = Flips::new(device, on.mesh.vertices(), on.mesh.triangles(), None)?;
        let relaxation = Relaxation::new(device, on.mesh.vertices(), None)?;
        let rounds = progress.at_most(FEW_ROUNDS, options.rounds);
        let mut submissions = Submissions::new(device, on.mesh.vertices(), rounds)?;
        for round in 0..rounds {
            progress.done(f64::from(round) / f64::from(rounds))?;
            if round >= FEW_ROUNDS && progress.leave_out() {
                break;
            }
            let late = round + ANGLE_ROUNDS >= rounds;
            let valence_weight = if late { 0.0 } else { options.valence_weight };
            let recorder = submissions.next_round()?;
            flips.record(recorder, &on.mesh, valence_weight as f32, (round, PASSES))?;
            relaxation.record(recorder, &on.mesh, surface, &on.under)?;
        }
        let mut recorder = submissions.into_last();
        let half_edges = on.mesh.download_half_edges(&mut recorder)?;
        let positions = on.mesh.download_positions(&mut recorder)?;
        let flips = flips.download_flips(&mut recorder)?;
        let undone = relaxation.download_undone(&mut recorder)?;
        let done = recorder.submit()?;
        half_edges.read(&done, &mut on.half_edges)?;
        read_positions(&done, &positions, &on.fixed, &mut mesh.vertices)?;
        mesh.triangles.clone_from(&on.half_edges.triangles);
        progress.done(1.0)?;
        let lifted = improve_worst(&on.half_edges, &mut mesh.vertices, &on.fixed, &self.model.target);
        let [flips, taken_back] = [done.first(&flips)?, done.first(&undone)?].map(|count| count as usize);
        Ok(Polished { flips, taken_back, lifted })
    }

    /// Like [`crate::polish::fit`]; `under` has the triangles of the surface that the sites were on.
    pub(super) fn fit_on_device(
        &self,
        on: &mut MeshOnDevice,
        (constrained, under): (&mut ConstrainedMesh, &[u32]),
        options: &FitOptions,
        progress: &ProgressToken,
    ) -> Result<()> {
        let device = self.context.device;
        let surface = self.model.on_device().records;
        let ConstrainedMesh { mesh, lengths, .. } = constrained;
        on.mesh.write(device, &mesh.vertices, lengths)?;
        let moves = on.fixed.iter().map(|fixed| !fixed).collect();
        let fit = FitMesh::of(device, &on.mesh, &on.half_edges, moves, None)?;
        let samples = FaceSamples::new(device, (&fit, surface), None, None)?;
        let inward = InwardSamples::new(device, &self.surface_points(on, under), on.mesh.triangles(), None)?;
        let equations = Equations::new(device, on.mesh.vertices(), fit.edges.len(), None)?;
        let limits = Limits::new(device, on.mesh.vertices(), None)?;
        let shortest = lengths.iter().copied().fold(1.0, f64::min);
        let far = FAR * shortest * spacing(self.context.surface.area(), on.mesh.vertices());
        let mut submissions = Submissions::new(device, on.mesh.vertices(), options.rounds)?;
        for round in 0..options.rounds {
            let begin = f64::from(round) / f64::from(options.rounds);
            progress.done(begin)?;
            if round >= FEW_FIT_ROUNDS && progress.leave_out() {
                break;
            }
            let recorder = submissions.next_round()?;
            fit.record(recorder)?;
            if round == 0 {
                samples.record_tree(recorder, surface)?;
            }
            samples.record(recorder, &fit, surface, &on.under, far as f32)?;
            inward.record(recorder, &fit)?;
            let recorder = submissions.divide()?;
            progress.done(begin + 0.5 / f64::from(options.rounds))?;
            equations.record(recorder, &fit, &samples, &inward)?;
            equations.record_solve(recorder, &fit, SOLVER_STEPS)?;
            limits.record(recorder, &fit, &equations.moves, options.min_angle.to_radians() as f32)?;
        }
        let mut recorder = submissions.into_last();
        let positions = on.mesh.download_positions(&mut recorder)?;
        read_positions(&recorder.submit()?, &positions, &on.fixed, &mut mesh.vertices)
    }

    /// The vertices of the surface, each with a triangle of the mesh near it; `under` has the triangles that
    /// the sites are on. Without those of components that have no site.
    fn surface_points(&self, on: &MeshOnDevice, under: &[u32]) -> Vec<SurfacePoint> {
        let vertices = &self.model.target.vertices;
        let near = sites_near_vertices(&self.context.surface.triangles, vertices.len(), under);
        let firsts = on.half_edges.firsts();
        let point = |(vertex, site): (&SurfaceVertex, u32)| {
            let first = *firsts.get(site as usize)?;
            let SurfaceVertex { position, normal, area } = *vertex;
            let near = (first != NONE).then_some(first / 3)?;
            (normal != DVec3::ZERO).then_some(SurfacePoint { position, normal, area, near })
        };
        vertices.iter().zip(near).filter_map(point).collect()
    }
}
