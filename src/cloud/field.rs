//! The distance from the surface through oriented points, on a sparse grid: at every node, the algebraic
//! sphere that fits the points around it best (Guennebaud and Gross 2007, "Algebraic point set surfaces", in
//! the closed form of Guennebaud, Germann and Gross 2008).

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::level_set::{BLOCK, BLOCK_NODES, SparseGrid};
use crate::{ProgressToken, Result};

/// Points whose normal has a smaller cosine with that of the nearest point count less,
const SAME_SIDE: f64 = 0.2;
/// and none below this: they are on the other side of a thin sheet.
const OTHER_SIDE: f64 = -0.2;
/// Blocks that a thread does at a time.
const CHUNK: usize = 4;

/// Points with outward normals of length 1.
pub(super) struct Oriented<'a> {
    pub points: &'a [DVec3],
    pub normals: &'a [DVec3],
    /// The distance between points near each.
    pub spacing: &'a [f64],
    /// The radius of each one's weight.
    pub radius: &'a [f64],
    /// The field is defined where a point is closer than this share of its radius.
    pub reach: f64,
}

/// A grid with the signed distance, and what else is known at its nodes.
pub(super) struct Field {
    pub grid: SparseGrid,
    /// How far the centre of the points around a node is from it, along the surface and in radii of their
    /// weights: 0 inside of even points, about 0.24 where they end on one side.
    pub offset: Vec<f32>,
}

/// The field around all points on a grid with this distance of nodes.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn field(cloud: &Oriented, side: f64, progress: &ProgressToken) -> Result<Field> {
    // Not at a point of symmetry, where values would be exactly 0.
    let origin = DVec3::splat(-0.5) + side * DVec3::new(0.137, 0.291, 0.419);
    let reached = |i: usize| reached(cloud.points[i] - origin, cloud.radius[i], side);
    let mut pairs: Vec<([i32; 3], u32)> = (0..cloud.points.len())
        .into_par_iter()
        .flat_map_iter(|i| reached(i).map(move |block| (block, i as u32)))
        .collect();
    pairs.par_sort_unstable_by_key(|([x, y, z], i)| (*z, *y, *x, *i));
    progress.poll()?;
    let mut blocks: Vec<[i32; 3]> = pairs.iter().map(|(block, _)| *block).collect();
    blocks.dedup();
    let mut grid = SparseGrid::new(origin, side, blocks);
    let mut offset = vec![f32::NAN; grid.values.len()];
    let lists: Vec<&[([i32; 3], u32)]> = pairs.chunk_by(|a, b| a.0 == b.0).collect();
    let corners: Vec<DVec3> =
        grid.blocks().iter().map(|block| grid.position(block.map(|c| BLOCK * c))).collect();
    let chunks = (grid.values.par_chunks_mut(CHUNK * BLOCK_NODES))
        .zip(offset.par_chunks_mut(CHUNK * BLOCK_NODES))
        .zip(lists.par_chunks(CHUNK).zip(corners.par_chunks(CHUNK)))
        .enumerate();
    let total = lists.len() as f64;
    chunks.try_for_each(|(chunk, ((values, offsets), (lists, corners)))| {
        progress.done((chunk * CHUNK) as f64 / total)?;
        let blocks = values.chunks_mut(BLOCK_NODES).zip(offsets.chunks_mut(BLOCK_NODES));
        for ((values, offsets), (list, corner)) in blocks.zip(lists.iter().zip(corners)) {
            Block { corner: *corner, side, cloud, list }.fill(values, offsets);
        }
        Ok(())
    })?;
    Ok(Field { grid, offset })
}

/// The blocks whose nodes a ball reaches; `p` is relative to node 0, 0, 0.
fn reached(p: DVec3, radius: f64, side: f64) -> impl Iterator<Item = [i32; 3]> {
    let block = |x: f64| (x / side).floor() as i32;
    let low = (p - radius).to_array().map(|x| block(x).div_euclid(BLOCK));
    let high = (p + radius).to_array().map(|x| block(x).div_euclid(BLOCK));
    let all = (low[2]..=high[2])
        .flat_map(move |z| (low[1]..=high[1]).flat_map(move |y| (low[0]..=high[0]).map(move |x| [x, y, z])));
    all.filter(move |at| {
        let first = side * DVec3::from_array(at.map(|c| f64::from(BLOCK * c)));
        let last = first + f64::from(BLOCK - 1) * side;
        (first - p).max(p - last).max(DVec3::ZERO).length_squared() <= radius * radius
    })
}

/// A block of nodes and the points that reach them.
struct Block<'a> {
    corner: DVec3,
    side: f64,
    cloud: &'a Oriented<'a>,
    list: &'a [([i32; 3], u32)],
}

/// Weighted sums over the points around a node, relative to it.
#[derive(Clone, Copy, Default)]
struct Sums {
    weight: f64,
    radius: f64,
    at: DVec3,
    normal: DVec3,
    /// Of products of places and normals, and of places with themselves.
    flux: f64,
    square: f64,
    around: Around,
}

/// Sums over all points around a node, of whatever side. Across a sharp edge there are points, too.
#[derive(Clone, Copy, Default)]
struct Around {
    /// Of weights times radii.
    weight: f64,
    at: DVec3,
    normal: DVec3,
}

impl Block<'_> {
    fn fill(&self, values: &mut [f32], offsets: &mut [f32]) {
        let mut nearest = [(f64::INFINITY, u32::MAX); BLOCK_NODES];
        self.for_each(|node, i, distance_sq, _| {
            if distance_sq < nearest[node].0 {
                nearest[node] = (distance_sq, i);
            }
        });
        let mut sums = [Sums::default(); BLOCK_NODES];
        let Oriented { normals, spacing, radius, .. } = self.cloud;
        self.for_each(|node, i, distance_sq, at| {
            let i = i as usize;
            let normal = normals[i];
            let cosine = normal.dot(normals[nearest[node].1 as usize]);
            let side = ((cosine - OTHER_SIDE) / (SAME_SIDE - OTHER_SIDE)).clamp(0.0, 1.0);
            let falloff = (1.0 - distance_sq / (radius[i] * radius[i])).powi(4);
            // Each point stands for its own piece of the surface, so that density makes no difference.
            let share = falloff * spacing[i] * spacing[i];
            let weight = side * share;
            let sum = &mut sums[node];
            sum.around.weight += share * radius[i];
            sum.around.at += share * at;
            sum.around.normal += share * normal;
            sum.weight += weight;
            sum.radius += weight * radius[i];
            sum.at += weight * at;
            sum.normal += weight * normal;
            sum.flux += weight * at.dot(normal);
            sum.square += weight * at.length_squared();
        });
        for (node, (sums, (distance_sq, i))) in sums.iter().zip(nearest).enumerate() {
            if i != u32::MAX && distance_sq < (self.cloud.reach * radius[i as usize]).powi(2) {
                values[node] = (sums.distance() / self.side) as f32;
                offsets[node] = sums.offset() as f32;
            }
        }
    }

    /// Calls `visit` with each node and each point that reaches it, the squared distance, and the point's
    /// place relative to the node.
    fn for_each(&self, mut visit: impl FnMut(usize, u32, f64, DVec3)) {
        for (_, i) in self.list {
            let p = self.cloud.points[*i as usize] - self.corner;
            let radius = self.cloud.radius[*i as usize];
            let clamp = |x: f64| x.clamp(0.0, f64::from(BLOCK)) as usize;
            let low = ((p - radius) / self.side).ceil().to_array().map(clamp);
            let high = ((p + radius) / self.side + 1.0).floor().to_array().map(clamp);
            for z in low[2]..high[2] {
                for y in low[1]..high[1] {
                    let at_row = p - self.side * DVec3::new(0.0, y as f64, z as f64);
                    for x in low[0]..high[0] {
                        let at = at_row - DVec3::new(self.side * x as f64, 0.0, 0.0);
                        let distance_sq = at.length_squared();
                        if distance_sq < radius * radius {
                            visit(x + 8 * (y + 8 * z), *i, distance_sq, at);
                        }
                    }
                }
            }
        }
    }
}

impl Sums {
    /// The signed distance of the node from the sphere, positive outside.
    fn distance(&self) -> f64 {
        let centre = self.at / self.weight;
        let normal = self.normal / self.weight;
        let radius = self.radius / self.weight;
        let spread = self.square / self.weight - centre.length_squared();
        let bend = 0.5 * (self.flux / self.weight - centre.dot(normal)) / spread.max(f64::MIN_POSITIVE);
        // A sphere smaller than the weights' own radius comes from noise, and its other side is near.
        let bend = if spread > 0.0 { bend.clamp(-0.5 / radius, 0.5 / radius) } else { 0.0 };
        let slope = normal - 2.0 * bend * centre;
        let value = -slope.dot(centre) - bend * self.square / self.weight;
        let root = (slope.length_squared() - 4.0 * bend * value).max(0.0).sqrt();
        2.0 * value / (slope.length() + root).max(f64::MIN_POSITIVE)
    }

    fn offset(&self) -> f64 {
        let Around { weight, at, normal } = self.around;
        at.reject_from_normalized(normal.normalize_or_zero()).length() / weight
    }
}
