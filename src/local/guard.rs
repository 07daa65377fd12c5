//! Operations that are undone where they make triangles run into others.

use super::star_mesh::StarMesh;
use crate::mesh::NONE;
use crate::mesh::intersections::{any_of_faces_intersects, intersecting_faces};
use crate::{ProgressToken, Result, TriMesh};

/// Maximum number of times that operations are repeated, each time with more vertices frozen.
const TRIES: u32 = 4;
/// Up to one of so many triangles, those that have changed are few: then it takes less time to look at these
/// alone.
const FEW_CHANGED: usize = 4;

/// Does operations on a mesh; looks for intersections after each, if it is to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Guard<'a> {
    pub looks: bool,
    pub progress: &'a ProgressToken,
}

impl Guard<'_> {
    /// Does what `operations` does. If more triangles intersect afterwards than before, this is undone and
    /// repeated with the vertices there frozen; as a last resort, nothing is done.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn run(&self, mesh: &mut StarMesh, operations: impl Fn(&mut StarMesh) -> Result<()>) -> Result<()> {
        if !self.looks {
            return operations(mesh);
        }
        let before = mesh.clone();
        // How many did before: counted on first use.
        let mut most = None;
        let mut frozen = vec![false; before.points.len()];
        for _ in 0..TRIES {
            mesh.frozen.clone_from(&frozen);
            operations(mesh)?;
            mesh.frozen.iter_mut().for_each(|frozen| *frozen = false);
            let Some(intersecting) = mesh.intersecting_since(&before, self.progress)? else { return Ok(()) };
            let most = match most {
                Some(most) => most,
                None => *most.insert(before.intersecting(self.progress)?.len()),
            };
            if intersecting.len() <= most {
                return Ok(());
            }
            // Vertices that were not there before have gone with what made them.
            let count = frozen.len() as u32;
            for v in intersecting.into_iter().filter(|v| *v < count) {
                frozen[v as usize] = true;
                before.neighbours(v).into_iter().for_each(|w| frozen[w as usize] = true);
            }
            *mesh = before.clone();
        }
        Ok(())
    }
}

impl StarMesh {
    /// The vertices of triangles that intersect others, with repetitions, if one of these triangles is new or
    /// has moved since `before`. If none is, no more intersect than before.
    fn intersecting_since(&self, before: &Self, progress: &ProgressToken) -> Result<Option<Vec<u32>>> {
        let is_changed = |t: usize, triangle: [u32; 3]| {
            before.triangles.get(t) != Some(&triangle) || before.corners(triangle) != self.corners(triangle)
        };
        let alive = (0..).zip(&self.triangles).filter(|(_, triangle)| triangle[0] != NONE);
        let (is_changed, triangles): (Vec<bool>, Vec<[u32; 3]>) =
            alive.map(|(t, triangle)| (is_changed(t, *triangle), *triangle)).unzip();
        let changed: Vec<u32> =
            (0..).zip(&is_changed).filter(|(_, changed)| **changed).map(|(k, _)| k).collect();
        let mesh = TriMesh { vertices: self.points.clone(), triangles };
        let are_few = FEW_CHANGED * changed.len() <= mesh.triangles.len();
        if changed.is_empty() || (are_few && !any_of_faces_intersects(&mesh, &changed, progress)?) {
            return Ok(None);
        }
        let faces = intersecting_faces(&mesh, progress)?;
        let has_new = faces.iter().any(|t| is_changed[*t as usize]);
        Ok(has_new.then(|| faces.into_iter().flat_map(|t| mesh.triangles[t as usize]).collect()))
    }

    /// The vertices of triangles that intersect others, with repetitions.
    fn intersecting(&self, progress: &ProgressToken) -> Result<Vec<u32>> {
        let alive: Vec<[u32; 3]> = self.alive().collect();
        let mesh = TriMesh { vertices: self.points.clone(), triangles: alive };
        let faces = intersecting_faces(&mesh, progress)?;
        Ok(faces.into_iter().flat_map(|t| mesh.triangles[t as usize]).collect())
    }
}
