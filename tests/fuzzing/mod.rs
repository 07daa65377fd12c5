//! What any bytes must do to the readers and to repair: the checks that `fuzz/` runs for hours and `replay` for
//! seconds.

pub mod reading;
pub mod repairing;
pub mod replay;
