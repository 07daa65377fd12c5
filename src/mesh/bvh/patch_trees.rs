//! A tree for each patch of a surface: closest points among the triangles of one patch that face a direction.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::build::build;
use super::{Aabb, Bvh, Closest, Node, Tree, fit_boxes};
use crate::mesh::csr::Csr;

/// A box of unit normals that lies below a plane by this much holds none above it, however they are
/// rounded.
const BELOW: f32 = -1e-5;

/// The trees of all patches over the triangles of a [`Bvh`].
///
/// In the one tree over all triangles, a search that accepts few of them has nothing to compare boxes with
/// until it comes upon one, and looks at nearly everything where a surface has hundreds of patches.
#[derive(Debug, Clone)]
pub(crate) struct PatchTrees {
    trees: Vec<PatchTree>,
}

#[derive(Debug, Clone)]
struct PatchTree {
    nodes: Vec<Node>,
    /// Of the unit normals below each node.
    normals: Vec<NormalBox>,
    /// The triangles of the leaves, as ranks in [`Bvh::leaf_order`].
    ranks: Vec<u32>,
}

/// The smallest and the largest coordinates of unit normals.
#[derive(Debug, Clone, Copy)]
struct NormalBox {
    min: Vec3,
    max: Vec3,
}

impl NormalBox {
    const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    fn of(normal: DVec3) -> Self {
        let unit = normal.normalize_or_zero().as_vec3();
        if unit == Vec3::ZERO { Self::EMPTY } else { Self { min: unit, max: unit } }
    }

    fn join(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether none of the normals makes an acute angle with a unit vector.
    #[inline]
    fn is_below(&self, direction: Vec3) -> bool {
        (self.min * direction).max(self.max * direction).element_sum() < BELOW
    }
}

impl PatchTrees {
    /// Over the triangles of a tree, with the patch and the normal of each triangle. Panics if there are not
    /// as many of them.
    pub fn new(bvh: &Bvh, patches: &[u32], normals: &[DVec3]) -> Self {
        let count = patches.iter().max().map_or(0, |most| *most as usize + 1);
        let ranks = (0..).zip(bvh.leaf_order()).map(|(rank, t)| (patches[*t as usize], rank));
        let of_patch: Csr = Csr::group(count, ranks);
        let tree = |patch: u32| PatchTree::new(bvh, of_patch.of(patch), normals);
        Self { trees: (0..count as u32).into_par_iter().map(tree).collect() }
    }

    /// Like [`Bvh::closest_accepted`], among the triangles of a patch that `accept` holds for. It must hold
    /// for none whose normal makes no acute angle with `direction`.
    pub fn closest(
        &self,
        bvh: &Bvh,
        (p, direction): (DVec3, DVec3),
        patch: u32,
        rank: &mut usize,
        accept: impl Fn(u32) -> bool,
    ) -> Option<Closest> {
        let tree = self.trees.get(patch as usize)?;
        let facing = Facing { tree, direction: direction.normalize_or_zero().as_vec3() };
        bvh.search_tree(facing, p, rank, accept, [-1.0, f64::INFINITY])
    }
}

impl PatchTree {
    fn new(bvh: &Bvh, ranks: &[u32], normals: &[DVec3]) -> Self {
        let bounds = |rank: u32| Aabb::of(bvh.triangles[rank as usize].at);
        let (mut nodes, ranks) = build(ranks, bounds);
        fit_boxes(&mut nodes, |item| bounds(ranks[item]));
        let mut boxes = vec![NormalBox::EMPTY; nodes.len()];
        let normal = |rank: u32| NormalBox::of(normals[bvh.order[rank as usize] as usize]);
        // Children come after their parent.
        for k in (0..nodes.len()).rev() {
            let Node { start_or_skip, count, .. } = nodes[k];
            let at = start_or_skip as usize;
            boxes[k] = if count > 0 {
                let leaf = ranks[at..at + count as usize].iter();
                leaf.fold(NormalBox::EMPTY, |all, rank| all.join(normal(*rank)))
            } else {
                boxes[k + 1].join(boxes[k + at])
            };
        }
        Self { nodes, normals: boxes, ranks }
    }
}

/// The triangles of a patch that face a direction.
#[derive(Clone, Copy)]
struct Facing<'a> {
    tree: &'a PatchTree,
    direction: Vec3,
}

impl Tree for Facing<'_> {
    #[inline]
    fn nodes(&self) -> &[Node] {
        &self.tree.nodes
    }

    #[inline]
    fn rank(&self, item: usize) -> usize {
        self.tree.ranks[item] as usize
    }

    #[inline]
    fn is_left_out(&self, node: u32) -> bool {
        self.tree.normals[node as usize].is_below(self.direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;
    use crate::mesh::triangle::doubled_normal;
    use rand::{RngExt, SeedableRng};
    use std::cell::Cell;

    /// The hierarchy of a sample with its normals and patches: this many slices along an axis.
    fn sliced(name: &str, slices: u32) -> (Bvh, Vec<DVec3>, Vec<u32>) {
        let surface = sample(name).unwrap_or_default();
        let bvh = Bvh::new(&surface);
        let count = surface.triangles.len();
        let normals = (0..count).map(|t| doubled_normal(surface.corners(t))).collect();
        let Aabb { min, max } = bvh.bounds();
        let slice = |t: usize| {
            let [a, b, c] = surface.corners(t);
            let height = ((a + b + c) / 3.0 - min).z / (max - min).z;
            ((height * f64::from(slices)) as u32).min(slices - 1)
        };
        (bvh, normals, (0..count).map(slice).collect())
    }

    #[test]
    fn the_closest_point_of_a_patch_is_that_of_the_whole_tree() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(7);
        for name in ["genus3", "open-hemisphere", "box"] {
            let (bvh, normals, patches) = sliced(name, 9);
            let trees = PatchTrees::new(&bvh, &patches, &normals);
            let mut found = 0;
            for _ in 0..2000 {
                let mut coordinates = || DVec3::from_array([0, 1, 2].map(|_| random.random_range(-1.0..1.0)));
                let (p, direction) = (coordinates(), coordinates());
                let patch = random.random_range(0..10);
                let is_facing = |t: u32| normals[t as usize].dot(direction) > 0.0;
                let accept = |t: u32| patches[t as usize] == patch && is_facing(t);
                let mut ranks = [0; 2];
                let expected = bvh.closest_accepted(p, &mut ranks[0], accept);
                let closest = trees.closest(&bvh, (p, direction), patch, &mut ranks[1], accept);
                assert_eq!(closest, expected, "{name}");
                assert_eq!(ranks[0], ranks[1], "{name}");
                found += usize::from(closest.is_some());
            }
            assert!(found > 500, "{found} of {name}");
        }
    }

    #[test]
    fn a_search_looks_at_few_triangles_however_far_its_patch_is() {
        let (bvh, normals, patches) = sliced("genus3", 100);
        let trees = PatchTrees::new(&bvh, &patches, &normals);
        let Aabb { min, max } = bvh.bounds();
        let (looked_at, mut searches) = (Cell::new(0), 0);
        for patch in 0..100 {
            // At the other end of the surface.
            let p = if patch < 50 { max } else { min };
            for direction in [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y] {
                let accept = |t: u32| {
                    looked_at.set(looked_at.get() + 1);
                    patches[t as usize] == patch && normals[t as usize].dot(direction) > 0.0
                };
                trees.closest(&bvh, (p, direction), patch, &mut 0, accept);
                searches += 1;
            }
        }
        let mean = f64::from(looked_at.get()) / f64::from(searches);
        assert!(mean < 40.0, "{mean} of {} triangles", normals.len());
    }
}
