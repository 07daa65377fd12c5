//! The mesh of the last level: polished, fitted, and checked for faces that intersect others.

use super::densify::{ConnectedSites, densify};
use super::level_mesh::{LevelMesh, LevelSites};
use super::shared::CoarseToFine;
use crate::mesh::bvh::Bvh;
use crate::mesh::spacing;
use crate::pipeline::clock::Clock;
use crate::pipeline::cost::AttemptCost;
use crate::pipeline::fallback::components::Components;
use crate::pipeline::intersections::{Intersections, intersecting_on_device};
use crate::pipeline::missing::missing_vertices;
use crate::pipeline::near_sites::near_sites;
use crate::pipeline::outcome::{Fault, FaultKind};
use crate::pipeline::user_curves::has_user_curves;
use crate::polish::{
    ConstrainedMesh, FitOptions, MeshCache, OutlierOptions, PolishOptions, fit, polish, reduce_outliers,
};
use crate::progress::{ProgressReporter, ProgressToken};
use crate::sites::cells::{BrokenCell, CellSurface};
use crate::{Phase, Result, TriMesh};
use glam::DVec3;

/// At most so many times sites are moved to faces that intersect others.
const DENSIFICATIONS: u32 = 4;
/// Further rounds of polish where vertices slide along curves.
const ROUNDS_ON_CURVES: u32 = 10;

/// What reports a run: its progress against the estimated cost, and its wall time.
pub(crate) struct Reporting<'a, 'p> {
    pub cost: &'a AttemptCost,
    pub progress: &'a mut ProgressReporter<'p>,
    pub clock: &'a mut Clock,
}

impl CoarseToFine<'_> {
    /// The mesh polished and fitted, and what is wrong with it. If faces intersect others, sites are moved
    /// there from elsewhere.
    pub(crate) fn finish(
        &self,
        on: &CellSurface,
        mut level: LevelMesh,
        level_spacing: f64,
        reporting: &mut Reporting,
    ) -> Result<(LevelMesh, Option<Fault>)> {
        let mut left = DENSIFICATIONS;
        let mut flips_chords = level.on_curves.is_some();
        loop {
            let faces = level.mesh.triangles.clone();
            if !level.is_sound {
                // Of a single component nothing will be left; if local operations fail too, what there is has
                // worse faults than uneven triangles.
                if !self.is_replaced_as_a_whole() {
                    let around = self.polish_and_fit(&mut level, flips_chords, reporting)?;
                    self.mend(&mut level, (around, 0), level_spacing, reporting)?;
                }
                let fault = Fault { kind: FaultKind::Topology, at: level.faulty_place };
                return Ok((level, Some(fault)));
            }
            let mut around = self.polish_and_fit(&mut level, flips_chords, reporting)?;
            let tree = std::mem::take(&mut around.cache).into_tree();
            let Reporting { cost, progress, clock } = &mut *reporting;
            progress.phase(Phase::Check, cost.check.until, cost.check.after)?;
            let intersecting =
                progress.during(|p| self.new_intersections(&mut level, level_spacing, tree, p))?;
            clock.phase("check");
            if intersecting.is_empty() {
                self.mend(&mut level, (around, 0), level_spacing, reporting)?;
                let fault = reporting.progress.during(|p| self.fault_of_shape(&level, level_spacing, p))?;
                return Ok((level, fault));
            }
            if flips_chords {
                // In thin walls, flips between curves may be what made faces intersect.
                flips_chords = false;
                level.mesh = TriMesh { vertices: level.sites.positions.clone(), triangles: faces };
                continue;
            }
            let destinations: Vec<BrokenCell> =
                intersecting.iter().filter_map(|t| self.beside(&level.mesh, *t)).collect();
            let (fixed, sizes) = (level.fixed(), &self.model.sizes);
            let of = ConnectedSites { faces: &faces, fixed: &fixed, spacing: level_spacing, sizes };
            if left == 0 || reporting.progress.leave_out() || !densify(&mut level.sites, &of, &destinations) {
                if !self.is_replaced_as_a_whole() {
                    self.mend(&mut level, (around, intersecting.len()), level_spacing, reporting)?;
                }
                let kind = FaultKind::Intersections(intersecting.len());
                let at = destinations.first().map(|b| b.farthest.0);
                return Ok((level, Some(Fault { kind, at })));
            }
            left -= 1;
            let near = near_sites(self.device, &level.sites.positions)?;
            let moved = LevelSites { sites: level.sites, on_curves: level.on_curves, near };
            level = self.connect(on, moved, level_spacing, reporting.progress)?;
        }
    }

    /// Faces that intersect others and do so at no such place of the input; the level knows how many all are.
    pub(super) fn new_intersections(
        &self,
        level: &mut LevelMesh,
        level_spacing: f64,
        tree: Option<Bvh>,
        progress: &ProgressToken,
    ) -> Result<Vec<u32>> {
        let mesh = (&level.mesh, tree);
        let intersecting = intersecting_on_device(self.device, mesh, self.frame, progress)?;
        let result = (&level.mesh, level_spacing, intersecting);
        let Intersections { count, new } =
            self.input_intersections.compare(self.mesh, self.frame, result, progress)?;
        level.intersecting_faces = Some(count);
        Ok(new)
    }

    /// Whether a mesh of another topology is replaced as a whole by local operations.
    fn is_replaced_as_a_whole(&self) -> bool {
        !has_user_curves(self.options) && Components::new(&self.surface.mesh()).count() == 1
    }

    /// The fault of a mesh that leaves out a part of the surface, such as a pin in a single cell, or has
    /// slivers.
    fn fault_of_shape(
        &self,
        level: &LevelMesh,
        level_spacing: f64,
        progress: &ProgressToken,
    ) -> Result<Option<Fault>> {
        let edges = (level_spacing, &self.model.sizes);
        let missing =
            missing_vertices(&self.surface.mesh(), (&level.mesh, &level.sites.triangles), edges, progress)?;
        let at = |v: &u32| Some(self.surface.vertices[*v as usize]);
        let missing = missing.first().map(|v| Fault { kind: FaultKind::Missing, at: at(v) });
        Ok(missing.or_else(|| {
            Fault::sliver(&level.mesh, &self.surface.mesh(), self.options.coarse_to_fine.feature_angle)
        }))
    }

    /// Where another site would help a face that intersects others: on the surface beside its centre.
    fn beside(&self, mesh: &TriMesh, t: u32) -> Option<BrokenCell> {
        let centre = mesh.corners(t as usize).into_iter().sum::<DVec3>() / 3.0;
        Some(BrokenCell { site: mesh.triangles[t as usize][0], farthest: self.in_a_triangle(centre)? })
    }

    /// A point of the surface near another one, inside the triangle that is given with it, since a curve may
    /// run along its edges.
    pub(super) fn in_a_triangle(&self, p: DVec3) -> Option<(DVec3, u32)> {
        let (point, triangle) = self.model.target.nearest(p)?;
        let corners = self.surface.triangles[triangle as usize].map(|v| self.surface.vertices[v as usize]);
        Some((point.lerp(corners.into_iter().sum::<DVec3>() / 3.0, 0.05), triangle))
    }

    /// Improves the triangles and fits them to the surface; returns what the mesh has to keep, without the
    /// mesh. Whether edges between two vertices on curves are flipped is up to the caller.
    fn polish_and_fit(
        &self,
        level: &mut LevelMesh,
        flips_chords: bool,
        reporting: &mut Reporting,
    ) -> Result<ConstrainedMesh> {
        let Reporting { cost, progress, clock } = reporting;
        let target = &self.model.target;
        progress.phase(Phase::Polish, cost.polish.until, cost.polish.after)?;
        let (mut constrained, under) = (self.constrained(level), &level.sites.triangles);
        let more_rounds = if constrained.sliding_curves.is_empty() { 0 } else { ROUNDS_ON_CURVES };
        let rounds = self.options.coarse_to_fine.polish_rounds + more_rounds;
        let keeps_chords = !flips_chords;
        let options = PolishOptions { rounds, keeps_chords, ..Default::default() };
        // Along curves, vertices slide one after the other.
        let slides = level.on_curves.is_some();
        let mut on_device = if slides { None } else { self.on_device(&mut constrained, under)? };
        if on_device.is_none() {
            constrained.cache = MeshCache::on(target, under);
        }
        progress.during(|progress| match &mut on_device {
            Some(on) => self.polish_on_device(on, &mut constrained.mesh, &options, progress),
            None => polish(&mut constrained, target, &options, progress),
        })?;
        clock.phase("polish");
        if self.options.coarse_to_fine.fit {
            if slides {
                on_device = self.on_device(&mut constrained, under)?;
            }
            progress.phase(Phase::Fit, cost.fit.until, cost.fit.after)?;
            let options = FitOptions::default();
            progress.during(|progress| match &mut on_device {
                Some(on) => self.fit_on_device(on, (&mut constrained, under), &options, progress),
                None => fit(&mut constrained, target, &options, progress).map(drop),
            })?;
            clock.phase("fit");
            if let Some(on) = on_device {
                constrained.cache.keep(on.half_edges);
            }
            let edge = spacing(self.surface.area(), constrained.mesh.vertices.len());
            progress.phase(Phase::Outliers, cost.outliers.until, cost.outliers.after)?;
            let tolerance = self.deviation.unwrap_or(f64::INFINITY);
            let options = OutlierOptions { tolerance, keeps_chords, ..Default::default() };
            let reduced =
                progress.during(|p| reduce_outliers(&mut constrained, target, edge, &options, p))?;
            level.outliers = reduced.left;
            clock.phase("outliers");
        }
        level.mesh = std::mem::take(&mut constrained.mesh);
        Ok(constrained)
    }
}
