//! The distance from the surface through oriented points, on a sparse grid: at every node, the algebraic
//! sphere that fits the points around it best (Guennebaud and Gross 2007, "Algebraic point set surfaces", in
//! the closed form of Guennebaud, Germann and Gross 2008). Two sheets near each other are two spheres.

use glam::DVec3;
use rayon::prelude::*;

use super::sphere::{Sphere, Sums};
use crate::mesh::level_set::{BLOCK, BLOCK_NODES, SparseGrid};
use crate::{ProgressToken, Result};

/// Points count less if the cosine between their normal and that of the nearest point is below this.
const SAME_SIDE: f64 = 0.2;
/// Points do not count if the cosine between their normal and that of the nearest point is below this: they
/// are on the other side of a thin sheet.
const OTHER_SIDE: f64 = -0.2;
/// Points on the other side are a sheet of their own if they weigh at least this fraction of the nearest
/// sheet's points.
const SHARE: f64 = 0.1;
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
    /// Sheets with opposite normals are at least this many spacings apart.
    pub apart: f64,
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
    let reached = |i: usize| blocks_within(cloud.points[i] - origin, cloud.radius[i], side);
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
fn blocks_within(p: DVec3, radius: f64, side: f64) -> impl Iterator<Item = [i32; 3]> {
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

/// Sums over all points around a node, of whatever side. Across a sharp edge there are points, too.
#[derive(Clone, Copy, Default)]
struct Around {
    /// Of weights times radii.
    weight: f64,
    at: DVec3,
    normal: DVec3,
}

/// The nearest point of each node of a block, and the squared distance.
type Nearest = [(f64, u32); BLOCK_NODES];
/// The sums over a sheet's points, around each node of a block.
type Sheet = [Sums; BLOCK_NODES];

impl Block<'_> {
    fn fill(&self, values: &mut [f32], offsets: &mut [f32]) {
        let mut nearest: Nearest = [(f64::INFINITY, u32::MAX); BLOCK_NODES];
        self.for_each(|node, i, distance_sq, _| {
            if distance_sq < nearest[node].0 {
                nearest[node] = (distance_sq, i);
            }
        });
        let mut sheet: Sheet = [Sums::default(); BLOCK_NODES];
        let mut around = [Around::default(); BLOCK_NODES];
        let mut has_others = false;
        let Oriented { normals, radius, .. } = self.cloud;
        self.for_each(|node, i, distance_sq, at| {
            let share = self.share(i, distance_sq);
            let (radius, normal) = (radius[i as usize], normals[i as usize]);
            let cosine = normal.dot(normals[nearest[node].1 as usize]);
            let side = ((cosine - OTHER_SIDE) / (SAME_SIDE - OTHER_SIDE)).clamp(0.0, 1.0);
            has_others |= side == 0.0;
            around[node].add(share, radius, at, normal);
            sheet[node].add(side * share, radius, at, normal);
        });
        let mut spheres = [None; BLOCK_NODES];
        for (node, (distance_sq, i)) in nearest.into_iter().enumerate() {
            if i != u32::MAX && distance_sq < (self.cloud.reach * radius[i as usize]).powi(2) {
                let sphere = sheet[node].sphere();
                values[node] = (sphere.distance(DVec3::ZERO) / self.side) as f32;
                offsets[node] = around[node].offset() as f32;
                spheres[node] = Some(sphere);
            }
        }
        if has_others {
            self.add_other_sheets(&nearest, &sheet, &spheres, values);
        }
    }

    /// Where points with opposite normals are near, too, the nearest point alone does not tell which sheet a
    /// node is at: between random points there are gaps as wide as a thin sheet. So the object is inside
    /// the nearest sheet and one behind it, such as the other side of a plate, or inside one in front of it,
    /// across a slit.
    fn add_other_sheets(
        &self,
        nearest: &Nearest,
        own: &Sheet,
        spheres: &[Option<Sphere>; BLOCK_NODES],
        values: &mut [f32],
    ) {
        let Oriented { normals, spacing, radius, apart: least, .. } = self.cloud;
        let mut others: [Sheet; 2] = [[Sums::default(); BLOCK_NODES]; 2];
        let mut distances = [[0.0; BLOCK_NODES]; 2];
        self.for_each(|node, i, distance_sq, at| {
            let normal = normals[i as usize];
            let Some(sphere) = spheres[node] else { return };
            if normal.dot(normals[nearest[node].1 as usize]) < OTHER_SIDE {
                let share = self.share(i, distance_sq);
                let distance = sphere.distance(at) / spacing[i as usize];
                let which = usize::from(distance < 0.0);
                others[which][node].add(share, radius[i as usize], at, normal);
                distances[which][node] += share * distance.abs();
            }
        });
        for (node, (_, i)) in nearest.iter().enumerate().filter(|(node, _)| spheres[*node].is_some()) {
            let centre = own[node].at / own[node].weight;
            for (which, sign) in [1.0, -1.0].into_iter().enumerate() {
                let other = &others[which][node];
                if other.weight < SHARE * own[node].weight || distances[which][node] < least * other.weight {
                    continue;
                }
                let sphere = other.sphere();
                // Each must be on the same side of the other: single normals that are wrong make no sheet.
                if sign * sphere.distance(centre) > least * spacing[*i as usize] {
                    let value = (sphere.distance(DVec3::ZERO) / self.side) as f32;
                    values[node] = if sign > 0.0 { values[node].min(value) } else { values[node].max(value) };
                }
            }
        }
    }

    /// The weight of a point. Each stands for its own piece of the surface, so that density makes no
    /// difference.
    fn share(&self, i: u32, distance_sq: f64) -> f64 {
        let (radius, spacing) = (self.cloud.radius[i as usize], self.cloud.spacing[i as usize]);
        (1.0 - distance_sq / (radius * radius)).powi(4) * spacing * spacing
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

impl Around {
    fn add(&mut self, share: f64, radius: f64, at: DVec3, normal: DVec3) {
        self.weight += share * radius;
        self.at += share * at;
        self.normal += share * normal;
    }

    fn offset(&self) -> f64 {
        let Self { weight, at, normal } = self;
        at.reject_from_normalized(normal.normalize_or_zero()).length() / weight
    }
}
