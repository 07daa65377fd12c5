//! One test binary; each module says what belongs in it.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]

mod cells;
mod cells_curves;
mod cli;
mod cli_bad;
mod cli_inspect;
mod coarsen;
mod connect;
mod curve_sites;
mod distance;
mod fit;
mod generators;
mod gpu_layer;
mod intersections;
mod io;
mod io_bad;
mod kernels_curves;
mod kernels_face;
mod kernels_lists;
mod kernels_move;
mod kernels_neighbours;
mod kernels_normals;
mod kernels_planar;
mod kernels_settle;
mod kernels_sort;
mod kernels_surface;
mod measure;
mod polish;
mod properties;
mod quality;
mod reference;
mod repair;
mod repair_more;
mod runs;
mod runs_curves;
mod runs_default;
mod samples;
mod shapes;
mod shapes_of_faces;
mod skeleton;
mod spots;
mod support;
mod topology;
