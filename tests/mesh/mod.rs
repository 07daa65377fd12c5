//! Geometry on the host, with known answers.

pub mod attributes;
pub mod correspondence;
pub mod cracks;
pub mod distance;
pub mod features;
pub mod fill_holes;
pub mod follow;
pub mod hausdorff;
pub mod hidden_components;
pub mod intersections;
pub mod level_set;
pub mod narrow_facets;
pub mod quality;
pub mod repair;
pub mod repair_with_tolerances;
pub mod samples;
pub mod simplify;
pub mod smooth_boundary;
pub mod smooth_spikes;
pub mod subdivide;
pub mod topology;
