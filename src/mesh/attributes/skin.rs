//! Skins: the joints that move each vertex, the skeleton that they belong to, and its animations.

use std::sync::Arc;

use glam::DAffine3;

use crate::mesh::TriMesh;
use crate::mesh::correspondence::SurfacePoint;

/// The joints that a vertex follows, at most four.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Influences {
    /// Numbers of joints in the skin; 0 where the weight is 0.
    pub joints: [u16; 4],
    /// How much the vertex follows each joint; the largest weight is first, and the sum is 1.
    pub weights: [f32; 4],
}

/// The skin of a glTF file, which deforms the mesh as its skeleton moves. Several skins of a file are joined
/// into one. Of the formats written, GLB alone holds it.
#[derive(Debug, Clone, PartialEq)]
pub struct Skin {
    /// The influences on each vertex.
    pub vertices: Vec<Influences>,
    pub(crate) skeleton: Arc<Skeleton>,
}

/// Nodes that move, and how.
#[derive(Debug, PartialEq, Default)]
pub(crate) struct Skeleton {
    /// Parents come before their children.
    pub bones: Vec<Bone>,
    /// The bone of each joint, each another one.
    pub joints: Vec<u32>,
    /// For each joint, the transform from the mesh to the bone's own coordinates.
    pub inverse_bind: Vec<DAffine3>,
    pub animations: Vec<Animation>,
    /// The numbers of all animations, which channels may share.
    pub tracks: Vec<Track>,
}

/// A node, with its transform relative to its parent as glTF has it.
#[derive(Debug, PartialEq, Default)]
pub(crate) struct Bone {
    pub name: Option<String>,
    pub parent: Option<u32>,
    /// By columns; replaces the three below.
    pub matrix: Option<Box<[f64; 16]>>,
    pub translation: Option<Box<[f64; 3]>>,
    /// x, y, z, w.
    pub rotation: Option<Box<[f64; 4]>>,
    pub scale: Option<Box<[f64; 3]>>,
}

#[derive(Debug, PartialEq)]
pub(crate) struct Animation {
    pub name: Option<String>,
    pub channels: Vec<Channel>,
}

/// What one property of a bone does in an animation.
#[derive(Debug, PartialEq)]
pub(crate) struct Channel {
    pub bone: u32,
    /// `translation`, `rotation` or `scale`.
    pub path: &'static str,
    /// `LINEAR`, `STEP` or `CUBICSPLINE`.
    pub interpolation: &'static str,
    /// Indices into the skeleton's tracks.
    pub times: usize,
    pub values: usize,
}

#[derive(Debug, PartialEq)]
pub(crate) struct Track {
    /// Numbers of each element: 1, 3 or 4.
    pub components: usize,
    pub values: Vec<f32>,
}

impl Influences {
    /// A vertex that moves with one joint.
    pub(crate) fn rigid(joint: u16) -> Self {
        Self { joints: [joint, 0, 0, 0], weights: [1.0, 0.0, 0.0, 0.0] }
    }

    /// Adds up the weights of each joint, and keeps the four largest sums. `None` if no weight is positive.
    pub(crate) fn combined(parts: impl IntoIterator<Item = (u16, f64)>) -> Option<Self> {
        let mut sums: Vec<(u16, f64)> = Vec::with_capacity(12);
        for (joint, weight) in parts.into_iter().filter(|(_, weight)| *weight > 0.0) {
            match sums.iter_mut().find(|(own, _)| *own == joint) {
                Some((_, sum)) => *sum += weight,
                None => sums.push((joint, weight)),
            }
        }
        sums.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        sums.truncate(4);
        let total: f64 = sums.iter().map(|(_, weight)| weight).sum();
        let mut found = Self::default();
        let slots = found.joints.iter_mut().zip(&mut found.weights);
        for ((own_joint, own_weight), (joint, weight)) in slots.zip(&sums) {
            *own_weight = (weight / total) as f32;
            // Too little for f32 is nothing, and then the joint has to be 0.
            *own_joint = if *own_weight > 0.0 { *joint } else { 0 };
        }
        (found.weights[0] > 0.0).then_some(found)
    }

    /// The joints with a positive weight.
    pub fn iter(&self) -> impl Iterator<Item = (u16, f32)> {
        self.joints.into_iter().zip(self.weights).filter(|(_, weight)| *weight > 0.0)
    }
}

impl Skin {
    /// The number of joints.
    pub fn joint_count(&self) -> usize {
        self.skeleton.joints.len()
    }

    /// The number of animations that move the skeleton.
    pub fn animation_count(&self) -> usize {
        self.skeleton.animations.len()
    }

    /// The same skin on another mesh, whose vertices are at these points of `input`.
    pub(super) fn at(&self, input: &TriMesh, points: &[SurfacePoint]) -> Self {
        let vertices = points.iter().map(|point| {
            let corners = input.triangles[point.triangle as usize].map(|v| self.vertices[v as usize]);
            let parts = corners.iter().zip(point.barycentric).flat_map(|(corner, share)| {
                corner.iter().map(move |(joint, weight)| (joint, share * f64::from(weight)))
            });
            Influences::combined(parts).unwrap_or(corners[0])
        });
        Self { vertices: vertices.collect(), skeleton: self.skeleton.clone() }
    }
}
