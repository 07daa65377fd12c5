//! The nearest sites of every site.

pub mod knn;
pub mod lists;
