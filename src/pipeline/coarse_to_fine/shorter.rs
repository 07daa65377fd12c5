//! Another attempt with shorter edges around places that even edges leave out.
//!
//! Evenly spaced sites miss a fold that is narrower than an edge, such as the corner of a mouth: one cell has
//! both of its sides, and the faces bridge it. A few more sites there are enough for one on its bottom.

use glam::DVec3;

use super::attempts::Runner;
use super::surface_model::{ModelRequest, surface_vertices};
use crate::mesh::hash_grid::HashGrid;
use crate::mesh::quality::extreme_angles;
use crate::mesh::sizing::{SizeField, vertices_with};
use crate::mesh::small_angles::small_angle_places;
use crate::mesh::spacing;
use crate::options::{CoarseToFineOptions, Sizing};
use crate::pipeline::missing::far_vertices;
use crate::pipeline::outcome::{FaultKind, Outcome};
use crate::pipeline::result::ShorterEdges;
use crate::pipeline::run_context::RunContext;
use crate::{Error, Result, TriMesh};

/// A place of the surface farther from the mesh than this many edge lengths is left out.
const LEFT_OUT: f64 = 0.4;
/// If a place is left out, others farther away than this many edge lengths are to come closer as well.
const FAR: f64 = 0.3;
/// Fraction of their length that edges near places left out have in the next attempt.
const SHORTER: f64 = 0.6;
/// Edges within this many spacings of places left out become shorter in the next attempt.
const REACH: f64 = 1.5;
/// Maximum number of further attempts.
const ATTEMPTS: u32 = 3;
/// Where more than this share of the triangles has small angles, the surface has more details than the mesh
/// has vertices for, and a place is not left out for want of a few of them.
const TOO_MANY_SMALL: f64 = 0.01;
/// Largest share of the vertices that shorter edges may take from elsewhere: attempts that took 18 to 58 % on
/// CAD parts were all worse, those that took 1 to 13 % on sculpts mostly better.
const MOST_VERTICES: f64 = 0.15;
/// Another attempt is much closer if the largest distance of a place from the mesh is at most this fraction
/// of the best attempt's.
const CLOSER: f64 = 0.8;
/// A much closer attempt may have more faces with small angles, by this fraction of all faces.
const MORE_SMALL: f64 = 0.001;
/// The smallest angle of a much closer attempt is at least this fraction of the best attempt's.
const NARROWER: f64 = 0.7;
/// Places that are told apart are this many spacings away from each other.
const APART: f64 = 2.0;

impl Runner<'_, '_> {
    /// The outcome, or a closer one with shorter edges around the places that it leaves out, if the options
    /// leave edge lengths open.
    pub(super) fn with_shorter_edges(&mut self, first: Outcome, vertices: usize) -> Result<Outcome> {
        let surface = self.shared.context.surface.mesh();
        let length = spacing(surface.area(), vertices);
        let is_open = self.shared.context.plan.sizing == Sizing::Automatic;
        if !is_open || !is_sound(&first) || farthest(&first) <= LEFT_OUT * length {
            return Ok(first);
        }
        let mut places: Vec<DVec3> = Vec::new();
        let mut left_out = self.left_out(&surface, &first, length)?;
        let (mut standing, mut best) = (self.standing(&first), first);
        if standing.small as f64 > TOO_MANY_SMALL * standing.faces as f64 {
            return Ok(best);
        }
        let usual = self.usual_lengths(vertices)?;
        let mut values = usual.clone();
        for _ in 0..ATTEMPTS {
            let is_over = standing.farthest <= LEFT_OUT * length || self.progress.leave_out();
            if is_over || !self.shorten(&mut values, &left_out, length) {
                break;
            }
            add_places(&mut places, &left_out, length);
            let sizing = &Sizing::Given(values.clone());
            let plan = self.shared.context.plan;
            let request = ModelRequest { vertices, sizing, refined: &[], ..ModelRequest::of(plan) };
            let model = self.model(&request)?;
            let share = self.share_for_shorter_edges(&usual, &model.sizes);
            if share > MOST_VERTICES {
                break;
            }
            let next = match self.attempt(&model, vertices, self.shared.context.options.seed) {
                // More vertices on curves than there may be.
                Err(Error::Usage { .. }) => break,
                next => next?,
            };
            // A sheet that is lost is not left out for want of vertices.
            if is_sound(&next) {
                left_out = self.left_out(&surface, &next, length)?;
            }
            let reached = self.standing(&next);
            if next.fault.is_none() && reached.is_better_than(&standing) {
                standing = reached;
                let shorter_edges = Some(self.summary(&places, &model.sizes, share));
                best = Outcome { shorter_edges, ..next };
            }
        }
        Ok(Outcome { attempts: self.attempts, ..best })
    }

    /// The relative edge lengths of a first attempt, at the vertices of the run's mesh.
    fn usual_lengths(&mut self, vertices: usize) -> Result<Vec<f64>> {
        let sizes = self.model_for(vertices)?.sizes;
        let RunContext { surface, mesh, .. } = self.shared.context;
        Ok(surface_vertices(surface, mesh).into_iter().map(|v| sizes.at_vertex(v)).collect())
    }

    /// The share of the vertices that edges of these lengths need beyond those as long as `usual`, at the
    /// vertices of the run's mesh, wherever they are not shorter.
    fn share_for_shorter_edges(&self, usual: &[f64], sizes: &SizeField) -> f64 {
        let RunContext { surface, mesh, .. } = self.shared.context;
        let on_surface = surface_vertices(surface, mesh);
        let lengths: Vec<f64> = on_surface.iter().map(|v| sizes.at_vertex(*v)).collect();
        let scale = lengths.iter().zip(usual).map(|(length, usual)| length / usual).fold(0.0, f64::max);
        let usual: Vec<f64> = usual.iter().map(|length| scale * length).collect();
        1.0 - vertices_with(mesh, &usual) / vertices_with(mesh, &lengths)
    }

    /// The surface's vertices that are far from the mesh, the farthest first.
    fn left_out(&mut self, surface: &TriMesh, outcome: &Outcome, length: f64) -> Result<Vec<DVec3>> {
        let even = SizeField::default();
        let find = |progress: &_| far_vertices(surface, (&outcome.mesh, &[]), FAR, (length, &even), progress);
        let far = self.progress.during(find)?;
        Ok(far.into_iter().map(|v| surface.vertices[v as usize]).collect())
    }

    /// Shortens the edges wanted around some places; whether there are vertices around any. The values are
    /// those of the repaired input's vertices.
    fn shorten(&self, values: &mut [f64], places: &[DVec3], length: f64) -> bool {
        let reach = REACH * length;
        let mut grid = HashGrid::new(reach, places.len());
        places.iter().for_each(|at| grid.insert(*at, *at));
        let mut is_shorter = false;
        for (value, p) in values.iter_mut().zip(&self.shared.context.mesh.vertices) {
            let p = self.shared.context.frame.to_unit(*p);
            if grid.any(p, |at: DVec3| at.distance_squared(p) < reach * reach) {
                *value *= SHORTER;
                is_shorter = true;
            }
        }
        is_shorter
    }

    fn standing(&self, outcome: &Outcome) -> Standing {
        let (small, smallest) = self.small_angles(&outcome.mesh);
        Standing { farthest: farthest(outcome), faces: outcome.mesh.triangles.len(), small, smallest }
    }

    /// How many triangles have an angle below the least one, and the smallest of these, or the least one if
    /// there are none.
    fn small_angles(&self, mesh: &TriMesh) -> (usize, f64) {
        let CoarseToFineOptions { min_angle, feature_angle, .. } = self.shared.context.options.coarse_to_fine;
        let small = small_angle_places(mesh, min_angle, feature_angle);
        let angle = |(t, _): &(usize, _)| extreme_angles(mesh.corners(*t))[0];
        (small.len(), small.iter().map(angle).fold(min_angle, f64::min))
    }

    fn summary(&self, places: &[DVec3], sizes: &SizeField, share: f64) -> ShorterEdges {
        let [least, largest] = sizes.range();
        ShorterEdges {
            places: places.iter().map(|p| self.shared.context.frame.to_input_units(*p).to_array()).collect(),
            shortest: least / largest,
            vertices: (share * self.shared.context.plan.vertices as f64).round() as usize,
        }
    }
}

/// What attempts are compared by.
struct Standing {
    /// The distance of the place that is farthest from the mesh.
    farthest: f64,
    faces: usize,
    /// Faces with small angles.
    small: usize,
    /// The smallest of these angles.
    smallest: f64,
}

impl Standing {
    /// Whether it is much closer and has hardly more or smaller angles; or a little closer and fewer, and
    /// none that is smaller.
    fn is_better_than(&self, best: &Self) -> bool {
        let more = (MORE_SMALL * best.faces as f64) as usize;
        let is_much_closer = self.farthest <= CLOSER * best.farthest
            && self.small <= best.small + more
            && self.smallest >= NARROWER * best.smallest;
        let has_larger_angles = self.small < best.small && self.smallest >= best.smallest;
        is_much_closer || (self.farthest < best.farthest && has_larger_angles)
    }
}

/// Whether nothing but what is left out is wrong.
fn is_sound(outcome: &Outcome) -> bool {
    outcome.fault.as_ref().is_none_or(|fault| fault.kind == FaultKind::Missing)
}

/// The distance of the place that is farthest from the mesh, of those that the fit left.
fn farthest(outcome: &Outcome) -> f64 {
    outcome.outliers.iter().map(|place| place.distance).fold(0.0, f64::max)
}

/// Adds those of `more` that are apart from the others.
fn add_places(places: &mut Vec<DVec3>, more: &[DVec3], length: f64) {
    for p in more {
        if places.iter().all(|at| at.distance(*p) > APART * length) {
            places.push(*p);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closer_attempts_are_better_if_angles_allow_it() {
        let of = |farthest, small, smallest| Standing { farthest, faces: 3000, small, smallest };
        let best = of(1.0, 4, 20.0);
        for (next, is_better) in [
            (of(0.8, 4, 20.0), true),
            (of(0.8, 7, 14.5), true),
            (of(0.8, 8, 20.0), false),
            (of(0.8, 4, 13.0), false),
            (of(0.9, 4, 20.0), false),
            (of(0.9, 3, 20.0), true),
            (of(0.9, 3, 19.0), false),
            (of(1.0, 0, 30.0), false),
        ] {
            let Standing { farthest, small, smallest, .. } = next;
            assert_eq!(next.is_better_than(&best), is_better, "{farthest} {small} {smallest}");
        }
    }
}
