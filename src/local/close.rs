//! Remeshing by local operations that keep the mesh close to the surface, whatever that costs in evenness.
//!
//! Where details are finer than an edge, edges of one length leave them no room. Here triangles are as large
//! as a tolerance allows: flat parts give up vertices first, and the tolerance grows only if that is not
//! enough.

use super::collapse::Limits;
use super::guard::Guard;
use super::star_mesh::StarMesh;
use super::{EdgeLengths, LONG, LocalSurface, MOST_CHANGE, MOST_SPLIT, SHORT};
use crate::mesh::features::Features;
use crate::polish::{ConstrainedMesh, Target};
use crate::{ProgressToken, Result, TriMesh};

/// The tolerance while needles of the surface are flipped away, in spacings.
const AT_FIRST: f64 = 0.03;
/// Longest target length and tolerance of the steps, in spacings, until there are few enough vertices.
const STEPS: [(f64, f64); 4] = [(1.6, 0.1), (2.0, 0.15), (2.5, 0.2), (3.0, 0.3)];
/// Rounds of all operations in a step.
const ROUNDS: u32 = 4;
/// Vertices that are few enough, over the number asked for.
const FEW_ENOUGH: f64 = 1.02;
/// Tolerances of curves for an exact number of vertices, in spacings; that of samples only grows.
const LAST: [f64; 6] = [0.1, 0.2, 0.3, 0.4, 0.6, 1.0];

impl<'a> LocalSurface<'a> {
    /// Like [`LocalSurface::new`], for [`LocalSurface::remeshed_closely`].
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn new_close(
        (surface, target): (&'a TriMesh, &'a Target),
        features: &Features,
        (lengths, count): (&'a [f64], usize),
        progress: &ProgressToken,
    ) -> Result<Self> {
        let wanted = EdgeLengths { lengths, maps: &[] };
        Self::start((surface, target), features, (wanted, count), Some(AT_FIRST), progress)
    }

    /// Like [`LocalSurface::remeshed`], but what counts is the distance between mesh and surface, and edges
    /// may be several times as long as they would be on average. The number of vertices may be another one.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn remeshed_closely(&self, guarded: bool, progress: &ProgressToken) -> Result<ConstrainedMesh> {
        let Self { surface, target, wanted, ref polylines, count, spacing, .. } = *self;
        let mut mesh = self.mesh.clone();
        let mut length = spacing;
        if mesh.samples.is_none() {
            return Ok(mesh.into_constrained(polylines));
        }
        let guard = Guard { looks: guarded, progress };
        for (longest, tolerance) in STEPS {
            mesh.tolerate(tolerance * spacing);
            for _ in 0..ROUNDS {
                if progress.leave_out() {
                    return Ok(mesh.into_constrained(polylines));
                }
                self.close_round(&mut mesh, length, tolerance * spacing, guard)?;
                mesh.refresh_sizes(surface, target, wanted);
                let ratio = (mesh.used() as f64 / count as f64).sqrt();
                length *= ratio.clamp(1.0 / MOST_CHANGE, MOST_CHANGE);
                length = length.clamp(super::LEAST * spacing, longest * spacing);
            }
            if mesh.used() as f64 <= FEW_ENOUGH * count as f64 {
                break;
            }
        }
        self.collapse_closely(&mut mesh, guard)?;
        self.finished(mesh, guard)
    }

    /// All operations once.
    fn close_round(&self, mesh: &mut StarMesh, length: f64, tolerance: f64, guard: Guard) -> Result<()> {
        let (target, polylines, progress) = (self.target, &self.polylines, guard.progress);
        let most = (MOST_SPLIT * self.count).max(mesh.used());
        mesh.split_long(LONG * length, most, polylines);
        guard.run(mesh, |mesh| {
            mesh.space_curves(length, most, polylines);
            mesh.collapse_short(
                SHORT * length,
                &Limits::close(length, tolerance, false),
                polylines,
                progress,
            )?;
            mesh.flip(progress)?;
            mesh.relax(target, polylines, progress)
        })
    }

    /// Collapses the shortest edges until there are as many vertices as wanted, or none may collapse.
    fn collapse_closely(&self, mesh: &mut StarMesh, guard: Guard) -> Result<()> {
        let Self { ref polylines, count, spacing, .. } = *self;
        let progress = guard.progress;
        for (tolerance, loose) in
            LAST.into_iter().flat_map(|tolerance| [(tolerance, false), (tolerance, true)])
        {
            if mesh.used() <= count || progress.leave_out() {
                return Ok(());
            }
            mesh.tolerate(tolerance * spacing);
            let limits = Limits::close(spacing, tolerance * spacing, loose);
            guard
                .run(mesh, |mesh| mesh.collapse_edges(f64::INFINITY, count, &limits, polylines, progress))?;
            guard.run(mesh, |mesh| mesh.flip(progress))?;
        }
        if mesh.used() > count {
            mesh.samples = None;
            mesh.collapse_to(count, spacing, polylines, guard)?;
        }
        Ok(())
    }
}

impl StarMesh {
    /// Raises the tolerance of the samples; never lowers it.
    fn tolerate(&mut self, tolerance: f64) {
        if let Some(samples) = &mut self.samples {
            samples.tolerance = samples.tolerance.max(tolerance);
        }
    }
}
