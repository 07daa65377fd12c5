//! The nearest other points of each point, the local spacing, and points that are far from all others.

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::kd_tree::KdTree;
use crate::{ProgressToken, Result};

/// Neighbours of a point.
pub(super) const COUNT: usize = 16;
/// Points that a thread does at a time.
const CHUNK: usize = 1 << 10;
/// A point is an outlier if it has this many times as much room as its neighbours.
const FAR: f64 = 2.5;
/// A neighbour so far in the order of their rooms is compared with.
const RANK: usize = 12;

/// Neighbours of all points.
pub(super) struct Neighbours {
    /// Neighbours of each point, nearest first.
    count: usize,
    nearest: Vec<u32>,
    /// The distance between points near each, as the side of the square that one has for itself.
    pub spacing: Vec<f64>,
    /// The points that are far from all others, ascending.
    pub outliers: Vec<u32>,
}

impl Neighbours {
    /// Of points of which there are more than one, with normals or without.
    pub fn new(points: &[DVec3], normals: &[DVec3], tree: &KdTree, progress: &ProgressToken) -> Result<Self> {
        let count = COUNT.min(points.len() - 1);
        let mut nearest = vec![0; points.len() * count];
        let mut room = vec![0.0; points.len()];
        let chunks = nearest.par_chunks_mut(CHUNK * count).zip(room.par_chunks_mut(CHUNK)).enumerate();
        chunks.try_for_each(|(chunk, (nearest, room))| {
            progress.poll()?;
            let mut found = Vec::new();
            for (k, (nearest, room)) in nearest.chunks_mut(count).zip(room).enumerate() {
                let own = (chunk * CHUNK + k) as u32;
                tree.nearest_few(points[own as usize], count + 1, &mut found);
                found.retain(|(_, i)| *i != own);
                nearest.iter_mut().zip(&found).for_each(|(to, (_, i))| *to = *i);
                // A disc of this radius has the neighbours and the point itself, half of it and of the last;
                // those on the other side of a thin sheet are in another disc.
                let disc = std::f64::consts::PI * found[count - 1].0;
                let is_other =
                    |i: u32| normals.get(own as usize).is_some_and(|n| n.dot(normals[i as usize]) < 0.0);
                let others = found.iter().filter(|(_, i)| is_other(*i)).count();
                *room = (disc / (count - others).max(1) as f64).sqrt();
            }
            Ok(())
        })?;
        let mut all = Self { count, nearest, spacing: Vec::new(), outliers: Vec::new() };
        let around = |i: usize| {
            let mut around: Vec<f64> = all.of(i as u32).iter().map(|j| room[*j as usize]).collect();
            around.sort_unstable_by(f64::total_cmp);
            around
        };
        let found: Vec<(f64, bool)> = (0..points.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|i| {
                let around = around(i);
                let is_far = room[i] > FAR * around[RANK.min(count - 1)];
                (around[count / 2], is_far)
            })
            .collect();
        all.outliers = (0..).zip(&found).filter(|(_, (_, far))| *far).map(|(i, _)| i).collect();
        all.spacing = found.into_iter().map(|(spacing, _)| spacing).collect();
        Ok(all)
    }

    /// The neighbours of a point, nearest first.
    pub fn of(&self, i: u32) -> &[u32] {
        &self.nearest[i as usize * self.count..][..self.count]
    }
}

/// The middle of values, of which there are some.
pub(super) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
