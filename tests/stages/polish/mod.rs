//! `polish/*` against the definitions of flips and relaxation.

pub mod fixture;
pub mod flip;
pub mod relax;
