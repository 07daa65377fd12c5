//! Specks: components so small compared with the largest that they are noise in the values.

use glam::DVec3;

use crate::TriMesh;
use crate::mesh::half_edges::EdgeTable;
use crate::mesh::repair::connected_components;
use crate::mesh::submesh::without_unused_vertices;

/// A component with less than this fraction of the largest one's volume is a speck.
const SHARE: f64 = 1e-3;
/// A component smaller than this many voxels is a speck.
pub(super) const VOXELS: f64 = 8.0;
/// A speck always has less than this fraction of the largest component's volume, which may be small itself.
const MOST_SHARE: f64 = 0.125;

/// Volumes below this are those of specks where the largest is `largest`, both in voxels.
pub(super) fn least_volume(largest: f64) -> f64 {
    (SHARE * largest).max(VOXELS).min(MOST_SHARE * largest)
}

/// The mesh without specks, in units of nodes, and the number of these. Cavities count as components.
pub(super) fn without_specks(mesh: TriMesh) -> (TriMesh, usize) {
    let (of_triangle, areas) = connected_components(&mesh);
    if areas.len() < 2 {
        return (mesh, 0);
    }
    let volumes = volumes(&mesh, &of_triangle, &areas);
    let least = least_volume(volumes.iter().copied().fold(0.0, f64::max));
    let specks = volumes.iter().filter(|volume| **volume < least).count();
    if specks == 0 {
        return (mesh, 0);
    }
    let stays = |t: &usize| volumes[of_triangle[*t] as usize] >= least;
    let kept = (0..mesh.triangles.len()).filter(stays).map(|t| mesh.triangles[t]).collect();
    (without_unused_vertices(&mesh, kept), specks)
}

/// The volume that each component encloses. One that is open has none, and counts as a half of a ball as
/// large as its area allows.
fn volumes(mesh: &TriMesh, of_triangle: &[u32], areas: &[f64]) -> Vec<f64> {
    let mut first = vec![None; areas.len()];
    let mut volumes = vec![0.0; areas.len()];
    for (t, own) in of_triangle.iter().enumerate() {
        let corners = mesh.triangles[t].map(|v| mesh.vertices[v as usize]);
        // Near the component, so that sums of small volumes lose nothing.
        let origin: DVec3 = *first[*own as usize].get_or_insert(corners[0]);
        let [a, b, c] = corners.map(|p| p - origin);
        volumes[*own as usize] += a.dot(b.cross(c)) / 6.0;
    }
    let mut is_open = vec![false; areas.len()];
    for edge in EdgeTable::new(&mesh.triangles).edges() {
        if let [one] = edge {
            is_open[of_triangle[one.triangle()] as usize] = true;
        }
    }
    let half_ball = |area: f64| area.powf(1.5) / (3.0 * (2.0 * std::f64::consts::PI).sqrt());
    let of = |(own, volume): (usize, f64)| if is_open[own] { half_ball(areas[own]) } else { volume.abs() };
    volumes.into_iter().enumerate().map(of).collect()
}
