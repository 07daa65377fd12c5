//! Small angles that the shape of a surface forces on every mesh of it, whatever its triangles.

use glam::DVec3;
use std::collections::{BTreeMap, HashMap};

use super::feature_distance::sharp_edges;
use super::hash_grid::HashGrid;
use super::quality::TriangleQuality;
use super::small_angles::small_angle_places;
use super::topology::Partition;
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

/// A triangle lies in a sector if the cosine between their directions from the corner is at least this.
const ALONG: f64 = 0.7;

/// Corners of a surface where an angle below a limit cannot be avoided: the surface between two sharp edges
/// or boundaries has such an angle, or the whole angle around a vertex, the tip of a spike, is small.
pub(crate) struct ForcedAngles {
    corners: Vec<Corner>,
}

/// A corner that forces an angle.
#[derive(Debug, Clone, Copy)]
struct Corner {
    at: DVec3,
    /// In degrees.
    angle: f64,
    /// Where the surface with that angle lies, seen from the corner; `None` if it is all around.
    along: Option<DVec3>,
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
        let tips = tips.map(|(sum, at)| Corner { at: *at, angle: sum / AROUND, along: None });
        corners.extend(tips.filter(|tip| tip.angle < limit));
        Self { corners }
    }

    /// The triangles of a mesh of the surface, with edges of about `spacing`, that have an angle below
    /// `limit` degrees which no corner forces.
    pub fn unforced(&self, mesh: &TriMesh, limit: f64, spacing: f64) -> Vec<usize> {
        let near = AT * spacing;
        let mut grid = HashGrid::new(near, self.corners.len());
        self.corners.iter().for_each(|corner| grid.insert(corner.at, *corner));
        // At 180 degrees no edge is looked for.
        let small = small_angle_places(mesh, limit, 180.0);
        let is_forced = |t: usize| {
            let corners = mesh.corners(t);
            let angles = TriangleQuality::new(corners).angles;
            (0..3).filter(|k| angles[*k] < limit).all(|k| {
                let is_at = |corner: Corner| {
                    corner.at.distance_squared(corners[k]) <= near * near
                        && angles[k] >= SHARE * corner.angle
                        && corner.along.is_none_or(|along| direction(corners, k).dot(along) >= ALONG)
                };
                grid.any(corners[k], is_at)
            })
        };
        small.into_iter().map(|(t, _)| t).filter(|t| !is_forced(*t)).collect()
    }
}

/// The middle direction of a triangle, seen from its corner `k`.
fn direction(corners: [DVec3; 3], k: usize) -> DVec3 {
    let [p, q] = [1, 2].map(|j| (corners[(k + j) % 3] - corners[k]).normalize_or_zero());
    (p + q).normalize_or_zero()
}

/// The vertices where the surface between two sharp edges or boundaries has a small angle.
fn sharp_corners(surface: &TriMesh, limit: f64, feature_angle: f64) -> Vec<Corner> {
    let mut sharp: HashMap<u32, Vec<u32>> = HashMap::new();
    for (a, b) in sharp_edges(surface, feature_angle) {
        sharp.entry(a).or_default().push(b);
        sharp.entry(b).or_default().push(a);
    }
    let flat = flat_vertices(surface);
    // The angle between the edges is at most that of the surface between them.
    let least = limit.to_radians().cos();
    sharp.retain(|v, others| {
        let towards =
            |w: &u32| (surface.vertices[*w as usize] - surface.vertices[*v as usize]).normalize_or_zero();
        let directions: Vec<DVec3> = others.iter().map(towards).collect();
        let mut pairs = (0..directions.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        flat.binary_search(v).is_err() && pairs.any(|(i, j)| directions[i].dot(directions[j]) > least)
    });
    if sharp.is_empty() {
        return Vec::new();
    }
    let mut star: HashMap<u32, Vec<usize>> = HashMap::new();
    for (t, triangle) in surface.triangles.iter().enumerate() {
        triangle.iter().filter(|v| sharp.contains_key(v)).for_each(|v| star.entry(*v).or_default().push(t));
    }
    let mut vertices: Vec<(u32, Vec<u32>)> = sharp.into_iter().collect();
    vertices.sort_unstable();
    let of_vertex = |(v, others): (u32, Vec<u32>)| sectors(surface, v, &others, &star[&v]);
    vertices.into_iter().flat_map(of_vertex).filter(|corner| corner.angle < limit).collect()
}

/// The sectors between the sharp edges from a vertex to `others`, with the triangles `star` around it.
fn sectors(surface: &TriMesh, v: u32, others: &[u32], star: &[usize]) -> Vec<Corner> {
    let mut across: HashMap<u32, usize> = HashMap::new();
    let mut parts = Partition::new(star.len());
    for (k, t) in star.iter().enumerate() {
        for w in surface.triangles[*t].into_iter().filter(|w| *w != v && !others.contains(w)) {
            parts.join(k as u32, *across.entry(w).or_insert(k) as u32);
        }
    }
    let mut sectors: BTreeMap<u32, (f64, DVec3)> = BTreeMap::new();
    for (k, t) in star.iter().enumerate() {
        let corners = surface.corners(*t);
        let corner = surface.triangles[*t].iter().position(|w| *w == v).unwrap_or(0);
        let angle = TriangleQuality::new(corners).angles[corner];
        let (sum, along) = sectors.entry(parts.root(k as u32)).or_default();
        *sum += angle;
        *along += angle * direction(corners, corner);
    }
    let at = surface.vertices[v as usize];
    let corner = |(angle, along): (f64, DVec3)| Corner { at, angle, along: Some(along.normalize_or_zero()) };
    sectors.into_values().map(corner).collect()
}

/// The vertices of flat triangles, ascending: which of their edges are sharp is unknown.
fn flat_vertices(surface: &TriMesh) -> Vec<u32> {
    let (lo, hi) = surface
        .vertices
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
    let flat = FLAT * lo.distance(hi);
    let is_flat = |t: &&[u32; 3]| {
        let corners = t.map(|v| surface.vertices[v as usize]);
        let longest = (0..3).map(|k| corners[k].distance(corners[(k + 1) % 3])).fold(0.0, f64::max);
        doubled_normal(corners).length() <= flat * longest
    };
    let mut vertices: Vec<u32> = surface.triangles.iter().filter(is_flat).flatten().copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
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
    fn a_groove_forces_no_angle_on_the_surface_around_its_end() {
        // The end face of a block, with a groove of 6 degrees in it, whose walls go down from there.
        let rim = [3.0, 60.0, 120.0, 180.0, 240.0, 300.0, 357.0].map(|a| at(a, 1.0));
        let deep = |p: DVec3| p - 2.0 * DVec3::Z;
        let block = |face: &[[u32; 3]]| {
            let mut mesh = TriMesh { vertices: vec![DVec3::ZERO], triangles: face.to_vec() };
            mesh.vertices.extend(rim);
            mesh.vertices.extend([DVec3::ZERO, rim[0], rim[6]].map(deep));
            mesh.triangles.extend([[1, 0, 8], [1, 8, 9], [0, 7, 10], [0, 10, 8]]);
            mesh
        };
        let fan = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5], [0, 5, 6], [0, 6, 7]];
        let forced = ForcedAngles::of(&block(&fan), 10.0, 40.0);
        assert!(forced.corners.is_empty(), "{:?}", forced.corners);
        // A needle of the face is not excused by the edges that meet at 6 degrees.
        let mut needle = block(&fan);
        needle.vertices[2] = at(8.0, 1.0);
        assert_eq!(forced.unforced(&needle, 10.0, 1.0), [0]);
    }

    #[test]
    fn a_corner_excuses_only_triangles_that_lie_in_it() {
        // Two wedges that share a corner: one of 8 degrees and one of 90.
        let two = |degrees: &[f64]| {
            let mut mesh =
                TriMesh { vertices: vec![DVec3::ZERO, at(0.0, 1.0), at(8.0, 1.0)], ..TriMesh::default() };
            mesh.triangles.push([0, 1, 2]);
            mesh.vertices.extend(degrees.iter().map(|a| at(*a, 1.0)));
            mesh.triangles.extend((0..degrees.len() as u32 - 1).map(|k| [0, 3 + k, 4 + k]));
            mesh
        };
        let input = two(&[135.0, 225.0]);
        let forced = ForcedAngles::of(&input, 10.0, 40.0);
        assert_eq!(forced.unforced(&input, 10.0, 1.0), Vec::<usize>::new());
        assert_eq!(forced.unforced(&two(&[135.0, 142.0, 225.0]), 10.0, 1.0), [1]);
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
