//! One spot at a time: edits tried on a copy of the mesh.

use std::sync::Arc;

use glam::DVec3;

use super::find::Outlier;
use super::region::{Far, Region};
use super::{FAR, OutlierOptions};
use crate::mesh::NONE;
use crate::mesh::half_edge_mesh::{HalfEdgeMesh, VertexKind};
use crate::mesh::half_edges::previous;
use crate::mesh::intersections::intersecting_faces;
use crate::mesh::quality::TriangleQuality;
use crate::mesh::triangle::closest_on_triangle;
use crate::polish::worst::lift_freely;
use crate::polish::{Target, is_fixed};
use crate::{ProgressToken, Result, TriMesh};

/// Edits that are carried through at a spot, the most promising ones.
const TRIALS: usize = 10;
/// No further edit is tried once one leaves this share of what was far.
const ENOUGH: f64 = 0.3;
/// What is far nearby must fall below this share.
const GAIN: f64 = 0.95;
/// What a degree below the least angle is worth, in edges, before the vertices around make room.
const ANGLE_COST: f64 = 0.02;
/// Sweeps over the vertices around an edit.
const SWEEPS: u32 = 3;

/// What all copies of the mesh have in common.
#[derive(Clone, Copy)]
pub(crate) struct Ground<'a> {
    pub target: &'a Target,
    pub options: &'a OutlierOptions,
    /// The typical length of edges.
    pub edge: f64,
    pub progress: &'a ProgressToken,
}

impl Ground<'_> {
    /// The typical length of the edges of a triangle.
    pub fn edge_at(&self, triangle: [u32; 3]) -> f64 {
        let lengths = &self.options.lengths;
        if lengths.is_empty() {
            return self.edge;
        }
        self.edge * triangle.iter().map(|v| lengths[*v as usize]).sum::<f64>() / 3.0
    }

    /// The square of the distance at a triangle below which nothing is far.
    pub fn least_sq(&self, triangle: [u32; 3]) -> f64 {
        (FAR * self.edge_at(triangle)).powi(2)
    }
}

/// A change of the mesh.
#[derive(Debug, Clone, Copy)]
enum Edit {
    Move(u32, DVec3),
    Flip(u32),
}

/// An edit with the places of a region's vertices after it.
pub(crate) struct Change {
    edit: Edit,
    places: Vec<DVec3>,
}

/// What an edit is judged by at first sight.
#[derive(Debug, Clone, Copy)]
struct Shape {
    /// From the triangle to the spot.
    distance: f64,
    /// In degrees.
    min_angle: f64,
}

/// A copy of the mesh.
#[derive(Clone)]
pub(crate) struct Work<'a> {
    pub ground: Ground<'a>,
    pub links: HalfEdgeMesh,
    points: Vec<DVec3>,
    /// Vertices that stay where they are; the same for all copies.
    fixed: Arc<[bool]>,
}

impl<'a> Work<'a> {
    pub fn new(mesh: &TriMesh, ground: &Ground<'a>) -> Self {
        let links = HalfEdgeMesh::new(mesh.triangles.clone(), mesh.vertices.len(), &ground.options.patches);
        let fixed = (0..mesh.vertices.len()).map(|v| is_fixed(&links, &ground.options.fixed, v)).collect();
        Self { ground: *ground, links, points: mesh.vertices.clone(), fixed }
    }

    pub fn into_mesh(self, mesh: &mut TriMesh) {
        mesh.vertices = self.points;
        mesh.triangles = self.links.triangles;
    }

    pub fn corners(&self, t: u32) -> [DVec3; 3] {
        self.links.triangles[t as usize].map(|v| self.points[v as usize])
    }

    /// The best edit at a spot, if it is worth it; the mesh stays as it is.
    pub fn mend(&mut self, spot: &Outlier, region: &Region) -> Result<Option<Change>> {
        let mut before = self.before(region);
        let Far { sum, largest_sq } = before.far;
        if sum <= 0.0 {
            return Ok(None);
        }
        let shapes: Vec<Shape> = region.triangles.iter().map(|t| self.shape(*t, spot)).collect();
        let smallest = shapes.iter().map(|shape| shape.min_angle).fold(90.0, f64::min);
        let floor = smallest.min(self.ground.options.min_angle);
        let mut edits: Vec<(f64, Edit)> = self
            .edits(spot)
            .into_iter()
            .map(|edit| (self.promise(edit, spot, (region, &shapes)), edit))
            .collect();
        edits.sort_by(|a, b| a.0.total_cmp(&b.0));
        let saved: Vec<DVec3> = self.places(region);
        let crossings = self.crossings(region)?;
        let mut least = sum * GAIN;
        let mut best = None;
        for (_, edit) in edits.into_iter().take(TRIALS) {
            let turned = self.apply(edit);
            self.make_room(&region.vertices, edit);
            let changed = self.changed(region, &saved, turned);
            let far = self.after(region, &mut before, &changed, (floor, least));
            if let Some(far) = far.filter(|far| far.largest_sq <= largest_sq)
                && self.crossings(region)? <= crossings
            {
                best = Some(Change { edit, places: self.places(region) });
                least = far.sum;
            }
            self.take_back(edit);
            self.put(region, &saved);
            if least < ENOUGH * sum {
                break;
            }
        }
        Ok(best)
    }

    /// The places of the triangles of a region that are not as they were when its vertices were at `saved`.
    /// Near an edge that turned, between the four vertices `turned`, samples may belong to other triangles.
    fn changed(&self, region: &Region, saved: &[DVec3], turned: [u32; 4]) -> Vec<usize> {
        let moved: Vec<u32> = (region.vertices.iter().zip(saved))
            .filter(|(v, saved)| self.points[**v as usize] != **saved)
            .map(|(v, _)| *v)
            .collect();
        let is_changed = |t: u32| {
            let corners = self.links.triangles[t as usize];
            corners.iter().any(|v| turned.contains(v) || moved.binary_search(v).is_ok())
        };
        (0..region.triangles.len()).filter(|k| is_changed(region.triangles[*k])).collect()
    }

    /// Changes the mesh as [`Work::mend`] said of a region.
    pub fn change(&mut self, region: &Region, change: &Change) {
        self.apply(change.edit);
        self.put(region, &change.places);
    }

    /// Where the vertices of a region are.
    fn places(&self, region: &Region) -> Vec<DVec3> {
        region.vertices.iter().map(|v| self.points[*v as usize]).collect()
    }

    fn put(&mut self, region: &Region, places: &[DVec3]) {
        region.vertices.iter().zip(places).for_each(|(v, p)| self.points[*v as usize] = *p);
    }

    fn edits(&self, spot: &Outlier) -> Vec<Edit> {
        let mut edits = Vec::new();
        let mut near: Vec<u32> = self.links.triangles[spot.triangle as usize].to_vec();
        for h in 3 * spot.triangle..3 * spot.triangle + 3 {
            if let Some(twin) = self.links.twin(h) {
                near.push(self.links.origin(previous(twin)));
            }
            if self.may_turn(h) {
                edits.push(Edit::Flip(h));
            }
        }
        for v in near.into_iter().filter(|v| !self.fixed[*v as usize]) {
            let here = self.points[v as usize];
            edits.push(Edit::Move(v, spot.at));
            edits.extend([0.5, 1.0, 1.5].map(|s| Edit::Move(v, here + spot.offset * s)));
            edits.extend([0.3, 0.6].map(|s| Edit::Move(v, here.lerp(spot.at, s))));
        }
        edits
    }

    fn shape(&self, t: u32, spot: &Outlier) -> Shape {
        let corners = self.corners(t);
        let distance = closest_on_triangle(spot.at, corners).point.distance(spot.at);
        Shape { distance, min_angle: TriangleQuality::new(corners).min_angle() }
    }

    /// How far the spot is after an edit, in edges, with what the worst angle costs; `shapes` are as before.
    fn promise(&mut self, edit: Edit, spot: &Outlier, (region, shapes): (&Region, &[Shape])) -> f64 {
        let saved = match edit {
            Edit::Move(v, _) => Some((v as usize, self.points[v as usize])),
            Edit::Flip(_) => None,
        };
        let turned = self.apply(edit);
        let (mut near, mut angle) = (f64::INFINITY, 60.0f64);
        for (t, shape) in region.triangles.iter().zip(shapes) {
            let corners = self.links.triangles[*t as usize];
            let changed =
                corners.iter().any(|v| turned.contains(v) || saved.is_some_and(|s| s.0 == *v as usize));
            let shape = if changed { self.shape(*t, spot) } else { *shape };
            near = near.min(shape.distance);
            angle = angle.min(shape.min_angle);
        }
        self.take_back(edit);
        if let Some((v, here)) = saved {
            self.points[v] = here;
        }
        near / self.ground.edge_at(self.links.triangles[spot.triangle as usize])
            + (self.ground.options.min_angle - angle).max(0.0) * ANGLE_COST
    }

    /// Whether an edge may turn: between free vertices that keep five to seven neighbours.
    fn may_turn(&self, h: u32) -> bool {
        let Some(twin) = self.links.twin(h) else { return false };
        let ends @ [a, b, c, d] = self.links.diamond(h, twin);
        ends.iter().all(|v| self.links.kind(*v) == VertexKind::Inner)
            && self.links.valence(a).min(self.links.valence(b)) > 5
            && self.links.valence(c).max(self.links.valence(d)) < 7
            && !(self.fixed[a as usize] && self.fixed[b as usize])
            && !self.links.joined(c, d)
            && self.links.patch(h / 3) == self.links.patch(twin / 3)
    }

    /// Carries an edit out; gives the four vertices around an edge that turned.
    fn apply(&mut self, edit: Edit) -> [u32; 4] {
        match edit {
            Edit::Move(v, to) => {
                self.points[v as usize] = to;
                [NONE; 4]
            }
            Edit::Flip(h) => self.turn(h),
        }
    }

    fn turn(&mut self, h: u32) -> [u32; 4] {
        let Some(twin) = self.links.twin(h) else { return [NONE; 4] };
        let diamond = self.links.diamond(h, twin);
        self.links.flip(h, twin);
        diamond
    }

    /// Takes an edit back; moves are for the caller to take back.
    fn take_back(&mut self, edit: Edit) {
        if let Edit::Flip(h) = edit {
            // Twice would do for the edge, but swap the numbers of its triangles.
            for _ in 0..3 {
                self.turn(h);
            }
        }
    }

    /// Gives the surface's points at a turned edge to the nearer of its triangles.
    pub fn share_points(&self, change: &Change, points_of: &mut [Vec<u32>]) {
        let Edit::Flip(h) = change.edit else { return };
        let Some(twin) = self.links.twin(h) else { return };
        let pair = [h / 3, twin / 3];
        let corners = pair.map(|t| self.corners(t));
        let mut points: Vec<u32> =
            pair.iter().flat_map(|t| std::mem::take(&mut points_of[*t as usize])).collect();
        points.sort_unstable();
        for p in points {
            let at = self.ground.target.points[p as usize].at;
            let [first, second] = corners.map(|c| closest_on_triangle(at, c).point.distance_squared(at));
            points_of[pair[usize::from(second < first)] as usize].push(p);
        }
    }

    /// Moves the vertices around an edit to where their triangles are better.
    fn make_room(&mut self, around: &[u32], edit: Edit) {
        for _ in 0..SWEEPS {
            for v in around {
                let moved = matches!(edit, Edit::Move(w, _) if w == *v);
                if !moved && !self.fixed[*v as usize] {
                    lift_freely(&self.links, &mut self.points, *v);
                }
            }
        }
    }

    /// Triangles of a region that run through others of it.
    fn crossings(&self, region: &Region) -> Result<usize> {
        let mut names: Vec<u32> =
            region.triangles.iter().flat_map(|t| self.links.triangles[*t as usize]).collect();
        names.sort_unstable();
        names.dedup();
        let name = |v: u32| names.binary_search(&v).map_or(0, |k| k as u32);
        let triangles =
            region.triangles.iter().map(|t| self.links.triangles[*t as usize].map(name)).collect();
        let vertices = names.iter().map(|v| self.points[*v as usize]).collect();
        Ok(intersecting_faces(&TriMesh { vertices, triangles }, self.ground.progress)?.len())
    }
}
