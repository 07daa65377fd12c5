//! Spots: what the fit leaves, the few places where mesh and surface are farthest apart, one by one.
//!
//! Evenly spread vertices meet a corner or the bottom of a fold by chance only. At each such place a few edits are tried:
//! a vertex goes there, or an edge turns; the vertices around make room; and the best edit stays if what is far nearby
//! becomes less, the largest distance does not grow, and no triangle suffers.

use glam::DVec3;
use rayon::prelude::*;

use super::links::{Kind, Links, cross, next, previous};
use super::relax::CHUNK;
use super::worst::lift_freely;
use super::{Target, is_locked};
use crate::TriMesh;
use crate::mesh::bvh::Bvh;
use crate::mesh::intersections::intersecting_faces;
use crate::mesh::quality::TriangleQuality;
use crate::mesh::triangle::closest_on_triangle;

/// Distances below this share of the typical edge are left.
const FAR: f64 = 0.15;
/// Edits that are carried through at a spot, the most promising ones.
const TRIALS: usize = 10;
/// No further edit is tried once one leaves this share of what was far.
const ENOUGH: f64 = 0.3;
/// Edits in a row at one spot: what is too far for one, some can do.
const STEPS: u32 = 4;
/// What is far nearby must fall below this share.
const GAIN: f64 = 0.95;
/// What a degree below the least angle is worth, in edges, before the vertices around make room.
const ANGLE_COST: f64 = 0.02;
/// Rings of vertices that make room.
const RINGS: u32 = 2;
/// Sweeps over the vertices around an edit.
const SWEEPS: u32 = 3;
/// Least cosine between a triangle and the surface under it, and between two neighbouring triangles.
const FACING: f64 = 0.1;
const DIHEDRAL: f64 = -0.4;
/// Where nearly everything is far, these many spots are looked at, and one more for so many vertices.
const MOST_SPOTS: usize = 100;
const VERTICES_A_SPOT: usize = 100;
/// Points of the surface that are looked at around a spot.
const MOST_POINTS: usize = 400;

/// Settings of [`reach_spots`].
#[derive(Debug, Clone, PartialEq)]
pub struct SpotOptions {
    /// Times that all spots are tried; those around which nothing has changed since are left out.
    pub passes: u32,
    /// No angle may fall below this many degrees, unless it was smaller before.
    pub min_angle: f64,
    /// Vertices that stay where they are, besides those on a boundary; vertices beyond the end of the list are free.
    pub fixed: Vec<bool>,
    /// The patch of each triangle, in which it stays; nothing if there is but one.
    pub patches: Vec<u32>,
    /// The edge length wanted at each vertex, relative to the typical one; nothing if they are equal.
    pub lengths: Vec<f64>,
}

impl Default for SpotOptions {
    fn default() -> Self {
        Self { passes: 2, min_angle: 38.0, fixed: Vec::new(), patches: Vec::new(), lengths: Vec::new() }
    }
}

/// Brings `mesh` and `target` closer where they are farthest apart; gives the number of edits.
///
/// `edge` is the typical length of the mesh's edges. Keeps the topology. Panics if an index is out of range.
pub fn reach_spots(mesh: &mut TriMesh, target: &Target, edge: f64, options: &SpotOptions) -> usize {
    reach_spots_while(mesh, target, edge, options, &mut |_| true)
}

/// As [`reach_spots`], as long as `go_on` agrees: it is asked before every spot, with the share of the work that is done.
/// What was done so far stays.
pub fn reach_spots_while(
    mesh: &mut TriMesh,
    target: &Target,
    edge: f64,
    options: &SpotOptions,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> usize {
    let links = Links::new(std::mem::take(&mut mesh.triangles), mesh.vertices.len(), &options.patches);
    let locked = (0..mesh.vertices.len()).map(|v| is_locked(&links, &options.fixed, v)).collect();
    let points = std::mem::take(&mut mesh.vertices);
    let mut work = Work { links, points, locked, target, options, points_of: Vec::new(), edge };
    let spots = work.spots(go_on);
    // The number of the edit that last changed each triangle, and of the last one before each spot was tried: where
    // nothing changed since then, nothing can be done.
    let mut changed = vec![1; work.links.triangles.len()];
    let mut tried = vec![0; spots.len()];
    let mut edits = 0;
    let all = (options.passes as usize * spots.len()).max(1) as f64;
    'passes: for pass in 0..options.passes as usize {
        let before = edits;
        for (number, (spot, tried)) in (pass * spots.len()..).zip(spots.iter().zip(&mut tried)) {
            if !go_on(number as f64 / all) {
                break 'passes;
            }
            let last = std::mem::replace(tried, edits + 1);
            for step in 0..STEPS {
                let mut region = work.region(spot.triangle);
                let untouched = region.triangles.iter().all(|t| changed[*t as usize] <= last);
                if (step == 0 && untouched) || !work.mend(spot, &mut region) {
                    break;
                }
                edits += 1;
                region.triangles.iter().for_each(|t| changed[*t as usize] = edits + 1);
            }
        }
        if edits == before {
            break;
        }
    }
    mesh.triangles = work.links.triangles;
    mesh.vertices = work.points;
    edits
}

/// A point of the mesh and one of the surface that should not be so far apart.
struct Spot {
    distance: f64,
    triangle: u32,
    /// From the mesh to the surface.
    offset: DVec3,
    /// On the surface.
    at: DVec3,
}

/// A change of the mesh.
#[derive(Debug, Clone, Copy)]
enum Edit {
    Move(u32, DVec3),
    Flip(u32),
}

struct Work<'a> {
    links: Links,
    points: Vec<DVec3>,
    locked: Vec<bool>,
    target: &'a Target,
    options: &'a SpotOptions,
    /// The surface's vertices nearest to each triangle.
    points_of: Vec<Vec<u32>>,
    edge: f64,
}

impl Work<'_> {
    /// The typical length of the edges of a triangle.
    fn edge_at(&self, t: u32) -> f64 {
        let lengths = &self.options.lengths;
        if lengths.is_empty() {
            return self.edge;
        }
        self.edge * self.links.triangles[t as usize].iter().map(|v| lengths[*v as usize]).sum::<f64>() / 3.0
    }

    /// The square of the distance at a triangle below which nothing is far.
    fn least_sq(&self, t: u32) -> f64 {
        (FAR * self.edge_at(t)).powi(2)
    }

    fn corners(&self, t: u32) -> [DVec3; 3] {
        self.links.triangles[t as usize].map(|v| self.points[v as usize])
    }

    /// Where mesh and surface are far apart, the farthest first; nothing if it is not to go on.
    fn spots(&mut self, go_on: &mut dyn FnMut(f64) -> bool) -> Vec<Spot> {
        let mesh = TriMesh { vertices: self.points.clone(), triangles: self.links.triangles.clone() };
        let bvh = Bvh::new(&mesh);
        if !go_on(0.0) {
            return Vec::new();
        }
        let shortest = self.options.lengths.iter().copied().reduce(f64::min).unwrap_or(1.0);
        let least = (FAR * self.edge * shortest).powi(2);
        let inward: Vec<_> = (self.target.points.par_iter())
            .with_min_len(CHUNK)
            .map_init(|| 0, |rank, point| bvh.closest_or_near(point.at, rank, least))
            .collect();
        self.points_of = vec![Vec::new(); mesh.triangles.len()];
        let mut spots = Vec::new();
        for (p, found) in inward.iter().enumerate() {
            let Some(found) = found else { continue };
            self.points_of[found.triangle as usize].push(p as u32);
            if found.distance_sq > self.least_sq(found.triangle) {
                let at = self.target.points[p].at;
                let offset = at - found.point;
                spots.push(Spot { distance: offset.length(), triangle: found.triangle, offset, at });
            }
        }
        if !go_on(0.0) {
            return Vec::new();
        }
        let outward: Vec<Spot> = (0..mesh.triangles.len() as u32)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map_init(|| 0, |rank, t| self.outward(t, rank))
            .flatten()
            .collect();
        spots.extend(outward);
        spots.sort_by(|a, b| b.distance.total_cmp(&a.distance).then(a.triangle.cmp(&b.triangle)));
        spots.truncate(MOST_SPOTS + mesh.vertices.len() / VERTICES_A_SPOT);
        spots
    }

    /// The farthest of a triangle's samples, if it is far.
    fn outward(&self, t: u32, rank: &mut usize) -> Option<Spot> {
        let least = self.least_sq(t);
        let spots = samples(self.corners(t)).into_iter().filter_map(|p| {
            let found = self.target.bvh.closest_or_near(p, rank, least)?;
            let (distance, offset) = (found.distance_sq.sqrt(), found.point - p);
            (found.distance_sq > least).then_some(Spot { distance, triangle: t, offset, at: found.point })
        });
        spots.max_by(|a, b| a.distance.total_cmp(&b.distance))
    }

    /// Tries edits at a spot; whether one was kept.
    fn mend(&mut self, spot: &Spot, before: &mut Region) -> bool {
        let (sum, largest) = self.error(before, f64::INFINITY);
        if sum <= 0.0 {
            return false;
        }
        let mut edits: Vec<(f64, Edit)> =
            self.edits(spot).into_iter().map(|edit| (self.promise(edit, spot, before), edit)).collect();
        edits.sort_by(|a, b| a.0.total_cmp(&b.0));
        let saved: Vec<(u32, DVec3)> =
            before.vertices.iter().map(|v| (*v, self.points[*v as usize])).collect();
        let floor = self.floor(&before.triangles);
        let crossings = self.crossings(before);
        let mut best: Option<(f64, Edit, Vec<DVec3>)> = None;
        let mut enough = false;
        for (_, edit) in edits.into_iter().take(TRIALS) {
            self.apply(edit);
            self.make_room(&before.vertices, edit);
            let least = best.as_ref().map_or(sum * GAIN, |b| b.0);
            if self.sound(before, floor) {
                let (reached, farthest) = self.error(before, least);
                if reached < least && farthest <= largest && self.crossings(before) <= crossings {
                    let places = before.vertices.iter().map(|v| self.points[*v as usize]).collect();
                    best = Some((reached, edit, places));
                    enough = reached < ENOUGH * sum;
                }
            }
            self.take_back(edit);
            saved.iter().for_each(|(v, p)| self.points[*v as usize] = *p);
            if enough {
                break;
            }
        }
        let Some((_, edit, places)) = best else { return false };
        self.apply(edit);
        before.vertices.iter().zip(places).for_each(|(v, p)| self.points[*v as usize] = p);
        if let Edit::Flip(h) = edit {
            self.share_points(h);
        }
        true
    }

    /// The corners of a triangle and the rings of vertices around it.
    fn around(&self, t: u32) -> Vec<u32> {
        let mut around: Vec<u32> = self.links.triangles[t as usize].to_vec();
        for _ in 0..RINGS {
            for k in 0..around.len() {
                around.extend(self.links.ring(around[k]).map(|h| self.links.origin(next(h))));
            }
            around.sort_unstable();
            around.dedup();
        }
        around
    }

    /// All triangles at the vertices around one, with the surface's points there.
    fn region(&self, t: u32) -> Region {
        let vertices = self.around(t);
        let mut triangles: Vec<u32> =
            vertices.iter().flat_map(|v| self.links.ring(*v).map(|h| h / 3)).collect();
        triangles.sort_unstable();
        triangles.dedup();
        let mut points: Vec<(u32, usize)> = (0..)
            .zip(&triangles)
            .flat_map(|(k, t)| self.points_of[*t as usize].iter().map(move |p| (*p, k)))
            .collect();
        let every = points.len().div_ceil(MOST_POINTS).max(1);
        points = points.into_iter().step_by(every).collect();
        let ranks = vec![[0; 16]; triangles.len()];
        Region { vertices, triangles, points, ranks, least_sq: self.least_sq(t) }
    }

    /// What is far in a region, both ways: the sum of how much the squared distances exceed what is allowed, and the
    /// largest distance; infinite both as soon as the sum exceeds `most`.
    fn error(&self, region: &mut Region, most: f64) -> (f64, f64) {
        let least = region.least_sq;
        let (mut sum, mut largest) = (0.0, 0.0f64);
        let mut add = |distance_sq: f64| {
            sum += ((distance_sq - least).max(0.0) / least).powi(2);
            largest = largest.max(distance_sq);
            sum > most
        };
        let corners: Vec<[DVec3; 3]> = region.triangles.iter().map(|t| self.corners(*t)).collect();
        for (p, k) in &region.points {
            let at = self.target.points[*p as usize].at;
            let to = |corners: &[DVec3; 3]| closest_on_triangle(at, *corners).point.distance_squared(at);
            let mut near = to(&corners[*k]);
            for corners in &corners {
                if near <= least {
                    break;
                }
                near = near.min(to(corners));
            }
            if add(near) {
                return (f64::INFINITY, f64::INFINITY);
            }
        }
        let Region { triangles, ranks, .. } = region;
        for ((t, corners), ranks) in triangles.iter().zip(&corners).zip(ranks) {
            let [a, b, c] = *corners;
            let middle = (a + b + c) / 3.0;
            let inside = [middle, (a + middle) * 0.5, (b + middle) * 0.5, (c + middle) * 0.5];
            // Each vertex and each edge but once, where all triangles around are of the region.
            let vertices = [(0, a), (1, b), (2, c)].into_iter().filter(|(k, _): &(usize, DVec3)| {
                let v = self.links.triangles[*t as usize][*k];
                self.links.ring(v).map(|h| h / 3).min() == Some(*t)
            });
            let edges =
                [(0, a, b), (1, b, c), (2, c, a)].into_iter().filter(|(k, ..): &(usize, DVec3, DVec3)| {
                    let h = 3 * t + *k as u32;
                    let within = |twin: u32| triangles.binary_search(&(twin / 3)).is_ok();
                    self.links.twin(h).is_none_or(|twin| h < twin || !within(twin))
                });
            let on_edges =
                edges.flat_map(|(k, p, q)| [1, 2, 3].map(|m| (3 + 3 * k + m - 1, p.lerp(q, m as f64 / 4.0))));
            let inside = inside.into_iter().enumerate().map(|(k, p)| (12 + k, p));
            for (k, p) in vertices.chain(on_edges).chain(inside) {
                let found = self.target.bvh.closest_or_near(p, &mut ranks[k], least);
                if add(found.map_or(0.0, |found| found.distance_sq)) {
                    return (f64::INFINITY, f64::INFINITY);
                }
            }
        }
        (sum, largest.sqrt())
    }

    fn edits(&self, spot: &Spot) -> Vec<Edit> {
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
        for v in near.into_iter().filter(|v| !self.locked[*v as usize]) {
            let here = self.points[v as usize];
            edits.push(Edit::Move(v, spot.at));
            edits.extend([0.5, 1.0, 1.5].map(|s| Edit::Move(v, here + spot.offset * s)));
            edits.extend([0.3, 0.6].map(|s| Edit::Move(v, here.lerp(spot.at, s))));
        }
        edits
    }

    /// How far the spot is after an edit, in edges, with what the worst angle costs.
    fn promise(&mut self, edit: Edit, spot: &Spot, region: &Region) -> f64 {
        let saved = match edit {
            Edit::Move(v, _) => Some((v as usize, self.points[v as usize])),
            Edit::Flip(_) => None,
        };
        self.apply(edit);
        let (mut near, mut angle) = (f64::INFINITY, 60.0f64);
        for t in &region.triangles {
            let corners = self.corners(*t);
            near = near.min(closest_on_triangle(spot.at, corners).point.distance(spot.at));
            angle = angle.min(TriangleQuality::new(corners).min_angle());
        }
        self.take_back(edit);
        if let Some((v, here)) = saved {
            self.points[v] = here;
        }
        near / self.edge_at(spot.triangle) + (self.options.min_angle - angle).max(0.0) * ANGLE_COST
    }

    /// Whether an edge may turn: between free vertices that keep five to seven neighbours.
    fn may_turn(&self, h: u32) -> bool {
        let Some(twin) = self.links.twin(h) else { return false };
        let ends @ [a, b, c, d] = self.links.diamond(h, twin);
        ends.iter().all(|v| self.links.kind(*v) == Kind::Inner)
            && self.links.valence(a).min(self.links.valence(b)) > 5
            && self.links.valence(c).max(self.links.valence(d)) < 7
            && !(self.locked[a as usize] && self.locked[b as usize])
            && !self.links.joined(c, d)
            && self.links.patch(h / 3) == self.links.patch(twin / 3)
    }

    fn apply(&mut self, edit: Edit) {
        match edit {
            Edit::Move(v, to) => self.points[v as usize] = to,
            Edit::Flip(h) => self.turn(h),
        }
    }

    fn turn(&mut self, h: u32) {
        if let Some(twin) = self.links.twin(h) {
            self.links.flip(h, twin);
        }
    }

    /// Takes an edit back; moves are for the caller to take back.
    fn take_back(&mut self, edit: Edit) {
        if let Edit::Flip(h) = edit {
            // Twice would do for the edge, but swap the numbers of its triangles.
            (0..3).for_each(|_| self.turn(h));
        }
    }

    /// Gives the surface's points at a turned edge to the nearer of its triangles.
    fn share_points(&mut self, h: u32) {
        let Some(twin) = self.links.twin(h) else { return };
        let pair = [h / 3, twin / 3];
        let corners = pair.map(|t| self.corners(t));
        let mut points: Vec<u32> =
            pair.iter().flat_map(|t| std::mem::take(&mut self.points_of[*t as usize])).collect();
        points.sort_unstable();
        for p in points {
            let at = self.target.points[p as usize].at;
            let [first, second] = corners.map(|c| closest_on_triangle(at, c).point.distance_squared(at));
            self.points_of[pair[usize::from(second < first)] as usize].push(p);
        }
    }

    /// Moves the vertices around an edit to where their triangles are better.
    fn make_room(&mut self, around: &[u32], edit: Edit) {
        for _ in 0..SWEEPS {
            for v in around {
                let moved = matches!(edit, Edit::Move(w, _) if w == *v);
                if !moved && !self.locked[*v as usize] {
                    lift_freely(&self.links, &mut self.points, *v);
                }
            }
        }
    }

    /// Triangles of a region that run through others of it.
    fn crossings(&self, region: &Region) -> usize {
        let mut names: Vec<u32> =
            region.triangles.iter().flat_map(|t| self.links.triangles[*t as usize]).collect();
        names.sort_unstable();
        names.dedup();
        let name = |v: u32| names.binary_search(&v).map_or(0, |k| k as u32);
        let triangles =
            region.triangles.iter().map(|t| self.links.triangles[*t as usize].map(name)).collect();
        let vertices = names.iter().map(|v| self.points[*v as usize]).collect();
        intersecting_faces(&TriMesh { vertices, triangles }).len()
    }

    /// Angles may not fall below this.
    fn floor(&self, triangles: &[u32]) -> f64 {
        let smallest =
            triangles.iter().map(|t| TriangleQuality::new(self.corners(*t)).min_angle()).fold(90.0, f64::min);
        smallest.min(self.options.min_angle)
    }

    /// Whether no triangle is too flat, faces away from the surface, or folds onto its neighbour.
    fn sound(&self, region: &mut Region, floor: f64) -> bool {
        let Region { triangles, ranks, .. } = region;
        triangles.iter().zip(ranks).all(|(t, ranks)| {
            let corners = self.corners(*t);
            let shape = TriangleQuality::new(corners);
            let normal = cross(corners).normalize_or_zero();
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            shape.min_angle() >= floor
                && shape.max_angle() <= 90.0
                && self
                    .target
                    .closest_with_normal(middle, normal, self.links.patch(*t), &mut ranks[12])
                    .is_some_and(|(at, facing)| {
                        facing.dot(normal) > FACING && at.distance(middle) < self.edge_at(*t)
                    })
                && (3 * t..3 * t + 3).all(|h| {
                    self.links
                        .twin(h)
                        .is_none_or(|g| cross(self.corners(g / 3)).normalize_or_zero().dot(normal) > DIHEDRAL)
                })
        })
    }
}

/// What is looked at around a spot.
struct Region {
    /// Those that make room.
    vertices: Vec<u32>,
    /// In ascending order.
    triangles: Vec<u32>,
    /// The surface's vertices that were nearest to them, with the place of that triangle in the list.
    points: Vec<(u32, usize)>,
    /// Of each triangle, where the searches of its samples ended: at the corners, on the edges, and inside.
    ranks: Vec<[usize; 16]>,
    /// The square of the distance below which nothing is far.
    least_sq: f64,
}

/// Points of a triangle that stand for it.
fn samples([a, b, c]: [DVec3; 3]) -> [DVec3; 7] {
    [a, b, c, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5, (a + b + c) / 3.0]
}
