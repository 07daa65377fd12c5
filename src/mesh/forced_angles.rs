//! Small angles that the shape of a surface forces on every mesh of it, whatever its triangles.

use glam::DVec3;
use std::collections::HashMap;

use super::feature_distance::sharp_edges;
use super::hash_grid::HashGrid;
use super::quality::TriangleQuality;
use super::small_angles::small_angle_places;
use super::triangle::doubled_normal;
use crate::TriMesh;

/// A triangle has the angle of a corner if it has at least this share of it: two that share it have half.
const SHARE: f64 = 0.6;
/// A vertex of a result is at a corner of the input if it is at most this many edge lengths away from it.
const AT: f64 = 0.1;
/// Minimum number of triangles around a vertex inside the surface.
const AROUND: f64 = 3.0;
/// Sides of triangles lower than this share of the diagonal say nothing of the shape: their normals are as
/// much rounding of coordinates as the surface's.
const FLAT: f64 = 1e-6;

/// Corners of a surface where an angle below a limit cannot be avoided: two sharp edges or boundaries meet at
/// such an angle, or the whole angle around a vertex, the tip of a spike, is small.
pub(crate) struct ForcedAngles {
    /// Where, and the angle in degrees.
    corners: Vec<(DVec3, f64)>,
}

impl ForcedAngles {
    /// The angles below `limit` that `surface` forces. Edges are sharp where it turns by at least
    /// `feature_angle`. All are in degrees. Panics if an index is out of range.
    pub fn of(surface: &TriMesh, limit: f64, feature_angle: f64) -> Self {
        let mut corners = sharp_corners(surface, limit, feature_angle);
        let mut around = vec![0.0; surface.vertices.len()];
        for t in 0..surface.triangles.len() {
            let angles = TriangleQuality::new(surface.corners(t)).angles;
            surface.triangles[t].iter().zip(angles).for_each(|(v, angle)| around[*v as usize] += angle);
        }
        // At a boundary one triangle may have the whole angle.
        for v in sharp_edges(surface, 180.0).into_iter().flat_map(|(a, b)| [a, b]) {
            around[v as usize] = f64::INFINITY;
        }
        let tips = around.into_iter().zip(&surface.vertices);
        corners.extend(tips.map(|(sum, at)| (*at, sum / AROUND)).filter(|(_, angle)| *angle < limit));
        Self { corners }
    }

    /// The triangles of a mesh of the surface, with edges of about `spacing`, that have an angle below
    /// `limit` degrees which no corner forces.
    pub fn unforced(&self, mesh: &TriMesh, limit: f64, spacing: f64) -> Vec<usize> {
        let near = AT * spacing;
        let mut grid = HashGrid::new(near, self.corners.len());
        self.corners.iter().for_each(|corner| grid.insert(corner.0, *corner));
        // At 180 degrees no edge is looked for.
        let small = small_angle_places(mesh, limit, 180.0);
        let is_forced = |t: usize| {
            let corners = mesh.corners(t);
            let angles = TriangleQuality::new(corners).angles;
            (0..3).filter(|k| angles[*k] < limit).all(|k| {
                let is_at = |(at, angle): (DVec3, f64)| {
                    at.distance_squared(corners[k]) <= near * near && angles[k] >= SHARE * angle
                };
                grid.any(corners[k], is_at)
            })
        };
        small.into_iter().map(|(t, _)| t).filter(|t| !is_forced(*t)).collect()
    }
}

/// The vertices where two sharp edges or boundaries meet at a small angle, with the smallest one.
fn sharp_corners(surface: &TriMesh, limit: f64, feature_angle: f64) -> Vec<(DVec3, f64)> {
    let least = limit.to_radians().cos();
    let (lo, hi) = surface
        .vertices
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
    let flat = FLAT * lo.distance(hi);
    // Where two such edges of a flat triangle meet, nothing is known.
    let flat_sides = |t: &[u32; 3]| {
        let corners = t.map(|v| surface.vertices[v as usize]);
        let longest = (0..3).map(|k| corners[k].distance(corners[(k + 1) % 3])).fold(0.0, f64::max);
        doubled_normal(corners).length() <= flat * longest
    };
    let mut flat_vertices: Vec<u32> =
        surface.triangles.iter().filter(|t| flat_sides(t)).flatten().copied().collect();
    flat_vertices.sort_unstable();
    flat_vertices.dedup();
    let mut at: HashMap<u32, Vec<u32>> = HashMap::new();
    for (a, b) in sharp_edges(surface, feature_angle) {
        at.entry(a).or_default().push(b);
        at.entry(b).or_default().push(a);
    }
    let smallest = |(v, others): (u32, Vec<u32>)| {
        let here = surface.vertices[v as usize];
        let directions: Vec<DVec3> =
            others.iter().map(|w| (surface.vertices[*w as usize] - here).normalize_or_zero()).collect();
        let pairs = (0..directions.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        let cosine = pairs.map(|(i, j)| directions[i].dot(directions[j])).fold(-1.0, f64::max);
        (cosine > least).then(|| (v, here, cosine.min(1.0).acos().to_degrees()))
    };
    let mut corners: Vec<(u32, DVec3, f64)> = at
        .into_iter()
        .filter(|(v, _)| flat_vertices.binary_search(v).is_err())
        .filter_map(smallest)
        .collect();
    corners.sort_unstable_by_key(|corner| corner.0);
    corners.into_iter().map(|(_, at, angle)| (at, angle)).collect()
}

#[cfg(test)]
mod tests {
    use super::ForcedAngles;
    use crate::TriMesh;
    use glam::DVec3;

    fn at(degrees: f64, length: f64) -> DVec3 {
        length * DVec3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0)
    }

    #[test]
    fn the_corner_of_a_wedge_forces_its_angle_and_its_triangles_force_nothing() {
        let wedge = |degrees: &[f64]| TriMesh {
            vertices: std::iter::once(DVec3::ZERO).chain(degrees.iter().map(|a| at(*a, 1.0))).collect(),
            triangles: (1..degrees.len() as u32).map(|k| [0, k, k + 1]).collect(),
        };
        let one = wedge(&[0.0, 8.0]);
        let forced = ForcedAngles::of(&one, 10.0, 40.0);
        assert_eq!(forced.unforced(&one, 10.0, 1.0), Vec::<usize>::new());
        // Halves of it are not forced.
        assert_eq!(forced.unforced(&wedge(&[0.0, 4.0, 8.0]), 10.0, 1.0), [0, 1]);
        // Nor are narrow triangles of a right angle, which the input has, too.
        let narrow = wedge(&[0.0, 5.0, 45.0, 90.0]);
        let forced = ForcedAngles::of(&narrow, 10.0, 40.0);
        assert_eq!(forced.unforced(&narrow, 10.0, 1.0), [0]);
    }

    #[test]
    fn the_tip_of_a_spike_forces_its_angle() {
        let sides = 3;
        let ring = (0..sides).map(|k| at(120.0 * f64::from(k), 0.04));
        let spike = TriMesh {
            vertices: std::iter::once(DVec3::Z).chain(ring).collect(),
            triangles: (0..sides as u32).map(|k| [0, 1 + k, 1 + (k + 1) % 3]).collect(),
        };
        // Without sharp edges but the boundary.
        let forced = ForcedAngles::of(&spike, 10.0, 180.0);
        assert_eq!(forced.unforced(&spike, 10.0, 1.0), Vec::<usize>::new());
    }
}
