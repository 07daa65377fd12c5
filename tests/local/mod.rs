//! Local operations on the host: remeshing, and mending small angles.

mod mend;
mod mend_ragged;
mod remesh;
mod split;
