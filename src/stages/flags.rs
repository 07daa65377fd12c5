//! Flags of a site, numbered as in `glsl/common/flags.glsl`.

use serde::Serialize;

/// How many sites have each flag.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[non_exhaustive]
pub struct FlagCounts {
    /// More dual triangles than #T: no face.
    pub triangle_overflow: usize,
    /// More planes than #P: no face.
    pub plane_overflow: usize,
    /// More corners than a face can store: no face.
    pub corner_overflow: usize,
    /// Clipping that did not close: no face.
    pub badly_closed: usize,
    /// The k nearest did not reach the radius of security: completed with all sites.
    pub security_missed: usize,
    /// Another site at the same position: told apart by index.
    pub coincident: usize,
    /// The face reaches the cube that its cell started from, as at the tip of a spike.
    pub unbounded: usize,
    /// No plane fits the neighbours, or it stands more than 37 degrees off the surface: the surface's normal
    /// was taken.
    pub surface_normal_taken: usize,
    /// Completing the face overflowed, or took more attempts than there are: it is clipped by its k
    /// neighbours only.
    pub incomplete: usize,
    /// The shadow sites of others clip the whole face away: the site stays where it is.
    pub hidden: usize,
    /// The walk over the surface was stopped after as many triangles as it may visit: the site is where it
    /// was then. Not a bit of the flags, but a mark that the walk leaves.
    pub walk_stopped: usize,
}

impl FlagCounts {
    /// Counts the bits.
    pub fn of(flags: &[u32]) -> Self {
        let count = |bit: u32| flags.iter().filter(|f| *f & bit != 0).count();
        Self {
            triangle_overflow: count(1),
            plane_overflow: count(2),
            corner_overflow: count(4),
            badly_closed: count(8),
            security_missed: count(16),
            coincident: count(32),
            unbounded: count(64),
            surface_normal_taken: count(128),
            incomplete: count(256),
            hidden: count(512),
            walk_stopped: 0,
        }
    }
}
