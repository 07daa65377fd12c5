//! A volume with fewer values, for a surface that must be there early.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use crate::io::Volume;
use crate::progress::ProgressReporter;
use crate::{ProgressToken, Result};

/// Makes a surface with `run`, which is told the step; if that must finish early, makes it of every `step`-th
/// node along each axis, so that about `few` values are left.
pub(super) fn surface_or_coarse<T: Send>(
    reporter: &mut ProgressReporter,
    volume: &Volume,
    few: f64,
    run: impl Fn(&Volume, usize, &ProgressToken) -> Result<T> + Sync,
) -> Result<T> {
    let step = step_for(volume, few);
    if step == 1 {
        return reporter.during(|token| run(volume, 1, token));
    }
    let rough = |token: &ProgressToken| run(&every(volume, step), step, token);
    reporter.during(|token| token.or_rough(|token| run(volume, 1, token), rough))
}

/// The volume with every `step`-th node along each axis, where it has as many, and the last.
fn every(volume: &Volume, step: usize) -> Volume {
    let steps = volume.size.map(|count| step.min(count - 1).max(1));
    let size: [usize; 3] = std::array::from_fn(|k| (volume.size[k] - 1) / steps[k] + 1);
    let value = |i: usize| {
        let node = [i % size[0], i / size[0] % size[1], i / size[0] / size[1]];
        volume.at(std::array::from_fn(|k| node[k] * steps[k]))
    };
    let scale = DAffine3::from_scale(DVec3::from_array(steps.map(|step| step as f64)));
    Volume {
        size,
        values: (0..size.iter().product()).into_par_iter().map(value).collect(),
        frame: volume.frame * scale,
        notes: volume.notes.clone(),
    }
}

/// The step with which [`every`] leaves about this many values.
fn step_for(volume: &Volume, values: f64) -> usize {
    (volume.values.len() as f64 / values).cbrt().round().max(1.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_of_a_coarse_volume_are_where_they_were() {
        let size = [7, 2, 12];
        let values: Vec<f32> = (0..7 * 2 * 12).map(|i| i as f32).collect();
        let frame = DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0)) * DAffine3::from_rotation_z(1.0);
        let fine = Volume { size, values, frame, notes: vec!["a".to_owned()] };
        for (step, wanted) in [(1, size), (2, [4, 2, 6]), (3, [3, 2, 4]), (50, [2, 2, 2])] {
            let coarse = every(&fine, step);
            assert_eq!(coarse.size, wanted);
            for z in 0..wanted[2] {
                for x in 0..wanted[0] {
                    let value = coarse.at([x, 1, z]) as usize;
                    let node = [value % 7, value / 7 % 2, value / 14];
                    let place = |volume: &Volume, [x, y, z]: [usize; 3]| {
                        volume.frame.transform_point3(DVec3::new(x as f64, y as f64, z as f64))
                    };
                    assert!(place(&coarse, [x, 1, z]).distance(place(&fine, node)) < 1e-12);
                }
            }
        }
        assert_eq!(step_for(&fine, 21.0), 2);
        assert_eq!(step_for(&fine, 1e9), 1);
    }
}
