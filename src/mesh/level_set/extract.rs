//! From the values of a grid to triangles, all blocks in parallel.

use glam::DVec3;
use rayon::prelude::*;

use super::cell::{CYCLES, LOW};
use super::grid::{BLOCK, BLOCK_NODES, SparseGrid};
use crate::mesh::TriMesh;
use crate::{Error, ProgressToken, Result};

/// Vertices keep this share of their edge away from its ends, where those of several edges would meet.
const CLEARANCE: f64 = 0.02;
/// Words of the bits of a block's edges, three for each node.
const WORDS: usize = 3 * BLOCK_NODES / 64;

/// Where on the grid a vertex stands: on the edge between two nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeVertex {
    /// Indices of both nodes among the grid's values.
    pub nodes: [u32; 2],
    /// How far along from the first, 0 to 1.
    pub share: f32,
}

impl EdgeVertex {
    /// Numbers at the nodes, interpolated.
    pub fn interpolated(&self, values: &[f32]) -> f32 {
        let [a, b] = self.nodes.map(|node| values[node as usize]);
        a + self.share * (b - a)
    }
}

/// A surface with the places of its vertices on the grid.
pub struct Extracted {
    /// The surface, outward where the field grows; manifold, and closed unless it meets cells with undefined
    /// values. Some vertices may be unused.
    pub mesh: TriMesh,
    /// Of the first vertices. Those behind them are in the middle of a cell; [`Extracted::centres`] has the
    /// vertices around each.
    pub on_edges: Vec<EdgeVertex>,
    /// Vertices around those in the middle of a cell.
    pub centres: Vec<Vec<u32>>,
}

impl Extracted {
    /// Numbers at the nodes as those of the vertices.
    pub fn interpolated(&self, values: &[f32]) -> Vec<f32> {
        let mut found: Vec<f32> = self.on_edges.par_iter().map(|on| on.interpolated(values)).collect();
        for around in &self.centres {
            let sum: f32 = around.iter().map(|v| found[*v as usize]).sum();
            found.push(sum / around.len() as f32);
        }
        found
    }
}

/// The zero surface of a grid's values. Cells with an undefined value have none.
///
/// # Errors
/// [`Error::Cancelled`]; [`Error::Input`] for more vertices than an index can count.
pub fn extract(grid: &SparseGrid, progress: &ProgressToken) -> Result<Extracted> {
    let ahead: Vec<Ahead> = grid.blocks().par_iter().map(|block| Ahead::of(grid, *block)).collect();
    let mut crossed: Vec<Crossed> =
        (0..ahead.len()).into_par_iter().map(|b| Crossed::of(grid, b, &ahead[b])).collect();
    progress.poll()?;
    let mut count = 0_u64;
    for block in &mut crossed {
        block.first = count as u32;
        count += block.edges().count() as u64;
    }
    if count >= u64::from(CENTRE) {
        let problem = format!("the grid has {count} vertices, more than an index can count");
        return Err(Error::input(None, problem, "use a coarser grid"));
    }
    let on_edges: Vec<EdgeVertex> = (0..ahead.len())
        .into_par_iter()
        .flat_map_iter(|b| crossed[b].edges().map(|edge| ahead[b].vertex(grid, b, edge)).collect::<Vec<_>>())
        .collect();
    let place = |on: &EdgeVertex| {
        let [a, b] = on.nodes.map(|node| grid.position_of(node));
        a.lerp(b, f64::from(on.share))
    };
    let mut vertices: Vec<DVec3> = on_edges.par_iter().map(place).collect();
    progress.poll()?;
    let pieces: Vec<Pieces> = (0..ahead.len())
        .into_par_iter()
        .map(|b| Pieces::of(grid, b, &ahead[b], &crossed, &vertices))
        .collect();
    progress.poll()?;
    let mut triangles = Vec::with_capacity(pieces.iter().map(|piece| piece.triangles.len()).sum());
    let mut centres = Vec::new();
    for piece in pieces {
        let first = (on_edges.len() + centres.len()) as u32;
        let index = |v: u32| if v >= CENTRE { first + (v - CENTRE) } else { v };
        triangles.extend(piece.triangles.iter().map(|corners| corners.map(index)));
        centres.extend(piece.centres);
    }
    for around in &centres {
        let sum: DVec3 = around.iter().map(|v| vertices[*v as usize]).sum();
        vertices.push(sum / around.len() as f64);
    }
    Ok(Extracted { mesh: TriMesh { vertices, triangles }, on_edges, centres })
}

/// A block with those that begin where it ends: bit 0 of an index stands for x, bit 1 for y, bit 2 for z.
struct Ahead([Option<u32>; 8]);

impl Ahead {
    fn of(grid: &SparseGrid, block: [i32; 3]) -> Self {
        let at = |bits: i32| [0, 1, 2].map(|axis| block[axis] + (bits >> axis & 1));
        Self(std::array::from_fn(|bits| grid.block(at(bits as i32)).map(|b| b as u32)))
    }

    /// The block and the number there of a node of this block or one step beyond it.
    fn node(&self, within: [i32; 3]) -> Option<(u32, usize)> {
        let bits = (0..3).fold(0, |bits, axis| bits | usize::from(within[axis] == BLOCK) << axis);
        let [x, y, z] = within.map(|c| (c % BLOCK) as usize);
        self.0[bits].map(|block| (block, x + 8 * (y + 8 * z)))
    }

    /// The index among all values.
    fn index(&self, within: [i32; 3]) -> Option<u32> {
        self.node(within).map(|(block, number)| block * BLOCK_NODES as u32 + number as u32)
    }

    /// The vertex on an edge: three times the number of its lower node, and the axis.
    fn vertex(&self, grid: &SparseGrid, b: usize, edge: usize) -> EdgeVertex {
        let low = (b * BLOCK_NODES + edge / 3) as u32;
        let high = self.index(beyond(edge)).unwrap_or(low);
        let [from, to] = [low, high].map(|node| f64::from(grid.values[node as usize]));
        let share = (from / (from - to)).clamp(CLEARANCE, 1.0 - CLEARANCE);
        EdgeVertex { nodes: [low, high], share: share as f32 }
    }
}

fn within(number: usize) -> [i32; 3] {
    [number & 7, number >> 3 & 7, number >> 6].map(|c| c as i32)
}

/// The upper node of an edge.
fn beyond(edge: usize) -> [i32; 3] {
    let mut node = within(edge / 3);
    node[edge % 3] += 1;
    node
}

/// The edges of a block that the surface crosses.
struct Crossed {
    bits: [u64; WORDS],
    /// The number of crossed edges before each word.
    before: [u16; WORDS],
    /// The index of the first vertex.
    first: u32,
}

impl Crossed {
    fn of(grid: &SparseGrid, b: usize, ahead: &Ahead) -> Self {
        let mut bits = [0_u64; WORDS];
        for edge in 0..3 * BLOCK_NODES {
            let value = grid.values[b * BLOCK_NODES + edge / 3];
            let Some(other) = ahead.index(beyond(edge)).filter(|_| !value.is_nan()) else { continue };
            let other = grid.values[other as usize];
            if !other.is_nan() && (value < 0.0) != (other < 0.0) {
                bits[edge / 64] |= 1 << (edge % 64);
            }
        }
        let mut before = [0_u16; WORDS];
        for word in 1..WORDS {
            before[word] = before[word - 1] + bits[word - 1].count_ones() as u16;
        }
        Self { bits, before, first: 0 }
    }

    fn edges(&self) -> impl Iterator<Item = usize> {
        (0..3 * BLOCK_NODES).filter(|edge| self.bits[edge / 64] >> (edge % 64) & 1 == 1)
    }

    /// The vertex on an edge that is crossed.
    fn vertex(&self, edge: usize) -> u32 {
        let below = self.bits[edge / 64] & ((1 << (edge % 64)) - 1);
        self.first + u32::from(self.before[edge / 64]) + below.count_ones()
    }
}

/// Vertices in the middle of a block's cells are numbered from here until all blocks are done.
const CENTRE: u32 = 0xff00_0000;

/// The triangles of a block's cells.
#[derive(Default)]
struct Pieces {
    triangles: Vec<[u32; 3]>,
    centres: Vec<Vec<u32>>,
}

impl Pieces {
    fn of(grid: &SparseGrid, b: usize, ahead: &Ahead, crossed: &[Crossed], vertices: &[DVec3]) -> Self {
        let mut pieces = Self::default();
        for number in 0..BLOCK_NODES {
            let low = within(number);
            let value = grid.values[b * BLOCK_NODES + number];
            if value.is_nan() {
                continue;
            }
            let corner = |bits: usize| [0, 1, 2].map(|axis| low[axis] + (bits >> axis & 1) as i32);
            let inside = (0..8).try_fold(0_usize, |inside, bits| {
                let value = grid.values[ahead.index(corner(bits))? as usize];
                (!value.is_nan()).then_some(inside | usize::from(value < 0.0) << bits)
            });
            for cycle in inside.map_or(&[][..], |inside| &CYCLES[inside]) {
                let on = |edge: &u8| {
                    let (block, number) = ahead.node(corner(LOW[*edge as usize].into()))?;
                    Some(crossed[block as usize].vertex(3 * number + usize::from(edge / 4)))
                };
                let around: Vec<u32> = cycle.edges.iter().filter_map(on).collect();
                pieces.add(around, cycle.needs_centre, vertices);
            }
        }
        pieces
    }

    /// Cuts a polygon into triangles.
    fn add(&mut self, around: Vec<u32>, needs_centre: bool, vertices: &[DVec3]) {
        let count = around.len();
        if needs_centre {
            let centre = CENTRE + self.centres.len() as u32;
            self.triangles.extend((0..count).map(|k| [centre, around[k], around[(k + 1) % count]]));
            self.centres.push(around);
            return;
        }
        let at = |k: usize| vertices[around[k % count] as usize];
        // From the corner with the shortest diagonals.
        let length = |k: usize| (k + 2..k + count - 1).map(|j| at(k).distance_squared(at(j))).sum::<f64>();
        let lengths = (0..count).map(|k| (length(k), k));
        let best = lengths.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0, |(_, k)| k);
        let fan = (1..count - 1).map(|k| [0, k, k + 1].map(|j| around[(best + j) % count]));
        self.triangles.extend(fan);
    }
}
