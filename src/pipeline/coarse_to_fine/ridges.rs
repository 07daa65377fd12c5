//! Sites on ridges that no curve marks: a second mesh of the last level, kept if it is closer to the surface.

use super::improve::{Improved, Reporting};
use super::level_mesh::{LevelMesh, LevelSites};
use super::score::Score;
use super::shared::CoarseToFine;
use crate::mesh::distance::rms_distance;
use crate::mesh::half_edges::EdgeTable;
use crate::options::Sizing;
use crate::pipeline::near_sites::near_sites;
use crate::pipeline::outcome::FaultKind;
use crate::polish::{FEW_ROUNDS, PulledSite, pull_sites};
use crate::sites::cells::CellSurface;
use crate::sites::on_surface::SitesOnSurface;
use crate::{Result, TriMesh};
use glam::DVec3;
use std::collections::BTreeSet;

/// Meshes with more vertices get no second mesh, since the host would take too long.
const MOST_VERTICES: usize = 20_000;
/// Edges where a mesh turns by at least this many degrees are sharp.
const SHARP: f64 = 35.0;
/// The least share of the vertices that are on sharp edges.
const LEAST_SHARP: f64 = 0.003;
/// Edges where a mesh turns by less than this many degrees are in a plane.
const PLANE: f64 = 0.1;
/// The least share of the edges that are in planes: ridges stand out only where much of the surface is flat,
/// as on CAD parts.
const LEAST_PLANE: f64 = 0.2;
/// Share of a spacing by which sites are moved off the edges of the surface's triangles.
const OFF_EDGES: f64 = 5e-4;

/// The second mesh is better if its root mean square distance is at most this share of the first one's, its
/// smallest angle at least this share, and its mean quality lower by no more: the second row allows more for
/// a much closer mesh.
const CLOSER: [[f64; 3]; 2] = [[0.9, 0.7, 0.02], [0.6, 0.55, 0.03]];
/// If a larger share of the first mesh's triangles has an angle below 30 degrees, features are too close to
/// each other for a second one to be better.
const MOST_NARROW: f64 = 0.06;
/// The second mesh is dropped if, before its small angles are mended, it has more than this share of the
/// first one's distance.
const STILL_CLOSER: f64 = 0.95;
/// At most this share of its triangles may have an angle below 30 degrees beyond those of the first one.
const MOST_ADDED_NARROW: f64 = 0.02;
/// A smallest angle of at least this many degrees is large enough, whatever the first one's.
const WIDE: f64 = 25.0;
/// The second mesh may not bring the smallest angle below this many degrees.
const SMALL: f64 = 15.0;

impl CoarseToFine<'_> {
    /// A copy of the last level if it has ridges that no curve marks.
    pub(super) fn ridged(&self, level: &LevelMesh) -> Option<LevelMesh> {
        (self.may_pull(level) && has_ridges(level)).then(|| level.clone())
    }

    /// The level with its sites pulled onto ridges; `None` if the mesh that connects them is not sound.
    fn pulled(
        &self,
        on: &CellSurface,
        level: &LevelMesh,
        spacing: f64,
        reporting: &mut Reporting,
    ) -> Result<Option<LevelMesh>> {
        let (fixed, on_surface) = (level.fixed(), (&self.model.target, &self.model.sizes));
        let pulled =
            reporting.progress.during(|progress| pull_sites(&level.mesh, &fixed, on_surface, progress))?;
        let sites = self.on_surface(level, &pulled, spacing);
        let near = near_sites(self.context.device, &sites.positions)?;
        let (before, on_curves) = (sites.positions.clone(), level.on_curves.clone());
        let sites = LevelSites { sites, on_curves, near };
        let mut connected = self.connect(on, sites, spacing, reporting.progress)?;
        // Those that were moved into broken cells stay there.
        let stays = |v: usize| connected.sites.positions[v] == before[v];
        let on_ridges = pulled.iter().enumerate().map(|(v, site)| site.is_on_ridge && stays(v)).collect();
        let position = |(v, site): (usize, &PulledSite)| {
            if stays(v) { site.at } else { connected.sites.positions[v] }
        };
        connected.mesh.vertices = pulled.iter().enumerate().map(position).collect();
        connected.on_ridges = on_ridges;
        Ok(Some(LevelMesh { flags: level.flags, ..connected }).filter(|connected| connected.is_sound))
    }

    /// Whether the sites of a level may be pulled: where no lengths are asked for, with polish and fit, on a
    /// surface whose sharp edges are to be kept.
    fn may_pull(&self, level: &LevelMesh) -> bool {
        let method = &self.context.options.coarse_to_fine;
        level.is_sound
            && level.sites.len() <= MOST_VERTICES
            && (self.model.sizes.is_uniform() || self.context.plan.sizing == Sizing::Automatic)
            && self.context.deviation.is_none()
            && method.fit
            && method.polish_rounds > FEW_ROUNDS
            && method.feature_angle < 180.0
    }

    /// Pulled sites back on the surface, each on its sheet and in its patch.
    fn on_surface(&self, level: &LevelMesh, pulled: &[PulledSite], spacing: f64) -> SitesOnSurface {
        let (surface, target) = (self.context.surface, &self.model.target);
        let patch = |t: u32| self.model.curves.as_deref().map_or(0, |curves| curves.patches[t as usize]);
        let fixed = level.fixed();
        let mut sites = SitesOnSurface::with_capacity(pulled.len());
        let mut rank = 0;
        for (v, site) in pulled.iter().enumerate() {
            let (at, home) = (level.sites.positions[v], level.sites.triangles[v]);
            let is_on_sheet =
                |t: u32| surface.normals[t as usize].dot(site.normal) > 0.0 && patch(t) == patch(home);
            let is_fixed = fixed.get(v).copied().unwrap_or(false);
            let found = (!is_fixed).then(|| target.bvh().closest_accepted(site.at, &mut rank, is_on_sheet));
            let Some(found) = found.flatten() else {
                sites.push(at, home);
                continue;
            };
            let corners = surface.triangles[found.triangle as usize].map(|v| surface.vertices[v as usize]);
            let inwards = corners.into_iter().sum::<DVec3>() / 3.0 - found.point;
            let step = (0.5 * inwards).clamp_length_max(OFF_EDGES * spacing);
            sites.push(found.point + step, found.triangle);
        }
        sites
    }

    /// The first mesh, or one of the level with its sites pulled onto ridges if that is better. Where the
    /// first one has lost its topology or intersects itself, walls are thin, and no other is made.
    pub(super) fn closer(
        &self,
        on: &CellSurface,
        (first, level): (Improved, &LevelMesh),
        spacing: f64,
        reporting: &mut Reporting,
    ) -> Result<Improved> {
        let kind = first.fault.as_ref().map(|fault| fault.kind);
        let is_thin = matches!(kind, Some(FaultKind::Topology | FaultKind::Intersections(_)));
        if is_thin || reporting.progress.leave_out() {
            return Ok(first);
        }
        let score = self.score(&first, reporting)?;
        if score.narrow > MOST_NARROW {
            return Ok(first);
        }
        let Some(mut pulled) = self.pulled(on, level, spacing, reporting)? else { return Ok(first) };
        pulled.most_rms = STILL_CLOSER * score.rms;
        let second = self.improve(on, pulled, spacing, reporting)?;
        let is_better = self.score(&second, reporting)?.is_closer_than(&score);
        Ok(if is_better { second } else { first })
    }

    /// The number of vertices on curves; those on ridges do not count.
    pub(super) fn vertices_on_curves(&self, improved: &Improved) -> usize {
        let Some(mended) = &improved.mended else {
            let on_curves = improved.level.on_curves.as_ref();
            return on_curves.map_or(0, |on_curves| on_curves.sites.positions.len());
        };
        if improved.level.on_ridges.is_empty() {
            return mended.curve_vertices;
        }
        let curves = self.model.curves.as_deref().map_or(0, |curves| curves.polylines().count());
        let edges = improved.mesh.curve_edges.iter().filter(|edge| (edge.curve as usize) < curves);
        edges.flat_map(|edge| edge.ends).collect::<BTreeSet<u32>>().len()
    }

    /// The root mean square distance between a mesh and the surface.
    pub(super) fn rms(&self, mesh: &TriMesh, reporting: &mut Reporting) -> Result<f64> {
        let surface = self.context.surface.mesh();
        reporting.progress.during(|progress| rms_distance(mesh, &surface, progress))
    }

    fn score(&self, improved: &Improved, reporting: &mut Reporting) -> Result<Score> {
        let (mesh, surface) = (&improved.mesh.mesh, self.context.surface.mesh());
        let fault = improved.fault.as_ref();
        reporting.progress.during(|progress| Score::of(mesh, fault, &surface, progress))
    }
}

impl Score {
    /// Whether it is clearly closer to the surface, and its triangles are nearly as good.
    fn is_closer_than(&self, first: &Self) -> bool {
        let is_closer = |[closer, narrower, quality_loss]: [f64; 3]| {
            self.rms <= closer * first.rms
                && self.smallest >= WIDE.min(narrower * first.smallest)
                && self.quality >= first.quality - quality_loss
        };
        self.fault <= first.fault
            && self.smallest >= SMALL.min(first.smallest)
            && self.narrow <= first.narrow + MOST_ADDED_NARROW
            && CLOSER.into_iter().any(is_closer)
    }
}

/// Whether a mesh turns sharply at edges that are not on curves, and has enough edges in planes.
fn has_ridges(level: &LevelMesh) -> bool {
    let mesh = &level.mesh;
    let on_curves = level.on_curves.as_ref().map(|curves| curves.edges()).unwrap_or_default();
    let normals: Vec<DVec3> =
        (0..mesh.triangles.len()).map(|t| mesh.doubled_normal(t).normalize_or_zero()).collect();
    let [sharp, plane] = [SHARP, PLANE].map(|degrees| degrees.to_radians().cos());
    let mut is_sharp = vec![false; mesh.vertices.len()];
    let (mut edges, mut in_planes) = (0, 0);
    for edge in EdgeTable::new(&mesh.triangles).edges() {
        let [one, other] = edge else { continue };
        let (a, b) = one.ends();
        let cosine = normals[one.triangle()].dot(normals[other.triangle()]);
        edges += 1;
        in_planes += usize::from(cosine > plane);
        if cosine < sharp && !on_curves.contains(&(a, b)) {
            (is_sharp[a as usize], is_sharp[b as usize]) = (true, true);
        }
    }
    let on_sharp = is_sharp.iter().filter(|is_sharp| **is_sharp).count();
    on_sharp as f64 >= LEAST_SHARP * is_sharp.len() as f64
        && on_sharp > 0
        && in_planes as f64 >= LEAST_PLANE * f64::from(edges)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_closer_mesh_is_better_if_its_angles_allow_it() {
        let first = Score { fault: None, rms: 1.0, smallest: 30.0, narrow: 0.0, quality: 0.9 };
        for (second, is_better) in [
            (Score { rms: 0.9, ..first }, true),
            (Score { rms: 0.95, ..first }, false),
            (Score { rms: 0.8, smallest: 21.0, quality: 0.885, ..first }, true),
            (Score { rms: 0.8, smallest: 20.0, ..first }, false),
            (Score { rms: 0.8, quality: 0.875, ..first }, false),
            (Score { rms: 0.5, smallest: 17.0, quality: 0.875, ..first }, true),
            (Score { rms: 0.5, smallest: 16.0, ..first }, false),
            (Score { rms: 0.5, quality: 0.865, ..first }, false),
            (Score { rms: 0.5, narrow: 0.03, ..first }, false),
            (Score { rms: 0.5, fault: Some(FaultKind::Missing), ..first }, false),
        ] {
            assert_eq!(second.is_closer_than(&first), is_better, "{second:?}");
        }
        let small = Score { smallest: 20.0, ..first };
        assert!(!Score { rms: 0.5, smallest: 14.0, ..small }.is_closer_than(&small));
        // Above 25 degrees, no angle is too small.
        let even = Score { smallest: 42.0, ..first };
        assert!(Score { rms: 0.5, smallest: 26.0, ..even }.is_closer_than(&even));
    }
}
