//! Properties that readers and repair keep whatever bytes they get: `fuzz/` checks them for hours, `replay`
//! for seconds.

pub mod images;
pub mod reading;
pub mod references;
pub mod repairing;
pub mod replay;
