//! Formats of values on a regular grid.

pub(crate) mod metaimage;
pub(crate) mod nifti;
pub(crate) mod npy;
pub(crate) mod nrrd;
pub(crate) mod raw;

use glam::{DAffine3, DVec3};

/// Values at the nodes of a regular grid: densities, distances, labels.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    /// Number of nodes along the first, second and third axis, each at least 2.
    pub size: [usize; 3],
    /// A value for each node, with the first axis varying fastest; NaN where there is none.
    pub values: Vec<f32>,
    /// Maps the three indices of a node to its position in space: spacing, orientation, origin.
    pub frame: DAffine3,
    /// What was left out of the file or assumed, one sentence each.
    pub notes: Vec<String>,
}

impl Volume {
    /// The index of a node's value.
    pub fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        x + self.size[0] * (y + self.size[1] * z)
    }

    /// The value at a node.
    pub fn at(&self, node: [usize; 3]) -> f32 {
        self.values[self.index(node)]
    }

    /// The distance between nodes along each axis.
    pub fn spacing(&self) -> DVec3 {
        let axes = self.frame.matrix3;
        DVec3::new(axes.x_axis.length(), axes.y_axis.length(), axes.z_axis.length())
    }

    /// The minimum and maximum finite value; `None` if there is none.
    pub fn range(&self) -> Option<[f32; 2]> {
        let finite = self.values.iter().filter(|value| value.is_finite());
        finite.fold(None, |range, value| match range {
            None => Some([*value; 2]),
            Some([low, high]) => Some([value.min(low), value.max(high)]),
        })
    }
}
