//! Edits at one outlier, tried on a copy of the mesh.

use glam::DVec3;

use super::find::FarPlace;
use super::known::KnownTriangles;
use super::mesh_copy::MeshCopy;
use super::region::{Deviation, Region};
use crate::mesh::NONE;
use crate::mesh::half_edge_mesh::{Flip, VertexKind};
use crate::mesh::half_edges::{next, previous};
use crate::mesh::intersections::{any_intersects, count_intersecting};
use crate::mesh::quality::smallest_angle;
use crate::mesh::triangle::closest_on_triangle;
use crate::polish::worst::{better_position, lift_freely};

/// Most promising edits at an outlier, which are tried in full.
const TRIALS: usize = 10;
/// No further edit is tried once one reduces the deviation to this share.
const ENOUGH: f64 = 0.3;
/// An edit must reduce the deviation below this share.
const GAIN: f64 = 0.95;
/// Cost of a degree below the least angle, in edge lengths, before the vertices around are relaxed.
const ANGLE_COST: f64 = 0.02;
/// Passes of relaxation over the vertices around an edit.
const SWEEPS: u32 = 3;

/// A change of the mesh.
#[derive(Debug, Clone, Copy)]
enum Edit {
    Move(u32, DVec3),
    Flip(u32),
}

/// An edit with the positions of a region's vertices after it.
pub(crate) struct Change {
    edit: Edit,
    positions: Vec<DVec3>,
}

/// What edits are compared by before they are tried in full.
#[derive(Debug, Clone, Copy)]
struct Shape {
    /// Distance from the triangle to the outlier.
    distance: f64,
    /// In degrees.
    min_angle: f64,
}

impl Shape {
    fn min(self, other: Self) -> Self {
        let Self { distance, min_angle } = self;
        Self { distance: distance.min(other.distance), min_angle: min_angle.min(other.min_angle) }
    }
}

impl MeshCopy<'_> {
    /// The best change at an outlier, if any is good enough; the mesh stays as it is.
    pub fn best_change(
        &mut self,
        outlier: &FarPlace,
        region: &Region,
        known: &KnownTriangles,
    ) -> Option<Change> {
        let mut before = self.before(region, known);
        let Deviation { sum, largest_sq } = before.deviation;
        if sum <= 0.0 {
            return None;
        }
        let shapes: Vec<Shape> = region.triangles.iter().map(|t| self.shape(*t, outlier)).collect();
        let smallest = shapes.iter().map(|shape| shape.min_angle).fold(90.0, f64::min);
        let floor = smallest.min(self.context.options.min_angle);
        let mut edits: Vec<(f64, Edit)> = self.predicted_edits(outlier, region, &shapes);
        edits.sort_by(|a, b| a.0.total_cmp(&b.0));
        let saved: Vec<DVec3> = self.positions(region);
        let is_settled = |v: &u32| better_position(&self.half_edges, &self.points, *v).is_none();
        let settled: Vec<bool> = region.vertices.iter().map(is_settled).collect();
        let mut crossings = None;
        let mut least = Deviation { sum: sum * GAIN, largest_sq };
        let mut best = None;
        for (_, edit) in edits.into_iter().take(TRIALS) {
            let flip = self.apply(edit);
            let flipped = flipped_vertices(flip.as_ref());
            let changed = self.changed(region, &saved, flipped);
            let mut better = None;
            if self.is_promising(region, &before, &changed, &least) {
                self.relax_around(&region.vertices, &settled, (edit, flipped));
                let changed = self.changed(region, &saved, flipped);
                better = self.after(region, &mut before, &changed, (floor, &least)).map(|deviation| {
                    // Mostly none of those that changed crosses another, and there are no more than before.
                    let crossing = if self.crosses(region, &changed) { self.crossings(region) } else { 0 };
                    (deviation, self.positions(region), crossing)
                });
            }
            self.undo(flip.as_ref());
            self.set_positions(region, &saved);
            let Some((deviation, positions, crossing)) = better else { continue };
            if crossing > 0 && crossing > *crossings.get_or_insert_with(|| self.crossings(region)) {
                continue;
            }
            best = Some(Change { edit, positions });
            least.sum = deviation.sum;
            if least.sum < ENOUGH * sum {
                break;
            }
        }
        best
    }

    /// The indices of a region's triangles that changed since its vertices were at `saved`. At a flipped
    /// edge, between the four vertices `flipped`, samples may now belong to other triangles.
    fn changed(&self, region: &Region, saved: &[DVec3], flipped: [u32; 4]) -> Vec<usize> {
        let moved: Vec<u32> = (region.vertices.iter().zip(saved))
            .filter(|(v, saved)| self.points[**v as usize] != **saved)
            .map(|(v, _)| *v)
            .collect();
        let is_changed = |t: u32| {
            let corners = self.half_edges.triangles[t as usize];
            corners.iter().any(|v| flipped.contains(v) || moved.binary_search(v).is_ok())
        };
        (0..region.triangles.len()).filter(|k| is_changed(region.triangles[*k])).collect()
    }

    /// Applies a change that [`MeshCopy::best_change`] found.
    pub fn apply_change(&mut self, region: &Region, change: &Change) {
        self.apply(change.edit);
        self.set_positions(region, &change.positions);
    }

    /// The positions of the vertices of a region.
    fn positions(&self, region: &Region) -> Vec<DVec3> {
        region.vertices.iter().map(|v| self.points[*v as usize]).collect()
    }

    fn set_positions(&mut self, region: &Region, positions: &[DVec3]) {
        region.vertices.iter().zip(positions).for_each(|(v, p)| self.points[*v as usize] = *p);
    }

    fn edits(&self, outlier: &FarPlace) -> Vec<Edit> {
        let mut edits = Vec::new();
        let mut near: Vec<u32> = self.half_edges.triangles[outlier.triangle as usize].to_vec();
        for h in 3 * outlier.triangle..3 * outlier.triangle + 3 {
            if let Some(twin) = self.half_edges.twin(h) {
                near.push(self.half_edges.origin(previous(twin)));
            }
            if self.may_flip(h) {
                edits.push(Edit::Flip(h));
            }
        }
        for v in near.into_iter().filter(|v| !self.fixed[*v as usize]) {
            let here = self.points[v as usize];
            edits.push(Edit::Move(v, outlier.at));
            edits.extend([0.5, 1.0, 1.5].map(|s| Edit::Move(v, here + outlier.offset * s)));
            edits.extend([0.3, 0.6].map(|s| Edit::Move(v, here.lerp(outlier.at, s))));
        }
        edits
    }

    fn shape(&self, t: u32, outlier: &FarPlace) -> Shape {
        let corners = self.corners(t);
        let distance = closest_on_triangle(outlier.at, corners).point.distance(outlier.at);
        Shape { distance, min_angle: smallest_angle(corners) }
    }

    /// The edits at an outlier, each with the distance of the outlier after it, in edge lengths, plus the
    /// cost of the worst angle; `shapes` are those of the region's triangles now.
    fn predicted_edits(&mut self, outlier: &FarPlace, region: &Region, shapes: &[Shape]) -> Vec<(f64, Edit)> {
        let edge = self.edge_length_at(outlier.triangle);
        // Several moves of a vertex leave the same triangles as they are.
        let mut others: Option<(u32, Others)> = None;
        let mut predicted = Vec::new();
        for edit in self.edits(outlier) {
            let cost = |least: Shape, mesh: &Self| {
                least.distance / edge
                    + (mesh.context.options.min_angle - least.min_angle).max(0.0) * ANGLE_COST
            };
            let least = match edit {
                Edit::Move(v, to) => {
                    let known = others.take().filter(|(of, _)| *of == v);
                    let (_, rest) = others.insert(known.unwrap_or_else(|| {
                        (
                            v,
                            self.others(region, shapes, |t| {
                                self.half_edges.triangles[t as usize].contains(&v)
                            }),
                        )
                    }));
                    let here = std::mem::replace(&mut self.points[v as usize], to);
                    let least = rest.with(self, outlier);
                    self.points[v as usize] = here;
                    least
                }
                Edit::Flip(_) => {
                    let flip = self.apply(edit);
                    let around = flipped_vertices(flip.as_ref());
                    let is_touched =
                        |t: u32| self.half_edges.triangles[t as usize].iter().any(|v| around.contains(v));
                    let least = self.others(region, shapes, is_touched).with(self, outlier);
                    self.undo(flip.as_ref());
                    least
                }
            };
            predicted.push((cost(least, self), edit));
        }
        predicted
    }

    /// The triangles of a region that an edit touches, and the least figures of the others.
    fn others(&self, region: &Region, shapes: &[Shape], is_touched: impl Fn(u32) -> bool) -> Others {
        let mut others =
            Others { touched: Vec::new(), least: Shape { distance: f64::INFINITY, min_angle: 60.0 } };
        for (t, shape) in region.triangles.iter().zip(shapes) {
            if is_touched(*t) {
                others.touched.push(*t);
            } else {
                others.least = others.least.min(*shape);
            }
        }
        others
    }

    /// Whether an edge may flip: it does not stay, and its vertices are inner ones and keep five
    /// to seven neighbours.
    fn may_flip(&self, h: u32) -> bool {
        let Some(twin) = self.half_edges.twin(h) else { return false };
        let ends @ [a, b, c, d] = self.half_edges.diamond(h, twin);
        ends.iter().all(|v| self.half_edges.kind(*v) == VertexKind::Inner)
            && self.half_edges.valence(a).min(self.half_edges.valence(b)) > 5
            && self.half_edges.valence(c).max(self.half_edges.valence(d)) < 7
            && !self.locked().holds(a, b)
            && !self.half_edges.joined(c, d)
            && self.half_edges.patch(h / 3) == self.half_edges.patch(twin / 3)
    }

    /// Carries out an edit; returns the flip if it is one. Moves are undone by the caller.
    fn apply(&mut self, edit: Edit) -> Option<Flip> {
        match edit {
            Edit::Move(v, to) => {
                self.points[v as usize] = to;
                None
            }
            Edit::Flip(h) => self.half_edges.twin(h).map(|twin| self.half_edges.flip(h, twin)),
        }
    }

    fn undo(&mut self, flip: Option<&Flip>) {
        if let Some(flip) = flip {
            self.half_edges.undo(flip);
        }
    }

    /// Assigns the surface's points at a flipped edge to the closer one of its triangles.
    pub fn share_points(&self, change: &Change, points_of: &mut [Vec<u32>]) {
        let Edit::Flip(h) = change.edit else { return };
        let Some(twin) = self.half_edges.twin(h) else { return };
        let pair = [h / 3, twin / 3];
        let corners = pair.map(|t| self.corners(t));
        let mut points: Vec<u32> =
            pair.iter().flat_map(|t| std::mem::take(&mut points_of[*t as usize])).collect();
        points.sort_unstable();
        for p in points {
            let at = self.context.target.vertices[p as usize].position;
            let [first, second] = corners.map(|c| closest_on_triangle(at, c).point.distance_squared(at));
            points_of[pair[usize::from(second < first)] as usize].push(p);
        }
    }

    /// Moves the vertices around an edit to improve their triangles. `settled` says which of them had no
    /// better position before it.
    fn relax_around(&mut self, around: &[u32], settled: &[bool], (edit, flipped): (Edit, [u32; 4])) {
        let mut settled = settled.to_vec();
        let unsettle = |settled: &mut [bool], v: u32| {
            if let Ok(k) = around.binary_search(&v) {
                settled[k] = false;
            }
        };
        let moved = match edit {
            Edit::Move(v, _) => Some(v),
            Edit::Flip(_) => None,
        };
        let neighbours = |mesh: &Self, v: u32| -> Vec<u32> {
            mesh.half_edges.ring(v).map(|h| mesh.half_edges.origin(next(h))).collect()
        };
        let changed = moved.map_or_else(|| flipped.to_vec(), |v| neighbours(self, v));
        changed.into_iter().for_each(|v| unsettle(&mut settled, v));
        for _ in 0..SWEEPS {
            for (k, v) in around.iter().enumerate() {
                if settled[k] || moved == Some(*v) || self.fixed[*v as usize] {
                    continue;
                }
                settled[k] = !lift_freely(&self.half_edges, &mut self.points, *v);
                if !settled[k] {
                    neighbours(self, *v).into_iter().for_each(|w| unsettle(&mut settled, w));
                }
            }
        }
    }

    /// How many triangles of a region intersect others of it.
    fn crossings(&self, region: &Region) -> usize {
        count_intersecting(&self.triangles(region), |v| self.points[v as usize])
    }

    /// Whether one of a region's triangles with these indices intersects another of it.
    fn crosses(&self, region: &Region, some: &[usize]) -> bool {
        any_intersects(&self.triangles(region), some, |v| self.points[v as usize])
    }

    fn triangles(&self, region: &Region) -> Vec<[u32; 3]> {
        region.triangles.iter().map(|t| self.half_edges.triangles[*t as usize]).collect()
    }

    /// Forgets what is no longer true of a region's triangles after a change, which is not applied yet.
    pub fn forget(&self, region: &Region, change: &Change, known: &mut KnownTriangles) {
        let mut moved = Vec::new();
        for (v, to) in region.vertices.iter().zip(&change.positions) {
            if self.points[*v as usize] != *to {
                moved.push(*v);
            }
        }
        if let Edit::Flip(h) = change.edit
            && let Some(twin) = self.half_edges.twin(h)
        {
            moved.extend(self.half_edges.diamond(h, twin));
        }
        for t in &region.triangles {
            if self.half_edges.triangles[*t as usize].iter().any(|v| moved.contains(v)) {
                known.forget(*t);
                let across = (3 * t..3 * t + 3).filter_map(|h| self.half_edges.twin(h));
                across.for_each(|twin| known.forget_sound(twin / 3));
            }
        }
    }
}

/// What an edit leaves as it is.
struct Others {
    /// The triangles that it touches.
    touched: Vec<u32>,
    /// The least figures of the others.
    least: Shape,
}

impl Others {
    /// The least figures of all; those of the touched triangles are computed again.
    fn with(&self, mesh: &MeshCopy, outlier: &FarPlace) -> Shape {
        self.touched.iter().fold(self.least, |least, t| least.min(mesh.shape(*t, outlier)))
    }
}

/// The four vertices around an edge that was flipped.
fn flipped_vertices(flip: Option<&Flip>) -> [u32; 4] {
    flip.map_or([NONE; 4], |flip| flip.vertices)
}
