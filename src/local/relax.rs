//! Tangential relaxation onto the surface, and along curves.

use glam::DVec3;

use super::curve_edges::CurvePart;
use super::star_mesh::{Place, StarMesh};
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

impl StarMesh {
    /// Moves vertices one by one towards the mean of their neighbours, over the surface or along their curve.
    pub fn relax(&mut self, target: &Target, polylines: &[Polyline], progress: &ProgressToken) -> Result<()> {
        for _ in 0..PASSES {
            self.slide_all(polylines);
            for v in 0..self.points.len() as u32 {
                if v % 4096 == 0 {
                    progress.poll()?;
                }
                if !self.is_used(v) || self.is_frozen(v) {
                    continue;
                }
                if self.places[v as usize] == Place::Inside {
                    self.relax_inside(v, target);
                }
            }
        }
        Ok(())
    }

    pub fn relax_inside(&mut self, v: u32, target: &Target) {
        let here = self.points[v as usize];
        let (normal, left) = self.normal(v);
        if left < TIP {
            return;
        }
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        for w in self.neighbours(v) {
            let weight = 1.0 / self.size_at(w);
            sum += weight * self.points[w as usize];
            weights += weight;
        }
        let up = normal.normalize_or_zero();
        let step = sum / weights - here;
        let step = step - up * step.dot(up);
        for share in SHARES {
            let goal = here + share * step;
            let patch = self.patch_at(v);
            let rank = &mut self.ranks[v as usize];
            let Some(to) = target.closest(goal, up, patch, rank) else { return };
            if !self.folds(v, to, normal)
                && (left > FLAT || self.turns_little_at(v, to) || self.stays_apart_at(v, to))
                && self.stays_close_at(v, to)
            {
                self.move_to(v, to);
                return;
            }
        }
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
        self.star[v as usize].iter().any(|t| {
            let triangle = self.triangles[*t as usize];
            let old = self.corners(triangle);
            let new = [0, 1, 2].map(|k| if triangle[k] == v { to } else { old[k] });
            let turned =
                doubled_normal(old).dot(doubled_normal(new)) <= 0.0 && doubled_normal(old) != DVec3::ZERO;
            turned || folds_or_flattens(old, new, if up == DVec3::ZERO { doubled_normal(old) } else { up })
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
        let sizes: f64 = edges.iter().map(|(a, b, _)| self.size(*a, *b)).sum();
        let (mut is, mut should) = (0.0, 0.0);
        let mut shifts: Vec<(u32, f64)> = Vec::with_capacity(edges.len());
        for (a, b, part) in edges {
            is += (part.to - part.from).abs();
            should += self.size(*a, *b) * length / sizes;
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
