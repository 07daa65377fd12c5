//! Moves of vertices, over the surface and along curves, that lower the cost of the triangles around.

use glam::DVec3;

use super::Mending;
use super::angle_cost::sides_around;
use crate::local::curve_edges::CurvePart;
use crate::local::star_mesh::{Place, StarMesh};

/// Directions that are tried from a position, as cosines and sines.
const DIRECTIONS: [[f64; 2]; 8] = {
    const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;
    [
        [1.0, 0.0],
        [HALF, HALF],
        [0.0, 1.0],
        [-HALF, HALF],
        [-1.0, 0.0],
        [-HALF, -HALF],
        [0.0, -1.0],
        [HALF, -HALF],
    ]
};
/// First trial steps over the shortest edge, halved between series of trials.
const FIRST_STEP: f64 = 0.24;
const SERIES: u32 = 4;
/// Trial steps along a curve, as shares of the distance to the next vertex that way.
const SLIDES: [f64; 5] = [0.4, 0.2, 0.1, 0.05, 0.025];
/// Minimum gain of a move.
const MIN_GAIN: f64 = 1e-5;
/// Below this share of the lengths of its normals, a vertex is at the tip of a needle and stays.
const TIP: f64 = 0.3;

impl Mending<'_> {
    /// Moves every vertex of those that are `untried`, not frozen, and have bad angles around them once;
    /// returns how many moved. Those around one that moved are untried again.
    pub fn smooth(&self, mesh: &mut StarMesh, untried: &mut [bool]) -> usize {
        let mut moves = 0;
        for v in 0..mesh.points.len() as u32 {
            if !std::mem::take(&mut untried[v as usize]) || mesh.is_frozen(v) || !mesh.is_used(v) {
                continue;
            }
            let has_moved = match mesh.places[v as usize] {
                Place::Inside => self.move_inside(mesh, v),
                Place::Curve => self.move_along(mesh, v),
                Place::Corner => false,
            };
            if has_moved {
                moves += 1;
                untried[v as usize] = true;
                mesh.neighbours(v).into_iter().for_each(|w| untried[w as usize] = true);
            }
        }
        moves
    }

    fn move_inside(&self, mesh: &mut StarMesh, v: u32) -> bool {
        let here = mesh.points[v as usize];
        let mut sides = sides_around(mesh, v);
        let start = self.cost.around(&sides, here);
        if start < MIN_GAIN {
            return false;
        }
        let (normal, left) = mesh.normal(v);
        if left < TIP {
            return false;
        }
        self.cost.sort_dearest_first(&mut sides, here);
        let up = normal.normalize_or_zero();
        let across = up.any_orthonormal_vector();
        let along = up.cross(across);
        let lengths = mesh.neighbours(v).into_iter().map(|w| mesh.points[w as usize].distance(here));
        let mut step = FIRST_STEP * lengths.fold(f64::INFINITY, f64::min);
        let (mut to, mut best) = (here, start);
        for _ in 0..SERIES {
            for [cos, sin] in DIRECTIONS {
                let trial = to + (across * cos + along * sin) * step;
                if let Some(reached) = self.cost.around_below(&sides, trial, best) {
                    (to, best) = (trial, reached);
                }
            }
            step *= 0.5;
        }
        if best > start - MIN_GAIN {
            return false;
        }
        let patch = mesh.patch_at(v);
        let mut rank = mesh.ranks[v as usize];
        let height = self.height(mesh, v, up, patch);
        let Some(below) = self.target.closest(to, up, patch, &mut rank) else { return false };
        let to = below + height * up;
        if self.cost.around(&sides, to) <= start - MIN_GAIN && !mesh.folds(v, to, normal) {
            mesh.points[v as usize] = to;
            mesh.ranks[v as usize] = rank;
            return true;
        }
        false
    }

    /// How high a vertex stays over the surface, where a fit has put it.
    fn height(&self, mesh: &StarMesh, v: u32, up: DVec3, patch: u32) -> f64 {
        if self.deviation.is_none() {
            return 0.0;
        }
        let here = mesh.points[v as usize];
        let mut rank = mesh.ranks[v as usize];
        self.target.closest(here, up, patch, &mut rank).map_or(0.0, |below| (here - below).dot(up))
    }

    /// How high a vertex inside a patch is over the surface.
    pub fn height_at(&self, mesh: &StarMesh, v: u32) -> f64 {
        if mesh.places[v as usize] != Place::Inside {
            return 0.0;
        }
        self.height(mesh, v, mesh.normal(v).0.normalize_or_zero(), mesh.patch_at(v))
    }

    fn move_along(&self, mesh: &mut StarMesh, v: u32) -> bool {
        let here = mesh.points[v as usize];
        let mut sides = sides_around(mesh, v);
        let start = self.cost.around(&sides, here);
        if start < MIN_GAIN {
            return false;
        }
        self.cost.sort_dearest_first(&mut sides, here);
        let Some([(w, there), (x, other)]) = mesh.parts_at(v) else { return false };
        if there.curve != other.curve {
            return false;
        }
        let stray = self.spacing * self.stray(Some(there));
        let line = &self.polylines[there.curve as usize];
        let moved = |part: CurvePart, shift: f64| CurvePart { from: part.from + shift, ..part };
        let mut best = (start - MIN_GAIN, 0.0);
        for share in SLIDES {
            for part in [there, other] {
                let shift = share * (part.to - part.from);
                let to = line.at(there.from + shift).0;
                let Some(reached) = self.cost.around_below(&sides, to, best.0) else { continue };
                let strays = || {
                    [there, other].iter().any(|part| {
                        let deviation = moved(*part, shift).deviation(self.polylines);
                        deviation > (stray * mesh.size(v, w)).max(part.deviation(self.polylines))
                    })
                };
                if !mesh.folds(v, to, DVec3::ZERO) && !strays() {
                    best = (reached, shift);
                }
            }
        }
        let shift = best.1;
        if shift != 0.0 {
            mesh.points[v as usize] = line.at(there.from + shift).0;
            mesh.curves.insert(v, w, moved(there, shift));
            mesh.curves.insert(v, x, moved(other, shift));
        }
        shift != 0.0
    }
}
