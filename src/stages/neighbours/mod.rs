//! Nearest neighbours of the sites.

pub mod knn;
pub mod lists;
