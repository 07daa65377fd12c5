//! Small angles of the last level's mesh mended by local edits, then the others made more even.

use super::improve::{Improved, Reporting};
use super::level_mesh::LevelMesh;
use super::shared::CoarseToFine;
use crate::local::{MendOptions, Mended, mend_angles};
use crate::mesh::NONE;
use crate::mesh::submesh::used_vertices;
use crate::polish::{ConstrainedMesh, is_to_be_smoothed, smooth};
use crate::sites::on_surface::SitesOnSurface;
use crate::{Phase, ProgressToken, Result, TriMesh};

impl CoarseToFine<'_> {
    /// Mends small angles, then smooths: each unless more faces then intersect in the input's units where
    /// none of the input do. `intersecting` do now.
    pub(super) fn mend_and_smooth(
        &self,
        now: &mut Improved,
        intersecting: usize,
        reporting: &mut Reporting,
    ) -> Result<()> {
        reporting.pass(Phase::Mend, reporting.cost.mend, |progress| {
            let intersecting = self.mend(now, intersecting, progress)?;
            self.smooth(now, intersecting, progress)
        })
    }

    /// Mends small angles. The sites of the level are then the mesh's vertices. Returns how many faces
    /// intersect then.
    fn mend(&self, now: &mut Improved, intersecting: usize, progress: &ProgressToken) -> Result<usize> {
        let before = now.mesh.clone();
        let mut mended = self.mend_mesh(&mut now.mesh, now.spacing, progress)?;
        if mended.origins.is_empty() {
            return Ok(intersecting);
        }
        // Sites without a triangle, in a component that local operations replace, are counted on.
        let unused = unused_vertices(&before.mesh);
        now.mesh.mesh.vertices.extend(unused.iter().map(|v| before.mesh.vertices[*v as usize]));
        now.mesh.lengths.extend(unused.iter().filter_map(|v| before.lengths.get(*v as usize)));
        mended.origins.extend(unused);
        let left = self.fewer_intersections(now, before, intersecting, progress)?;
        if let Some(left) = left {
            self.renew_sites(&mut now.level, &now.mesh.mesh, &mended.origins);
            now.mended = Some(mended);
            return Ok(left);
        }
        Ok(intersecting)
    }

    /// Raises the mean quality of the triangles between curves.
    fn smooth(&self, now: &mut Improved, intersecting: usize, progress: &ProgressToken) -> Result<()> {
        let method = &self.context.options.coarse_to_fine;
        // Distances count more.
        let is_within = method.sizing.deviation().is_some();
        let is_sound = now.intersecting_faces.is_some();
        if !is_to_be_smoothed(&now.mesh) || method.polish_rounds == 0 || is_within || !is_sound {
            return Ok(());
        }
        let before = now.mesh.clone();
        if smooth(&mut now.mesh, &self.model.target, progress)? {
            self.fewer_intersections(now, before, intersecting, progress)?;
        }
        Ok(())
    }

    /// How many faces intersect where none of the input do, if these are at most so many; otherwise the mesh
    /// is again what it was before. Those of a mesh that is not sound are not counted.
    fn fewer_intersections(
        &self,
        now: &mut Improved,
        before: ConstrainedMesh,
        most: usize,
        progress: &ProgressToken,
    ) -> Result<Option<usize>> {
        let Some(count) = now.intersecting_faces else { return Ok(Some(most)) };
        let found = self.new_intersections(now, None, progress)?.len();
        if found > most {
            (now.mesh, now.intersecting_faces) = (before, Some(count));
            return Ok(None);
        }
        Ok(Some(found))
    }

    fn mend_mesh(
        &self,
        constrained: &mut ConstrainedMesh,
        spacing: f64,
        progress: &ProgressToken,
    ) -> Result<Mended> {
        let min_angle = self.context.options.coarse_to_fine.min_angle;
        let options = MendOptions { min_angle, spacing, deviation: self.context.deviation };
        let mended = mend_angles(constrained, &self.model.target, &options, progress)?;
        let inserted = self.insert(constrained, spacing, progress)?;
        if inserted.is_empty() {
            return Ok(mended);
        }
        let curve_vertices = constrained.fixed.iter().filter(|fixed| **fixed).count();
        Ok(Mended { curve_vertices, origins: after_both(&mended.origins, inserted), ..mended })
    }

    /// Makes the mesh's vertices the sites; `origins` are the sites that they were, [`NONE`] for new ones.
    fn renew_sites(&self, level: &mut LevelMesh, mesh: &TriMesh, origins: &[u32]) {
        let positions = mesh.vertices.clone();
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
