//! Sites that no triangle of a connected mesh uses.

use crate::TriMesh;
use crate::mesh::bvh::Bvh;
use crate::mesh::submesh::used_vertices;
use crate::mesh::triangle::doubled_normal;
use glam::DVec3;

/// Moves every vertex that no triangle uses to the surface under the middle of the largest triangle, which is
/// split there. The topology stays as it is. `normals` are those of the surface's triangles.
pub(super) fn place_unused(mesh: &mut TriMesh, surface: &TriMesh, normals: &[DVec3]) {
    let is_used = used_vertices(mesh.vertices.len(), &mesh.triangles);
    let unused: Vec<u32> = (0..).zip(is_used).filter(|(_, used)| !used).map(|(v, _)| v).collect();
    let bvh = Bvh::new(surface);
    for v in unused {
        let size = |t: &usize| doubled_normal(mesh.corners(*t)).length_squared();
        let largest = (0..mesh.triangles.len()).max_by(|a, b| size(a).total_cmp(&size(b)).then(b.cmp(a)));
        let Some(largest) = largest else { return };
        let corners = mesh.corners(largest);
        let (middle, normal) = (corners.iter().sum::<DVec3>() / 3.0, doubled_normal(corners));
        let is_same_side = |t: u32| normals[t as usize].dot(normal) > 0.0;
        mesh.vertices[v as usize] =
            bvh.closest_accepted(middle, &mut 0, is_same_side).map_or(middle, |closest| closest.point);
        let [a, b, c] = mesh.triangles[largest];
        mesh.triangles[largest] = [a, b, v];
        mesh.triangles.extend([[b, c, v], [c, a, v]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;
    use crate::mesh::topology::topology;

    #[test]
    fn unused_vertices_are_put_into_the_largest_triangles() {
        let Ok(surface) = sample("box") else { panic!("no box") };
        let normals: Vec<DVec3> =
            (0..surface.triangles.len()).map(|t| doubled_normal(surface.corners(t)).normalize()).collect();
        let mut mesh = surface.clone();
        mesh.vertices.extend([DVec3::splat(9.0); 3]);
        let largest = |mesh: &TriMesh| {
            (0..mesh.triangles.len()).map(|t| doubled_normal(mesh.corners(t)).length()).fold(0.0, f64::max)
        };
        let before = largest(&mesh);
        place_unused(&mut mesh, &surface, &normals);
        let (got, want) = (topology(&mesh), topology(&surface));
        assert!(got.is_closed_manifold());
        assert_eq!((got.vertices, got.euler), (want.vertices + 3, want.euler));
        let bvh = Bvh::new(&surface);
        let off = |p: &DVec3| bvh.closest(*p).map_or(f64::INFINITY, |closest| closest.distance_sq);
        assert!(mesh.vertices.iter().all(|p| off(p) < 1e-24) && largest(&mesh) <= before);
        place_unused(&mut TriMesh::default(), &surface, &normals);
    }
}
