//! A method of the same name for every field of [`Options`] and of its groups.

use super::{
    Centroid, Face, FeatureLines, Length, MeasureDepth, Method, Neighbours, Normals, Options, Projection,
    Refinement, Seeding, Shortage, Sizing, Symmetry,
};
use crate::io::Format;
use crate::mesh::correspondence::CorrespondenceRequest;
use glam::DVec3;

macro_rules! setters {
    ($owner:ident, |$options:ident| $place:expr; $($field:ident: $value:ty,)*) => {
        $(
            #[doc = concat!("Sets [`crate::options::", stringify!($owner), "::", stringify!($field), "`].")]
            #[must_use]
            pub fn $field(mut self, $field: $value) -> Self {
                let $options = &mut self;
                $place.$field = $field;
                self
            }
        )*
    };
}

impl Options {
    setters! {
        Options, |options| options;
        vertices: usize,
        method: Method,
        iterations: u32,
        tolerance: f64,
        seed: u64,
        weld: f64,
        min_component: f64,
        smooth_boundary: f64,
        smooth_spikes: bool,
        outer: bool,
        shortage: Shortage,
        measures: MeasureDepth,
        accuracy: f64,
        correspondence: CorrespondenceRequest,
    }

    setters! {
        CoarseToFineOptions, |options| options.coarse_to_fine;
        coarsest: usize,
        first_iterations: u32,
        coarse_iterations: u32,
        polish_rounds: u32,
        local: bool,
        fit: bool,
        min_angle: f64,
        feature_angle: f64,
        points: Vec<DVec3>,
        keep: Vec<u32>,
        keep_boundary: bool,
        fixed_half_edges: Vec<u32>,
        label_borders: Vec<u32>,
        smooth_labels: f64,
        may_give_up_fixed: bool,
        sizing: Sizing,
        refine: Vec<Refinement>,
        growth: f64,
    }

    setters! {
        AllAtOnceOptions, |options| options.all_at_once;
        face: Face,
        normals: Normals,
        projection: Projection,
        seeding: Seeding,
        neighbours: Neighbours,
        k_normal: u32,
        k_clip: u32,
        k_project: u32,
        centroid: Centroid,
        momentum: f64,
        lbfgs: u32,
        offset: f64,
    }

    /// Sets [`crate::Options::faces`].
    #[must_use]
    pub fn faces(mut self, faces: impl Into<Option<usize>>) -> Self {
        self.faces = faces.into();
        self
    }

    /// Sets [`crate::Options::fill_holes`].
    #[must_use]
    pub fn fill_holes(mut self, fill_holes: impl Into<Option<Length>>) -> Self {
        self.fill_holes = fill_holes.into();
        self
    }

    /// Sets [`crate::Options::format`].
    #[must_use]
    pub fn format(mut self, format: impl Into<Option<Format>>) -> Self {
        self.format = format.into();
        self
    }

    /// Sets [`crate::CoarseToFineOptions::features`].
    #[must_use]
    pub fn features(mut self, features: impl Into<Option<FeatureLines>>) -> Self {
        self.coarse_to_fine.features = features.into();
        self
    }

    /// Sets [`crate::CoarseToFineOptions::symmetric`].
    #[must_use]
    pub fn symmetric(mut self, symmetric: impl Into<Option<Symmetry>>) -> Self {
        self.coarse_to_fine.symmetric = symmetric.into();
        self
    }

    /// Sets [`crate::CoarseToFineOptions::min_edge`].
    #[must_use]
    pub fn min_edge(mut self, min_edge: impl Into<Option<Length>>) -> Self {
        self.coarse_to_fine.min_edge = min_edge.into();
        self
    }

    /// Sets [`crate::CoarseToFineOptions::max_edge`].
    #[must_use]
    pub fn max_edge(mut self, max_edge: impl Into<Option<Length>>) -> Self {
        self.coarse_to_fine.max_edge = max_edge.into();
        self
    }
}
