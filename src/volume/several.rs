//! The isosurfaces of several values in one mesh.

use super::IsoSurface;
use super::iso::no_surface;
use crate::io::Volume;
use crate::mesh::attributes::{Attribute, Attributes, Kind, Role};
use crate::mesh::bvh::Bvh;
use crate::mesh::position_key;
use crate::mesh::quick_hash::QuickMap;
use crate::mesh::repair::connected_components;
use crate::mesh::submesh::without_unused_vertices;
use crate::{Error, Result, TriMesh};
use rayon::prelude::*;

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

/// Checks several values of isosurfaces before any of these is made; `closed` as in [`super::IsoOptions`].
///
/// # Errors
/// [`Error::Usage`] for a value that is not finite or given twice, [`Error::Input`] for one beyond all values
/// of the volume, unless the surface may lie at its border.
pub(crate) fn check_values(volume: &Volume, values: &[f64], closed: bool) -> Result<()> {
    if values.len() < 2 {
        return Ok(());
    }
    // Infinite values count, values that are no numbers do not.
    let [low, high] = (volume.values.par_iter())
        .fold(|| [f32::INFINITY, f32::NEG_INFINITY], |[low, high], v| [low.min(*v), high.max(*v)])
        .reduce(|| [f32::INFINITY, f32::NEG_INFINITY], |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    for (k, iso) in values.iter().enumerate() {
        if !iso.is_finite() {
            return Err(Error::option("iso", format!("`iso` {iso} is not finite"), "give a number"));
        }
        if values[..k].contains(iso) {
            return Err(Error::option("iso", format!("`iso` has {iso} twice"), "give each value once"));
        }
        if !closed && !(low..=high).contains(&(*iso as f32)) {
            return Err(no_surface(volume, *iso));
        }
    }
    Ok(())
}

/// Isosurfaces with their values in one mesh, in which no vertex belongs to two of them.
///
/// # Errors
/// [`Error::Usage`] if two touch along edges, or more than one ends flat at the volume's border;
/// [`Error::Input`] for more vertices or corners of triangles than an index can count.
pub(crate) fn join(surfaces: Vec<(f64, IsoSurface)>) -> Result<JoinedSurfaces> {
    if surfaces.iter().filter(|(_, surface)| !surface.rim.is_empty()).count() > 1 {
        let problem = "closed isosurfaces of several values would overlap at the volume's border";
        return Err(Error::usage(problem, "remove --closed, or give one value"));
    }
    let size = |of: fn(&TriMesh) -> usize| surfaces.iter().map(|(_, own)| of(&own.mesh)).sum::<usize>();
    let most = size(|mesh| mesh.vertices.len()).max(size(|mesh| 3 * mesh.triangles.len()));
    if most >= u32::MAX as usize {
        let problem = format!("the isosurfaces have {most} corners, more than an index can count");
        return Err(Error::input(None, problem, "use a coarser grid or fewer values"));
    }
    let names: Vec<f64> = surfaces.iter().map(|(iso, _)| *iso).collect();
    let mut joined = JoinedSurfaces::default();
    let mut values = Vec::new();
    // The surface that is known to have a vertex at each place.
    let mut taken: QuickMap<[u64; 3], usize> = QuickMap::default();
    for (k, (iso, surface)) in surfaces.into_iter().enumerate() {
        let IsoSurface { mesh, rim, .. } = surface;
        let owner = |v: &u32| taken.get(&position_key(mesh.vertices[*v as usize]));
        let touching = mesh.triangles.iter().find_map(|t| {
            let mut owners = t.iter().filter_map(owner);
            owners.next().filter(|_| owners.next().is_some())
        });
        if let Some(other) = touching {
            let problem = format!("the isosurfaces at {} and {iso} touch", names[*other]);
            let remedy = "choose values that are farther apart, or run once for each value";
            return Err(Error::usage(problem, remedy));
        }
        if k + 1 < names.len() {
            taken.extend(mesh.vertices.iter().map(|p| (position_key(*p), k)));
        }
        let (vertices, triangles) = (joined.mesh.vertices.len() as u32, joined.mesh.triangles.len() as u32);
        values.extend(std::iter::repeat_n(iso, mesh.triangles.len()));
        joined.rim.extend(rim.iter().map(|half| 3 * triangles + half));
        joined.mesh.vertices.extend(mesh.vertices);
        joined.mesh.triangles.extend(mesh.triangles.iter().map(|triangle| triangle.map(|v| vertices + v)));
    }
    joined.attributes.face = vec![Attribute::new(ISO, Role::Other, Kind::F64, 1, values)];
    Ok(joined)
}

/// Gives all triangles of a connected component of `result` the same [`ISO`], that of the surface which the
/// component is closest to. `values` are those of the triangles of `joined`, `found` those of the triangles
/// of `result`: where surfaces are closer than its edges are long, some have that of another surface.
pub(crate) fn settle_values(joined: &TriMesh, values: &[f64], result: &TriMesh, found: &mut [f64]) {
    let (of_triangle, areas) = connected_components(result);
    let mut triangles = vec![Vec::new(); areas.len()];
    of_triangle.iter().enumerate().for_each(|(t, part)| triangles[*part as usize].push(t));
    for part in triangles {
        let mut candidates: Vec<f64> = part.iter().map(|t| found[*t]).collect();
        candidates.sort_by(f64::total_cmp);
        candidates.dedup();
        if candidates.len() < 2 {
            continue;
        }
        // Vertices lie on one side of a curved surface, and centres on the other.
        let points = part.iter().flat_map(|t| {
            let corners = result.corners(*t);
            corners.into_iter().chain([corners.into_iter().sum::<glam::DVec3>() / 3.0; 3])
        });
        let distance = |iso: f64| {
            let own = (0..values.len()).filter(|t| values[*t] == iso).map(|t| joined.triangles[t]).collect();
            let bvh = Bvh::new(&without_unused_vertices(joined, own));
            let mut rank = 0;
            let square = |p| bvh.closest_from(p, &mut rank).map_or(0.0, |on| on.point.distance_squared(p));
            points.clone().map(square).sum::<f64>()
        };
        let squares = candidates.iter().map(|iso| (distance(*iso), *iso));
        if let Some((_, closest)) = squares.min_by(|a, b| a.0.total_cmp(&b.0)) {
            part.iter().for_each(|t| found[*t] = closest);
        }
    }
}
