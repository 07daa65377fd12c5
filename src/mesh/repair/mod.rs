//! Repairs what has one obvious remedy: duplicates, faces without an area, unused vertices, faces turned
//! over, cracks no wider than rounding; and, where the caller gives a tolerance, wider cracks and small
//! components; and, where asked for, fills holes, smooths spikes and ragged boundaries, and removes what is
//! inside.

mod borders;
mod boundary;
mod clean;
mod components;
mod counts;
mod cracks;
mod hidden;
pub(crate) mod holes;
mod joints;
mod orient;
mod region_areas;
mod smooth_boundary;
mod spikes;
mod weld;

use std::collections::HashSet;
use std::collections::hash_map::Entry;
use std::ops::Range;

use glam::DVec3;

use super::half_edges::EdgeTable;
use super::kd_tree::KdTree;
use super::quick_hash::QuickMap;
use super::submesh::without_unused_vertices;
use super::{TriMesh, position_key};
use crate::{Error, Length, ProgressToken, Result};
pub(crate) use borders::{BorderSmoothing, smooth_borders};
pub(crate) use clean::is_flat;
use clean::{Cleaned, clean};
pub(crate) use components::connected_components;
pub use counts::RepairCounts;
pub use cracks::{Cracks, cracks};
use smooth_boundary::smooth_boundary;

/// A mesh after [`repair`], with what was done to it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Repaired {
    /// The mesh that is left; vertices and triangles in their old order.
    pub mesh: TriMesh,
    /// Of each triangle that is left, which of the input it was.
    pub origin: Vec<u32>,
    /// How much was changed.
    pub counts: RepairCounts,
    /// The triangles that fill holes. Each of them has the origin of one at the hole.
    pub(crate) patches: Range<usize>,
    /// How far a vertex may have gone to another.
    reach: f64,
}

impl Repaired {
    /// The mesh that this was made from, with its vertices where they were welded to. All faces keep their
    /// numbers, including those that were dropped. What attributes say about edges then also holds for cracks
    /// that were closed.
    /// `None` if only vertices at exactly equal positions were welded.
    pub fn at_welded_places(&self, mesh: &TriMesh) -> Option<TriMesh> {
        if self.counts.crack_vertices_welded + self.counts.near_vertices_welded == 0 {
            return None;
        }
        let tree = KdTree::new(&self.mesh.vertices);
        let welded = |p: &DVec3| {
            let nearest = tree.nearest(*p).map(|v| self.mesh.vertices[v as usize]);
            nearest.filter(|place| place.distance(*p) <= self.reach).unwrap_or(*p)
        };
        let vertices = mesh.vertices.iter().map(welded).collect();
        Some(TriMesh { vertices, triangles: mesh.triangles.clone() })
    }
}

/// What [`repair_with`] may do in addition.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct RepairOptions {
    /// Vertices closer than this share of the bounding box's diagonal become one, and boundary edges are
    /// joined to the boundary vertices on them; 0 to below 1, 0 for exact duplicates only.
    pub weld: f64,
    /// Components with less than this share of the area are dropped, but never the largest; 0 to below 1.
    pub min_component: f64,
    /// Ragged boundaries are smoothed; none of their vertices moves farther than this fraction of the
    /// bounding box's diagonal. 0 to below 1; 0 leaves boundaries as they are.
    pub smooth_boundary: f64,
    /// Spikes are smoothed: vertices that stick out alone like needles, around which all angles sum to less
    /// than 90 degrees.
    pub smooth_spikes: bool,
    /// Holes are filled if the diagonal of their bounding box is at most this long; `None` fills none.
    pub fill_holes: Option<Length>,
    /// Components inside closed ones are dropped unless they intersect these.
    pub outer: bool,
}

impl RepairOptions {
    /// Checks the ranges, as [`repair_with`] also does.
    ///
    /// # Errors
    /// [`Error::Usage`] with the first field that is out of its range.
    pub fn validate(&self) -> Result<()> {
        let shares = [
            ("weld", self.weld),
            ("min_component", self.min_component),
            ("smooth_boundary", self.smooth_boundary),
        ];
        for (name, value) in shares {
            if !(0.0..1.0).contains(&value) {
                let problem = format!("`{name}` {value} is out of range");
                return Err(Error::option(name, problem, "use 0 or a small fraction, below 1"));
            }
        }
        if let Some(Length::Units(length) | Length::OfDiagonal(length)) = self.fill_holes
            && !(length.is_finite() && length > 0.0)
        {
            let problem = format!("`fill_holes` {length} is out of range");
            return Err(Error::option("fill_holes", problem, "give a length above 0, such as 5%"));
        }
        Ok(())
    }

    /// Sets [`RepairOptions::weld`].
    #[must_use]
    pub fn weld(self, weld: f64) -> Self {
        Self { weld, ..self }
    }

    /// Sets [`RepairOptions::min_component`].
    #[must_use]
    pub fn min_component(self, min_component: f64) -> Self {
        Self { min_component, ..self }
    }

    /// Sets [`RepairOptions::smooth_boundary`].
    #[must_use]
    pub fn smooth_boundary(self, smooth_boundary: f64) -> Self {
        Self { smooth_boundary, ..self }
    }

    /// Sets [`RepairOptions::smooth_spikes`].
    #[must_use]
    pub fn smooth_spikes(self, smooth_spikes: bool) -> Self {
        Self { smooth_spikes, ..self }
    }

    /// Sets [`RepairOptions::outer`].
    #[must_use]
    pub fn outer(self, outer: bool) -> Self {
        Self { outer, ..self }
    }

    /// Sets [`RepairOptions::fill_holes`].
    #[must_use]
    pub fn fill_holes(self, fill_holes: Length) -> Self {
        Self { fill_holes: Some(fill_holes), ..self }
    }
}

/// [`repair_with`] without tolerances.
///
/// # Errors
///
/// See there.
pub fn repair(mesh: &TriMesh) -> Result<Repaired> {
    repair_with(mesh, &RepairOptions::default())
}

/// Welds vertices at exactly equal positions (-0.0 equals 0.0), then drops faces without an area, repeated
/// faces (the first is kept) and unused vertices. Areas are judged relative to the triangle's own longest
/// edge, so neither size nor position of the mesh matters; edges that a flat face joined are split at its
/// vertex. Then closes cracks no wider than 32 units of 32-bit rounding of the largest coordinate and a
/// hundredth of the edges there, closes others and drops small components as far as `options` say, and turns
/// faces over that disagree with others of their component: closed ones then face outwards. A surface that is
/// inside out as a whole stays inside out. Last, spikes are smoothed, holes filled, hidden components dropped
/// and boundaries smoothed if `options` ask for it.
///
/// # Errors
///
/// [`Error::Input`] naming the face or vertex for an index out of range or a coordinate that is not finite;
/// without a place if no face with an area is left. [`Error::Usage`] for options out of range.
pub fn repair_with(mesh: &TriMesh, options: &RepairOptions) -> Result<Repaired> {
    repair_with_progress(mesh, options, &ProgressToken::default())
}

/// Like [`repair_with`].
///
/// # Errors
/// As [`repair_with`], and [`Error::Cancelled`].
pub(crate) fn repair_with_progress(
    mesh: &TriMesh,
    options: &RepairOptions,
    progress: &ProgressToken,
) -> Result<Repaired> {
    options.validate()?;
    check(mesh)?;
    let mut counts = RepairCounts::default();
    let first_there = same_places(&mesh.vertices);
    counts.duplicate_vertices_welded = (0..).zip(&first_there).filter(|(own, first)| *own != **first).count();
    let Cleaned { triangles, mut origin, flat } = clean(mesh, |v| first_there[v as usize], &mut counts);
    if triangles.is_empty() {
        return Err(Error::input(None, "the mesh has no faces with an area", "give a surface mesh"));
    }
    let mut kept = without_unused_vertices(mesh, triangles);
    counts.unreferenced_vertices_removed =
        mesh.vertices.len() - counts.duplicate_vertices_welded - kept.vertices.len();
    let places: HashSet<[u64; 3]> = flat.iter().map(|v| position_key(mesh.vertices[*v as usize])).collect();
    let at_flat: Vec<bool> =
        kept.vertices.iter().map(|p| !flat.is_empty() && places.contains(&position_key(*p))).collect();
    let unit = unit_of(&kept);
    kept.vertices.iter_mut().for_each(|vertex| *vertex /= unit);
    if !flat.is_empty() {
        // A flat face between a long edge and two short ones held them together.
        let reach = kept.bounds().map_or(0.0, |[low, high]| FLAT_REACH * (high - low).length());
        joints::join(&mut kept, &mut origin, |v| at_flat[v as usize].then_some(reach), &mut counts);
    }
    let (mut reach, mut table) = cracks::close(&mut kept, &mut origin, &mut counts);
    if options.weld > 0.0 {
        let wide = kept.bounds().map_or(0.0, |[low, high]| options.weld * (high - low).length());
        weld::weld(&mut kept, &mut origin, wide, &mut counts);
        joints::join(&mut kept, &mut origin, |_| Some(wide), &mut counts);
        reach = reach.max(wide);
        if kept.triangles.is_empty() {
            let problem = format!("`weld` {} leaves no face", options.weld);
            return Err(Error::input(None, problem, "use a smaller tolerance"));
        }
    }
    if options.min_component > 0.0 {
        components::drop_small(&mut kept, &mut origin, options.min_component, &mut counts);
    }
    if options.weld > 0.0 || options.min_component > 0.0 {
        // A third face may be gone from edges that had too many.
        (_, table) = cracks::close(&mut kept, &mut origin, &mut counts);
    }
    orient::orient(&mut kept, &table, &mut counts);
    if options.smooth_spikes {
        counts.spikes_smoothed = spikes::smooth_spikes(&mut kept, &table, progress)?;
    }
    let mut first_patch = kept.triangles.len();
    if let Some(largest) = options.fill_holes {
        let diagonal = kept.bounds().map_or(0.0, |[low, high]| high.distance(low));
        let largest = match largest {
            Length::Units(length) => length / unit,
            // All, whatever rounding does to the diagonal.
            Length::OfDiagonal(share) if share >= 1.0 => f64::INFINITY,
            Length::OfDiagonal(share) => share * diagonal,
        };
        first_patch = holes::fill_holes(&mut kept, &mut origin, largest, &mut counts, progress)?;
    }
    if options.outer {
        counts.hidden_components_removed =
            hidden::drop_hidden(&mut kept, &mut origin, &mut first_patch, progress)?;
    }
    let patches = first_patch..kept.triangles.len();
    if options.smooth_boundary > 0.0 {
        let [low, high] = kept.bounds().unwrap_or_default();
        let tolerance = options.smooth_boundary * (high - low).length();
        let table = EdgeTable::new(&kept.triangles);
        counts.boundary_vertices_moved = smooth_boundary(&mut kept, &table, tolerance);
    }
    kept.vertices.iter_mut().for_each(|vertex| *vertex *= unit);
    Ok(Repaired { mesh: kept, origin, counts, patches, reach: reach * unit })
}

/// Vertices of flat faces are closer to the opposite edges than this share of the bounding box's diagonal.
const FLAT_REACH: f64 = 1e-9;

/// Extents beyond this, and below its inverse, have squares that overflow or vanish.
const FAR: f64 = 1e60;

/// What lengths are divided by so that they can be multiplied: a power of two, so that no digit is lost; 1
/// for what is of an ordinary size.
fn unit_of(mesh: &TriMesh) -> f64 {
    let [low, high] = mesh.bounds().unwrap_or_default();
    // Halved first, because the difference can overflow.
    let half = (0.5 * high - 0.5 * low).max_element();
    if half > FAR {
        // No smaller than need be, or coordinates next to nothing would become nothing.
        (half / FAR).log2().ceil().exp2()
    } else if half > 0.0 && half < 1.0 / FAR {
        half.log2().floor().clamp(-1000.0, 0.0).exp2()
    } else {
        1.0
    }
}

fn check(mesh: &TriMesh) -> Result<()> {
    let count = mesh.vertices.len();
    if u32::try_from(count).map_or(true, |count| count == u32::MAX) {
        let problem = format!("the mesh has {count} vertices, more than the {} possible", u32::MAX - 1);
        return Err(Error::input(None, problem, "split or simplify the mesh first"));
    }
    if let Some(vertex) = mesh.vertices.iter().position(|vertex| !vertex.is_finite()) {
        let place = Some(format!("vertex {vertex}"));
        return Err(Error::input(place, "a coordinate is not finite", "remove or repair the vertex"));
    }
    for (face, triangle) in mesh.triangles.iter().enumerate() {
        if let Some(vertex) = triangle.iter().find(|vertex| **vertex as usize >= count) {
            let problem = format!("there is no vertex {vertex}, the mesh has {count}");
            return Err(Error::input(Some(format!("face {face}")), problem, "mend the face"));
        }
    }
    Ok(())
}

/// For each vertex the first one at the same position.
fn same_places(vertices: &[DVec3]) -> Vec<u32> {
    let mut firsts: QuickMap<[u64; 3], u32> = QuickMap::default();
    firsts.reserve(vertices.len());
    let first_of = |(own, position): (u32, &DVec3)| match firsts.entry(position_key(*position)) {
        Entry::Occupied(first) => *first.get(),
        Entry::Vacant(free) => *free.insert(own),
    };
    (0..).zip(vertices).map(first_of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;
    use crate::mesh::submesh::append;

    #[test]
    fn patches_are_the_last_triangles_whatever_is_removed_before_them() {
        let ball = sample("sphere").unwrap();
        let scaled = |factor: f64| TriMesh {
            vertices: ball.vertices.iter().map(|p| *p * factor).collect(),
            triangles: ball.triangles.clone(),
        };
        let (mut mesh, mut open) = (scaled(0.3), scaled(1.0));
        let fan: Vec<[u32; 3]> = open.triangles.extract_if(.., |t| t.contains(&1200)).collect();
        // A triangle that hangs in the hole by a vertex.
        let at = fan[0].into_iter().find(|v| *v != 1200).unwrap();
        let middle = open.vertices[1200];
        let last = open.vertices.len() as u32;
        open.vertices.extend([middle, middle + 0.2 * (open.vertices[at as usize] - middle).cross(middle)]);
        open.triangles.push([at, last, last + 1]);
        append(&mut mesh, &open);
        let options = RepairOptions::default().fill_holes(Length::OfDiagonal(1.0)).outer(true);
        let Repaired { mesh, counts, patches, .. } = repair_with(&mesh, &options).unwrap();
        let made = (counts.parts_removed, counts.holes_filled, counts.hidden_components_removed);
        assert_eq!(made, (1, 1, 1));
        assert_eq!(patches, ball.triangles.len() - fan.len()..mesh.triangles.len());
    }
}
