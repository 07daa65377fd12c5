//! Borders between labels made smooth where they follow the triangles to and fro, as those of segmentations
//! do. Single triangles that stick out change sides, and the vertices of the borders move within the surface.

use glam::DVec3;
use rayon::prelude::*;

use super::region_areas::{FreeVertex, region_areas, restoring_moves};
use super::smooth_boundary::{Limits, follow, unfold};
use crate::mesh::bvh::Bvh;
use crate::mesh::csr::Csr;
use crate::mesh::half_edges::{EdgeTable, next, previous};
use crate::mesh::topology::Partition;
use crate::mesh::unit_frame::UnitFrame;
use crate::mesh::{NONE, TriMesh};

/// A border is ragged if its [`raggedness`] is more than this, in radians: smooth curves and polygons have
/// hardly any.
const RAGGED: f64 = 0.1;
/// Turns to and fro belong together if they are at most this many edges apart.
const APART: usize = 2;
/// A ragged border has at least this many bends: fewer may be intended.
const LEAST_BENDS: usize = 4;
/// Pairs of steps in which borders are filtered, one that shrinks and one that grows (Taubin 1995).
const PAIRS: usize = 60;
const SHRINKING: f64 = 0.5;
const GROWING: f64 = -0.51;
/// Rounds in which triangles that stick out change sides.
const ROUNDS: usize = 4;
/// Odd, so that no two indices have the same product.
const SCATTER: u32 = 2_654_435_761;
/// Regions of fewer triangles keep them all.
const SMALL: u32 = 16;
/// Maximum number of rounds in which regions get their areas back.
const RESTORATIONS: usize = 3;
/// They have them if no more than this fraction of the whole area is in the wrong one.
const WRONG_AREA: f64 = 2e-4;
/// How far triangles may be turned and shrunk.
const LIMITS: Limits = Limits { factor: 0.8, rounds: 14, least_cosine: 0.94, least_area: 0.08 };

/// What is made smooth, and how far.
pub(crate) struct BorderSmoothing<'a> {
    /// Vertices move by at most this many mean edges of their border.
    pub edges: f64,
    /// Edges where the surface turns by at least this angle in degrees stay.
    pub feature_angle: f64,
    /// Half-edges that stay, too.
    pub fixed: &'a [u32],
}

/// Makes ragged borders of a mesh smooth; `borders` are half-edges along them. `origin` has the triangle of
/// another mesh that each triangle comes from; one that changes sides gets that of its neighbour there. The
/// regions between borders keep their areas, as far as the vertices may move. Returns the half-edges along
/// the borders then.
pub(crate) fn smooth_borders(
    mesh: &mut TriMesh,
    origin: &mut [u32],
    borders: &[u32],
    by: &BorderSmoothing,
) -> Vec<u32> {
    let Ok(frame) = UnitFrame::of(mesh) else { return borders.to_vec() };
    let mut unit = TriMesh {
        vertices: mesh.vertices.iter().map(|p| frame.to_unit(*p)).collect(),
        triangles: mesh.triangles.clone(),
    };
    let mut sides = Sides::new(&unit, borders, by);
    if !sides.ragged.contains(&true) {
        return borders.to_vec();
    }
    let mut region = sides.regions();
    let areas = region_areas(&unit, &region);
    sides.turn_teeth(origin, &mut region);
    let (mut wanted, is_given, free) = sides.moves(&unit, by.edges);
    let bvh = Bvh::new(&unit);
    let mut moves = settled(&unit, &bvh, &wanted, &is_given);
    let mut best = (f64::INFINITY, Vec::new());
    let mut moved = unit.clone();
    for round in 0..=RESTORATIONS {
        let places = unit.vertices.iter().zip(&moves).map(|(p, by)| *p + *by);
        moved.vertices.iter_mut().zip(places).for_each(|(p, place)| *p = place);
        let now = region_areas(&moved, &region);
        let wrong: f64 = now.iter().zip(&areas).map(|(now, area)| (now - area).abs()).sum();
        if wrong < best.0 {
            best = (wrong, moves);
        }
        if wrong <= WRONG_AREA * areas.iter().sum::<f64>() || round == RESTORATIONS {
            break;
        }
        let restoring = restoring_moves(&moved, &region, &areas, &free);
        for (FreeVertex { vertex, max_move }, by) in free.iter().zip(restoring) {
            let whole = &mut wanted[*vertex as usize];
            *whole = (*whole + by).clamp_length_max(*max_move);
        }
        moves = settled(&unit, &bvh, &wanted, &is_given);
    }
    for (v, by) in best.1.iter().enumerate().filter(|(_, by)| **by != DVec3::ZERO) {
        unit.vertices[v] += *by;
        mesh.vertices[v] = frame.to_input_units(unit.vertices[v]);
    }
    (0..).zip(&sides.is_border).filter(|(_, is)| **is).map(|(half, _)| half).collect()
}

/// The moves of all vertices, where some are wanted: others follow, all stay on the surface, and no triangle
/// folds.
fn settled(mesh: &TriMesh, bvh: &Bvh, wanted: &[DVec3], is_given: &[bool]) -> Vec<DVec3> {
    let mut moves = wanted.to_vec();
    follow(mesh, is_given, &mut moves);
    let mut rank = 0;
    for _ in 0..2 {
        for (v, by) in moves.iter_mut().enumerate().filter(|(_, by)| **by != DVec3::ZERO) {
            let place = mesh.vertices[v];
            if let Some(closest) = bvh.closest_from(place + *by, &mut rank) {
                *by = closest.point - place;
            }
        }
        unfold(mesh, &mut moves, &LIMITS);
    }
    moves
}

/// By how much a curve turns to and fro within a few edges, at each of its points on average; in radians. A
/// closed one ends with its first point.
fn raggedness(points: &[DVec3]) -> f64 {
    let edges: Vec<DVec3> = points.windows(2).map(|pair| (pair[1] - pair[0]).normalize_or_zero()).collect();
    let turn = |pair: &[DVec3]| {
        let axis = pair[0].cross(pair[1]);
        axis.length().atan2(pair[0].dot(pair[1])) * axis.normalize_or_zero()
    };
    let turns: Vec<DVec3> = edges.windows(2).map(turn).collect();
    let lost = |k: usize, to: usize| {
        let [a, b] = [turns[k], turns[to]];
        a.length() + b.length() - (a + b).length()
    };
    let near = |k: usize| (k + 1..(k + 1 + APART).min(turns.len())).map(move |to| (k, to));
    (0..turns.len()).flat_map(near).map(|(k, to)| lost(k, to)).sum::<f64>() / turns.len().max(1) as f64
}

/// The regions on both sides of borders.
struct Sides {
    triangles: Vec<[u32; 3]>,
    /// The other half-edge of an edge of two triangles.
    twins: Vec<u32>,
    /// Half-edges where nothing moves.
    is_stiff: Vec<bool>,
    is_border: Vec<bool>,
    /// The half-edges of borders that are made smooth.
    ragged: Vec<bool>,
}

/// A curve along borders, between vertices where it ends or meets others.
struct Chain {
    vertices: Vec<u32>,
    half_edges: Vec<u32>,
    is_closed: bool,
}

impl Sides {
    fn new(mesh: &TriMesh, borders: &[u32], by: &BorderSmoothing) -> Self {
        let count = 3 * mesh.triangles.len();
        let mut twins = vec![NONE; count];
        let mut is_stiff = vec![false; count];
        let mut is_border = vec![false; count];
        by.fixed.iter().for_each(|half| is_stiff[*half as usize] = true);
        borders.iter().for_each(|half| is_border[*half as usize] = true);
        let least_cosine = by.feature_angle.to_radians().cos();
        for edge in EdgeTable::new(&mesh.triangles).edges() {
            let halves: Vec<usize> = edge.iter().map(|half| half.corners().0).collect();
            let mut stiff = halves.iter().any(|half| is_stiff[*half]);
            match edge {
                [one, other] => {
                    twins[halves[0]] = halves[1] as u32;
                    twins[halves[1]] = halves[0] as u32;
                    let [m, n] = [one, other].map(|half| mesh.doubled_normal(half.triangle()));
                    // 180 degrees are none.
                    stiff |= by.feature_angle < 180.0 && m.dot(n) <= least_cosine * m.length() * n.length();
                }
                _ => stiff = true,
            }
            let border = halves.iter().any(|half| is_border[*half]);
            for half in halves {
                is_stiff[half] = stiff;
                is_border[half] = border;
            }
        }
        let ragged = vec![false; count];
        let mut found = Self { triangles: mesh.triangles.clone(), twins, is_stiff, is_border, ragged };
        let mut short = Vec::new();
        for chain in found.chains(mesh.vertices.len()) {
            let mut points: Vec<DVec3> = chain.vertices.iter().map(|v| mesh.vertices[*v as usize]).collect();
            if chain.is_closed {
                points.push(points[0]);
            }
            if chain.half_edges.len() <= LEAST_BENDS {
                short.push(chain);
            } else if raggedness(&points) > RAGGED {
                found.add_ragged(&chain);
            }
        }
        // Short ones are what those are that they meet.
        let mut is_on = vec![false; mesh.vertices.len()];
        for half in (0..count as u32).filter(|half| found.ragged[*half as usize]) {
            found.ends(half).iter().for_each(|v| is_on[*v as usize] = true);
        }
        let meets = |chain: &Chain| {
            [chain.vertices.first(), chain.vertices.last()].into_iter().flatten().any(|v| is_on[*v as usize])
        };
        short.iter().filter(|chain| meets(chain)).for_each(|chain| found.add_ragged(chain));
        found
    }

    fn add_ragged(&mut self, chain: &Chain) {
        for half in &chain.half_edges {
            self.ragged[*half as usize] = true;
            self.ragged[self.twins[*half as usize] as usize] = true;
        }
    }

    fn ends(&self, half: u32) -> [u32; 2] {
        let corners = self.triangles.as_flattened();
        [half, next(half)].map(|corner| corners[corner as usize])
    }

    /// Curves along the borders, each edge once, where nothing is stiff.
    fn chains(&self, vertices: usize) -> Vec<Chain> {
        let is_first = |half: &u32| self.twins[*half as usize] == NONE || *half < self.twins[*half as usize];
        let halves = (0..self.twins.len() as u32).filter(is_first);
        // Edges at each vertex; curves end where there are not two.
        let mut on: Vec<Vec<u32>> = vec![Vec::new(); vertices];
        let mut is_end = vec![false; vertices];
        let mut edges = Vec::new();
        for half in halves {
            let (own, ends) = (half as usize, self.ends(half));
            if self.is_border[own] && !self.is_stiff[own] {
                ends.iter().for_each(|v| on[*v as usize].push(half));
                edges.push(half);
            } else if self.is_stiff[own] {
                ends.iter().for_each(|v| is_end[*v as usize] = true);
            }
        }
        for (v, on) in on.iter().enumerate() {
            is_end[v] |= on.len() != 2;
        }
        let mut is_done = vec![false; self.twins.len()];
        let mut found = Vec::new();
        let mut trace = |first: u32, from: u32, is_done: &mut Vec<bool>| {
            let mut chain =
                Chain { vertices: vec![from], half_edges: Vec::new(), is_closed: !is_end[from as usize] };
            let (mut half, mut at) = (first, from);
            loop {
                is_done[half as usize] = true;
                chain.half_edges.push(half);
                let [a, b] = self.ends(half);
                at = if a == at { b } else { a };
                if at == from && chain.is_closed {
                    break;
                }
                chain.vertices.push(at);
                if is_end[at as usize] {
                    break;
                }
                let Some(onward) = on[at as usize].iter().find(|other| !is_done[**other as usize]) else {
                    break;
                };
                half = *onward;
            }
            found.push(chain);
        };
        for half in &edges {
            let [a, b] = self.ends(*half);
            let end = [a, b].into_iter().find(|v| is_end[*v as usize]);
            if let (Some(end), false) = (end, is_done[*half as usize]) {
                trace(*half, end, &mut is_done);
            }
        }
        for half in edges {
            if !is_done[half as usize] {
                trace(half, self.ends(half)[0], &mut is_done);
            }
        }
        found
    }

    /// Whether a corner of a triangle may come to lie on a ragged border.
    fn is_beside(&self, t: u32) -> bool {
        let is_ragged = |half: u32| self.ragged[half as usize];
        (3 * t..3 * t + 3).any(|half| {
            let twin = self.twins[half as usize];
            is_ragged(half) || (twin != NONE && (is_ragged(next(twin)) || is_ragged(previous(twin))))
        })
    }

    /// The region of each triangle.
    fn regions(&self) -> Vec<u32> {
        let count = self.triangles.len();
        let mut regions = Partition::new(count);
        for half in 0..self.twins.len() {
            if !self.is_border[half] && self.twins[half] != NONE {
                regions.join(half as u32 / 3, self.twins[half] / 3);
            }
        }
        (0..count as u32).map(|t| regions.root(t)).collect()
    }

    /// Triangles with two ragged sides towards the same region go over to it.
    fn turn_teeth(&mut self, origin: &mut [u32], region: &mut [u32]) {
        let count = self.triangles.len();
        let mut sizes = vec![0_u32; count];
        region.iter().for_each(|root| sizes[*root as usize] += 1);
        // In no order that follows the triangles: each region loses as many as it gets.
        let mut order: Vec<u32> = (0..count as u32).filter(|t| self.is_beside(*t)).collect();
        order.sort_by_key(|t| t.wrapping_mul(SCATTER));
        for _ in 0..ROUNDS {
            let mut is_changed = false;
            for t in order.iter().map(|t| *t as usize) {
                let halves = [0, 1, 2].map(|k| 3 * t as u32 + k);
                let Some(base) = halves.into_iter().find(|half| {
                    [next(*half), previous(*half)].iter().all(|side| self.ragged[*side as usize])
                }) else {
                    continue;
                };
                let [one, other] = [next(base), previous(base)].map(|half| self.twins[half as usize] / 3);
                let (own, to) = (region[t], region[one as usize]);
                if to != region[other as usize]
                    || to == own
                    || self.is_stiff[base as usize]
                    || self.is_border[base as usize]
                    || sizes[own as usize] < SMALL
                {
                    continue;
                }
                region[t] = to;
                origin[t] = origin[one as usize];
                sizes[own as usize] -= 1;
                sizes[to as usize] += 1;
                is_changed = true;
                for half in halves {
                    let is_border = half == base;
                    for half in [half, self.twins[half as usize]] {
                        self.is_border[half as usize] = is_border;
                        self.ragged[half as usize] = is_border;
                    }
                }
            }
            if !is_changed {
                break;
            }
        }
    }

    /// The moves of the vertices of ragged borders; for each vertex whether its move is given, as it is for
    /// those that stay; and the vertices that may move.
    fn moves(&self, mesh: &TriMesh, edges: f64) -> (Vec<DVec3>, Vec<bool>, Vec<FreeVertex>) {
        let count = mesh.vertices.len();
        let mut is_given = vec![false; count];
        let mut is_held = vec![false; count];
        // Along the borders; with the sum of lengths.
        let mut links = Vec::new();
        let mut lengths = vec![0.0; count];
        for half in 0..self.twins.len() as u32 {
            let (own, [a, b]) = (half as usize, self.ends(half));
            if self.is_border[own] || self.is_stiff[own] {
                [a, b].iter().for_each(|v| is_given[*v as usize] = true);
            }
            if !self.ragged[own] && (self.is_border[own] || self.is_stiff[own]) {
                [a, b].iter().for_each(|v| is_held[*v as usize] = true);
            } else if self.ragged[own] {
                // The other half-edge has the other way.
                links.push((a, b));
                lengths[a as usize] += mesh.vertices[a as usize].distance(mesh.vertices[b as usize]);
            }
        }
        let links = Csr::group(count, links.into_iter());
        let is_free = |v: &u32| links.of(*v).len() > 1 && !is_held[*v as usize];
        let free: Vec<u32> = (0..count as u32).filter(is_free).collect();
        let mut places = mesh.vertices.clone();
        for step in 0..2 * PAIRS {
            let share = if step % 2 == 0 { SHRINKING } else { GROWING };
            let place = |v: &u32| {
                let near = links.of(*v);
                let mean = near.iter().map(|w| places[*w as usize]).sum::<DVec3>() / near.len() as f64;
                places[*v as usize].lerp(mean, share)
            };
            let moved: Vec<DVec3> = free.par_iter().map(place).collect();
            free.iter().zip(moved).for_each(|(v, place)| places[*v as usize] = place);
        }
        let mut moves = vec![DVec3::ZERO; count];
        let to_move = |v: u32| {
            let own = v as usize;
            let max_move = edges * lengths[own] / links.of(v).len() as f64;
            moves[own] = (places[own] - mesh.vertices[own]).clamp_length_max(max_move);
            FreeVertex { vertex: v, max_move }
        };
        let free = free.into_iter().map(to_move).collect();
        (moves, is_given, free)
    }
}
