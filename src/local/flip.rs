//! Edge flips towards Delaunay triangles and six edges per vertex.

use glam::DVec3;

use super::ahead::Ahead;
use super::star_mesh::{Place, Ring, StarMesh, edges_of};
use crate::mesh::triangle::doubled_normal;
use crate::polish::{angle_gain, has_no_wide_angle, keeps_direction};
use crate::{ProgressToken, Result};

/// Passes over all edges.
const PASSES: u32 = 6;
/// Weight of valences against cotangents.
const VALENCE_WEIGHT: f64 = 1.0;
/// Minimum gain of a flip, so that rounding errors cannot flip an edge back and forth.
const MIN_GAIN: f64 = 1e-6;
/// Cosine between two triangles above which a flip does not run into others.
const SMOOTH: f64 = 0.9;
/// Four points are flat if their height over their mean plane is below this share of the shorter diagonal.
const FLAT: f64 = 1e-3;

/// An edge a–b with triangles a b c, and b a d on the other side.
#[derive(Debug, Clone, Copy)]
pub(super) struct Diamond {
    pub ring: [u32; 4],
    pub triangles: [u32; 2],
}

impl Diamond {
    /// The triangles after a flip.
    fn flipped(&self) -> [[u32; 3]; 2] {
        let [a, b, c, d] = self.ring;
        [[d, c, a], [c, d, b]]
    }
}

impl StarMesh {
    /// Flips edges off the curves where that is a gain, in ascending order.
    pub fn flip(&mut self, progress: &ProgressToken) -> Result<()> {
        let mut edges = self.edges();
        for _ in 0..PASSES {
            progress.poll()?;
            let mut changed = self.flip_all(edges);
            if changed.is_empty() {
                break;
            }
            changed.sort_unstable();
            changed.dedup();
            // What a flip gains elsewhere is as before.
            edges = edges_of(
                changed.iter().flat_map(|v| &self.star[*v as usize]).map(|t| self.triangles[*t as usize]),
            );
        }
        Ok(())
    }

    /// Flips edges where that is a gain, in this order; returns the vertices around them.
    fn flip_all(&mut self, mut edges: Vec<(u32, u32)>) -> Vec<u32> {
        let mut flipped = Vec::new();
        let mut ahead = Ahead::new(self);
        edges.reverse();
        loop {
            let known = ahead.next(&edges, |(a, b)| self.flip_of(*a, *b));
            let Some((a, b)) = edges.pop() else { return flipped };
            let known = known.filter(|_| !ahead.has_changed([a, b]));
            let Some(flip) = known.unwrap_or_else(|| self.flip_of(a, b)) else { continue };
            if !self.apply_flip(&flip) {
                continue;
            }
            let ring = flip.ring;
            // Edges opposite these vertices gain by something else now, too.
            ring.iter().for_each(|v| ahead.note(&self.neighbours(*v)));
            flipped.extend(ring);
        }
    }

    /// The flip of an edge, if that is a gain and keeps curves and shape, as far as the two triangles tell.
    fn flip_of(&self, a: u32, b: u32) -> Option<Diamond> {
        // What takes least time and refuses most comes first.
        let keeps = |diamond: &Diamond| {
            !self.gains_little(diamond) && self.is_free(diamond) && self.flip_keeps_shape(diamond)
        };
        self.pair_at(a, b).filter(keeps)
    }

    /// Whether the flip of these two triangles' edge is no gain.
    fn gains_little(&self, diamond: &Diamond) -> bool {
        let Diamond { ring, triangles } = *diamond;
        let points = self.even_corners(ring);
        let patch = self.patches[triangles[0] as usize];
        angle_gain(points) + VALENCE_WEIGHT * self.valence_gain(ring, patch) <= MIN_GAIN
    }

    /// Flips an edge, whether or not that is a gain, if that keeps curves and shape; whether it has.
    pub fn turn_edge(&mut self, a: u32, b: u32) -> bool {
        let flip = self.diamond(a, b).filter(|diamond| self.flip_keeps_shape(diamond));
        flip.is_some_and(|flip| self.apply_flip(&flip))
    }

    fn flip_keeps_shape(&self, diamond: &Diamond) -> bool {
        let points = diamond.ring.map(|v| self.points[v as usize]);
        let new = diamond.flipped().map(|triangle| self.corners(triangle));
        let keeps = || keeps_direction(points) && has_no_wide_angle(self.even_corners(diamond.ring));
        (is_flat(points) || keeps()) && self.stays_close(&diamond.triangles, &new)
    }

    /// Where four vertices are in the image in which edges of the target length are 1 long, if that depends
    /// on the direction.
    fn even_corners(&self, ring: [u32; 4]) -> [DVec3; 4] {
        let points = ring.map(|v| self.points[v as usize]);
        self.map_at(ring).map_or(points, |map| points.map(|p| map * p))
    }

    /// Flips an edge if triangles stay apart; whether it has.
    fn apply_flip(&mut self, diamond: &Diamond) -> bool {
        let points = diamond.ring.map(|v| self.points[v as usize]);
        if !is_flat(points) && !is_smooth(points) && !self.flip_stays_apart(diamond) {
            return false;
        }
        let ([t, s], new) = (diamond.triangles, diamond.flipped());
        self.replace(t, new[0]);
        self.replace(s, new[1]);
        self.pass_samples(&[t, s], &[t, s]);
        true
    }

    /// What is around an edge that may be flipped as far as curves and connectivity go.
    pub fn diamond(&self, a: u32, b: u32) -> Option<Diamond> {
        self.pair_at(a, b).filter(|diamond| self.is_free(diamond))
    }

    /// Whether no edge is where the flipped one would be.
    fn is_free(&self, diamond: &Diamond) -> bool {
        let [_, _, c, d] = diamond.ring;
        c != d && !self.has_edge(c, d)
    }

    /// What is around an edge that is on no curve and has two triangles.
    fn pair_at(&self, a: u32, b: u32) -> Option<Diamond> {
        if self.curves.contains(a, b) || (self.is_frozen(a) && self.is_frozen(b)) {
            return None;
        }
        let mut at_edge = self.at_edge_in_any_order(a, b);
        let (Some(t), Some(s), None) = (at_edge.next(), at_edge.next(), at_edge.next()) else { return None };
        let runs = |triangle: [u32; 3], from: u32, to: u32| {
            let k = triangle.iter().position(|v| *v == from)?;
            (triangle[(k + 1) % 3] == to).then(|| triangle[(k + 2) % 3])
        };
        let [first, second] = [t, s].map(|t| self.triangles[t as usize]);
        let (c, d, t, s) = match (runs(first, a, b), runs(second, b, a)) {
            (Some(c), Some(d)) => (c, d, t, s),
            _ => match (runs(second, a, b), runs(first, b, a)) {
                (Some(c), Some(d)) => (c, d, s, t),
                _ => return None,
            },
        };
        Some(Diamond { ring: [a, b, c, d], triangles: [t, s] })
    }

    /// Whether no more triangles around intersect after the flip.
    fn flip_stays_apart(&self, diamond: &Diamond) -> bool {
        let [a, b, ..] = diamond.ring;
        self.change_stays_apart(&[a, b], &diamond.triangles, &diamond.flipped(), |w| self.points[w as usize])
    }

    /// Half the decrease of the sum of squared differences to the ideal valences; `patch` is that of the two
    /// triangles.
    fn valence_gain(&self, corners: [u32; 4], patch: u32) -> f64 {
        let [a, b, c, d] = corners.map(|v| self.valence_excess(v, patch));
        let change = |excess: Option<f64>, by: f64| excess.map_or(0.0, |excess| by * excess - 0.5);
        change(a, 1.0) + change(b, 1.0) + change(c, -1.0) + change(d, -1.0)
    }

    /// Triangles of a vertex beyond six inside a patch, or beyond three on the side of a curve; `None` at
    /// corners, where it depends on the angle.
    fn valence_excess(&self, v: u32, patch: u32) -> Option<f64> {
        let star = &self.star[v as usize];
        match self.places[v as usize] {
            Place::Inside => Some(star.len() as f64 - 6.0),
            Place::Curve => {
                let in_patch = star.iter().filter(|t| self.patches[**t as usize] == patch).count();
                // With the same patch on both sides, all triangles count.
                let sides = if in_patch < star.len() || self.is_boundary(v) { 1.0 } else { 2.0 };
                Some(in_patch as f64 - 3.0 * sides)
            }
            Place::Corner => None,
        }
    }

    /// Whether a vertex has an edge with one triangle.
    fn is_boundary(&self, v: u32) -> bool {
        let around = self.star[v as usize].iter().flat_map(|t| self.triangles[*t as usize]);
        let mut ends: Ring = around.filter(|w| *w != v).collect();
        ends.sort_unstable();
        ends.chunk_by(|a, b| a == b).any(|same| same.len() == 1)
    }
}

/// Whether the two triangles turn against each other by little.
fn is_smooth([a, b, c, d]: [DVec3; 4]) -> bool {
    let (old, other) = (doubled_normal([a, b, c]), doubled_normal([b, a, d]));
    old.dot(other) > SMOOTH * old.length() * other.length()
}

/// Whether the four points are so nearly in a plane, and the flipped triangles inside their quadrilateral,
/// that angles alone decide: slivers may then get worse on the way to what is better.
fn is_flat([a, b, c, d]: [DVec3; 4]) -> bool {
    let pair = doubled_normal([a, b, c]) + doubled_normal([b, a, d]);
    let up = pair.normalize_or_zero();
    let (new, next) = (doubled_normal([d, c, a]), doubled_normal([c, d, b]));
    let (longest, shortest) = (a.distance(b).max(c.distance(d)), a.distance(b).min(c.distance(d)));
    let high = [a, b, c, d].map(|p| (p - a).dot(up));
    let height = high.iter().fold(f64::MIN, |m, h| m.max(*h)) - high.iter().fold(f64::MAX, |m, h| m.min(*h));
    // A triangle without an area has no direction, but must not be turned over by much either.
    let least = 1e-9 * longest * longest;
    new.dot(up) > least && next.dot(up) > least && height <= FLAT * shortest
}
