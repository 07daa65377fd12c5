//! Carries a remeshed surface over to other poses of the mesh that it was made from.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::TriMesh;
use super::correspondence::{CorrespondenceRequest, SurfacePoint, find_correspondence};
use super::repair::repair;
use super::triangle::doubled_normal;
use crate::{Error, ProgressToken, Result};

/// A result belongs to a mesh if no vertex is farther from it than this many of the result's mean edges.
const FARTHEST: f64 = 2.0;

/// A result that follows its input: where each vertex is on the input, and how far off it.
///
/// ```no_run
/// use rtfmesh::{Follower, ProgressToken, io};
///
/// let [rest, pose, result] = ["rest.ply", "pose.ply", "result.ply"].map(io::read);
/// let (rest, pose, result) = (rest?.mesh, pose?.mesh, result?.mesh);
/// let follower = Follower::new(rest, &result, &ProgressToken::default())?;
/// let vertices = follower.follow(&pose)?;
/// # Ok::<(), rtfmesh::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Follower {
    input: TriMesh,
    /// For each triangle of the input the inverse of its own frame, times its area.
    inverse: Vec<DMat3>,
    vertices: Vec<SurfacePoint>,
    /// From the surface to each vertex.
    offsets: Vec<DVec3>,
}

impl Follower {
    /// Finds where the vertices of `result` are on `input`, which it was made from.
    ///
    /// # Errors
    /// Those of [`find_correspondence`]; [`Error::Input`] if `result` is not close to `input`.
    pub fn new(input: TriMesh, result: &TriMesh, progress: &ProgressToken) -> Result<Self> {
        let repaired = repair(&input)?;
        let request = CorrespondenceRequest { vertices: true, faces: false };
        let vertices = find_correspondence(&input, &repaired, result, request, progress)?.vertices;
        let places = vertices.iter().map(|place| place.position(&input));
        let offsets: Vec<DVec3> = result.vertices.iter().zip(places).map(|(p, place)| *p - place).collect();
        let farthest = offsets.iter().map(|offset| offset.length()).fold(0.0, f64::max);
        let limit = FARTHEST * mean_edge(result);
        if farthest > limit {
            let problem = format!("the result is up to {farthest:.4} away from the input, {limit:.4} may be");
            return Err(Error::input(None, problem, "give the mesh that the result was made from"));
        }
        let of_one = |t| {
            let (frame, area) = frame(input.corners(t));
            // Triangles without an area have no say.
            let inverse = if frame.determinant() == 0.0 { DMat3::ZERO } else { frame.inverse() * area };
            if inverse.is_finite() { inverse } else { DMat3::ZERO }
        };
        let inverse = (0..input.triangles.len()).into_par_iter().map(of_one).collect();
        Ok(Self { input, inverse, vertices, offsets })
    }

    /// The vertices of the result on another pose of the input: the input's vertices elsewhere, with the same
    /// triangles or none.
    ///
    /// Each vertex is at its place on the pose's surface; an offset is turned and stretched as the surface
    /// around it.
    ///
    /// # Errors
    /// [`Error::Input`] for another number of vertices, other triangles, or coordinates that are not
    /// finite or too large.
    pub fn follow(&self, pose: &TriMesh) -> Result<Vec<DVec3>> {
        self.check(pose)?;
        let stretches = self.stretches(&pose.vertices);
        let of_one = |(place, offset): (&SurfacePoint, &DVec3)| {
            let corners = self.input.triangles[place.triangle as usize].map(|v| v as usize);
            let [a, b, c] = corners.map(|v| pose.vertices[v]);
            let [_, v, w] = place.barycentric;
            let terms = corners.iter().zip(place.barycentric).map(|(v, weight)| stretches[*v] * weight);
            a + (b - a) * v + (c - a) * w + terms.sum::<DMat3>() * *offset
        };
        let moved: Vec<DVec3> = self.vertices.par_iter().zip(&self.offsets).map(of_one).collect();
        if moved.iter().all(|p| p.is_finite()) {
            return Ok(moved);
        }
        let problem = "the pose has coordinates that are not finite or too large";
        Err(Error::input(None, problem, "mend or leave out this pose"))
    }

    /// Checks what [`Follower::follow`] does.
    fn check(&self, pose: &TriMesh) -> Result<()> {
        let remedy = "give poses of the same mesh, with the same vertices and triangles in the same order";
        let [own, other] = [&self.input, pose].map(|mesh| mesh.vertices.len());
        if own != other {
            let problem = format!("the pose has {other} vertices, and the input has {own}");
            return Err(Error::input(None, problem, remedy));
        }
        let (own, other) = (&self.input.triangles, &pose.triangles);
        if other.is_empty() || own == other {
            return Ok(());
        }
        let problem = match own.iter().zip(other).position(|(own, other)| own != other) {
            Some(first) if own.len() == other.len() => {
                format!("triangle {first} of the pose has other vertices than that of the input")
            }
            _ => format!("the pose has {} triangles, and the input has {}", other.len(), own.len()),
        };
        Err(Error::input(None, problem, remedy))
    }

    /// How the surface around each vertex of the input is turned and stretched: the mean over its triangles,
    /// weighted by their areas.
    fn stretches(&self, pose: &[DVec3]) -> Vec<DMat3> {
        let of_one =
            |(triangle, inverse): (&[u32; 3], &DMat3)| frame(triangle.map(|v| pose[v as usize])).0 * *inverse;
        let of_triangles: Vec<DMat3> =
            self.input.triangles.par_iter().zip(&self.inverse).map(of_one).collect();
        let mut sums = vec![(DMat3::ZERO, 0.0); pose.len()];
        for (t, (triangle, stretch)) in self.input.triangles.iter().zip(of_triangles).enumerate() {
            let has_say = self.inverse[t] != DMat3::ZERO;
            let area = if has_say { self.input.triangle_area(t) } else { 0.0 };
            for v in triangle {
                let (sum, weight) = &mut sums[*v as usize];
                *sum += stretch;
                *weight += area;
            }
        }
        let mean =
            |(sum, weight): (DMat3, f64)| if weight > 0.0 { sum * weight.recip() } else { DMat3::IDENTITY };
        sums.into_iter().map(mean).collect()
    }
}

/// Two sides of a triangle and its normal, as long as the triangle is wide; with the triangle's area.
fn frame(corners: [DVec3; 3]) -> (DMat3, f64) {
    let [a, b, c] = corners;
    let normal = doubled_normal(corners);
    let length = normal.length();
    let height = if length > 0.0 { normal / length.sqrt() } else { DVec3::ZERO };
    (DMat3::from_cols(b - a, c - a, height), 0.5 * length)
}

/// The mean length of the sides of all triangles.
fn mean_edge(mesh: &TriMesh) -> f64 {
    let around = |t| {
        let [a, b, c] = mesh.corners(t);
        a.distance(b) + b.distance(c) + c.distance(a)
    };
    (0..mesh.triangles.len()).map(around).sum::<f64>() / (3 * mesh.triangles.len()).max(1) as f64
}
