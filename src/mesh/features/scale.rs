//! The angle and the spacing that features are searched for with.

/// The options in the frame and units of the search.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    /// Degrees.
    pub feature: f64,
    /// In the unit-diagonal frame.
    pub spacing: f64,
}
