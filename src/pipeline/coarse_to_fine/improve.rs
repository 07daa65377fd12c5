//! The mesh of the last level improved: all passes, in order.

use super::densify::{ConnectedSites, densify};
use super::device_polish::MeshOnDevice;
use super::level_mesh::{LevelMesh, LevelSites};
use super::shared::CoarseToFine;
use crate::local::Mended;
use crate::mesh::bvh::Bvh;
use crate::mesh::half_edges::{EdgeSet, edge_key};
use crate::mesh::spacing;
use crate::pipeline::clock::Clock;
use crate::pipeline::cost::{AttemptCost, PhaseCost};
use crate::pipeline::fallback::components::Components;
use crate::pipeline::intersections::{Intersections, intersecting_on_device};
use crate::pipeline::missing::missing_vertices;
use crate::pipeline::near_sites::near_sites;
use crate::pipeline::outcome::{Fault, FaultKind};
use crate::polish::{
    ConstrainedMesh, FitOptions, MeshCache, Outlier, OutlierOptions, PolishOptions, add_ridges, fit, line_up,
    polish_beside, reduce_outliers,
};
use crate::progress::{ProgressReporter, ProgressToken};
use crate::sites::cells::{BrokenCell, CellSurface};
use crate::{Phase, Result, TriMesh};
use glam::DVec3;

/// Maximum number of times that sites are moved to faces that intersect others.
const DENSIFICATIONS: u32 = 4;
/// Further rounds of polish where vertices slide along curves.
const ROUNDS_ON_CURVES: u32 = 10;

/// What reports a run: its progress against the estimated cost, and its wall time.
pub(crate) struct Reporting<'a, 'p> {
    pub cost: &'a AttemptCost,
    pub progress: &'a mut ProgressReporter<'p>,
    pub clock: &'a mut Clock,
}

impl Reporting<'_, '_> {
    /// Does the work of a phase, reported and timed.
    pub fn pass<T: Send>(
        &mut self,
        phase: Phase,
        cost: PhaseCost,
        work: impl FnOnce(&ProgressToken) -> Result<T> + Send,
    ) -> Result<T> {
        self.progress.phase(phase, cost.until, cost.after)?;
        let done = self.progress.during(work)?;
        self.clock.end_phase(phase.name());
        Ok(done)
    }
}

/// The mesh of the last level as the passes leave it, with what they found.
pub(crate) struct Improved {
    pub mesh: ConstrainedMesh,
    /// The sites and how they were connected. After mending, the sites are the mesh's vertices.
    pub level: LevelMesh,
    /// The level's edge length.
    pub spacing: f64,
    /// Places of the surface that the fit left far from the mesh.
    pub outliers: Vec<Outlier>,
    /// Number of faces that intersect others, once it is known.
    pub intersecting_faces: Option<usize>,
    /// What was done about small angles.
    pub mended: Option<Mended>,
    /// What is wrong with the mesh.
    pub fault: Option<Fault>,
}

/// Faces that intersect others where none of the input do.
#[derive(Default)]
struct NewIntersections {
    faces: usize,
    /// Where another site would help each.
    places: Vec<BrokenCell>,
}

/// What was changed because new self-intersections appeared.
struct Retries {
    /// Whether edges between vertices on curves are not flipped.
    keeps_chords: bool,
    densifications: u32,
}

impl CoarseToFine<'_> {
    /// Improves the mesh of the last level by all passes, in order, and finds out what is wrong with it then.
    /// If new self-intersections appear, it starts again: without flips between curves, then with moved
    /// sites as long as these keep the topology.
    pub(crate) fn improve(
        &self,
        on: &CellSurface,
        mut level: LevelMesh,
        spacing: f64,
        reporting: &mut Reporting,
    ) -> Result<Improved> {
        let mut retries = Retries { keeps_chords: level.on_curves.is_none(), densifications: 0 };
        loop {
            let mut now = Improved::new(self.constrained(&level), level, spacing);
            // If local operations fail too, what there is has worse faults than uneven triangles.
            let is_kept = now.level.is_sound || !self.is_replaced_as_a_whole(&now);
            if is_kept {
                let on_device = self.polish(&mut now, &retries, reporting)?;
                if self.context.options.coarse_to_fine.fit {
                    self.fit(&mut now, on_device, reporting)?;
                    self.reduce_outliers(&mut now, &retries, reporting)?;
                }
            }
            let found = self.check(&mut now, reporting)?;
            // Instead of one along ridges that intersects itself, the first mesh is kept.
            let is_second_mesh = !now.level.on_ridges.is_empty();
            if found.faces > 0
                && !is_second_mesh
                && let Some(next) = self.another_try(on, &now, &found, &mut retries, reporting)?
            {
                level = next;
                continue;
            }
            if is_second_mesh {
                // Mending takes longest, and brings a mesh no closer.
                if self.rms(&now.mesh.mesh, reporting)? > now.level.most_rms {
                    return Ok(now);
                }
                add_ridges(&mut now.mesh);
            }
            if is_kept && (found.faces == 0 || !self.is_replaced_as_a_whole(&now)) {
                self.mend_and_smooth(&mut now, found.faces, reporting)?;
            }
            now.fault = self.find_fault(&now, &found, reporting)?;
            return Ok(now);
        }
    }

    /// Improves the triangles by flips and by moves over the surface. Returns the mesh on the device, if that
    /// has done it.
    fn polish(
        &self,
        now: &mut Improved,
        retries: &Retries,
        reporting: &mut Reporting,
    ) -> Result<Option<MeshOnDevice>> {
        let (target, slides) = (&self.model.target, now.level.on_curves.is_some());
        let (mesh, under) = (&mut now.mesh, &now.level.sites.triangles);
        let more_rounds = if mesh.sliding_curves.is_empty() { 0 } else { ROUNDS_ON_CURVES };
        let rounds = self.context.options.coarse_to_fine.polish_rounds + more_rounds;
        let options = PolishOptions { rounds, keeps_chords: retries.keeps_chords, ..Default::default() };
        // Along curves, vertices slide one after the other.
        let held = &now.level.on_ridges;
        let mut on_device = if slides || !held.is_empty() { None } else { self.on_device(mesh, under)? };
        if on_device.is_none() {
            mesh.cache = MeshCache::on(target, under);
        }
        reporting.pass(Phase::Polish, reporting.cost.polish, |progress| match &mut on_device {
            Some(on) => self.polish_on_device(on, &mut mesh.mesh, &options, progress),
            None => polish_beside(mesh, held, target, &options, progress),
        })?;
        if !held.is_empty() {
            reporting
                .progress
                .during(|progress| line_up(mesh, held, (target, &self.model.sizes), progress))?;
        }
        Ok(on_device)
    }

    /// Brings the faces closer to the surface.
    fn fit(
        &self,
        now: &mut Improved,
        mut on_device: Option<MeshOnDevice>,
        reporting: &mut Reporting,
    ) -> Result<()> {
        let slides = now.level.on_curves.is_some() || !now.level.on_ridges.is_empty();
        let options = FitOptions::default();
        let (mesh, under) = (&mut now.mesh, &now.level.sites.triangles);
        if slides && self.context.device.fits_along_curves(mesh.mesh.vertices.len()) {
            on_device = self.on_device(mesh, under)?;
        }
        reporting.pass(Phase::Fit, reporting.cost.fit, |progress| match &mut on_device {
            Some(on) => self.fit_on_device(on, (mesh, under), &options, progress),
            None => fit(mesh, &self.model.target, &options, progress).map(drop),
        })?;
        if let Some(on) = on_device {
            mesh.cache.keep(on.half_edges);
        }
        Ok(())
    }

    /// Brings mesh and surface closer where they are farthest apart.
    fn reduce_outliers(
        &self,
        now: &mut Improved,
        retries: &Retries,
        reporting: &mut Reporting,
    ) -> Result<()> {
        let (mesh, target) = (&mut now.mesh, &self.model.target);
        let edge = spacing(self.context.surface.area(), mesh.mesh.vertices.len());
        let tolerance = self.context.deviation.unwrap_or(f64::INFINITY);
        let options = OutlierOptions { tolerance, keeps_chords: retries.keeps_chords, ..Default::default() };
        let reduced = reporting.pass(Phase::Outliers, reporting.cost.outliers, |progress| {
            reduce_outliers(mesh, target, edge, &options, progress)
        })?;
        now.outliers = reduced.left;
        Ok(())
    }

    /// Finds the faces that intersect others; not in a mesh of another topology, which has a worse fault.
    fn check(&self, now: &mut Improved, reporting: &mut Reporting) -> Result<NewIntersections> {
        let tree = std::mem::take(&mut now.mesh.cache).into_tree();
        if !now.level.is_sound {
            return Ok(NewIntersections::default());
        }
        let faces = reporting.pass(Phase::Check, reporting.cost.check, |progress| {
            self.new_intersections(now, tree, progress)
        })?;
        let places = faces.iter().filter_map(|t| self.beside(&now.mesh.mesh, *t)).collect();
        Ok(NewIntersections { faces: faces.len(), places })
    }

    /// Faces that intersect others and do so at no such place of the input; how many all are is known then.
    pub(super) fn new_intersections(
        &self,
        now: &mut Improved,
        tree: Option<Bvh>,
        progress: &ProgressToken,
    ) -> Result<Vec<u32>> {
        let mesh = &now.mesh.mesh;
        let intersecting =
            intersecting_on_device(self.context.device, (mesh, tree), self.context.frame, progress)?;
        let result = (mesh, now.spacing, intersecting);
        let Intersections { count, new } = self.context.input_intersections.compare(
            self.context.mesh,
            self.context.frame,
            result,
            progress,
        )?;
        now.intersecting_faces = Some(count);
        Ok(new)
    }

    /// The level's mesh for another try, if one may help: the same, for one without flips between curves; or
    /// one with sites moved to the faces that intersect others, which are then connected again.
    fn another_try(
        &self,
        on: &CellSurface,
        now: &Improved,
        found: &NewIntersections,
        retries: &mut Retries,
        reporting: &mut Reporting,
    ) -> Result<Option<LevelMesh>> {
        let Improved { mesh, level, spacing, .. } = now;
        if !retries.keeps_chords {
            // In thin walls, flips between curves may be what made faces intersect.
            retries.keeps_chords = true;
            return Ok(Some(level.clone()));
        }
        if retries.densifications == DENSIFICATIONS || reporting.progress.leave_out() {
            return Ok(None);
        }
        let (faces, fixed, sizes) = (&level.mesh.triangles, &mesh.fixed, &self.model.sizes);
        let of = ConnectedSites { faces, fixed, spacing: *spacing, sizes };
        let mut sites = level.sites.clone();
        if !densify(&mut sites, &of, &found.places) {
            return Ok(None);
        }
        retries.densifications += 1;
        let near = near_sites(self.context.device, &sites.positions)?;
        let moved = LevelSites { sites, on_curves: level.on_curves.clone(), near };
        let next = self.connect(on, moved, *spacing, reporting.progress)?;
        if !next.is_sound {
            // That is a worse fault. It happens beside triangles of the surface that are folded over.
            reporting.progress.would_simplify(false);
            return Ok(None);
        }
        Ok(Some(next))
    }

    /// Whether a faulty mesh is replaced as a whole by local operations.
    fn is_replaced_as_a_whole(&self, now: &Improved) -> bool {
        if self.context.plan.has_kept() {
            return false;
        }
        let surface = self.context.surface.mesh();
        let components = Components::new(&surface);
        components.count() == 1
            || components.are_replaced(&surface, &now.mesh.mesh, &now.level.sites.triangles)
    }

    /// What is wrong with the mesh in the end, the worst first.
    fn find_fault(
        &self,
        now: &Improved,
        found: &NewIntersections,
        reporting: &mut Reporting,
    ) -> Result<Option<Fault>> {
        if !now.level.is_sound {
            return Ok(Some(Fault { kind: FaultKind::Topology, at: now.level.faulty_place }));
        }
        if let Some(at) = self.missing_whole_edge(&now.mesh) {
            return Ok(Some(Fault { kind: FaultKind::Topology, at: Some(at) }));
        }
        if let Some(missing) = reporting.progress.during(|progress| self.missing(now, progress))? {
            return Ok(Some(missing));
        }
        if found.faces > 0 {
            let at = found.places.first().map(|place| place.farthest.0);
            return Ok(Some(Fault { kind: FaultKind::Intersections(found.faces), at }));
        }
        let feature_angle = self.context.options.coarse_to_fine.feature_angle;
        Ok(Fault::sliver(&now.mesh.mesh, &self.context.surface.mesh(), feature_angle))
    }

    /// The middle of an edge that was to stay whole and is none of the mesh.
    fn missing_whole_edge(&self, constrained: &ConstrainedMesh) -> Option<DVec3> {
        let curves = self.model.curves.as_deref()?;
        // Ridges are numbered behind the curves.
        let is_whole = |curve: u32| curves.curves.get(curve as usize).is_some_and(|path| path.is_whole);
        let whole = constrained.curve_edges.iter().filter(|edge| is_whole(edge.curve));
        let mut missing: EdgeSet = whole.map(|edge| edge_key(edge.ends[0], edge.ends[1])).collect();
        if missing.is_empty() {
            return None;
        }
        for &[a, b, c] in &constrained.mesh.triangles {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                missing.remove(&edge_key(a, b));
            }
        }
        let at = |v: u32| constrained.mesh.vertices[v as usize];
        missing.into_iter().min().map(|(a, b)| at(a).midpoint(at(b)))
    }

    /// The fault of a mesh that leaves out a part of the surface, such as a pin in a single cell.
    fn missing(&self, now: &Improved, progress: &ProgressToken) -> Result<Option<Fault>> {
        let (mesh, edges) = (&now.mesh.mesh, (now.spacing, &self.model.sizes));
        let surface = self.context.surface.mesh();
        let missing = missing_vertices(&surface, (mesh, &now.level.sites.triangles), edges, progress)?;
        let at = |v: &u32| Some(self.context.surface.vertices[*v as usize]);
        Ok(missing.first().map(|v| Fault { kind: FaultKind::Missing, at: at(v) }))
    }

    /// Where another site would help a face that intersects others: on the surface near its centre.
    fn beside(&self, mesh: &TriMesh, t: u32) -> Option<BrokenCell> {
        let centre = mesh.corners(t as usize).into_iter().sum::<DVec3>() / 3.0;
        Some(BrokenCell { site: mesh.triangles[t as usize][0], farthest: self.in_a_triangle(centre)? })
    }

    /// A point of the surface near another one, inside the triangle that is given with it, since a curve may
    /// run along its edges.
    pub(super) fn in_a_triangle(&self, p: DVec3) -> Option<(DVec3, u32)> {
        let (point, triangle) = self.model.target.nearest(p)?;
        let surface = self.context.surface;
        let corners = surface.triangles[triangle as usize].map(|v| surface.vertices[v as usize]);
        Some((point.lerp(corners.into_iter().sum::<DVec3>() / 3.0, 0.05), triangle))
    }
}

impl Improved {
    fn new(mesh: ConstrainedMesh, level: LevelMesh, spacing: f64) -> Self {
        let (outliers, intersecting_faces, mended, fault) = (Vec::new(), None, None, None);
        Self { mesh, level, spacing, outliers, intersecting_faces, mended, fault }
    }
}
