//! `fit/*` against the definition of the fit, and all of it against the fit on the host.

pub mod equations;
pub mod inward;
pub mod limit;
pub mod samples;
pub mod whole;
