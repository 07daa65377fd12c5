//! How far the sharp edges and boundaries of two meshes are from each other.

use glam::DVec3;
use serde::Serialize;

use super::bvh::Bvh;
use super::half_edges::{EdgeTable, HalfEdge};
use super::triangle::{closest_on_triangle, doubled_normal};
use crate::{Error, ProgressToken, Result, TriMesh};

/// Samples on the features of a mesh, at least.
const SAMPLES: f64 = 20_000.0;
/// Gap between the ends of a largest distance, in diagonals.
const GAP: f64 = 1e-6;
/// Pieces between two looks at whether to go on.
const BETWEEN_POLLS: usize = 4096;

/// Distances of two meshes' features from each other, in percent of the diagonal of the reference's bounding
/// box. Features are edges where the surface turns by at least an angle, and those without exactly two faces.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct FeatureDistances {
    /// The angle in degrees.
    pub angle: f64,
    /// Length of the mesh's features.
    pub length: f64,
    /// Length of the reference's features.
    pub reference_length: f64,
    /// Distances from the mesh's features to the reference's, such as those of edges that the reference
    /// lacks; `None` if only the mesh has features.
    pub to_reference: Option<FeatureDistance>,
    /// Distances from the reference's features to the mesh's, such as those of features that the mesh has
    /// lost; `None` if only the reference has features.
    pub from_reference: Option<FeatureDistance>,
}

/// Distances from features to others.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct FeatureDistance {
    /// No point is farther than this, which is within 1e-4 percent.
    pub largest: f64,
    /// Root mean square over the length.
    pub rms: f64,
}

/// The edges of a mesh where it turns by at least `angle` degrees, and those without exactly two faces.
/// Panics if an index is out of range.
pub(crate) fn sharp_edges(mesh: &TriMesh, angle: f64) -> Vec<(u32, u32)> {
    let least = angle.to_radians().cos();
    let turns = |edge: &&[HalfEdge]| match edge {
        [one, two] => {
            let [n, m] = [one, two].map(|h| doubled_normal(mesh.corners(h.triangle())));
            n.dot(m) <= least * n.length() * m.length()
        }
        _ => true,
    };
    EdgeTable::new(&mesh.triangles).edges().filter(turns).map(|edge| edge[0].ends()).collect()
}

/// The edges with two faces where a mesh turns by more than `angle` degrees.
pub(crate) fn folded_edges(mesh: &TriMesh, angle: f64) -> Vec<(u32, u32)> {
    let least = angle.to_radians().cos();
    let is_folded = |edge: &&[HalfEdge]| {
        let [one, two] = edge else { return false };
        let [n, m] = [one, two].map(|h| doubled_normal(mesh.corners(h.triangle())));
        n.dot(m) < least * n.length() * m.length()
    };
    EdgeTable::new(&mesh.triangles).edges().filter(is_folded).map(|edge| edge[0].ends()).collect()
}

/// Distances between the features of `mesh` and `reference`, in which vertices at the same position are one
/// (see [`crate::measure::weld`]). Panics if an index is out of range.
///
/// # Errors
/// [`Error::Usage`] for an angle that is not above 0 and at most 180 degrees, [`Error::Input`] for a
/// reference without an extent, [`Error::Cancelled`].
pub fn feature_distances(
    mesh: &TriMesh,
    reference: &TriMesh,
    angle: f64,
    progress: &ProgressToken,
) -> Result<FeatureDistances> {
    if !(angle > 0.0 && angle <= 180.0) {
        let problem = format!("the feature angle {angle} is out of range");
        return Err(Error::usage(problem, "give an angle above 0 and up to 180 degrees, such as 40"));
    }
    let corners = || reference.triangles.as_flattened().iter().map(|v| reference.vertices[*v as usize]);
    let [low, high] = [corners().reduce(DVec3::min), corners().reduce(DVec3::max)];
    let diagonal = low.zip(high).map_or(0.0, |(low, high)| low.distance(high));
    if !(diagonal > 0.0 && diagonal.is_finite()) {
        return Err(Error::input(None, "the reference has no extent", "give one of some size"));
    }
    let [of_mesh, of_reference] = [mesh, reference].map(|mesh| Segments::of(mesh, angle, 100.0 / diagonal));
    Ok(FeatureDistances {
        angle,
        length: of_mesh.length,
        reference_length: of_reference.length,
        to_reference: of_mesh.distance_to(&of_reference, progress)?,
        from_reference: of_reference.distance_to(&of_mesh, progress)?,
    })
}

/// The features of a mesh, in percent of the diagonal.
struct Segments {
    ends: Vec<[DVec3; 2]>,
    length: f64,
    bvh: Bvh,
}

impl Segments {
    fn of(mesh: &TriMesh, angle: f64, scale: f64) -> Self {
        let edges = sharp_edges(mesh, angle);
        let at = |v: u32| scale * mesh.vertices[v as usize];
        let ends: Vec<[DVec3; 2]> = edges.iter().map(|(a, b)| [at(*a), at(*b)]).collect();
        let vertices = ends.as_flattened().to_vec();
        let triangles = (0..ends.len() as u32).map(|k| [2 * k, 2 * k + 1, 2 * k + 1]).collect();
        let length = ends.iter().map(|[a, b]| a.distance(*b)).sum();
        Self { ends, length, bvh: Bvh::new(&TriMesh { vertices, triangles }) }
    }

    /// The largest distance is found by halving pieces that may have it.
    fn distance_to(&self, others: &Self, progress: &ProgressToken) -> Result<Option<FeatureDistance>> {
        if self.ends.is_empty() {
            return Ok(Some(FeatureDistance::default()));
        }
        if others.ends.is_empty() {
            return Ok(None);
        }
        let mut rank = 0;
        let step = self.length / SAMPLES;
        let (mut pieces, mut squares, mut farthest) = (Vec::new(), 0.0, 0.0f64);
        for (k, [a, b]) in self.ends.iter().enumerate() {
            if k % BETWEEN_POLLS == 0 {
                progress.poll()?;
            }
            let length = a.distance(*b);
            let count = (length / step).ceil().max(1.0);
            for i in 0..count as usize {
                let piece = others.piece([i, i + 1].map(|i| a.lerp(*b, i as f64 / count)), &mut rank);
                squares += piece.at_middle.powi(2) * length / count;
                farthest = farthest.max(piece.at_middle);
                pieces.push(piece);
            }
        }
        let (mut largest, mut looks) = (farthest, 0);
        while let Some(Piece { ends: [a, b], most, .. }) = pieces.pop() {
            looks += 1;
            if looks % BETWEEN_POLLS == 0 {
                progress.poll()?;
            }
            if most <= farthest + 100.0 * GAP {
                largest = largest.max(most);
                continue;
            }
            let middle = a.midpoint(b);
            for ends in [[a, middle], [middle, b]] {
                let piece = others.piece(ends, &mut rank);
                farthest = farthest.max(piece.at_middle);
                pieces.push(piece);
            }
        }
        let largest = largest.max(farthest);
        Ok(Some(FeatureDistance { largest, rms: (squares / self.length).sqrt() }))
    }

    /// A piece of other features, measured.
    fn piece(&self, ends: [DVec3; 2], rank: &mut usize) -> Piece {
        let middle = ends[0].midpoint(ends[1]);
        let Some(found) = self.bvh.closest_from(middle, rank) else {
            return Piece { ends, at_middle: f64::INFINITY, most: f64::INFINITY };
        };
        let at_middle = found.distance_sq.sqrt();
        // No point of a piece is farther than its middle by more than half its length, nor than its ends from
        // the edge nearest to the middle, since the distance from an edge is convex.
        let [a, b] = self.ends[found.triangle as usize];
        let at_end = |p: DVec3| closest_on_triangle(p, [a, b, b]).point.distance(p);
        let most = at_end(ends[0]).max(at_end(ends[1])).min(at_middle + 0.5 * ends[0].distance(ends[1]));
        Piece { ends, at_middle, most }
    }
}

/// A piece of a feature, with its distance from others.
struct Piece {
    ends: [DVec3; 2],
    at_middle: f64,
    /// No point is farther.
    most: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;

    fn between(mesh: &TriMesh, reference: &TriMesh) -> FeatureDistances {
        feature_distances(mesh, reference, 40.0, &ProgressToken::default()).unwrap()
    }

    fn is(found: Option<FeatureDistance>, largest: f64, rms: f64) {
        let found = found.expect("no features");
        assert!((found.largest - largest).abs() < 2e-4, "{found:?} instead of {largest}");
        assert!((found.rms - rms).abs() < 1e-3 * (1.0 + rms), "{found:?} instead of {rms}");
    }

    #[test]
    fn a_mesh_is_at_its_own_features() {
        let mesh = sample("box").unwrap();
        let found = between(&mesh, &mesh);
        is(found.to_reference, 0.0, 0.0);
        is(found.from_reference, 0.0, 0.0);
        // Twelve sides of the unit box.
        assert!((found.length - 1200.0 / 3f64.sqrt()).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn distances_differ_by_direction() {
        let cube = sample("box").unwrap();
        // A corner is moved out along a side, which stays on its line.
        let mut longer = cube.clone();
        let corner = longer.vertices.iter().copied().reduce(DVec3::max).unwrap();
        longer.vertices.iter_mut().filter(|p| **p == corner).for_each(|p| p.x += 0.3);
        let found = between(&longer, &cube);
        let percent = |length: f64| 100.0 * length / 3f64.sqrt();
        // The farthest point of the mesh is the corner. From a side that leant towards it in the box, the
        // longer one is as far as the leaning one where those distances meet.
        assert!((found.to_reference.unwrap().largest - percent(0.3)).abs() < 2e-4, "{found:?}");
        let lean = 0.3 / 1.09f64.sqrt();
        let from = found.from_reference.unwrap().largest;
        assert!((from - percent(lean / (1.0 + lean))).abs() < 2e-4, "{found:?}");
        let rms = found.to_reference.unwrap().rms;
        assert!(rms > 0.0 && rms < percent(0.3), "{found:?}");
    }

    #[test]
    fn what_is_on_one_mesh_alone_has_no_distance() {
        let (cube, ball) = (sample("box").unwrap(), sample("sphere").unwrap());
        let found = between(&ball, &cube);
        assert_eq!((found.to_reference, found.from_reference), (Some(FeatureDistance::default()), None));
        let found = between(&cube, &ball);
        assert_eq!((found.to_reference, found.from_reference), (None, Some(FeatureDistance::default())));
        let progress = ProgressToken::default();
        for angle in [0.0, -1.0, 181.0, f64::NAN] {
            let error = feature_distances(&cube, &ball, angle, &progress).unwrap_err();
            assert!(matches!(error, Error::Usage { .. }), "{error}");
        }
    }

    #[test]
    fn the_largest_distance_between_samples_is_found() {
        // A triangle against a large one in the same plane: the boundaries alone are features.
        let triangle = |size: f64| TriMesh {
            vertices: vec![DVec3::ZERO, DVec3::new(size, 0.0, 0.0), DVec3::new(0.0, size, 0.0)],
            triangles: vec![[0, 1, 2]],
        };
        let found = between(&triangle(1.0), &triangle(4.0));
        // The hypotenuse: its middle is as far from both legs, 0.5, and its ends are on them.
        let percent = |length: f64| 100.0 * length / (4.0 * 2f64.sqrt());
        assert!((found.to_reference.unwrap().largest - percent(0.5)).abs() < 2e-4, "{found:?}");
        // The corners of the large one.
        assert!((found.from_reference.unwrap().largest - percent(3.0)).abs() < 2e-4, "{found:?}");
    }
}
