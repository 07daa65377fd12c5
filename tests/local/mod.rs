//! Local operations on the host: remeshing, and mending small angles.

mod mend;
mod remesh;
mod split;
