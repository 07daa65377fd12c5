//! Small angles of the last level's mesh mended by local edits.

use super::finish::Reporting;
use super::level_mesh::{LevelCurves, LevelMesh};
use super::shared::CoarseToFine;
use crate::local::{MendOptions, Mended, mend_angles};
use crate::mesh::NONE;
use crate::mesh::bvh::Bvh;
use crate::mesh::polyline::Polyline;
use crate::mesh::submesh::used_vertices;
use crate::polish::{ConstrainedMesh, CurveEdge, SlidingCurve};
use crate::sites::on_surface::SitesOnSurface;
use crate::{Phase, ProgressToken, Result, TriMesh};

/// What the polish knows of a mesh besides its triangles.
pub(crate) struct Surroundings {
    /// The patch of each triangle.
    pub patches: Vec<u32>,
    pub sliding_curves: Vec<SlidingCurve>,
    /// The relative target edge length at each vertex.
    pub lengths: Vec<f64>,
    /// A hierarchy over its triangles, from before they moved; `None` if none was needed.
    pub tree: Option<Bvh>,
}

impl CoarseToFine<'_> {
    /// Mends small angles, unless more faces then intersect in the input's units where none of the input do:
    /// `intersecting` do now. The sites of the level are then the mesh's vertices.
    pub(crate) fn mend(
        &self,
        level: &mut LevelMesh,
        (around, intersecting): (Surroundings, usize),
        level_spacing: f64,
        reporting: &mut Reporting,
    ) -> Result<()> {
        let Reporting { cost, progress, clock } = reporting;
        progress.phase(Phase::Mend, cost.mend.until, cost.mend.after)?;
        let before = level.mesh.clone();
        let mut mended = progress.during(|p| self.mend_mesh(level, around, level_spacing, p))?;
        if !mended.origins.is_empty() {
            // Sites without a triangle, in a component that local operations replace, are counted on.
            let unused = unused_vertices(&before);
            level.mesh.vertices.extend(unused.iter().map(|v| before.vertices[*v as usize]));
            mended.origins.extend(unused);
            let count = level.intersecting_faces;
            let new = match count {
                Some(_) => progress.during(|p| self.new_intersections(level, level_spacing, None, p))?.len(),
                None => 0,
            };
            if new > intersecting {
                (level.mesh, level.intersecting_faces) = (before, count);
            } else {
                self.renew_sites(level, &mended.origins);
                level.mended = Some(mended);
            }
        }
        clock.phase("mend");
        Ok(())
    }

    fn mend_mesh(
        &self,
        level: &mut LevelMesh,
        around: Surroundings,
        level_spacing: f64,
        progress: &ProgressToken,
    ) -> Result<Mended> {
        let min_angle = self.options.coarse_to_fine.min_angle;
        let Surroundings { patches, sliding_curves, lengths, .. } = around;
        let curve_edges = match (&level.on_curves, &self.model.curves) {
            (Some(on_curves), Some(curves)) => on_curves.curve_edges(curves.polylines()),
            _ => Vec::new(),
        };
        let fixed = level.fixed();
        let mesh = std::mem::take(&mut level.mesh);
        let mut local = ConstrainedMesh { mesh, patches, fixed, curve_edges, lengths, ..Default::default() };
        local.slide_to(sliding_curves);
        let options = MendOptions { min_angle, spacing: level_spacing, deviation: self.deviation };
        let mended = mend_angles(&mut local, &self.model.target, &options, progress);
        let changed = mended.and_then(|mended| {
            let inserted = self.insert(&mut local, level_spacing, progress)?;
            if inserted.is_empty() {
                return Ok(mended);
            }
            let curve_vertices = local.fixed.iter().filter(|fixed| **fixed).count();
            Ok(Mended { curve_vertices, origins: after_both(&mended.origins, inserted), ..mended })
        });
        level.mesh = local.mesh;
        changed
    }

    /// Makes the mesh's vertices the sites; `origins` are the sites that they were, [`NONE`] for new ones.
    fn renew_sites(&self, level: &mut LevelMesh, origins: &[u32]) {
        let positions = level.mesh.vertices.clone();
        let triangle = |(v, origin): (usize, &u32)| match *origin {
            NONE => self.model.target.nearest(positions[v]).map_or(0, |(_, t)| t),
            origin => level.sites.triangles[origin as usize],
        };
        let triangles = origins.iter().enumerate().map(triangle).collect();
        level.sites = SitesOnSurface { positions, triangles };
    }
}

/// The origins after two changes; an empty list means that the first one changed nothing.
pub(super) fn after_both(first: &[u32], second: Vec<u32>) -> Vec<u32> {
    if first.is_empty() {
        return second;
    }
    second.into_iter().map(|v| if v == NONE { NONE } else { first[v as usize] }).collect()
}

/// The vertices that no triangle uses.
fn unused_vertices(mesh: &TriMesh) -> Vec<u32> {
    let is_used = used_vertices(mesh.vertices.len(), &mesh.triangles);
    (0..).zip(is_used).filter(|(_, used)| !used).map(|(v, _)| v).collect()
}

impl LevelCurves {
    /// The edges along these curves, with the arc lengths of the sites before they slide.
    fn curve_edges<'a>(&self, polylines: impl Iterator<Item = &'a Polyline>) -> Vec<CurveEdge> {
        let mut vertices = vec![NONE; self.sites.positions.len()];
        self.pinned().for_each(|(v, pin)| vertices[pin] = v as u32);
        let lines: Vec<&Polyline> = polylines.collect();
        let mut inner = vec![0usize; lines.len()];
        for position in &self.sites.curve_positions {
            if let Some(count) = inner.get_mut(position.curve as usize) {
                *count += 1;
            }
        }
        let mut edges: Vec<CurveEdge> = Vec::with_capacity(self.sites.segments.len());
        let mut segments = self.sites.segments.iter();
        for ((curve, line), inner) in (0..).zip(lines).zip(inner) {
            let count = if line.is_closed() { inner } else { inner + 1 };
            let mut from = 0.0;
            for (k, pair) in segments.by_ref().take(count).enumerate() {
                let end = self.sites.curve_positions[pair[1] as usize].arc_length;
                let to = if k + 1 < count { end } else { line.length() };
                edges.push(CurveEdge { ends: pair.map(|site| vertices[site as usize]), curve, from, to });
                from = to;
            }
        }
        edges
    }
}
