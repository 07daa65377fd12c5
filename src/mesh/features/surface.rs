//! The surface as the feature search sees it: triangles with trustworthy normals, and the twins of
//! half-edges.

use glam::DVec3;
use rayon::prelude::*;

use super::curve::CurveKind;
use crate::mesh::NONE;
use crate::mesh::half_edges::{EdgeTable, edge_key, next, twin_pair};
use crate::mesh::triangle::doubled_normal;
use crate::{Error, Result};

/// Triangles lower than this share of the spacing take the normal of the one across their longest edge: their
/// own is as much rounding of coordinates as it is the surface's.
const NEEDLE: f64 = 1e-3;
/// Triangles lower than this fraction of the bounding box's diagonal are needles as well: with 32-bit
/// coordinates the normal of a triangle of this height is right to 5 degrees.
const NEEDLE_OF_DIAGONAL: f64 = 1e-6;

/// Triangles and half-edges with what the search needs of them.
pub(super) struct FeatureSurface<'a> {
    triangles: &'a [[u32; 3]],
    /// Unit normals (zero where there is none) and areas of the triangles.
    pub(super) normals: Vec<DVec3>,
    pub(super) areas: Vec<f64>,
    /// See [`EdgeTable::twins`].
    pub(super) twins: Vec<u32>,
    /// Edges that are curves whatever their angle, by their first half-edge.
    pub(super) fixed: Vec<(u32, CurveKind)>,
    /// Pairs of half-edges on one edge that are not twins; together they connect all half-edges of such an
    /// edge.
    pub(super) joined: Vec<[u32; 2]>,
    /// Whether a half-edge is on a fixed edge.
    pub(super) is_fixed: Vec<bool>,
}

impl<'a> FeatureSurface<'a> {
    pub(super) fn new(points: &[DVec3], triangles: &'a [[u32; 3]], spacing: f64) -> Self {
        let table = EdgeTable::new(triangles);
        let twins = table.twins(triangles);
        let mut is_fixed = vec![false; twins.len()];
        let mut fixed = Vec::new();
        let mut joined = Vec::new();
        for edge in table.edges() {
            let from = |k: usize| edge[k].corners().0;
            let kind = match edge.len() {
                1 => CurveKind::Boundary,
                2 if twin_pair(triangles, edge).is_some() => continue,
                2 => CurveKind::Inconsistent,
                _ => CurveKind::NonManifold,
            };
            fixed.push((from(0) as u32, kind));
            edge.iter().for_each(|side| is_fixed[side.corners().0] = true);
            joined.extend((1..edge.len()).map(|k| [from(0) as u32, from(k) as u32]));
        }
        let (mut normals, areas): (Vec<_>, Vec<_>) = triangles
            .par_iter()
            .map(|t| {
                let double = doubled_normal(t.map(|v| points[v as usize]));
                (double.normalize_or_zero(), 0.5 * double.length())
            })
            .unzip();
        let lowest = (NEEDLE * spacing).max(NEEDLE_OF_DIAGONAL);
        borrow_normals(points, triangles, &twins, &areas, lowest, &mut normals);
        Self { triangles, normals, areas, twins, fixed, joined, is_fixed }
    }

    /// Makes curves of the edges between these pairs of vertices.
    pub(super) fn add_user_edges(&mut self, edges: &[[u32; 2]]) -> Result<()> {
        if edges.is_empty() {
            return Ok(());
        }
        let mut asked: Vec<(u32, u32)> = edges.iter().map(|&[a, b]| edge_key(a, b)).collect();
        asked.sort_unstable();
        asked.dedup();
        let mut met = vec![false; asked.len()];
        for half in 0..self.twins.len() as u32 {
            let [a, b] = self.ends(half);
            let Ok(found) = asked.binary_search(&edge_key(a, b)) else { continue };
            met[found] = true;
            let twin = self.twins[half as usize];
            // An edge without a twin is a curve already.
            if twin != NONE && half < twin {
                self.fixed.push((half, CurveKind::User));
                self.is_fixed[half as usize] = true;
                self.is_fixed[twin as usize] = true;
            }
        }
        let missing = met.iter().position(|met| !met).map(|missing| asked[missing]);
        missing.map_or(Ok(()), |(a, b)| {
            let problem = format!("no edge joins vertices {a} and {b}");
            Err(Error::input(None, problem, "name only pairs of vertices that share a triangle"))
        })
    }

    /// The vertices that a half-edge joins.
    pub(super) fn ends(&self, half: u32) -> [u32; 2] {
        [half, next(half)].map(|corner| self.triangles.as_flattened()[corner as usize])
    }

    pub(super) fn triangles(&self) -> &'a [[u32; 3]] {
        self.triangles
    }

    /// Whether the surface turns down, and not up, across a half-edge that has a twin.
    pub(super) fn turns_down(&self, points: &[DVec3], half: u32) -> bool {
        let [a, b] = self.ends(half).map(|v| points[v as usize]);
        let twin = self.twins[half as usize];
        self.normals[half as usize / 3].cross(self.normals[twin as usize / 3]).dot(b - a) > 0.0
    }

    /// The angle in degrees by which the surface turns across a half-edge that has a twin.
    pub(super) fn turn(&self, half: u32) -> f64 {
        let twin = self.twins[half as usize];
        degrees_between(self.normals[half as usize / 3], self.normals[twin as usize / 3])
    }
}

/// The angle between two vectors in degrees; 0 where one of them is zero.
pub(super) fn degrees_between(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

/// Gives each needle the normal of the first triangle that is not a needle, walking across longest edges.
fn borrow_normals(
    points: &[DVec3],
    triangles: &[[u32; 3]],
    twins: &[u32],
    areas: &[f64],
    lowest: f64,
    normals: &mut [DVec3],
) {
    // Needles come in fans and rows, but not in long ones.
    const FARTHEST: usize = 8;
    // The longest half-edge of a triangle, the given one left out, and its length.
    let longest = |t: usize, but: usize| {
        let corners = triangles.as_flattened();
        let length = |half: usize| {
            let [a, b] = [half, next(half as u32) as usize].map(|c| points[corners[c] as usize]);
            a.distance(b)
        };
        (3 * t..3 * t + 3)
            .filter(|&half| half != but)
            .map(|half| (half, length(half)))
            .fold((but, 0.0), |best, side| if side.1 > best.1 { side } else { best })
    };
    let is_needle = |t: usize| 2.0 * areas[t] < lowest * longest(t, usize::MAX).1;
    let borrowed: Vec<(usize, DVec3)> = (0..triangles.len())
        .into_par_iter()
        .filter(|&t| is_needle(t))
        .filter_map(|needle| {
            let (mut t, mut came_by) = (needle, usize::MAX);
            for _ in 0..FARTHEST {
                let twin = *twins.get(longest(t, came_by).0)?;
                if twin == NONE {
                    return None;
                }
                (t, came_by) = (twin as usize / 3, twin as usize);
                if !is_needle(t) {
                    return Some((needle, normals[t]));
                }
            }
            None
        })
        .collect();
    borrowed.into_iter().for_each(|(t, normal)| normals[t] = normal);
}
