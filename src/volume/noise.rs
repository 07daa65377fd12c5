//! Noise that gives an isosurface more handles than can be removed one by one: the values are smoothed.

use glam::DVec3;
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::RangeInclusive;

use super::grid::Field;
use super::iso::Inside;
use super::specks::without_specks;
use crate::TriMesh;
use crate::io::Volume;
use crate::mesh::handles::many_handles;
use crate::mesh::level_set::extract;
use crate::mesh::topology::topology;
use crate::{ProgressToken, Result};

/// Maximum number of times that the values are smoothed.
const MOST_ROUNDS: usize = 3;
/// Handles may be noise if there is a speck for at least this fraction of them.
const SPECKS: f64 = 0.1;
/// They are noise if smoothing leaves at most this fraction of them, makes no more specks, and keeps the
/// volume within [`VOLUMES`]: struts that are too thin for it would be lost.
const LEFT: f64 = 0.5;
/// The enclosed volume after smoothing, over that before.
const VOLUMES: RangeInclusive<f64> = 0.75..=1.35;
/// Weights of the values up to two nodes away along an axis: those of a binomial distribution whose standard
/// deviation is the distance between nodes.
const WEIGHTS: [f64; 3] = [6.0, 4.0, 1.0];

/// An isosurface in units of nodes.
pub(super) struct Extracted {
    pub mesh: TriMesh,
    /// Components left out as specks.
    pub specks: usize,
    /// How often the values were smoothed before.
    pub smoothings: usize,
}

/// What is extracted from a volume.
#[derive(Clone, Copy)]
pub(super) struct Extraction {
    pub iso: f32,
    /// The side that is inside, as chosen.
    pub inside: Inside,
    pub closed: bool,
    /// Whether specks are kept.
    pub keeps_specks: bool,
    /// Whether values may be smoothed.
    pub smooths: bool,
}

impl Extraction {
    /// The isosurface without specks; of smoothed values if it has too many handles that are noise.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn without_noise(&self, volume: &Volume, progress: &ProgressToken) -> Result<Extracted> {
        let mut volume = Cow::Borrowed(volume);
        let mut best = self.of(&volume, progress)?;
        while self.smooths && best.smoothings < MOST_ROUNDS {
            let Some(handles) = many_handles(&best.mesh) else { break };
            if (best.specks as f64) < SPECKS * handles as f64 {
                break;
            }
            volume = Cow::Owned(smoothed(&volume, progress)?);
            let next = self.of(&volume, progress)?;
            let left = topology(&next.mesh).genus.unwrap_or(0) as f64;
            let centre = 0.5 * DVec3::from_array(volume.size.map(|nodes| nodes as f64));
            let [before, after] = [&best.mesh, &next.mesh].map(|mesh| enclosed(mesh, centre));
            let is_noise = left <= LEFT * handles as f64
                && next.specks <= best.specks
                && VOLUMES.contains(&(after / before));
            if !is_noise {
                break;
            }
            best = Extracted { smoothings: best.smoothings + 1, ..next };
        }
        Ok(best)
    }

    fn of(&self, volume: &Volume, progress: &ProgressToken) -> Result<Extracted> {
        let Self { iso, inside, closed, keeps_specks, .. } = *self;
        let sign = if inside == Inside::Above { -1.0 } else { 1.0 };
        let grid = Field { volume, iso, sign, closed }.grid();
        progress.done(0.4)?;
        let mesh = extract(&grid, progress)?.mesh;
        let (mesh, specks) = if keeps_specks { (mesh, 0) } else { without_specks(mesh) };
        Ok(Extracted { mesh, specks, smoothings: 0 })
    }
}

/// The volume that a mesh encloses; of an open one, with the cone from its boundary to the centre.
fn enclosed(mesh: &TriMesh, centre: DVec3) -> f64 {
    let of = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(|p| p - centre);
        a.dot(b.cross(c)) / 6.0
    };
    (0..mesh.triangles.len()).map(of).sum()
}

/// The volume with each value averaged with those around it, over a node in standard deviation. Values that
/// are not finite stay, and nothing is averaged across them or the border, so that linear values stay, too.
fn smoothed(volume: &Volume, progress: &ProgressToken) -> Result<Volume> {
    let mut values = Cow::Borrowed(&volume.values);
    let mut stride = 1;
    for length in volume.size {
        progress.poll()?;
        let of = |i: usize| {
            if !values[i].is_finite() {
                return values[i];
            }
            let at = i / stride % length;
            let reach = at.min(length - 1 - at).min(WEIGHTS.len() - 1);
            let (mut sum, mut total) = (WEIGHTS[0] * f64::from(values[i]), WEIGHTS[0]);
            for (step, weight) in WEIGHTS.iter().enumerate().take(reach + 1).skip(1) {
                let pair = [values[i - step * stride], values[i + step * stride]];
                if !pair.iter().all(|value| value.is_finite()) {
                    break;
                }
                sum += weight * pair.map(f64::from).iter().sum::<f64>();
                total += 2.0 * weight;
            }
            (sum / total) as f32
        };
        values = Cow::Owned((0..values.len()).into_par_iter().map(of).collect());
        stride *= length;
    }
    let (size, frame, notes) = (volume.size, volume.frame, volume.notes.clone());
    Ok(Volume { size, values: values.into_owned(), frame, notes })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DAffine3;

    fn volume(size: [usize; 3], value: impl Fn(usize) -> f32) -> Volume {
        let values = (0..size.iter().product()).map(value).collect();
        Volume { size, values, frame: DAffine3::IDENTITY, notes: Vec::new() }
    }

    #[test]
    fn smoothing_spreads_one_value_binomially_and_leaves_planes_alone() {
        let size = [9, 8, 7];
        let node = |[x, y, z]: [usize; 3]| x + 9 * (y + 8 * z);
        let one = smoothed(&volume(size, |i| f32::from(i == node([4, 4, 3]))), &ProgressToken::default());
        let one = one.unwrap();
        for (at, wanted) in [([4, 4, 3], 216.0), ([5, 4, 3], 144.0), ([6, 5, 2], 16.0), ([7, 4, 3], 0.0)] {
            assert!((one.values[node(at)] - wanted / 4096.0).abs() < 1e-7, "{at:?}");
        }
        let plane = volume(size, |i| (i % 9) as f32);
        let smooth = smoothed(&plane, &ProgressToken::default()).unwrap();
        for (i, value) in smooth.values.iter().enumerate() {
            assert!((value - plane.values[i]).abs() < 1e-6, "node {i}");
        }
    }

    #[test]
    fn values_that_are_not_finite_stay_and_spread_nowhere() {
        let holes = volume([5, 1, 1], |i| if i == 2 { f32::NAN } else { f32::MAX });
        let smooth = smoothed(&holes, &ProgressToken::default()).unwrap();
        for (i, value) in smooth.values.iter().enumerate() {
            assert!(if i == 2 { value.is_nan() } else { *value == f32::MAX }, "node {i}: {value}");
        }
    }
}
