//! One test binary; each module says what belongs in it.

mod distance;
mod intersections;
mod measure;
mod quality;
mod shapes;
mod topology;
