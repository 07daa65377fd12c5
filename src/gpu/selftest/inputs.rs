//! What the kernels of the self-test compute with.

use glam::{UVec4, Vec4};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Elements; not a multiple of any workgroup, so that the last one is not full.
pub(super) const COUNT: usize = 250;
/// Words; whole workgroups of `selftest/subgroups`, which writes their places as bytes.
pub(super) const WORDS: usize = 256;

/// Pseudorandom numbers of moderate size, so that no result is far smaller than its terms.
pub(super) struct Inputs {
    /// `x` and `y` are positive. [`COUNT`] elements.
    pub numbers: Vec<Vec4>,
    /// Any words but 0.
    pub words: Vec<UVec4>,
}

impl Inputs {
    pub fn new() -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(7);
        let mut number = |from: f32, to: f32| from + (to - from) * rng.random::<f32>();
        let numbers = (0..COUNT)
            .map(|_| {
                let [x, y] = std::array::from_fn(|_| number(0.5, 3.0));
                let [z, w] = std::array::from_fn(|_| {
                    let size = number(0.25, 3.5);
                    if number(-1.0, 1.0) < 0.0 { -size } else { size }
                });
                Vec4::new(x, y, z, w)
            })
            .collect();
        let words = (0..WORDS)
            .map(|_| UVec4::from_array(std::array::from_fn(|_| rng.random::<u32>().max(1))))
            .collect();
        Self { numbers, words }
    }
}
