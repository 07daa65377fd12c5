//! The mesh of the last level: polished, fitted, and checked for faces that intersect others.

use super::densify::{ConnectedSites, densify};
use super::level_mesh::{LevelCurves, LevelMesh, LevelSites};
use super::mend::Surroundings;
use super::shared::CoarseToFine;
use crate::mesh::NONE;
use crate::mesh::bvh::Bvh;
use crate::mesh::half_edges::{EdgeSet, edge_key};
use crate::mesh::polyline::Polyline;
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
    FitOptions, MeshCache, OutlierOptions, PolishOptions, SlidingCurve, fit, polish, reduce_outliers,
};
use crate::progress::{ProgressReporter, ProgressToken};
use crate::sites::cells::{BrokenCell, CellSurface};
use crate::sites::curve_sites::CurvePosition;
use crate::{Phase, Result, TriMesh};
use glam::DVec3;
use std::collections::HashMap;

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
            let tree = around.tree.take();
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

    /// Improves the triangles and fits them to the surface. Vertices on curves stay on their curve. Whether
    /// edges between two of them are flipped is up to the caller.
    fn polish_and_fit(
        &self,
        level: &mut LevelMesh,
        flips_chords: bool,
        reporting: &mut Reporting,
    ) -> Result<Surroundings> {
        let Reporting { cost, progress, clock } = reporting;
        let target = &self.model.target;
        let fixed = level.fixed();
        let curve_edges = level.curve_edges();
        let patches = self.patches(level, &fixed, &curve_edges);
        let curve_edges = if flips_chords { curve_edges } else { EdgeSet::new() };
        progress.phase(Phase::Polish, cost.polish.until, cost.polish.after)?;
        let sliding_curves =
            level.on_curves.as_ref().map_or_else(Vec::new, |curves| self.sliding_curves(curves));
        let more_rounds = if sliding_curves.is_empty() { 0 } else { ROUNDS_ON_CURVES };
        let rounds = self.options.coarse_to_fine.polish_rounds + more_rounds;
        let lengths = self.model.sizes.at_all(&level.sites.positions, &level.sites.triangles);
        let options = PolishOptions {
            rounds,
            fixed,
            curve_edges,
            patches,
            sliding_curves,
            lengths,
            ..Default::default()
        };
        // Along curves, vertices slide one after the other.
        let slides = level.on_curves.is_some();
        let mut cache = MeshCache::default();
        let mut on_device = if slides { None } else { self.on_device(level, &options, &mut cache)? };
        if on_device.is_none() {
            cache = MeshCache::on(target, &level.sites.triangles);
        }
        let mesh = &mut level.mesh;
        let polished = progress.during(|progress| match &mut on_device {
            Some(on) => self.polish_on_device(on, mesh, &options, progress),
            None => polish(mesh, target, &options, &mut cache, progress),
        })?;
        clock.phase("polish");
        if slides && self.options.coarse_to_fine.fit {
            on_device = self.on_device(level, &options, &mut cache)?;
        }
        let PolishOptions { fixed, curve_edges, patches, lengths, .. } = options;
        let sliding_curves = polished.sliding_curves;
        let (patches_around, lengths_around) = (patches.clone(), lengths.clone());
        if self.options.coarse_to_fine.fit {
            let options = FitOptions { fixed, patches, ..Default::default() };
            progress.phase(Phase::Fit, cost.fit.until, cost.fit.after)?;
            let (mesh, under) = (&mut level.mesh, &level.sites.triangles);
            progress.during(|progress| match &mut on_device {
                Some(on) => self.fit_on_device(on, (mesh, under), &options, progress),
                None => fit(mesh, target, &options, &mut cache, progress).map(drop),
            })?;
            clock.phase("fit");
            if let Some(on) = on_device {
                cache.keep(on.half_edges);
            }
            let FitOptions { fixed, patches, .. } = options;
            let edge = spacing(self.surface.area(), mesh.vertices.len());
            progress.phase(Phase::Outliers, cost.outliers.until, cost.outliers.after)?;
            let tolerance = self.deviation.unwrap_or(f64::INFINITY);
            let options =
                OutlierOptions { fixed, curve_edges, patches, lengths, tolerance, ..Default::default() };
            let reduced = progress
                .during(|progress| reduce_outliers(mesh, target, edge, &options, &mut cache, progress))?;
            level.outliers = reduced.left;
            clock.phase("outliers");
        }
        let tree = cache.into_tree();
        Ok(Surroundings { patches: patches_around, sliding_curves, lengths: lengths_around, tree })
    }

    /// The curves with the sites that slide along them.
    fn sliding_curves(&self, on_curves: &LevelCurves) -> Vec<SlidingCurve> {
        let Some(curves) = &self.model.curves else { return Vec::new() };
        let sliding_curve = |line: &Polyline| SlidingCurve { line: line.clone(), sliders: Vec::new() };
        let mut sliding_curves: Vec<SlidingCurve> = curves.polylines().map(sliding_curve).collect();
        let mut sliders: Vec<(usize, usize)> = on_curves.pinned().map(|(v, pin)| (pin, v)).collect();
        // The curve sites are in order along each curve.
        sliders.sort_unstable();
        for (pin, v) in sliders {
            let CurvePosition { curve, arc_length } = on_curves.sites.curve_positions[pin];
            if let Some(sliding_curve) = sliding_curves.get_mut(curve as usize) {
                sliding_curve.sliders.push((v as u32, arc_length));
            }
        }
        sliding_curves
    }

    /// The patch of every face; empty on surfaces without curves. Faces with all corners on curves have that
    /// of the faces beside them, [`NONE`] if all of these are such faces too.
    fn patches(&self, level: &LevelMesh, on_curve: &[bool], curve_edges: &EdgeSet) -> Vec<u32> {
        let Some(curves) = &self.model.curves else { return Vec::new() };
        let patch = |face: &[u32; 3]| {
            let interior = face.iter().find(|v| !on_curve[**v as usize]);
            interior.map_or(NONE, |v| curves.patches[level.sites.triangles[*v as usize] as usize])
        };
        let mut patches: Vec<u32> = level.mesh.triangles.iter().map(patch).collect();
        spread(&mut patches, &level.mesh.triangles, curve_edges);
        patches
    }
}

/// Gives faces without a patch that of the faces beside them, across edges that are not on curves.
fn spread(patches: &mut [u32], faces: &[[u32; 3]], curve_edges: &EdgeSet) {
    let mut unknown: Vec<usize> = (0..faces.len()).filter(|t| patches[*t] == NONE).collect();
    if unknown.is_empty() {
        return;
    }
    let edges = |t: usize| {
        let [a, b, c] = faces[t];
        [(a, b), (b, c), (c, a)].map(|(a, b)| edge_key(a, b))
    };
    let mut beside: HashMap<(u32, u32), Vec<usize>> = HashMap::new();
    for edge in unknown.iter().flat_map(|t| edges(*t)).filter(|edge| !curve_edges.contains(edge)) {
        beside.entry(edge).or_default();
    }
    for t in 0..faces.len() {
        for edge in edges(t) {
            if let Some(list) = beside.get_mut(&edge) {
                list.push(t);
            }
        }
    }
    loop {
        let known = |t: &usize| {
            let around = edges(*t).into_iter().filter_map(|edge| beside.get(&edge)).flatten();
            around.map(|s| patches[*s]).find(|patch| *patch != NONE).map(|patch| (*t, patch))
        };
        let found: Vec<(usize, u32)> = unknown.iter().filter_map(known).collect();
        if found.is_empty() {
            return;
        }
        found.into_iter().for_each(|(t, patch)| patches[t] = patch);
        unknown.retain(|t| patches[*t] == NONE);
    }
}
