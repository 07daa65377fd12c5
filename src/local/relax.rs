//! Tangential relaxation onto the surface, and along curves.

use glam::DVec3;
use rayon::prelude::*;
use smallvec::SmallVec;

use super::curve_edges::CurvePart;
use super::star_mesh::{Place, StarMesh};
use super::surface_samples::PassedSample;
use crate::mesh::polyline::Polyline;
use crate::mesh::triangle::doubled_normal;
use crate::polish::{Target, folds_or_flattens};
use crate::{ProgressToken, Result};

/// Passes over all vertices.
const PASSES: u32 = 4;
/// Vertices around which less than this share of the normals is left of their sum are tips, which stay.
const TIP: f64 = 0.5;
/// Where more than this share of the normals is left, triangles around a vertex do not run into others.
const FLAT: f64 = 0.9;
/// Largest distance of the curve from an edge after a slide, as a share of the edge's length.
const MAX_DEVIATION: f64 = 0.05;
/// Longest slide, as a share of the way to the next vertex.
const MOST_SLIDE: f64 = 0.4;
/// Steps of a move that are tried, as shares of it.
const SHARES: [f64; 3] = [1.0, 0.5, 0.25];
/// Share of the way to the weighted mean that a vertex takes in a metric: the weights grow with the lengths.
const SHARE_IN_METRIC: f64 = 0.4;
/// Fewer vertices than this are moved by one thread.
const FEW: usize = 64;

/// The neighbours of a vertex, in little space, since there is a list for each.
type Near = SmallVec<[u32; 8]>;

/// A move of a vertex.
struct Relaxed {
    /// Where the search for the surface ended.
    rank: usize,
    /// Where it goes, and where the samples around it then belong; `None` if it stays.
    to: Option<(DVec3, Vec<PassedSample>)>,
}

impl StarMesh {
    /// Moves vertices one by one towards the mean of their neighbours, over the surface or along their curve.
    pub fn relax(&mut self, target: &Target, polylines: &[Polyline], progress: &ProgressToken) -> Result<()> {
        let groups = self.independent_groups();
        let of_group =
            |group: &Vec<u32>| group.iter().map(|v| (*v, Near::from_slice(&self.neighbours(*v)))).collect();
        let groups: Vec<Vec<(u32, Near)>> = groups.par_iter().map(of_group).collect();
        for _ in 0..PASSES {
            self.slide_all(polylines);
            for group in &groups {
                progress.poll()?;
                self.relax_group(group, target);
            }
        }
        Ok(())
    }

    /// The vertices that move over the surface, in groups. Those of a group are farther apart than what one
    /// depends on, and each comes in a later group than those near it with smaller indices: moved group by
    /// group, they get where they would be if they were moved one by one.
    fn independent_groups(&self) -> Vec<Vec<u32>> {
        let mut groups: Vec<Vec<u32>> = Vec::new();
        // How many groups may not take another vertex next to this one.
        let mut passed = vec![0; self.points.len()];
        for v in 0..self.points.len() as u32 {
            if !self.is_used(v) || self.is_frozen(v) || self.places[v as usize] != Place::Inside {
                continue;
            }
            let mut near = self.neighbours(v);
            near.push(v);
            let group = near.iter().map(|w| passed[*w as usize]).max().unwrap_or(0);
            near.iter().for_each(|w| passed[*w as usize] = group + 1);
            if groups.len() == group {
                groups.push(Vec::new());
            }
            groups[group].push(v);
        }
        groups
    }

    /// Moves vertices, given with their neighbours.
    fn relax_group(&mut self, group: &[(u32, Near)], target: &Target) {
        if group.len() < FEW {
            for (v, near) in group {
                let relaxed = self.relaxed(*v, near, target);
                self.put_relaxed(*v, relaxed);
            }
            return;
        }
        let vertices = group.par_iter().with_min_len(FEW / 2);
        let relaxed: Vec<Relaxed> = vertices.map(|(v, near)| self.relaxed(*v, near, target)).collect();
        group.iter().zip(relaxed).for_each(|((v, _), relaxed)| self.put_relaxed(*v, relaxed));
    }

    pub fn relax_inside(&mut self, v: u32, target: &Target) {
        let relaxed = self.relaxed(v, &self.neighbours(v), target);
        self.put_relaxed(v, relaxed);
    }

    /// A move of a vertex inside a patch, with these neighbours.
    fn relaxed(&self, v: u32, near: &[u32], target: &Target) -> Relaxed {
        let mut rank = self.ranks[v as usize];
        let to = self.relaxed_place(v, near, target, &mut rank);
        Relaxed { rank, to: to.map(|to| (to, self.passed_at(v, to))) }
    }

    fn put_relaxed(&mut self, v: u32, relaxed: Relaxed) {
        self.ranks[v as usize] = relaxed.rank;
        if let Some((to, passed)) = relaxed.to {
            self.move_with(v, to, passed);
        }
    }

    /// Where a vertex inside a patch, with these neighbours, is to go, if it may go there. The search for the
    /// surface begins at `rank`, which becomes where it ends.
    fn relaxed_place(&self, v: u32, near: &[u32], target: &Target, rank: &mut usize) -> Option<DVec3> {
        let here = self.points[v as usize];
        let (normal, left) = self.normal(v);
        if left < TIP {
            return None;
        }
        let up = normal.normalize_or_zero();
        let step = self.pull(v, near);
        let step = step - up * step.dot(up);
        for share in SHARES {
            let goal = here + share * step;
            let to = target.closest(goal, up, self.patch_at(v), rank)?;
            if !self.folds(v, to, normal)
                && (left > FLAT || self.turns_little_at(v, to) || self.stays_apart_at(v, to))
                && self.stays_close_at(v, to)
            {
                return Some(to);
            }
        }
        None
    }

    /// The way to the mean of the neighbours of a vertex. Where lengths depend on the direction, part of the
    /// way to the mean weighted by squared lengths in their metric, down the gradient of the sum of their
    /// fourth powers: that makes edges even there.
    fn pull(&self, v: u32, near: &[u32]) -> DVec3 {
        let here = self.points[v as usize];
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        for w in near {
            let at = self.points[*w as usize];
            let weight = match self.map_at([v, *w]) {
                Some(map) => (map * (at - here)).length_squared(),
                None => 1.0 / self.size_at(*w),
            };
            sum += weight * at;
            weights += weight;
        }
        let step = sum / weights - here;
        if self.maps.is_empty() { step } else { SHARE_IN_METRIC * step }
    }

    fn turns_little_at(&self, v: u32, to: DVec3) -> bool {
        let around = self.star[v as usize].iter().map(|t| self.triangles[*t as usize]);
        self.turn_little(around, |w| if w == v { to } else { self.points[w as usize] })
    }

    fn size_at(&self, v: u32) -> f64 {
        self.sizes.get(v as usize).copied().unwrap_or(1.0)
    }

    /// Whether a triangle around `v` folds over or becomes flat once it is at `to`.
    pub fn folds(&self, v: u32, to: DVec3, up: DVec3) -> bool {
        let map = self.map_at([v]);
        // Where stretched triangles are even.
        let even = |corners: [DVec3; 3]| map.map_or(corners, |map| corners.map(|p| map * p));
        let even_up = map.filter(|_| up != DVec3::ZERO).map(|map| map.inverse().transpose() * up);
        self.star[v as usize].iter().any(|t| {
            let triangle = self.triangles[*t as usize];
            let old = self.corners(triangle);
            let new = [0, 1, 2].map(|k| if triangle[k] == v { to } else { old[k] });
            let before = doubled_normal(old);
            if before.dot(doubled_normal(new)) <= 0.0 && before != DVec3::ZERO {
                return true;
            }
            let (old, new) = (even(old), even(new));
            let up = match (map, even_up) {
                (None, _) if up == DVec3::ZERO => before,
                (None, _) => up,
                (Some(_), Some(up)) => up,
                (Some(_), None) => doubled_normal(old),
            };
            folds_or_flattens(old, new, up)
        })
    }

    /// The two parts of the curve from a vertex on it.
    pub fn parts_at(&self, v: u32) -> Option<[(u32, CurvePart); 2]> {
        let mut parts = self.neighbours(v).into_iter().filter_map(|w| Some((w, self.curves.get(v, w)?)));
        let both = [parts.next()?, parts.next()?];
        parts.next().is_none().then_some(both)
    }

    /// Moves vertices along their curve towards where its edges have their target lengths; one after the
    /// other, so that nothing folds on the way.
    fn slide_all(&mut self, polylines: &[Polyline]) {
        for edges in self.curves.by_curve(polylines.len()) {
            for (v, shift) in self.shifts(&edges) {
                self.slide(v, shift, polylines);
            }
        }
    }

    /// How far each vertex inside a curve is from where it should be, in arc length.
    fn shifts(&self, edges: &[(u32, u32, CurvePart)]) -> Vec<(u32, f64)> {
        let length: f64 = edges.iter().map(|(_, _, part)| (part.to - part.from).abs()).sum();
        let sizes: f64 = edges.iter().map(|(a, b, _)| self.size_along(*a, *b)).sum();
        let (mut is, mut should) = (0.0, 0.0);
        let mut shifts: Vec<(u32, f64)> = Vec::with_capacity(edges.len());
        for (a, b, part) in edges {
            is += (part.to - part.from).abs();
            should += self.size_along(*a, *b) * length / sizes;
            // The end of the edge.
            let v = if part.from < part.to { *b } else { *a };
            shifts.push((v, should - is));
        }
        if shifts.iter().all(|(v, _)| self.places[*v as usize] == Place::Curve) {
            // A closed curve has no end to count from.
            let mean = shifts.iter().map(|(_, shift)| shift).sum::<f64>() / shifts.len().max(1) as f64;
            shifts.iter_mut().for_each(|(_, shift)| *shift -= mean);
        }
        shifts.retain(|(v, _)| self.places[*v as usize] == Place::Curve && !self.is_frozen(*v));
        shifts
    }

    fn slide(&mut self, v: u32, shift: f64, polylines: &[Polyline]) {
        let Some([(w, there), (x, other)]) = self.parts_at(v) else { return };
        if there.curve != other.curve {
            return;
        }
        // No farther than half-way to the next vertex.
        let [one, two] = [there.to - there.from, other.to - other.from].map(|to| MOST_SLIDE * to);
        let shift = shift.clamp(one.min(two).min(0.0), one.max(two).max(0.0));
        let line = &polylines[there.curve as usize];
        for share in SHARES {
            let shift = share * shift;
            let to = line.at(there.from + shift).0;
            let moved = |part: CurvePart| CurvePart { from: part.from + shift, ..part };
            let cuts_off = [there, other].iter().any(|part| {
                let new = moved(*part);
                let limit = MAX_DEVIATION * (new.to - new.from).abs();
                new.deviation(polylines) > limit.max(part.deviation(polylines))
            });
            if !cuts_off && !self.folds(v, to, DVec3::ZERO) && self.stays_close_at(v, to) {
                self.move_to(v, to);
                self.curves.insert(v, w, moved(there));
                self.curves.insert(v, x, moved(other));
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::local::surface_samples::SurfaceSamples;
    use crate::mesh::features::{FeatureOptions, find_features};
    use crate::mesh::samples::sample;
    use crate::mesh::spacing;

    #[test]
    fn groups_move_as_their_vertices_do_one_by_one() {
        let surface = sample("torus").unwrap();
        let features = find_features(&surface, &FeatureOptions::new(0.1)).unwrap();
        let (target, progress) = (Target::new(&surface), ProgressToken::default());
        for has_samples in [false, true] {
            let mut mesh = StarMesh::new(&surface, &features, &[], &[]);
            mesh.samples = has_samples.then(|| {
                let mut samples = SurfaceSamples::new(&surface, 1000, spacing(surface.area(), 1000));
                samples.tolerance = 0.01;
                samples
            });
            mesh.split_long(0.0, 10_000, &[]);
            mesh.flip(&progress).unwrap();
            let mut one_by_one = mesh.clone();
            assert!(mesh.independent_groups().iter().any(|group| group.len() >= 2 * FEW));
            mesh.relax(&target, &[], &progress).unwrap();
            for _ in 0..PASSES {
                for v in (0..mesh.points.len() as u32).filter(|v| mesh.is_used(*v)) {
                    one_by_one.relax_inside(v, &target);
                }
            }
            assert_ne!(mesh.points[..100], surface.vertices[..100]);
            assert_eq!((mesh.points, mesh.ranks), (one_by_one.points, one_by_one.ranks));
        }
    }
}
