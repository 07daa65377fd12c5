//! Edge collapses onto one end of the edge, short edges of flat parts first.

use super::apart::stays_apart;
use super::changes::Changes;
use super::flip::flip;
use super::graph::{Around, Graph, Preserved};
use crate::mesh::chunks::par_map_chunks;
use crate::mesh::queue::Queue;
use crate::mesh::topology::topology;
use crate::mesh::triangle::doubled_normal;
use crate::{ProgressToken, Result, TriMesh};
use glam::{DMat3, DVec3};
use smallvec::SmallVec;
use std::cmp::Reverse;
use std::ops::Range;

/// Cost of a squared distance from the old surface, relative to the squared length of the edge.
const DISTANCE: f64 = 4.0;
/// Limits of collapses, from strict to loose; each is tried in turn.
const LIMITS: [Limits; 6] = [
    Limits { cosine: 0.8, height: 0.3, apart: false },
    Limits { cosine: 0.6, height: 0.15, apart: false },
    Limits { cosine: 0.4, height: 0.08, apart: true },
    Limits { cosine: 0.2, height: 0.03, apart: true },
    Limits { cosine: 0.0, height: 0.005, apart: true },
    Limits { cosine: -1.0, height: 1e-6, apart: true },
];
/// Limits that the topology alone sets, if faces may intersect.
const ANY_SHAPE: Limits = Limits { cosine: f64::NEG_INFINITY, height: 0.0, apart: false };
/// With fewer vertices even small turns may fold the surface: then every change is checked for intersections.
const FEW: usize = 2000;
/// Maximum number of passes over all edges at each limit.
const PASSES: usize = 4;
/// Another pass follows at a limit other than the last only if one removed this fraction of the vertices.
const WORTH_A_PASS: f64 = 0.02;
/// After this many limits the others may be left out: if more than [`MANY`] vertices are left, they take
/// long.
const STRICT: usize = 2;
/// With more vertices than this, the limits after the first [`STRICT`] take long.
const MANY: usize = 20_000;
/// Limits are left out for a number below what the topology needs, if at most this many times that need are
/// left.
const NEAR_NEED: usize = 4;

#[derive(Clone, Copy)]
struct Limits {
    /// The least cosine between a triangle's normals before and after.
    cosine: f64,
    /// The least height over the longest side, unless the triangle was worse.
    height: f64,
    /// Whether triangles nearby are checked, so that no more of them intersect.
    apart: bool,
}

/// The sum of squared distances to planes.
#[derive(Clone, Copy, Default)]
struct Quadric {
    normals: DMat3,
    linear: DVec3,
    constant: f64,
    weight: f64,
}

impl Quadric {
    /// To the plane of a triangle, by its area.
    fn of(corners: [DVec3; 3]) -> Self {
        let doubled = doubled_normal(corners);
        let (normal, weight) = (doubled.normalize_or_zero(), 0.5 * doubled.length());
        let offset = -normal.dot(corners[0]);
        Self {
            normals: DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z) * weight,
            linear: normal * offset * weight,
            constant: offset * offset * weight,
            weight,
        }
    }

    fn add(&mut self, other: &Self) {
        self.normals += other.normals;
        self.linear += other.linear;
        self.constant += other.constant;
        self.weight += other.weight;
    }

    /// The mean squared distance of a point from the planes.
    fn mean(&self, p: DVec3) -> f64 {
        let sum = p.dot(self.normals * p) + 2.0 * self.linear.dot(p) + self.constant;
        if self.weight > 0.0 { (sum / self.weight).max(0.0) } else { 0.0 }
    }
}

pub(super) struct Collapser<'a> {
    graph: &'a mut Graph,
    /// What the graph is made of.
    surface: &'a TriMesh,
    preserved: Preserved<'a>,
    quadrics: Vec<Quadric>,
    /// How often the triangles at each vertex changed.
    version: Vec<u32>,
    changes: Changes,
    progress: &'a ProgressToken,
}

/// A collapse of one vertex onto another, by cost.
type Move = Reverse<(u64, u32, u32, [u32; 2])>;

impl<'a> Collapser<'a> {
    pub fn new(
        graph: &'a mut Graph,
        surface: &'a TriMesh,
        preserved: Preserved<'a>,
        progress: &'a ProgressToken,
    ) -> Self {
        let mut quadrics = vec![Quadric::default(); graph.points.len()];
        for triangle in &graph.triangles {
            let quadric = Quadric::of(graph.corners(*triangle));
            triangle.iter().for_each(|v| quadrics[*v as usize].add(&quadric));
        }
        let (version, changes) = (vec![0; graph.points.len()], Changes::new(graph));
        Self { graph, surface, preserved, quadrics, version, changes, progress }
    }

    /// Collapses edges until there are `count` vertices, or no edge is left that may collapse.
    pub fn collapse(&mut self, count: usize) -> Result<()> {
        let any_shape = self.preserved.may_intersect.then_some(ANY_SHAPE);
        for (k, limits) in LIMITS.into_iter().chain(any_shape).enumerate() {
            let worth = if k + 1 < LIMITS.len() { WORTH_A_PASS } else { 0.0 };
            if k == STRICT && self.graph.used > MANY && self.is_out_of_reach(count) {
                return Ok(());
            }
            let mut last = 0;
            for _ in 0..PASSES {
                let before = self.graph.used;
                if before > count {
                    let since = std::mem::replace(&mut last, self.changes.now());
                    self.pass(count, limits, since)?;
                }
                let apart = self.must_stay_apart(limits);
                flip(self.graph, &mut self.changes, apart);
                if self.graph.used <= count {
                    return Ok(());
                }
                if (before - self.graph.used) as f64 <= worth * before as f64 {
                    break;
                }
            }
        }
        Ok(())
    }

    /// Whether changes are checked for intersections: never within [`ANY_SHAPE`], which asks for no height.
    fn must_stay_apart(&self, limits: Limits) -> bool {
        limits.height > 0.0 && (self.preserved.apart || limits.apart || self.graph.used < FEW)
    }

    /// Whether `count` is less than the topology needs, and not many more vertices than needed are left;
    /// false for 0, which asks for the smallest possible number.
    fn is_out_of_reach(&self, count: usize) -> bool {
        let needed = topology(self.surface).vertices_needed();
        count > 0 && count < needed && self.graph.used <= NEAR_NEED * needed
    }

    /// Collapses edges within the limits, which refused all that is left of those at the end of a pass that
    /// began at the time `since`; 0 for the first one.
    fn pass(&mut self, count: usize, limits: Limits, since: u32) -> Result<()> {
        let mut moves = Queue::new(self.moves());
        while self.graph.used > count {
            self.progress.poll()?;
            let Some(Reverse((_, v, u, versions))) = moves.pop() else { return Ok(()) };
            let current = [v, u].map(|w| self.version[w as usize]);
            if versions != current && [v, u].iter().any(|w| self.graph.is_hub(*w)) {
                // Its moves are brought up to date one by one, as they come up.
                let is_there = self.graph.around_edge(v, u).next().is_some();
                self.candidate(v, u).filter(|_| is_there).into_iter().for_each(|entry| moves.push(entry));
                continue;
            }
            let apart = self.must_stay_apart(limits);
            // What takes least time comes first.
            let keeps = versions == current
                && !self.is_same_since(since, [v, u], apart)
                && self.keeps_shape(v, u, limits)
                && self.keeps_topology(v, u)
                && (!apart || self.stays_apart(v, u));
            if !keeps {
                continue;
            }
            let theirs = self.graph.neighbours(v);
            self.apply(v, u);
            let is_hub = self.graph.is_hub(u);
            let around = if is_hub { theirs } else { self.graph.neighbours(u) };
            for w in around.into_iter().filter(|w| *w != u) {
                let around = [self.candidate(u, w), self.candidate(w, u)];
                around.into_iter().flatten().for_each(|entry| moves.push(entry));
            }
        }
        Ok(())
    }

    /// The possible moves, in no certain order.
    fn moves(&self) -> Vec<Move> {
        let of = |v: u32| self.graph.neighbours(v).into_iter().filter_map(move |u| self.candidate(v, u));
        let of_part = |part: Range<usize>| -> Vec<Move> { part.flat_map(|v| of(v as u32)).collect() };
        par_map_chunks(self.graph.points.len(), of_part).concat()
    }

    /// Whether nothing that a collapse depends on has changed since a time, `apart` with the triangles around
    /// the neighbours.
    fn is_same_since(&self, time: u32, ends: [u32; 2], apart: bool) -> bool {
        let near = || ends.iter().all(|v| self.changes.none_since(time, &self.graph.neighbours(*v)));
        self.changes.none_since(time, &ends) && (!apart || near())
    }

    fn candidate(&self, v: u32, u: u32) -> Option<Move> {
        let on_curve = &self.graph.along_curves[v as usize];
        if self.graph.fixed[v as usize] || !(on_curve.is_empty() || on_curve.contains(&u)) {
            return None;
        }
        let [at, to] = [v, u].map(|w| self.graph.points[w as usize]);
        let mut off = self.quadrics[v as usize].mean(to);
        for w in on_curve.iter().filter(|w| **w != u) {
            let edge = self.graph.points[*w as usize] - to;
            let share = ((at - to).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
            off += (to + share * edge).distance_squared(at);
        }
        let cost = at.distance_squared(to) + DISTANCE * off;
        Some(Reverse((cost.to_bits(), v, u, [v, u].map(|w| self.version[w as usize]))))
    }

    /// The link condition: what `v` and `u` have in common is what lies at their edge.
    fn keeps_topology(&self, v: u32, u: u32) -> bool {
        let graph = &self.graph;
        let mut apexes: Around = graph
            .around_edge(v, u)
            .flat_map(|t| graph.triangles[t as usize])
            .filter(|w| *w != v && *w != u)
            .collect();
        apexes.sort_unstable();
        let distinct = apexes.windows(2).all(|pair| pair[0] != pair[1]);
        if apexes.is_empty() || !distinct {
            return false;
        }
        let is_joined = |w: &u32| *w != u && graph.around_edge(*w, u).next().is_some();
        let common: Around = graph.neighbours(v).into_iter().filter(is_joined).collect();
        if common != apexes {
            return false;
        }
        // A curve of three edges stays one, and so does a surface of four triangles.
        let doubles_curve = graph.along_curves[v as usize].iter().any(|w| *w != u && graph.is_curve(u, *w));
        let doubles_face = self.moved(v, u).any(|(_, [a, b, c])| {
            let corners = [a, b, c];
            let [b, c] = if a == u {
                [b, c]
            } else if b == u {
                [c, a]
            } else {
                [a, b]
            };
            graph.around_edge(b, c).any(|t| corners.iter().all(|w| graph.triangles[t as usize].contains(w)))
        });
        !doubles_curve && !doubles_face
    }

    /// The triangles of `v` that stay, each with its corners once `v` is at `u`.
    fn moved(&self, v: u32, u: u32) -> impl Iterator<Item = (u32, [u32; 3])> {
        let of = move |t: &u32| (*t, self.graph.triangles[*t as usize]);
        self.graph.star[v as usize]
            .iter()
            .map(of)
            .filter(move |(_, triangle)| !triangle.contains(&u))
            .map(move |(t, triangle)| (t, triangle.map(|w| if w == v { u } else { w })))
    }

    fn keeps_shape(&self, v: u32, u: u32, limits: Limits) -> bool {
        self.moved(v, u).all(|(t, new)| {
            let [before, after] = [self.graph.triangles[t as usize], new].map(|t| self.graph.corners(t));
            let [n, m] = [before, after].map(doubled_normal);
            let turned = n.dot(m) < limits.cosine * n.length() * m.length();
            if turned {
                return false;
            }
            let height = height_of(after);
            height >= limits.height || height >= limits.height.min(height_of(before))
        })
    }

    /// Whether no more pairs of triangles around intersect or are folded once `v` is at `u`.
    fn stays_apart(&self, v: u32, u: u32) -> bool {
        let near: Around = [v, u].into_iter().flat_map(|w| self.graph.neighbours(w)).collect();
        let new: SmallVec<[[u32; 3]; 16]> = self.moved(v, u).map(|(_, triangle)| triangle).collect();
        stays_apart(self.graph, &near, |triangle| triangle.contains(&v), &new)
    }

    fn apply(&mut self, v: u32, u: u32) {
        let curve = self.graph.along_curves[v as usize].clone();
        let moved: SmallVec<[(u32, [u32; 3]); 16]> = self.moved(v, u).collect();
        let graph = &mut self.graph;
        // Most of what is around a hub lies far from what changes.
        let ends = if graph.is_hub(u) { vec![v] } else { vec![v, u] };
        let ends = ends.into_iter().flat_map(|w| &graph.star[w as usize]);
        self.changes.note(ends.flat_map(|t| graph.triangles[*t as usize]));
        let gone: Around = graph.at_edge(v, u).collect();
        for t in gone {
            graph.alive[t as usize] = false;
            for w in graph.triangles[t as usize] {
                graph.star[w as usize].retain(|s| *s != t);
            }
        }
        for (t, triangle) in moved {
            graph.triangles[t as usize] = triangle;
            graph.star[u as usize].push(t);
        }
        graph.star[v as usize].clear();
        for w in curve {
            graph.take_off_curve(v, w);
            if w != u {
                graph.add_to_curve(u, w);
            }
        }
        graph.used -= 1;
        let quadric = self.quadrics[v as usize];
        self.quadrics[u as usize].add(&quadric);
        self.version[v as usize] += 1;
        self.version[u as usize] += 1;
    }
}

/// The height of a triangle over its longest side, as a share of that.
fn height_of([a, b, c]: [DVec3; 3]) -> f64 {
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    doubled_normal([a, b, c]).length() / longest.max(f64::MIN_POSITIVE)
}
