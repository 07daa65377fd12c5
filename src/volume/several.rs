//! The isosurfaces of several values in one mesh.

use std::collections::HashSet;

use super::IsoSurface;
use crate::mesh::attributes::{Attribute, Attributes, Kind, Role};
use crate::mesh::position_key;
use crate::{Error, Result, TriMesh};

/// The attribute of triangles with the value of their isosurface.
pub const ISO: &str = "iso";

/// The isosurfaces of several values as one mesh.
#[derive(Debug, Default)]
pub(crate) struct JoinedSurfaces {
    pub mesh: TriMesh,
    /// [`ISO`] of each triangle.
    pub attributes: Attributes,
    /// As [`IsoSurface::rim`].
    pub rim: Vec<u32>,
}

/// Isosurfaces with their values in one mesh, in which they have no vertices in common.
///
/// # Errors
/// [`Error::Usage`] if two touch along edges, or more than one ends flat at the volume's border.
pub(crate) fn join(surfaces: Vec<(f64, IsoSurface)>) -> Result<JoinedSurfaces> {
    let names: Vec<String> = surfaces.iter().map(|(iso, _)| iso.to_string()).collect();
    if surfaces.iter().filter(|(_, surface)| !surface.rim.is_empty()).count() > 1 {
        let problem = "closed isosurfaces of several values would overlap at the volume's border";
        return Err(Error::usage(problem, "remove --closed, or give one value"));
    }
    let mut joined = JoinedSurfaces::default();
    let mut values = Vec::new();
    let mut taken: HashSet<[u64; 3]> = HashSet::new();
    for (k, (iso, surface)) in surfaces.into_iter().enumerate() {
        let IsoSurface { mesh, rim, .. } = surface;
        let is_shared: Vec<bool> = mesh.vertices.iter().map(|p| taken.contains(&position_key(*p))).collect();
        let touches = |t: &[u32; 3]| t.iter().filter(|v| is_shared[**v as usize]).count() > 1;
        if mesh.triangles.iter().any(touches) {
            let problem = format!("the isosurfaces at {} touch", names[..=k].join(", "));
            return Err(Error::usage(problem, "choose values that are farther apart"));
        }
        taken.extend(mesh.vertices.iter().map(|p| position_key(*p)));
        let (vertices, triangles) = (joined.mesh.vertices.len() as u32, joined.mesh.triangles.len() as u32);
        values.extend(std::iter::repeat_n(iso, mesh.triangles.len()));
        joined.rim.extend(rim.iter().map(|half| 3 * triangles + half));
        joined.mesh.vertices.extend(mesh.vertices);
        joined.mesh.triangles.extend(mesh.triangles.iter().map(|triangle| triangle.map(|v| vertices + v)));
    }
    joined.attributes.face = vec![Attribute::new(ISO, Role::Other, Kind::F64, 1, values)];
    Ok(joined)
}
