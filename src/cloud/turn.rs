//! Pieces of a surface whose sign their neighbours leave open, turned so that together they enclose a volume.
//!
//! The winding number of a closed surface is constant on both sides of it. So across a piece of it, that of
//! all others grows against the outward normal, by as much as that of the piece itself falls: a piece across
//! which both grow the same way is inside out. Each point stands for a dipole, and points far away together
//! for one, in a hierarchy (Barill et al. 2018, "Fast winding numbers for soups and clouds").

use std::cell::Cell;
use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;
use smallvec::SmallVec;

use crate::{ProgressToken, Result};

/// Points in a run; they follow each other in Morton order.
const RUN: usize = 32;
/// Runs of one level of the hierarchy that are one run of the next.
const FAN: usize = 8;
/// Runs nearer than this many times their radius are taken point by point.
const NEAR: f64 = 3.0;
/// Runs of a higher level that are nearer than this are taken run by run of the level below.
const NEAR_ABOVE: f64 = 6.0;
/// Points of a piece at which it is judged, at most.
const SAMPLES: usize = 256;
/// Dipoles nearer than this many spacings are spread out; [`SOFT_SHARE`] may raise the number.
const SOFT: f64 = 3.0;
/// Dipoles nearer than this fraction of a piece's size are spread out, if that is more than [`SOFT`].
const SOFT_SHARE: f64 = 0.2;
/// A piece is turned if the others speak against it with this share of its own strength.
const ENOUGH: f64 = 0.1;
/// Rounds in which pieces are turned.
const ROUNDS: usize = 4;
/// Pieces with fewer points than this do not matter.
const LEAST: usize = 8;

/// Points with normals, and what area each stands for.
pub(super) struct Dipoles<'a> {
    pub points: &'a [DVec3],
    pub spacing: &'a [f64],
    pub pieces: &'a [u32],
}

/// How strongly a piece speaks for its normals, and the others against them.
struct Strength {
    itself: f64,
    against: f64,
}

impl Strength {
    fn is_inside_out(&self) -> bool {
        self.against / self.itself.abs().max(f64::MIN_POSITIVE) > ENOUGH
    }

    /// The strength after some pieces were turned. `by_turned` is what they said against this one before,
    /// including itself if it `is_turned`.
    fn after(&self, by_turned: f64, is_turned: bool) -> Self {
        let against = match is_turned {
            true => 2.0 * (by_turned - self.itself) - self.against,
            false => self.against - 2.0 * by_turned,
        };
        Self { against, ..*self }
    }
}

/// Many points as one.
struct Run {
    /// How many.
    points: f64,
    centre: DVec3,
    radius: f64,
    moment: DVec3,
}

impl Run {
    /// Several runs as one.
    fn of(parts: &[Run]) -> Self {
        let points: f64 = parts.iter().map(|part| part.points).sum();
        let centre = parts.iter().map(|part| part.points * part.centre).sum::<DVec3>() / points;
        let radius = parts.iter().map(|part| part.centre.distance(centre) + part.radius).fold(0.0, f64::max);
        Self { points, centre, radius, moment: parts.iter().map(|part| part.moment).sum() }
    }
}

/// Runs of [`RUN`] points, and on each level above runs of [`FAN`] of the level below; one run at the top.
struct Hierarchy<'m> {
    members: &'m [u32],
    levels: Vec<Vec<Run>>,
}

impl<'m> Hierarchy<'m> {
    /// Of runs of these points.
    fn new(members: &'m [u32], runs: Vec<Run>) -> Self {
        let mut levels = vec![runs];
        while let Some(below) = levels.last().filter(|below| below.len() > 1) {
            levels.push(below.par_chunks(FAN).map(Run::of).collect());
        }
        Self { members, levels }
    }

    /// Calls `far` for runs that count as one point at a place, and `near` with each point of the others:
    /// together, they have all points.
    fn visit(&self, at: DVec3, mut far: impl FnMut(&Run), mut near: impl FnMut(usize)) {
        let top = self.levels.len() - 1;
        let mut open: SmallVec<[(usize, usize); 64]> = SmallVec::new();
        open.push((top, 0));
        while let Some((level, number)) = open.pop() {
            let run = &self.levels[level][number];
            let least = if level == 0 { NEAR } else { NEAR_ABOVE };
            if run.centre.distance_squared(at) >= (least * run.radius).powi(2) {
                far(run);
            } else if level == 0 {
                let own = &self.members[number * RUN..self.members.len().min((number + 1) * RUN)];
                own.iter().for_each(|i| near(*i as usize));
            } else {
                let below = number * FAN..((number + 1) * FAN).min(self.levels[level - 1].len());
                open.extend(below.rev().map(|number| (level - 1, number)));
            }
        }
    }
}

impl Dipoles<'_> {
    /// Turns the normals of pieces that are inside out.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn turn(&self, normals: &mut [DVec3], progress: &ProgressToken) -> Result<()> {
        let mut members: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        (0..).zip(self.pieces).for_each(|(i, piece)| members.entry(*piece).or_default().push(i));
        let mut members: Vec<Vec<u32>> = members.into_values().filter(|own| own.len() >= LEAST).collect();
        members.sort_by_key(|own| std::cmp::Reverse(own.len()));
        let pieces = &members[members.len().min(1)..];
        let mut strengths = self.strengths(pieces, normals, progress)?;
        for round in 1..=ROUNDS {
            let is_turned: Vec<bool> = strengths.iter().map(Strength::is_inside_out).collect();
            let mut turned: Vec<u32> = (pieces.iter().zip(&is_turned))
                .filter(|(_, is_turned)| **is_turned)
                .flat_map(|(own, _)| own.iter().copied())
                .collect();
            if turned.is_empty() {
                break;
            }
            turned.sort_unstable();
            let of_turned = self.hierarchy(&turned, normals);
            let after = |(own, (before, is_turned)): (&Vec<u32>, (&Strength, &bool))| {
                progress.poll()?;
                let by_turned = self.pull(own, &of_turned, normals);
                Ok(before.after(by_turned, *is_turned))
            };
            if round < ROUNDS {
                let known = pieces.par_iter().zip(strengths.par_iter().zip(&is_turned));
                strengths = known.map(after).collect::<Result<_>>()?;
            }
            turned.iter().for_each(|i| normals[*i as usize] = -normals[*i as usize]);
        }
        Ok(())
    }

    /// The strength of each of these pieces against the others.
    fn strengths(
        &self,
        pieces: &[Vec<u32>],
        normals: &[DVec3],
        progress: &ProgressToken,
    ) -> Result<Vec<Strength>> {
        let all: Vec<u32> = (0..self.points.len() as u32).collect();
        let all = self.hierarchy(&all, normals);
        let of = |own: &Vec<u32>| {
            progress.poll()?;
            let itself = self.pull(own, &self.hierarchy(own, normals), normals);
            Ok(Strength { itself, against: self.pull(own, &all, normals) - itself })
        };
        pieces.par_iter().map(of).collect()
    }

    /// The runs of some points, which ascend.
    fn hierarchy<'m>(&self, members: &'m [u32], normals: &[DVec3]) -> Hierarchy<'m> {
        let run = |own: &[u32]| {
            let centre = own.iter().map(|i| self.points[*i as usize]).sum::<DVec3>() / own.len() as f64;
            let radius = own.iter().map(|i| self.points[*i as usize].distance(centre)).fold(0.0, f64::max);
            let moment = own.iter().map(|i| self.moment(*i as usize, normals)).sum();
            Run { points: own.len() as f64, centre, radius, moment }
        };
        Hierarchy::new(members, members.par_chunks(RUN).map(run).collect())
    }

    fn moment(&self, i: usize, normals: &[DVec3]) -> DVec3 {
        self.spacing[i] * self.spacing[i] * normals[i]
    }

    /// How strongly some points speak against the normals of a piece, as a sum over samples of it.
    fn pull(&self, own: &[u32], of: &Hierarchy, normals: &[DVec3]) -> f64 {
        let samples = own.iter().step_by(own.len().div_ceil(SAMPLES)).map(|i| *i as usize);
        let at = |i: usize| {
            // Near dipoles would drown the others out.
            let soft = self.spacing[i] * SOFT.max(SOFT_SHARE * (own.len() as f64).sqrt());
            self.moment(i, normals).dot(self.slope(of, i, soft, normals))
        };
        samples.map(at).sum()
    }

    /// The gradient of the winding number of some points at one of the points, up to a factor.
    fn slope(&self, of: &Hierarchy, i: usize, soft: f64, normals: &[DVec3]) -> DVec3 {
        let at = self.points[i];
        let slope = Cell::new(DVec3::ZERO);
        let add = |r: DVec3, moment: DVec3| slope.set(slope.get() + slope_of(r, moment, soft));
        let near = |j: usize| add(self.points[j] - at, self.moment(j, normals));
        of.visit(at, |run| add(run.centre - at, run.moment), near);
        slope.get()
    }
}

/// The gradient of a dipole's winding number, up to a factor, at a place from which it is at `r`.
fn slope_of(r: DVec3, moment: DVec3, soft: f64) -> DVec3 {
    let square = r.length_squared() + soft * soft;
    let cube = square * square.sqrt();
    (3.0 * moment.dot(r) / square * r - moment) / cube
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;
    use crate::sites::morton::morton_order;

    struct Sphere {
        /// In Morton order.
        points: Vec<DVec3>,
        spacing: Vec<f64>,
        /// Normals.
        outward: Vec<DVec3>,
    }

    fn sphere() -> Sphere {
        let mesh = sample("sphere").unwrap();
        let order = morton_order(&mesh.vertices);
        let points: Vec<DVec3> = order.iter().map(|i| mesh.vertices[*i as usize]).collect();
        let spacing = vec![(mesh.area() / points.len() as f64).sqrt(); points.len()];
        let outward = points.iter().map(|p| p.normalize()).collect();
        Sphere { points, spacing, outward }
    }

    #[test]
    fn all_points_are_visited_once_and_far_ones_together() {
        let points: Vec<DVec3> = (0..5000).map(|i| DVec3::new(f64::from(i), 0.0, 0.0)).collect();
        let (ones, pieces) = (vec![1.0; points.len()], vec![0; points.len()]);
        let dipoles = Dipoles { points: &points, spacing: &ones, pieces: &pieces };
        // Of moment 1 each, so that moments count points.
        let all: Vec<u32> = (0..points.len() as u32).collect();
        let runs = dipoles.hierarchy(&all, &vec![DVec3::X; points.len()]);
        for at in [DVec3::ZERO, DVec3::new(2500.0, 3.0, 0.0), DVec3::new(0.0, 1e6, 0.0)] {
            let (mut far, mut near) = (Vec::new(), Vec::new());
            runs.visit(at, |run| far.push(run.moment.x as usize), |i| near.push(i));
            assert_eq!(far.iter().sum::<usize>() + near.len(), points.len());
            assert!(far.len() < 60 && near.len() < 9 * RUN, "{} runs and {} points", far.len(), near.len());
            assert_eq!(near.is_empty(), at.y > 1e3);
        }
    }

    #[test]
    fn a_cap_of_a_sphere_that_points_inwards_is_turned() {
        let Sphere { points, spacing, outward } = sphere();
        let is_cap = |n: &DVec3| n.z > 0.6;
        let pieces: Vec<u32> = outward.iter().map(|n| u32::from(is_cap(n))).collect();
        let mut normals: Vec<DVec3> = outward.iter().map(|n| if is_cap(n) { -*n } else { *n }).collect();
        assert!(normals != outward);
        let dipoles = Dipoles { points: &points, spacing: &spacing, pieces: &pieces };
        dipoles.turn(&mut normals, &ProgressToken::default()).unwrap();
        assert_eq!(normals, outward);
    }

    #[test]
    fn strengths_after_turns_are_those_of_the_turned_pieces() {
        let Sphere { points, spacing, outward: mut normals } = sphere();
        let cap = |side: DVec3| -> Vec<u32> {
            (0..points.len() as u32).filter(|i| normals[*i as usize].dot(side) > 0.8).collect()
        };
        let pieces = [cap(DVec3::Z), cap(-DVec3::Z), cap(DVec3::X)];
        let dipoles = Dipoles { points: &points, spacing: &spacing, pieces: &[] };
        let progress = ProgressToken::default();
        let before = dipoles.strengths(&pieces, &normals, &progress).unwrap();
        let mut turned = pieces[..2].concat();
        turned.sort_unstable();
        let of_turned = dipoles.hierarchy(&turned, &normals);
        let after: Vec<Strength> =
            (0..3).map(|k| before[k].after(dipoles.pull(&pieces[k], &of_turned, &normals), k < 2)).collect();
        turned.iter().for_each(|i| normals[*i as usize] = -normals[*i as usize]);
        let afresh = dipoles.strengths(&pieces, &normals, &progress).unwrap();
        for k in 0..3 {
            let size = afresh[k].itself.abs();
            assert!((after[k].against - afresh[k].against).abs() < 0.01 * size, "piece {k}");
            assert!((after[k].against - before[k].against).abs() > 0.05 * size, "piece {k}");
            assert_eq!([before[k].is_inside_out(), afresh[k].is_inside_out()], [false, k < 2]);
        }
    }
}
