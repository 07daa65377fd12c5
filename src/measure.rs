//! Measures a mesh: the shape of its triangles, its topology, and its distance to a reference.

pub use crate::sites::restricted_voronoi::{Energy, energy};

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::mesh::chunks::par_map_chunks;
use crate::mesh::coincident::has_coincident;
use crate::mesh::distance::{DEFAULT_ACCURACY, Distances, check_accuracy, distances_within};
use crate::mesh::half_edges::EdgeTable;
use crate::mesh::intersections::intersecting_faces;
use crate::mesh::quality::{
    Quality, Valence, closed_valence, folded_share, power_of_two_scale, quality, valence_of,
};
use crate::mesh::topology::{Topology, is_closed, topology_of};
use crate::{Error, ProgressToken, Result, TriMesh};

/// All measures of one mesh, taken after merging vertices at exactly the same position.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Measures {
    /// Number of vertices that are used by a triangle.
    pub vertices: usize,
    /// Number of triangles.
    pub faces: usize,
    /// The shape of the triangles.
    pub quality: Quality,
    /// The regularity of the vertices.
    pub valence: Valence,
    /// Components, holes, handles and defects.
    pub topology: Topology,
    /// Number of triangles that intersect another one, if requested.
    pub self_intersecting_faces: Option<usize>,
    /// Fraction of the edges with two triangles whose normals differ by more than 120 degrees, 0 to 1.
    pub folded_edges: f64,
    /// Enclosed volume relative to that of the bounding box, positive if the triangles face outwards. `None`
    /// if there is a boundary, 0 if the bounding box is flat.
    pub relative_volume: Option<f64>,
    /// Distances to the reference, if there is one.
    pub distances: Option<Distances>,
}

/// Measures `mesh`, and its distance to `reference` if there is one.
///
/// Fails with [`Error::Input`] if either mesh has no faces, a coordinate that is not a finite number, or an
/// index without a vertex, and if the reference has no extent.
pub fn measure(mesh: &TriMesh, reference: Option<&TriMesh>) -> Result<Measures> {
    measure_within(mesh, reference, DEFAULT_ACCURACY)
}

/// Like [`measure`], with Hausdorff intervals of relative width `accuracy`; see [`distances_within`].
///
/// Fails with [`Error::Usage`] as well, if that is out of range.
pub fn measure_within(mesh: &TriMesh, reference: Option<&TriMesh>, accuracy: f64) -> Result<Measures> {
    measure_with_progress(mesh, reference, accuracy, &ProgressToken::default())
}

/// Like [`measure_within`], for `progress` to cancel.
///
/// Fails with [`Error::Cancelled`] as well.
pub fn measure_with_progress(
    mesh: &TriMesh,
    reference: Option<&TriMesh>,
    accuracy: f64,
    progress: &ProgressToken,
) -> Result<Measures> {
    check_accuracy(accuracy)?;
    let reference = reference.map(|mesh| Reference { mesh, accuracy });
    measure_some(mesh, reference, Crossing::Find, progress)
}

/// What distances are measured to.
#[derive(Clone, Copy)]
pub(crate) struct Reference<'a> {
    pub mesh: &'a TriMesh,
    /// As in [`distances_within`].
    pub accuracy: f64,
}

/// What to do about faces that intersect others.
pub(crate) enum Crossing {
    /// Do not look for them.
    Skip,
    /// Count them.
    Find,
    /// Their number is known.
    Known(usize),
}

/// Like [`measure`], looking for intersections only if asked to; also fails with [`Error::Cancelled`].
pub(crate) fn measure_some(
    mesh: &TriMesh,
    reference: Option<Reference>,
    crossing: Crossing,
    progress: &ProgressToken,
) -> Result<Measures> {
    check_mesh(mesh, "mesh")?;
    // Not sorted where nothing is to be merged: vertices that are near are then near in memory, too.
    let welded = has_coincident(&mesh.vertices).then(|| weld(mesh));
    let mesh = welded.as_ref().unwrap_or(mesh);
    let distances = || {
        let Some(Reference { mesh: reference, accuracy }) = reference else { return Ok(None) };
        check_mesh(reference, "reference mesh")?;
        distances_within(mesh, &weld(reference), accuracy, progress).map(Some)
    };
    let shape = || {
        let quality = quality(mesh).ok_or_else(|| no_faces("mesh"))?;
        let table = EdgeTable::new(&mesh.triangles);
        let closed = is_closed(mesh, &table);
        let valence = || if closed { closed_valence(mesh) } else { valence_of(mesh, &table) };
        let (topology, (valence, folded_edges)) = rayon::join(
            || topology_of(mesh, &table, closed),
            || rayon::join(valence, || folded_share(mesh, &table)),
        );
        Ok::<_, Error>((quality, topology, valence, folded_edges))
    };
    let (distances, shape) = rayon::join(distances, shape);
    let (distances, (quality, topology, valence, folded_edges)) = (distances?, shape?);
    Ok(Measures {
        vertices: topology.vertices,
        faces: topology.faces,
        quality,
        valence,
        self_intersecting_faces: match crossing {
            Crossing::Skip => None,
            Crossing::Find => Some(intersecting_faces(mesh, progress)?.len()),
            Crossing::Known(count) => Some(count),
        },
        folded_edges,
        relative_volume: (topology.boundary_edges == 0).then(|| relative_volume(mesh)),
        topology,
        distances,
    })
}

fn no_faces(name: &str) -> Error {
    Error::input(None, format!("the {name} has no faces"), "give a mesh with at least one triangle")
}

fn check_mesh(mesh: &TriMesh, name: &str) -> Result<()> {
    if mesh.triangles.is_empty() {
        return Err(no_faces(name));
    }
    // A side of a triangle is numbered by 32 bits.
    if mesh.triangles.len() > (u32::MAX / 3) as usize {
        let problem = format!("the {name} has {} faces", mesh.triangles.len());
        return Err(Error::input(None, problem, format!("measure at most {} at a time", u32::MAX / 3)));
    }
    if let Some(v) = mesh.vertices.par_iter().position_first(|v| !v.is_finite()) {
        let problem = format!("the {name} has a coordinate that is not a finite number");
        return Err(Error::input(Some(format!("vertex {v}")), problem, "remove or repair that vertex"));
    }
    let count = mesh.vertices.len();
    let is_outside = |triangle: &[u32; 3]| triangle.iter().any(|v| *v as usize >= count);
    if let Some(t) = mesh.triangles.par_iter().position_first(is_outside) {
        let problem = format!("the {name} uses a vertex beyond its {count} vertices");
        return Err(Error::input(Some(format!("face {t}")), problem, "export the file again"));
    }
    Ok(())
}

/// Merges vertices at exactly the same position, as formats without indices write them; zero equals negative
/// zero. Triangles keep their number and order. Vertices are sorted by x, then y, then z; unused ones remain.
/// Panics if an index is out of range.
pub fn weld(mesh: &TriMesh) -> TriMesh {
    let mut order: Vec<(DVec3, u32)> = mesh.vertices.iter().map(|&v| v + DVec3::ZERO).zip(0u32..).collect();
    order.par_sort_unstable_by(|(a, i), (b, j)| {
        a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)).then(i.cmp(j))
    });
    let mut vertices: Vec<DVec3> = Vec::with_capacity(order.len());
    let mut new_indices = vec![0u32; order.len()];
    for (position, old) in order {
        if vertices.last() != Some(&position) {
            vertices.push(position);
        }
        new_indices[old as usize] = vertices.len() as u32 - 1;
    }
    let triangles = mesh.triangles.iter().map(|t| t.map(|v| new_indices[v as usize])).collect();
    TriMesh { vertices, triangles }
}

/// The volume that a mesh without boundary encloses, over that of its bounding box; negative if it is inside
/// out. Where its faces are not turned consistently, it is relative to the centre of the box.
pub(crate) fn relative_volume(mesh: &TriMesh) -> f64 {
    let (lo, hi) = triangle_bounds(mesh);
    let scale = power_of_two_scale([lo, hi].into_iter());
    let (lo, hi) = (lo * scale, hi * scale);
    let origin = 0.5 * (lo + hi);
    let six_volume = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(|p| p * scale - origin);
        a.dot(b.cross(c))
    };
    let six_volumes = par_map_chunks(mesh.triangles.len(), |range| range.map(six_volume).sum::<f64>());
    let size = hi - lo;
    let box_volume = size.x * size.y * size.z;
    if box_volume > 0.0 { six_volumes.into_iter().sum::<f64>() / 6.0 / box_volume } else { 0.0 }
}

/// The least and the greatest coordinates of a mesh's triangles; infinite the other way round without any.
pub(crate) fn triangle_bounds(mesh: &TriMesh) -> (DVec3, DVec3) {
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let bounds = par_map_chunks(mesh.triangles.len(), |range| {
        let corners = mesh.triangles[range].as_flattened().iter().map(|v| mesh.vertices[*v as usize]);
        corners.fold(none, |(lo, hi), p| (lo.min(p), hi.max(p)))
    });
    bounds.into_iter().fold(none, |(lo, hi), (l, h)| (lo.min(l), hi.max(h)))
}
