//! Signs of normals, so that all of a surface point to one side.
//!
//! Pairs of neighbours say whether their normals agree, and how surely: exactly so on any circle through both
//! (the reflection of König and Gumhold 2009, "Consistent propagation of normal orientations in point
//! clouds"). Sure pairs join points to pieces first, as the spanning tree of Hoppe et al. 1992 does; then
//! pieces are joined, those first for which the sum of all pairs between them is largest. So one wrong pair
//! decides nothing where many are right.

use std::collections::{BTreeMap, BinaryHeap};

use glam::DVec3;
use rayon::prelude::*;

use super::neighbours::Neighbours;
use super::normals::{Plane, WIDTH, noise};
use super::turn::Dipoles;
use crate::mesh::kd_tree::KdTree;
use crate::mesh::quick_hash::QuickMap;
use crate::{ProgressToken, Result};

/// Pairs at least as sure join points at once.
const SURE: f32 = 0.8;
/// Neighbours of a point that it is paired with.
const PAIRS: usize = 10;
/// Points that are thicker than most by this many spacings count half.
const THICK: f64 = 0.15;
/// The votes between two pieces are clear if their sum is at least this fraction of all.
const CLEAR: f64 = 0.7;
/// Rounds in which single normals follow their neighbours.
const ROUNDS: usize = 3;
/// Single normals follow their neighbours where the neighbours' mean is at least this long.
const MAJORITY: f64 = 0.3;
/// Points that a thread does at a time.
const CHUNK: usize = 1 << 9;
/// Joins between two polls.
const POLL: usize = 1 << 12;

/// The normals of the planes, turned so that they agree with their neighbours, and outwards. Between pieces
/// that no pair of neighbours connects, each piece counts for itself.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn orient(
    (points, tree): (&[DVec3], &KdTree),
    shapes: &[Plane],
    count: usize,
    neighbours: &Neighbours,
    progress: &ProgressToken,
) -> Result<Vec<DVec3>> {
    let mut normals: Vec<DVec3> = shapes.iter().map(|shape| shape.normal).collect();
    let normals = normals.as_mut_slice();
    let mut pieces = Pieces::new(points.len());
    let pairs = pairs(points, shapes, neighbours);
    let unsure = pairs.partition_point(|pair| pair.weight.abs() >= SURE);
    for (k, pair) in pairs[..unsure].iter().enumerate() {
        if k.is_multiple_of(POLL) {
            progress.poll()?;
        }
        pieces.join(pair.a, pair.b, pair.weight < 0.0);
    }
    join_pieces(&mut pieces, &pairs, CLEAR, progress)?;
    let clear: Vec<u32> = (0..points.len() as u32).map(|i| pieces.root(i).0).collect();
    join_pieces(&mut pieces, &pairs, 0.0, progress)?;
    let roots: Vec<(u32, bool)> = (0..points.len() as u32).map(|i| pieces.root(i)).collect();
    normals.par_iter_mut().zip(&roots).for_each(|(normal, (_, turned))| {
        if *turned {
            *normal = -*normal;
        }
    });
    let width = WIDTH + noise(shapes, &neighbours.spacing);
    follow_neighbours((points, tree, count), (&neighbours.spacing, width), normals, progress)?;
    let mut pieces: Vec<u32> = roots.iter().map(|(root, _)| *root).collect();
    Dipoles { points, spacing: &neighbours.spacing, pieces: &clear }.turn(normals, progress)?;
    outward(points, normals, &neighbours.spacing, &mut pieces);
    Ok(normals.to_vec())
}

/// Two neighbours; the weight is above 0 if their normals agree, and at most 1.
#[derive(Clone, Copy)]
struct Pair {
    a: u32,
    b: u32,
    weight: f32,
}

/// All pairs, the surest first.
fn pairs(points: &[DVec3], shapes: &[Plane], neighbours: &Neighbours) -> Vec<Pair> {
    let thickness = noise(shapes, &neighbours.spacing);
    // Where two sheets touch, or at a sharp edge, points lie around no plane, whose normal then means little.
    let trust = |i: u32| {
        let more = (shapes[i as usize].extents[0] / neighbours.spacing[i as usize] - thickness).max(0.0);
        1.0 / (1.0 + (more / THICK).powi(2))
    };
    let trust: Vec<f64> = (0..points.len() as u32).map(trust).collect();
    let trust = &trust;
    let few = |i: u32| neighbours.of(i).iter().take(PAIRS).copied();
    let of_point = |a: u32| {
        let others = few(a).filter(move |b| a < *b || !few(*b).any(|c| c == a));
        others.map(move |b| {
            let [p, q] = [a, b].map(|i| points[i as usize]);
            let [m, n] = [a, b].map(|i| shapes[i as usize].normal);
            let trust = trust[a as usize].min(trust[b as usize]);
            Pair { a: a.min(b), b: a.max(b), weight: (trust * agreement(p, m, q, n)) as f32 }
        })
    };
    let mut pairs: Vec<Pair> = (0..points.len() as u32).into_par_iter().flat_map_iter(of_point).collect();
    pairs.par_sort_unstable_by(|x, y| {
        y.weight.abs().total_cmp(&x.weight.abs()).then((x.a, x.b).cmp(&(y.a, y.b)))
    });
    pairs
}

/// Whether the normals `m` at `p` and `n` at `q` agree: 1 surely, -1 surely not.
pub(super) fn agreement(p: DVec3, m: DVec3, q: DVec3, n: DVec3) -> f64 {
    let d = (q - p).normalize_or_zero();
    let (along_m, along_n) = (d.dot(m), d.dot(n));
    let reflected = n - 2.0 * along_n * d;
    // Along a normal, the pair may also be noise, or two sheets.
    m.dot(reflected) * (1.0 - along_m.abs().max(along_n.abs()))
}

/// Sets that are joined, each with a sign relative to its root.
struct Pieces {
    parent: Vec<(u32, bool)>,
    size: Vec<u32>,
}

impl Pieces {
    fn new(count: usize) -> Self {
        Self { parent: (0..count as u32).map(|i| (i, false)).collect(), size: vec![1; count] }
    }

    /// The root, and whether the sign is opposite to that of the root.
    fn root(&mut self, i: u32) -> (u32, bool) {
        let (mut at, mut turned) = (i, false);
        while self.parent[at as usize].0 != at {
            let (up, by) = self.parent[at as usize];
            let (over, again) = self.parent[up as usize];
            if over != up {
                // Paths are halved on the way.
                self.parent[at as usize] = (over, by ^ again);
            }
            let (next, by) = self.parent[at as usize];
            turned ^= by;
            at = next;
        }
        (at, turned)
    }

    /// Joins the sets of both, with opposite signs or equal ones; returns the root that stays and the one
    /// that goes, with its sign, unless both are in one set.
    fn join(&mut self, a: u32, b: u32, opposite: bool) -> Option<(u32, u32, bool)> {
        let ((a, turned_a), (b, turned_b)) = (self.root(a), self.root(b));
        if a == b {
            return None;
        }
        let turned = opposite ^ turned_a ^ turned_b;
        let (stays, goes) = if self.size[a as usize] >= self.size[b as usize] { (a, b) } else { (b, a) };
        self.parent[goes as usize] = (stays, turned);
        self.size[stays as usize] += self.size[goes as usize];
        Some((stays, goes, turned))
    }
}

/// What speaks for equal signs of two pieces, less what speaks against, and both together, in millionths:
/// sums of integers. The order in which the tables are read does not matter, since the queue orders its
/// entries completely.
type Votes = QuickMap<u32, (i64, i64)>;

/// Joins pieces, those first between which most votes agree. Where less than this share of the votes is left
/// over, pieces are not joined.
fn join_pieces(pieces: &mut Pieces, pairs: &[Pair], least: f64, progress: &ProgressToken) -> Result<()> {
    let mut votes: QuickMap<u32, Votes> = QuickMap::default();
    for pair in pairs {
        let ((a, turned_a), (b, turned_b)) = (pieces.root(pair.a), pieces.root(pair.b));
        if a == b {
            continue;
        }
        let vote = (f64::from(pair.weight) * 1e6) as i64;
        let vote = if turned_a ^ turned_b { -vote } else { vote };
        for (from, to) in [(a, b), (b, a)] {
            let sum = votes.entry(from).or_default().entry(to).or_default();
            *sum = (sum.0 + vote, sum.1 + vote.abs());
        }
    }
    let mut queue: BinaryHeap<(i64, u32, u32)> = BinaryHeap::new();
    for (a, others) in &votes {
        queue.extend(others.iter().filter(|(b, _)| *b > a).map(|(b, (vote, _))| (vote.abs(), *a, *b)));
    }
    let mut steps = 0_usize;
    while let Some((size, a, b)) = queue.pop() {
        steps += 1;
        if steps.is_multiple_of(POLL) {
            progress.poll()?;
        }
        // Entries of pieces that are gone, or whose votes have changed since, are old.
        let Some((vote, all)) = votes.get(&a).and_then(|others| others.get(&b)).copied() else { continue };
        if vote.abs() != size || (vote.abs() as f64) < least * all as f64 {
            continue;
        }
        let Some((stays, goes, turned)) = pieces.join(a, b, vote < 0) else { continue };
        let moved = votes.remove(&goes).unwrap_or_default();
        for (other, (vote, all)) in moved {
            if let Some(back) = votes.get_mut(&other) {
                back.remove(&goes);
            }
            if other == stays {
                continue;
            }
            let vote = if turned { -vote } else { vote };
            let sum = votes.entry(stays).or_default().entry(other).or_default();
            *sum = (sum.0 + vote, sum.1 + all);
            let sum = *sum;
            votes.entry(other).or_default().insert(stays, sum);
            queue.push((sum.0.abs(), stays.min(other), stays.max(other)));
        }
    }
    Ok(())
}

/// Turns normals against which most of the `count` nearest stand, several times: those of points that noise
/// has carried off are not sure of anything.
fn follow_neighbours(
    (points, tree, count): (&[DVec3], &KdTree, usize),
    (spacing, width): (&[f64], f64),
    normals: &mut [DVec3],
    progress: &ProgressToken,
) -> Result<()> {
    // How far the nearest of each point reach, squared.
    let mut reach = vec![f64::INFINITY; points.len()];
    let mut last: Vec<DVec3> = Vec::new();
    for round in 0..ROUNDS {
        let tree_of_last = (round > 0).then(|| KdTree::new(&last));
        // Nothing is new where none of the nearest was turned in the last round.
        let is_new = |p: DVec3, reach: f64| {
            let Some(tree) = &tree_of_last else { return true };
            tree.nearest(p).is_some_and(|k| last[k as usize].distance_squared(p) <= reach)
        };
        let turns = |i: usize, reach: &mut f64, found: &mut Vec<(f64, u32)>| {
            let (p, normal) = (points[i], normals[i]);
            if !is_new(p, *reach) {
                return false;
            }
            tree.nearest_few(p, count, found);
            *reach = found.last().map_or(0.0, |(square, _)| *square);
            let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
            for (_, j) in found {
                let apart = normal.dot(points[*j as usize] - p) / (width * spacing[i]);
                let weight = (1.0 + apart * apart).powi(-2);
                sum += weight * normals[*j as usize];
                weights += weight;
            }
            sum.dot(normal) < -MAJORITY * weights
        };
        let of_chunk = |(chunk, reach): (usize, &mut [f64])| {
            progress.poll()?;
            let mut found = Vec::new();
            let own = (chunk * CHUNK..).zip(reach);
            Ok(own.filter_map(|(i, reach)| turns(i, reach, &mut found).then_some(i)).collect())
        };
        let turned: Vec<Vec<usize>> =
            reach.par_chunks_mut(CHUNK).enumerate().map(of_chunk).collect::<Result<_>>()?;
        let turned = turned.concat();
        if turned.is_empty() {
            break;
        }
        turned.iter().for_each(|i| normals[*i] = -normals[*i]);
        last = turned.into_iter().map(|i| points[i]).collect();
    }
    Ok(())
}

/// Turns whole pieces so that the volume they enclose is positive.
fn outward(points: &[DVec3], normals: &mut [DVec3], spacing: &[f64], pieces: &mut [u32]) {
    let mut sums: BTreeMap<u32, (DVec3, f64)> = BTreeMap::new();
    for ((p, s), piece) in points.iter().zip(spacing).zip(pieces.iter()) {
        let sum = sums.entry(*piece).or_default();
        *sum = (sum.0 + *p * (s * s), sum.1 + s * s);
    }
    let mut volumes: BTreeMap<u32, f64> = BTreeMap::new();
    for (((p, s), n), piece) in points.iter().zip(spacing).zip(normals.iter()).zip(pieces.iter()) {
        let (sum, area) = sums[piece];
        *volumes.entry(*piece).or_default() += s * s * n.dot(*p - sum / area);
    }
    for (normal, piece) in normals.iter_mut().zip(pieces) {
        if volumes[piece] < 0.0 {
            *normal = -*normal;
        }
    }
}
