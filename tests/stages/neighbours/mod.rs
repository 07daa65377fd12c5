//! Neighbours of sites.

pub mod knn;
pub mod lists;
