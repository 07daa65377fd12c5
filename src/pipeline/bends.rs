//! Bends of CAD parts that edges of equal length would cut off: fillets, chamfers and small holes that are
//! hardly wider than an edge. There edges become shorter; see `coarse_to_fine/bend_lengths.rs`.

use super::pinned::WholeEdges;
use super::refined::divide;
use crate::mesh::chunks::CHUNK;
use crate::mesh::half_edges::EdgeTable;
use crate::mesh::planes::has_planes;
use crate::mesh::quality::quality;
use crate::mesh::repair::Repaired;
use crate::mesh::spacing;
use crate::mesh::subdivide::halve_edges;
use crate::mesh::topology::Topology;
use crate::{ProgressToken, Result, TriMesh};
use glam::DVec3;
use rayon::prelude::*;

/// A surface is bent at an edge where it turns by less than this many degrees; at others, there is a crease.
const CREASE: f64 = 30.0;
/// The bends count that turn by at least this many radians along an edge of the result.
const BENT: f64 = 0.4;
/// At least this share of the area is next to them.
const LEAST_BENT: f64 = 2e-3;
/// If creases take more than this share of the vertices, none are left for bends.
const MOST_ON_CREASES: f64 = 0.4;
/// Edges of more than this many spacings are halved.
const LONG: f64 = 1.5;
/// Fewer than this many triangles are added for each vertex of the result.
const MOST_ADDED: usize = 4;

/// What is known of a part with bends before its planes are divided.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bends {
    /// The smallest angle of its triangles, in degrees.
    pub smallest_angle: f64,
}

/// What is known of a mesh that has bends, if much of it lies in planes and a result of so many `vertices`
/// has some to spare for bends.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn find_bends(mesh: &TriMesh, vertices: usize, progress: &ProgressToken) -> Result<Option<Bends>> {
    let spacing = spacing(mesh.area(), vertices);
    let Found { bent, creases } = Found::of(mesh, spacing);
    progress.poll()?;
    let has_bends = bent >= LEAST_BENT * mesh.area()
        && creases <= MOST_ON_CREASES * vertices as f64 * spacing
        && has_planes(mesh, spacing);
    let smallest_angle = || quality(mesh).map_or(0.0, |quality| quality.min_angle);
    Ok(has_bends.then(|| Bends { smallest_angle: smallest_angle() }))
}

/// Halves the long edges of a mesh, for a result of so many `vertices`, so that lengths can change along
/// them: planes often consist of long triangles. Lists of half-edges become those of their parts, and `whole`
/// edges stay. Returns the topology before, if anything changed.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn divide_planes(
    repaired: &mut Repaired,
    vertices: usize,
    (half_edges, whole): ([&mut Vec<u32>; 2], &WholeEdges),
    progress: &ProgressToken,
) -> Result<Option<Topology>> {
    let spacing = spacing(repaired.mesh.area(), vertices);
    let most = repaired.mesh.triangles.len() + MOST_ADDED * vertices;
    let size = |a: DVec3, b: DVec3| whole.size((a, b), LONG * spacing);
    let halved = halve_edges(&repaired.mesh, (1.0, &size), most, progress)?;
    Ok(halved.map(|halved| divide(repaired, halved, half_edges)))
}

/// What a surface has besides planes.
struct Found {
    /// The area next to bends along which edges would turn by much.
    bent: f64,
    /// The length of the creases, boundaries and junctions.
    creases: f64,
}

impl Found {
    /// For edges of length `spacing`.
    fn of(mesh: &TriMesh, spacing: f64) -> Self {
        let all = (0..mesh.triangles.len()).into_par_iter().with_min_len(CHUNK);
        let normals: Vec<DVec3> = all.map(|t| mesh.doubled_normal(t)).collect();
        let mut found = Self { bent: 0.0, creases: 0.0 };
        for sides in EdgeTable::new(&mesh.triangles).edges() {
            let (a, b) = sides[0].ends();
            let length = mesh.vertices[a as usize].distance(mesh.vertices[b as usize]);
            let [one, two] = sides else {
                found.creases += length;
                continue;
            };
            let [m, n] = [one, two].map(|side| normals[side.triangle()]);
            let angle = m.angle_between(n);
            // The turn happens on the way from one triangle to the other, which is about as long as the mean
            // of their heights.
            let doubled_area = m.length() + n.length();
            if angle >= CREASE.to_radians() {
                found.creases += length;
            } else if angle * spacing * length > BENT * 0.5 * doubled_area {
                found.bent += doubled_area / 6.0;
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::repair::repair;
    use crate::mesh::samples::sample;

    /// A strip of facets, each of this width and turned by so many degrees from the last, between two planes.
    fn bend(width: f64, degrees: f64) -> TriMesh {
        let turn = degrees.to_radians();
        let mut profile = vec![DVec3::ZERO, DVec3::X];
        for k in 1..=4 {
            let angle = f64::from(k) * turn;
            profile.push(profile[profile.len() - 1] + width * DVec3::new(angle.cos(), angle.sin(), 0.0));
        }
        let angle = 5.0 * turn;
        profile.push(profile[profile.len() - 1] + DVec3::new(angle.cos(), angle.sin(), 0.0));
        let count = profile.len() as u32;
        let strip = |k: u32| [[k, k + 1, k + 1 + count], [k, k + 1 + count, k + count]];
        TriMesh {
            vertices: profile.iter().copied().chain(profile.iter().map(|p| *p + DVec3::Z)).collect(),
            triangles: (0..count - 1).flat_map(strip).collect(),
        }
    }

    #[test]
    fn bends_count_if_an_edge_turns_by_much_there() {
        // 0.26 radians for each facet.
        for (width, spacing, expected) in
            [(0.02, 0.04, true), (0.02, 0.025, false), (0.05, 0.1, true), (0.05, 0.07, false)]
        {
            assert_eq!(Found::of(&bend(width, 15.0), spacing).bent > 0.0, expected, "{width} {spacing}");
        }
        // Creases are none.
        let Found { bent, creases } = Found::of(&bend(0.02, 35.0), 0.1);
        assert!(bent == 0.0 && creases > 5.0, "{bent} {creases}");
    }

    #[test]
    fn planes_with_bends_are_divided_and_others_stay() {
        let progress = ProgressToken::default();
        for (mesh, is_divided) in [(bend(0.02, 15.0), true), (sample("torus").unwrap(), false)] {
            let mut repaired = repair(&mesh).unwrap();
            let before = repaired.mesh.clone();
            let half_edges = ([&mut Vec::new(), &mut Vec::new()], &WholeEdges::default());
            let found = find_bends(&before, 400, &progress).unwrap();
            assert_eq!(found.is_some(), is_divided);
            let topology = divide_planes(&mut repaired, 40, half_edges, &progress).unwrap();
            assert_eq!(topology.map(|topology| topology.vertices), is_divided.then_some(14));
            assert_eq!(repaired.mesh != before, is_divided);
            assert!((repaired.mesh.area() / before.area() - 1.0).abs() < 1e-12);
            for (triangle, origin) in repaired.mesh.triangles.iter().zip(&repaired.origin) {
                let corners = triangle.map(|v| repaired.mesh.vertices[v as usize]);
                let normal = crate::mesh::triangle::doubled_normal(corners);
                assert!(normal.dot(before.doubled_normal(*origin as usize)) > 0.0);
            }
        }
    }
}
