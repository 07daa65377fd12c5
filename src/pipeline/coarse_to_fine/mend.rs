//! Small angles of the last level's mesh mended by local edits.

use super::finish::Reporting;
use super::level_mesh::LevelMesh;
use super::shared::CoarseToFine;
use crate::local::{MendOptions, Mended, mend_angles};
use crate::mesh::NONE;
use crate::mesh::submesh::used_vertices;
use crate::polish::ConstrainedMesh;
use crate::sites::on_surface::SitesOnSurface;
use crate::{Phase, ProgressToken, Result, TriMesh};

impl CoarseToFine<'_> {
    /// Mends small angles, unless more faces then intersect in the input's units where none of the input do:
    /// `intersecting` do now. The sites of the level are then the mesh's vertices.
    pub(crate) fn mend(
        &self,
        level: &mut LevelMesh,
        (around, intersecting): (ConstrainedMesh, usize),
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
        mut constrained: ConstrainedMesh,
        level_spacing: f64,
        progress: &ProgressToken,
    ) -> Result<Mended> {
        let min_angle = self.options.coarse_to_fine.min_angle;
        constrained.mesh = std::mem::take(&mut level.mesh);
        let options = MendOptions { min_angle, spacing: level_spacing, deviation: self.deviation };
        let mended = mend_angles(&mut constrained, &self.model.target, &options, progress)?;
        let inserted = self.insert(&mut constrained, level_spacing, progress)?;
        let curve_vertices = constrained.fixed.iter().filter(|fixed| **fixed).count();
        level.mesh = constrained.mesh;
        if inserted.is_empty() {
            return Ok(mended);
        }
        Ok(Mended { curve_vertices, origins: after_both(&mended.origins, inserted), ..mended })
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
