//! Volumes: surfaces through values on a grid.

mod border;
mod coarse;
mod grid;
mod iso;
mod labels;
mod noise;
mod several;
mod specks;

pub use iso::{Inside, IsoOptions, IsoSurface, iso_surface, iso_surface_with_progress};
pub use labels::{
    LABEL_BEFORE, LABEL_BEHIND, LabelOptions, LabelSurface, MOST_LABEL, label_surface,
    label_surface_with_progress,
};
pub use several::ISO;
pub(crate) use several::{JoinedSurfaces, check_values, join, settle_values};
