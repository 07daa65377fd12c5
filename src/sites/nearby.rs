//! For each vertex of the surface a site near it.

use crate::mesh::NONE;

/// For each of `vertices` vertices of a surface one of the sites, which stand on the triangles `under`: one
/// that is on a triangle there, or else one that fewest triangles separate from it. [`NONE`] where nothing
/// connects the vertex with a site. Panics if an index is out of range.
pub(crate) fn sites_near_vertices(triangles: &[[u32; 3]], vertices: usize, under: &[u32]) -> Vec<u32> {
    let mut near = vec![NONE; vertices];
    for (site, t) in (0..).zip(under) {
        give(&mut near, triangles[*t as usize], site);
    }
    let mut open: Vec<[u32; 3]> = triangles
        .iter()
        .filter(|triangle| triangle.iter().any(|v| near[*v as usize] == NONE))
        .copied()
        .collect();
    loop {
        let mut given = Vec::new();
        open.retain(|triangle| {
            let known = triangle.iter().map(|v| near[*v as usize]).find(|site| *site != NONE);
            given.extend(known.map(|site| (*triangle, site)));
            known.is_none()
        });
        if given.is_empty() {
            return near;
        }
        // Not before, or a site would spread as far as the order of triangles has it.
        given.into_iter().for_each(|(triangle, site)| give(&mut near, triangle, site));
    }
}

/// Gives the corners of a triangle that have no site this one.
fn give(near: &mut [u32], triangle: [u32; 3], site: u32) {
    for v in triangle.map(|v| v as usize) {
        if near[v] == NONE {
            near[v] = site;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;

    #[test]
    fn all_vertices_of_a_component_have_a_site_that_is_near() {
        let mesh = sample("torus").unwrap_or_default();
        let under: Vec<u32> = (0..40).map(|site| site * 80).collect();
        let near = sites_near_vertices(&mesh.triangles, mesh.vertices.len() + 1, &under);
        let far = |(v, site): (usize, &u32)| {
            mesh.vertices[v].distance(mesh.corners(under[*site as usize] as usize)[0])
        };
        let farthest = near[..mesh.vertices.len()].iter().enumerate().map(far).fold(0.0, f64::max);
        assert!(farthest < 1.0 && near[mesh.vertices.len()] == NONE, "{farthest}");
        for (site, t) in (0..).zip(&under) {
            assert!(mesh.triangles[*t as usize].iter().any(|v| near[*v as usize] == site));
        }
    }
}
