//! The surroundings of an outlier: the deviation between mesh and surface there, and whether the triangles
//! are sound. It is computed once, and after an edit only where that may have changed it.

use glam::DVec3;

use super::known::{Known, KnownTriangles, MIDDLE, Ranks, SAMPLES, sample};
use super::mesh_copy::MeshCopy;
use crate::mesh::half_edges::next;
use crate::mesh::quality::{are_clearly_acute, cosine_clear_of, extreme_angles};
use crate::mesh::triangle::{closest_on_triangle, doubled_normal};

/// Rings of vertices around a triangle that are relaxed.
const RINGS: u32 = 2;
/// Minimum cosine between the normals of a triangle and of the surface under it.
const FACING: f64 = 0.1;
/// Minimum cosine between the normals of two neighbouring triangles.
const DIHEDRAL: f64 = -0.4;
/// An edit is not tried in full if it leaves this share of the deviation that it must stay below.
const HOPELESS: f64 = 1.5;
/// Maximum number of points of the surface in a region; of more, evenly spaced ones are taken.
const MOST_POINTS: usize = 400;

/// The surroundings of an outlier.
pub(crate) struct Region {
    /// Vertices that are relaxed, in ascending order.
    pub vertices: Vec<u32>,
    /// All triangles that may change, in ascending order.
    pub triangles: Vec<u32>,
    /// Triangles outside that share an edge with them. Nothing beyond matters.
    pub adjacent: Vec<u32>,
    /// The samples that are each triangle's, one bit each.
    pub owned: Vec<u16>,
    /// The surface's vertices that are closest to these triangles, with the index of that triangle in the
    /// list.
    points: Vec<(u32, usize)>,
    /// The square of the tolerated distance.
    pub tolerance_sq: f64,
}

/// A region before it is edited.
pub(crate) struct RegionState {
    pub deviation: Deviation,
    /// For each point of the surface, the squared distance to the closest triangle, or to any within the
    /// tolerance, and the index of that triangle in the list.
    nearest: Vec<(f64, usize)>,
    /// The squared distances of samples that exceed the tolerance, each with the index of its triangle.
    samples: Vec<(f64, usize)>,
    sound: Vec<bool>,
    ranks: Vec<Ranks>,
}

/// Deviation of mesh and surface from each other in a region.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Deviation {
    /// Sum of the squared excesses of squared distances over the tolerance, relative to it.
    pub sum: f64,
    /// The largest squared distance.
    pub largest_sq: f64,
}

impl Deviation {
    fn add(&mut self, distance_sq: f64, tolerance_sq: f64) {
        self.sum += ((distance_sq - tolerance_sq).max(0.0) / tolerance_sq).powi(2);
        self.largest_sq = self.largest_sq.max(distance_sq);
    }

    /// Whether this is better than `most`: a smaller sum, and nothing farther.
    fn is_below(&self, most: &Self) -> bool {
        self.sum < most.sum && self.largest_sq <= most.largest_sq
    }
}

impl MeshCopy<'_> {
    /// The region around a triangle. `points_of` has for each triangle the surface's vertices to which it is
    /// the closest.
    pub fn region(&self, t: u32, points_of: &[Vec<u32>]) -> Region {
        let vertices = self.around(t);
        let at_vertex = |v: &u32| self.half_edges.ring(*v).map(|h| h / 3);
        let mut triangles: Vec<u32> = vertices.iter().flat_map(at_vertex).collect();
        triangles.sort_unstable();
        triangles.dedup();
        let mut points: Vec<(u32, usize)> = (0..)
            .zip(&triangles)
            .flat_map(|(k, t)| points_of[*t as usize].iter().map(move |p| (*p, k)))
            .collect();
        let every = points.len().div_ceil(MOST_POINTS).max(1);
        points = points.into_iter().step_by(every).collect();
        let across = |t: &u32| (3 * t..3 * t + 3).filter_map(|h| self.half_edges.twin(h)).map(|h| h / 3);
        let outside = |t: &u32| triangles.binary_search(t).is_err();
        let adjacent = triangles.iter().flat_map(across).filter(outside).collect();
        let owned = triangles.iter().map(|t| self.owned(*t, &triangles)).collect();
        let tolerance_sq = self.context.tolerance_sq(self.half_edges.triangles[t as usize]);
        Region { vertices, triangles, adjacent, owned, points, tolerance_sq }
    }

    /// Finds out what is not known of a triangle yet.
    pub fn complete(&self, known: &mut Known, t: u32, owned: u16, tolerance_sq: f64) {
        let corners = self.corners(t);
        let target = self.context.target;
        known.complete(owned, tolerance_sq, |k, rank, most| {
            target.tree.distance_sq_beyond(sample(corners, k), rank, most)
        });
        if known.sound.is_none() {
            known.sound = Some(self.sound(t, &mut known.ranks));
        }
    }

    /// The distance of a point to the nearest triangle of a region.
    pub fn distance_to(&self, region: &Region, at: DVec3) -> f64 {
        let distances = region.triangles.iter().map(|t| distance_sq(at, self.corners(*t)));
        distances.fold(f64::INFINITY, f64::min).sqrt()
    }

    /// The typical edge length at a triangle.
    pub fn edge_length_at(&self, t: u32) -> f64 {
        self.context.typical_edge_length(self.half_edges.triangles[t as usize])
    }

    /// The corners of a triangle and the rings of vertices around it, in ascending order.
    fn around(&self, t: u32) -> Vec<u32> {
        let mut around: Vec<u32> = self.half_edges.triangles[t as usize].to_vec();
        for _ in 0..RINGS {
            for k in 0..around.len() {
                around.extend(self.half_edges.ring(around[k]).map(|h| self.half_edges.origin(next(h))));
            }
            around.sort_unstable();
            around.dedup();
        }
        around
    }

    /// The present state of a region, of whose triangles all that is needed is `known`.
    pub fn before(&self, region: &Region, known: &KnownTriangles) -> RegionState {
        let corners: Vec<[DVec3; 3]> = region.triangles.iter().map(|t| self.corners(*t)).collect();
        let nearest: Vec<_> =
            region.points.iter().map(|(p, k)| self.nearest(*p, *k, &corners, region.tolerance_sq)).collect();
        let (mut samples, mut sound, mut ranks) = (Vec::new(), Vec::new(), Vec::new());
        for (k, (t, owned)) in region.triangles.iter().zip(&region.owned).enumerate() {
            let known = known.of(*t);
            samples.extend(known.beyond(*owned, region.tolerance_sq).map(|distance_sq| (distance_sq, k)));
            sound.push(known.sound == Some(true));
            ranks.push(known.ranks);
        }
        let mut deviation = Deviation::default();
        let distances = nearest.iter().map(|n| n.0).chain(samples.iter().map(|sample| sample.0));
        distances.for_each(|distance_sq| deviation.add(distance_sq, region.tolerance_sq));
        RegionState { deviation, nearest, samples, sound, ranks }
    }

    /// The deviation of a region after an edit that changed the triangles with the indices `changed`; `None`
    /// if one of these is unsound or has an angle below `floor` degrees, or if it is not below `most`.
    pub fn after(
        &self,
        region: &Region,
        before: &mut RegionState,
        changed: &[usize],
        (floor, most): (f64, &Deviation),
    ) -> Option<Deviation> {
        let clear_of_floor = cosine_clear_of(floor);
        let shaped = |k: &usize| {
            let corners = self.corners(region.triangles[*k]);
            are_clearly_acute(corners, clear_of_floor) || {
                let [smallest, largest] = extreme_angles(corners);
                smallest >= floor && largest <= 90.0
            }
        };
        let others_are_sound =
            || before.sound.iter().enumerate().all(|(k, sound)| *sound || changed.contains(&k));
        if !changed.iter().all(shaped) || !others_are_sound() {
            return None;
        }
        let mut deviation = self.partly_after(region, before, changed, most)?;
        if !changed.iter().all(|k| self.sound(region.triangles[*k], &mut before.ranks[*k])) {
            return None;
        }
        for k in changed {
            for distance_sq in self.samples(region.triangles[*k], region, &mut before.ranks[*k]) {
                deviation.add(distance_sq, region.tolerance_sq);
                if !deviation.is_below(most) {
                    return None;
                }
            }
        }
        deviation.is_below(most).then_some(deviation)
    }

    /// Whether an edit that changed the triangles with the indices `changed` may reduce the deviation below
    /// `most` once the vertices around are relaxed, which takes most of the time that a trial takes. Hardly
    /// ever is an edit kept that leaves more than this before.
    pub fn is_promising(
        &self,
        region: &Region,
        before: &RegionState,
        changed: &[usize],
        most: &Deviation,
    ) -> bool {
        let most = Deviation { sum: HOPELESS * most.sum, largest_sq: HOPELESS * most.largest_sq };
        self.partly_after(region, before, changed, &most).is_some()
    }

    /// Like [`MeshCopy::after`], without the samples of the triangles that changed.
    fn partly_after(
        &self,
        region: &Region,
        before: &RegionState,
        changed: &[usize],
        most: &Deviation,
    ) -> Option<Deviation> {
        let is_changed = {
            let mut is_changed = vec![false; region.triangles.len()];
            changed.iter().for_each(|k| is_changed[*k] = true);
            is_changed
        };
        let corners: Vec<[DVec3; 3]> = region.triangles.iter().map(|t| self.corners(*t)).collect();
        let tolerance_sq = region.tolerance_sq;
        let mut deviation = Deviation::default();
        // First what is known, then what is cheap.
        for (distance_sq, _) in before.samples.iter().filter(|(_, k)| !is_changed[*k]) {
            deviation.add(*distance_sq, tolerance_sq);
        }
        for ((p, _), (was, k)) in region.points.iter().zip(&before.nearest) {
            let distance_sq = if is_changed[*k] {
                self.nearest(*p, *k, &corners, tolerance_sq).0
            } else if *was > tolerance_sq {
                let at = self.context.target.vertices[*p as usize].position;
                changed.iter().map(|k| distance_sq(at, corners[*k])).fold(*was, f64::min)
            } else {
                continue;
            };
            deviation.add(distance_sq, tolerance_sq);
            if !deviation.is_below(most) {
                return None;
            }
        }
        Some(deviation)
    }

    /// The squared distance of a point of the surface to the closest triangle, or to any within the
    /// tolerance, and the index of that triangle; the search begins with `first`.
    fn nearest(&self, p: u32, first: usize, corners: &[[DVec3; 3]], tolerance_sq: f64) -> (f64, usize) {
        let at = self.context.target.vertices[p as usize].position;
        let mut nearest = (distance_sq(at, corners[first]), first);
        for (k, corners) in corners.iter().enumerate() {
            if nearest.0 <= tolerance_sq {
                break;
            }
            let distance_sq = distance_sq(at, *corners);
            if distance_sq < nearest.0 {
                nearest = (distance_sq, k);
            }
        }
        nearest
    }

    /// The squared distances of a triangle's samples that exceed the tolerance.
    fn samples<'s>(
        &'s self,
        t: u32,
        region: &'s Region,
        ranks: &'s mut Ranks,
    ) -> impl Iterator<Item = f64> + 's {
        let (corners, owned) = (self.corners(t), self.owned(t, &region.triangles));
        let target = self.context.target;
        (0..SAMPLES).filter(move |k| owned >> k & 1 != 0).filter_map(move |k| {
            target.tree.distance_sq_beyond(sample(corners, k), &mut ranks[k], region.tolerance_sq)
        })
    }

    /// The samples that are a triangle's, one bit each: those at vertices and on edges belong to one of the
    /// triangles of a region.
    fn owned(&self, t: u32, triangles: &[u32]) -> u16 {
        let mut owned = 0b1111 << MIDDLE;
        for k in 0..3 {
            let v = self.half_edges.triangles[t as usize][k];
            // All triangles around are of the region, or none of its vertices moves there.
            if self.half_edges.ring(v).all(|h| h / 3 >= t) {
                owned |= 1 << k;
            }
            let h = 3 * t + k as u32;
            let within = |twin: u32| triangles.binary_search(&(twin / 3)).is_ok();
            if self.half_edges.twin(h).is_none_or(|twin| h < twin || !within(twin)) {
                owned |= 0b111 << (3 + 3 * k);
            }
        }
        owned
    }

    /// Whether a triangle neither faces away from the surface nor folds onto its neighbours.
    fn sound(&self, t: u32, ranks: &mut Ranks) -> bool {
        let corners = self.corners(t);
        let normal = doubled_normal(corners).normalize_or_zero();
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let edge = self.edge_length_at(t);
        let across =
            |h| self.half_edges.twin(h).map(|g| doubled_normal(self.corners(g / 3)).normalize_or_zero());
        (3 * t..3 * t + 3).filter_map(across).all(|neighbour| neighbour.dot(normal) > DIHEDRAL)
            && self
                .context
                .target
                .closest_with_normal(middle, normal, self.half_edges.patch(t), &mut ranks[MIDDLE])
                .is_some_and(|(at, facing)| facing.dot(normal) > FACING && at.distance(middle) < edge)
    }
}

/// The squared distance of a point to a triangle.
fn distance_sq(at: DVec3, corners: [DVec3; 3]) -> f64 {
    closest_on_triangle(at, corners).point.distance_squared(at)
}
