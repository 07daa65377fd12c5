//! Ears: triangles with two sides on curves. Their cells meet right at the curve, where the third side can
//! come to lie on the wrong side of it, or on both.

use std::collections::{HashMap, HashSet};

use crate::mesh::half_edges::edge_key;
use crate::mesh::quality::extreme_angles;
use crate::mesh::triangle::doubled_normal;
use glam::DVec3;

/// Passes over all ears: one that is turned may leave another.
const PASSES: u32 = 3;

/// Flips the third sides of ears where that lifts the smallest angle of the two triangles there, or where
/// more than two triangles are at them. `curve_edges` are the edges on curves, the smaller vertex first.
pub fn turn_ears(triangles: &mut [[u32; 3]], positions: &[DVec3], curve_edges: &HashSet<(u32, u32)>) {
    let mut on_curve = vec![false; positions.len()];
    for (a, b) in curve_edges {
        on_curve[*a as usize] = true;
        on_curve[*b as usize] = true;
    }
    // The third side of an ear.
    let third = |triangle: [u32; 3]| {
        if triangle.iter().any(|v| !on_curve[*v as usize]) {
            return None;
        }
        let is_off = sides(triangle).map(|(a, b)| !curve_edges.contains(&edge_key(a, b)));
        let mut off = (0..3).filter(|k| is_off[*k]);
        off.next().filter(|_| off.next().is_none())
    };
    if !triangles.iter().any(|triangle| third(*triangle).is_some()) {
        return;
    }
    let mut ears = Ears::new(triangles, positions, &on_curve);
    for _ in 0..PASSES {
        let mut turned = false;
        for t in 0..ears.triangles.len() as u32 {
            if let Some(k) = third(ears.triangles[t as usize]) {
                turned |= ears.turn(t, k);
            }
        }
        if !turned {
            return;
        }
    }
}

/// Triangles, with those at each directed edge that has an end on a curve.
struct Ears<'a> {
    triangles: &'a mut [[u32; 3]],
    positions: &'a [DVec3],
    at: HashMap<(u32, u32), Vec<u32>>,
}

impl<'a> Ears<'a> {
    fn new(triangles: &'a mut [[u32; 3]], positions: &'a [DVec3], on_curve: &[bool]) -> Self {
        let mut at: HashMap<(u32, u32), Vec<u32>> = HashMap::new();
        for (t, triangle) in (0..).zip(triangles.iter()) {
            // All corners of an ear are on curves, so no other edge is ever looked up.
            let sides = sides(*triangle).into_iter();
            sides
                .filter(|(a, b)| on_curve[*a as usize] || on_curve[*b as usize])
                .for_each(|side| at.entry(side).or_default().push(t));
        }
        Self { triangles, positions, at }
    }

    fn count(&self, a: u32, b: u32) -> usize {
        self.at.get(&(a, b)).map_or(0, Vec::len)
    }

    /// Flips side `k` of triangle `t` if that is better.
    fn turn(&mut self, t: u32, k: usize) -> bool {
        let ear = self.triangles[t as usize];
        let [b, a, c] = [0, 1, 2].map(|step| ear[(k + step) % 3]);
        let at = |a, b| self.at.get(&(a, b)).into_iter().flatten().copied();
        // On the other side, but not the same triangle turned over.
        let mut beside = at(a, b).filter(|o| !self.triangles[*o as usize].contains(&c));
        let (Some(o), next) = (beside.next(), beside.next()) else { return false };
        // Where patches meet, two of them can have the same ear. Then it does not matter which one is turned.
        let is_twice = || at(b, a).filter(|o| self.triangles[*o as usize].contains(&c)).count() > 1;
        if next.is_some() && !is_twice() {
            return false;
        }
        let other = self.triangles[o as usize];
        let Some(d) = other.into_iter().find(|v| *v != a && *v != b) else { return false };
        if self.count(c, d) + self.count(d, c) > 0 {
            return false;
        }
        let is_crowded = self.count(a, b) + self.count(b, a) > 2;
        let new = [[c, b, d], [a, c, d]];
        if !is_crowded && !self.is_better([ear, other], new) {
            return false;
        }
        for (t, old, new) in [(t, ear, new[0]), (o, other, new[1])] {
            for side in sides(old) {
                if let Some(list) = self.at.get_mut(&side) {
                    list.retain(|s| *s != t);
                }
            }
            sides(new).into_iter().for_each(|side| self.at.entry(side).or_default().push(t));
            self.triangles[t as usize] = new;
        }
        true
    }

    /// Whether the new triangles face the way of the old ones and have a larger smallest angle.
    fn is_better(&self, old: [[u32; 3]; 2], new: [[u32; 3]; 2]) -> bool {
        let corners = |triangle: [u32; 3]| triangle.map(|v| self.positions[v as usize]);
        let facing: DVec3 = old.map(|t| doubled_normal(corners(t))).into_iter().sum();
        let least = |pair: [[u32; 3]; 2]| {
            let [one, two] = pair.map(|t| extreme_angles(corners(t))[0]);
            one.min(two)
        };
        new.iter().all(|t| doubled_normal(corners(*t)).dot(facing) > 0.0) && least(new) > least(old)
    }
}

fn sides([a, b, c]: [u32; 3]) -> [(u32, u32); 3] {
    [(a, b), (b, c), (c, a)]
}
