//! Sharp edges of boxes. Smooth fields round them off, and bulge beside them, though flat faces of many nodes
//! that meet at a right angle are no stairs of something smooth: of those, one of two faces that meet is a
//! single node wide.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::band::Band;
use super::extract::Borders;
use crate::mesh::half_edges::EdgeTable;

/// Both faces at a sharp edge are flat for at least this many nodes away from it, and the edge is as long.
const FLAT: usize = 5;
/// This many nodes on either side of an edge have the distances of a box: the band's depth, and one more that
/// second differences reach.
const BESIDE: usize = 3;
/// Nodes whose distance from the border is less than this have one of the other side next to them, possibly
/// along a diagonal.
const NEXT: f32 = 1.3;
/// The cosine of the angle between the normals of faces at a sharp edge is less than this.
const COSINE: f64 = 0.5;

/// Cells through which sharp edges pass, by their lowest nodes: along which axes they do, as bits.
pub(super) type Cells = HashMap<u32, u8>;

/// A straight sharp edge along an axis.
struct Run {
    axis: usize,
    /// The lowest of the four nodes around its first node's length.
    low: [usize; 3],
    length: usize,
    /// Whether it ends where sharp edges along other axes do, or at the volume's border; on either side.
    is_bounded: [bool; 2],
}

/// One label in a volume.
struct Shape<'a, I> {
    size: [usize; 3],
    band: &'a Band,
    is_inside: &'a I,
}

/// The sharp edges of a label. Nodes next to them get the distances of a box, and are fixed.
pub(super) fn fix(band: &mut Band, size: [usize; 3], is_inside: impl Fn(usize) -> bool + Sync) -> Cells {
    let shape = Shape { size, band, is_inside: &is_inside };
    let runs = shape.runs();
    let mut fixed: Vec<usize> = runs.iter().flat_map(|run| shape.beside(run)).collect();
    let mut cells = Cells::new();
    for run in &runs {
        shape.cells(run).for_each(|cell| *cells.entry(cell).or_default() |= 1 << run.axis);
    }
    fixed.sort_unstable();
    fixed.dedup();
    for number in fixed {
        let distance = &mut band.distance[number];
        *distance = if distance.abs() < NEXT { 0.5_f32 } else { 1.5 }.copysign(*distance);
        band.is_fixed[number] = true;
    }
    cells
}

impl<I: Fn(usize) -> bool + Sync> Shape<'_, I> {
    fn index(&self, at: [usize; 3]) -> usize {
        at[0] + self.size[0] * (at[1] + self.size[1] * at[2])
    }

    fn coordinates(&self, node: u32) -> [usize; 3] {
        let [nx, ny, _] = self.size;
        let node = node as usize;
        [node % nx, node / nx % ny, node / nx / ny]
    }

    /// Whether the node so far from another is inside; what is beyond the volume's border is as at it.
    fn is_inside(&self, at: [usize; 3], by: [isize; 3]) -> bool {
        let near = |axis: usize| at[axis].saturating_add_signed(by[axis]).min(self.size[axis] - 1);
        (self.is_inside)(self.index([0, 1, 2].map(near)))
    }

    /// Of the four nodes around a sharp edge along an axis, the one on a side of its own; none if there is no
    /// such edge.
    fn odd(&self, low: [usize; 3], axis: usize) -> Option<u8> {
        let across = [(axis + 1) % 3, (axis + 2) % 3];
        if across.iter().any(|a| low[*a] + 1 >= self.size[*a]) {
            return None;
        }
        let at = |steps: [isize; 2]| {
            let mut by = [0; 3];
            by[across[0]] = steps[0];
            by[across[1]] = steps[1];
            self.is_inside(low, by)
        };
        let around = [[0, 0], [1, 0], [0, 1], [1, 1]].map(at);
        let side = match around.iter().filter(|inside| **inside).count() {
            1 => true,
            3 => false,
            _ => return None,
        };
        let odd = around.iter().position(|inside| *inside == side)? as isize;
        let own = [odd & 1, odd >> 1];
        // Away from the edge.
        let away = own.map(|step| 2 * step - 1);
        let is_flat = |k: usize| {
            let other = 1 - k;
            (1..FLAT as isize).all(|steps| {
                let mut there = own;
                there[k] += steps * away[k];
                let mut beyond = there;
                beyond[other] -= away[other];
                at(there) == side && at(beyond) != side
            })
        };
        (is_flat(0) && is_flat(1)).then_some(odd as u8)
    }

    /// Straight sharp edges that end at sharp edges along other axes, or at the volume's border. Others are
    /// of curved rims, which are not straight for long.
    fn runs(&self) -> Vec<Run> {
        let next: Vec<u32> = (self.band.nodes.iter().zip(&self.band.distance))
            .filter_map(|(node, distance)| (distance.abs() < NEXT).then_some(*node))
            .collect();
        let mut runs: Vec<Run> = (0..3).flat_map(|axis| self.runs_along(axis, &next)).collect();
        let mut ends: HashMap<[usize; 3], u8> = HashMap::new();
        for run in &runs {
            run.end_cells(self.size)
                .into_iter()
                .flatten()
                .for_each(|c| *ends.entry(c).or_default() |= 1 << run.axis);
        }
        for run in &mut runs {
            let is_bounded = |cell: [usize; 3]| ends.get(&cell).is_some_and(|axes| axes.count_ones() > 1);
            run.is_bounded = run.end_cells(self.size).map(|cell| cell.is_none_or(is_bounded));
        }
        runs.retain(|run| run.is_bounded.contains(&true));
        runs
    }

    fn runs_along(&self, axis: usize, next: &[u32]) -> Vec<Run> {
        let of = |node: &u32| self.odd(self.coordinates(*node), axis).map(|odd| (*node, odd));
        let squares: HashMap<u32, u8> = next.par_iter().filter_map(of).collect();
        let stride = [1, self.size[0], self.size[0] * self.size[1]][axis] as u32;
        let is_on = |node: Option<u32>, odd: u8| node.is_some_and(|node| squares.get(&node) == Some(&odd));
        let mut firsts: Vec<(u32, u8)> = squares.iter().map(|(node, odd)| (*node, *odd)).collect();
        firsts.retain(|(node, odd)| {
            self.coordinates(*node)[axis] == 0 || !is_on(node.checked_sub(stride), *odd)
        });
        firsts.sort_unstable();
        let run = |(node, odd): (u32, u8)| {
            let low = self.coordinates(node);
            let most = self.size[axis] - low[axis];
            let goes_on = |steps: &usize| is_on(node.checked_add(*steps as u32 * stride), odd);
            let length = (0..most).take_while(goes_on).count();
            (length >= FLAT).then_some(Run { axis, low, length, is_bounded: [false; 2] })
        };
        firsts.into_iter().filter_map(run).collect()
    }

    /// The numbers in the band of the nodes next to an edge, and around its ends where it is bounded.
    fn beside(&self, run: &Run) -> Vec<usize> {
        let ranges: [_; 3] = std::array::from_fn(|axis| {
            let (before, length) = match axis == run.axis {
                false => (BESIDE - 1, 2 * BESIDE),
                true => {
                    let [first, last] = run.is_bounded.map(|is_bounded| if is_bounded { BESIDE } else { 0 });
                    (first, first + run.length + last)
                }
            };
            // Not beyond the border.
            let first = run.low[axis] as isize - before as isize;
            let last = (first + length as isize).min(self.size[axis] as isize);
            first.max(0) as usize..last.max(0) as usize
        });
        let [x, y, z] = ranges;
        let mut found = Vec::new();
        for at_z in z {
            for at_y in y.clone() {
                let nodes = x.clone().map(|at_x| self.index([at_x, at_y, at_z]) as u32);
                found.extend(nodes.filter_map(|node| self.band.nodes.binary_search(&node).ok()));
            }
        }
        found
    }

    /// The cells through which an edge passes, up to bounded ends.
    fn cells(&self, run: &Run) -> impl Iterator<Item = u32> {
        let [before, after] = run.is_bounded;
        let first = run.low[run.axis] as isize - isize::from(before);
        let count = run.length - 1 + usize::from(before) + usize::from(after);
        let cells =
            (first..first + count as isize).filter(|at| (0..self.size[run.axis] as isize - 1).contains(at));
        cells.map(|at| {
            let mut low = run.low;
            low[run.axis] = at as usize;
            self.index(low) as u32
        })
    }
}

impl Run {
    /// The cells beyond its first and its last node; none where the volume ends.
    fn end_cells(&self, size: [usize; 3]) -> [Option<[usize; 3]>; 2] {
        let at = |along: Option<usize>| {
            let mut cell = self.low;
            cell[self.axis] = along?;
            Some(cell)
        };
        let last = self.low[self.axis] + self.length - 1;
        [at(self.low[self.axis].checked_sub(1)), at((last + 1 < size[self.axis]).then_some(last))]
    }
}

/// The place on a sharp edge for a vertex between these nodes at `place`, if one passes through a cell that
/// has them all.
pub(super) fn snapped(cells: &Cells, size: [usize; 3], nodes: &[[usize; 3]], place: DVec3) -> Option<DVec3> {
    let low: [usize; 3] = std::array::from_fn(|a| nodes.iter().map(|node| node[a]).min().unwrap_or(0));
    let is_wide: [bool; 3] = std::array::from_fn(|a| nodes.iter().any(|node| node[a] != low[a]));
    let mut found: Option<(u32, DVec3)> = None;
    for bits in 0..8_usize {
        let steps = [0, 1, 2].map(|a| bits >> a & 1);
        if (0..3).any(|a| steps[a] > 0 && (is_wide[a] || low[a] == 0)) {
            continue;
        }
        let cell = [0, 1, 2].map(|a| low[a] - steps[a]);
        let index = cell[0] + size[0] * (cell[1] + size[1] * cell[2]);
        let Some(axes) = cells.get(&(index as u32)) else { continue };
        let is_along = |axis: usize| *axes == 1 << axis;
        let at = |axis: usize| {
            if is_along(axis) { (2.0 * place[axis]).round() / 2.0 } else { cell[axis] as f64 + 0.5 }
        };
        // Corners come first.
        let count = axes.count_ones();
        if found.is_none_or(|(other, _)| count > other) {
            found = Some((count, DVec3::from_array([0, 1, 2].map(at))));
        }
    }
    found.map(|(_, place)| place)
}

/// Half-edges `3 * triangle + k` along sharp edges.
pub(super) fn half_edges(borders: &Borders) -> Vec<u32> {
    if !borders.is_sharp.contains(&true) {
        return Vec::new();
    }
    let normal = |t: usize| {
        let [a, b, c] = borders.triangles[t].map(|v| borders.vertices[v as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    };
    let edges = EdgeTable::new(&borders.triangles);
    let mut found = Vec::new();
    for edge in edges.edges() {
        let [one, other] = edge else { continue };
        let ends = <[u32; 2]>::from(one.ends()).map(|v| v as usize);
        let along = borders.vertices[ends[1]] - borders.vertices[ends[0]];
        let is_straight = along.to_array().iter().filter(|length| **length != 0.0).count() == 1;
        if ends.iter().all(|v| borders.is_sharp[*v])
            && is_straight
            && normal(one.triangle()).dot(normal(other.triangle())).abs() < COSINE
        {
            found.push(one.corners().0 as u32);
        }
    }
    found
}
