//! Pieces of a surface whose sign their neighbours leave open, turned so that together they enclose a volume.
//!
//! The winding number of a closed surface is constant on both sides of it. So across a piece of it, that of
//! all others grows against the outward normal, by as much as that of the piece itself falls: a piece across
//! which both grow the same way is inside out. Each point stands for a dipole (Barill et al. 2018, "Fast
//! winding numbers for soups and clouds"), and runs of points far away for one.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;

use crate::{ProgressToken, Result};

/// Points in a run; they follow each other in Morton order.
const RUN: usize = 32;
/// Runs nearer than this many times their radius are taken point by point.
const NEAR: f64 = 3.0;
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

/// Many points as one.
struct Run {
    centre: DVec3,
    radius: f64,
    moment: DVec3,
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
        for _ in 0..ROUNDS {
            let runs = self.runs(normals);
            let judged: Vec<f64> = members
                .par_iter()
                .skip(1)
                .map(|own| {
                    progress.poll()?;
                    Ok(self.against(own, normals, &runs))
                })
                .collect::<Result<_>>()?;
            let mut turned = false;
            for (own, against) in members.iter().skip(1).zip(judged) {
                if against > ENOUGH {
                    own.iter().for_each(|i| normals[*i as usize] = -normals[*i as usize]);
                    turned = true;
                }
            }
            if !turned {
                break;
            }
        }
        Ok(())
    }

    fn runs(&self, normals: &[DVec3]) -> Vec<Run> {
        let run = |(first, points): (usize, &[DVec3])| {
            let centre = points.iter().sum::<DVec3>() / points.len() as f64;
            let radius = points.iter().map(|p| p.distance(centre)).fold(0.0, f64::max);
            let moment = (first * RUN..first * RUN + points.len()).map(|i| self.moment(i, normals)).sum();
            Run { centre, radius, moment }
        };
        self.points.par_chunks(RUN).enumerate().map(run).collect()
    }

    fn moment(&self, i: usize, normals: &[DVec3]) -> DVec3 {
        self.spacing[i] * self.spacing[i] * normals[i]
    }

    /// How strongly the other points speak against the normals of a piece, relative to its own strength.
    fn against(&self, own: &[u32], normals: &[DVec3], runs: &[Run]) -> f64 {
        let step = own.len().div_ceil(SAMPLES);
        let (mut all, mut itself) = (0.0, 0.0);
        for i in own.iter().step_by(step).map(|i| *i as usize) {
            // Near dipoles would drown the others out.
            let soft = self.spacing[i] * SOFT.max(SOFT_SHARE * (own.len() as f64).sqrt());
            let at = self.points[i];
            let mut slope = DVec3::ZERO;
            for (k, run) in runs.iter().enumerate() {
                let near = run.centre.distance_squared(at) < (NEAR * run.radius).powi(2);
                if !near {
                    slope += slope_of(run.centre - at, run.moment, soft);
                    continue;
                }
                for j in k * RUN..self.points.len().min((k + 1) * RUN) {
                    slope += slope_of(self.points[j] - at, self.moment(j, normals), soft);
                }
            }
            let moment = self.moment(i, normals);
            all += moment.dot(slope);
            let own_slope =
                |j: &u32| slope_of(self.points[*j as usize] - at, self.moment(*j as usize, normals), soft);
            itself += moment.dot(own.iter().map(own_slope).sum());
        }
        (all - itself) / itself.abs().max(f64::MIN_POSITIVE)
    }
}

/// The gradient of a dipole's winding number, up to a factor, at a place from which it is at `r`.
fn slope_of(r: DVec3, moment: DVec3, soft: f64) -> DVec3 {
    let square = r.length_squared() + soft * soft;
    let cube = square * square.sqrt();
    (3.0 * moment.dot(r) / square * r - moment) / cube
}
