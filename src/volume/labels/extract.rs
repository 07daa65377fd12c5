//! From labels and their fields to triangles.

use std::collections::HashMap;

use glam::{DMat4, DVec3, DVec4};
use rayon::prelude::*;

use super::contract::drop_flat;
use super::fields::Fields;
use super::sharp::snapped;
use super::simplex::{Corners, PATHS, Piece, pieces};
use crate::io::Volume;
use crate::{Error, ProgressToken, Result};

/// All borders, places in units of nodes.
pub(super) struct Borders {
    pub vertices: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    /// The labels behind each triangle and in front of it.
    pub sides: Vec<[u32; 2]>,
    /// Which vertices lie on sharp edges.
    pub is_sharp: Vec<bool>,
}

/// A vertex by the nodes that it is between: the index of the lowest, and behind it in bits of three the
/// ways to the others, each along some of the axes.
type Key = u64;

/// The volume's nodes, with a layer of label 0 around them if `margin` is 1.
struct Grid<'a> {
    volume: &'a Volume,
    margin: usize,
    /// Nodes along each axis with the margin.
    size: [usize; 3],
}

/// A polygon between two labels.
struct Polygon {
    around: [Key; 4],
    count: usize,
    sides: [u32; 2],
}

/// # Errors
/// [`Error::Cancelled`]; [`Error::Input`] for more vertices than an index can count.
pub(super) fn extract(
    volume: &Volume,
    fields: &Fields,
    closed: bool,
    progress: &ProgressToken,
) -> Result<Borders> {
    let margin = usize::from(closed);
    let grid = Grid { volume, margin, size: volume.size.map(|length| length + 2 * margin) };
    let [nx, ny, nz] = grid.size;
    let of_row = |row: usize| {
        let mut found = Vec::new();
        for x in 0..nx - 1 {
            grid.polygons([x, row % (ny - 1), row / (ny - 1)], &mut found);
        }
        found
    };
    let polygons: Vec<Polygon> = (0..(ny - 1) * (nz - 1)).into_par_iter().flat_map_iter(of_row).collect();
    progress.poll()?;
    let mut keys: Vec<Key> =
        polygons.par_iter().flat_map_iter(|p| p.around[..p.count].iter().copied()).collect();
    keys.par_sort_unstable();
    keys.dedup();
    if u32::try_from(keys.len()).is_err() {
        let problem = format!("the borders have {} vertices, more than an index can count", keys.len());
        return Err(Error::input(None, problem, "use a coarser volume"));
    }
    progress.done(0.8)?;
    let (vertices, is_sharp): (Vec<DVec3>, Vec<bool>) =
        keys.par_iter().map(|key| grid.place(*key, fields)).unzip();
    let same = same_places(&vertices, &is_sharp);
    let number = |key: Key| same[keys.partition_point(|other| *other < key)];
    let of = |polygon: &Polygon| {
        let around = polygon.around.map(number);
        let sides = polygon.sides;
        (2..polygon.count).map(move |k| ([around[0], around[k - 1], around[k]], sides))
    };
    let (triangles, sides) = polygons.par_iter().flat_map_iter(of).unzip();
    let mut borders = Borders { vertices, triangles, sides, is_sharp };
    if borders.is_sharp.contains(&true) {
        let is_changed = borders.is_sharp.clone();
        drop_flat(&mut borders, &is_changed);
    }
    Ok(borders)
}

/// For each vertex the first one at its place, if it lies on a sharp edge, or else itself.
fn same_places(vertices: &[DVec3], is_sharp: &[bool]) -> Vec<u32> {
    let mut firsts = HashMap::new();
    let mut first = |v: u32| {
        let place = vertices[v as usize].to_array().map(f64::to_bits);
        if is_sharp[v as usize] { *firsts.entry(place).or_insert(v) } else { v }
    };
    (0..vertices.len() as u32).map(&mut first).collect()
}

/// A corner of a cell, whose bits say along which axes it is up.
fn corner(bits: u8) -> DVec3 {
    DVec3::new(f64::from(bits & 1), f64::from(bits >> 1 & 1), f64::from(bits >> 2))
}

impl Grid<'_> {
    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        x + self.size[0] * (y + self.size[1] * z)
    }

    /// Whether a node is not in the margin.
    fn is_within(&self, at: [usize; 3]) -> bool {
        (0..3).all(|axis| at[axis].wrapping_sub(self.margin) < self.volume.size[axis])
    }

    /// The coordinates in the volume of a node that is not in the margin.
    fn coordinates(&self, index: usize) -> [usize; 3] {
        let [nx, ny, _] = self.size;
        [index % nx, index / nx % ny, index / nx / ny].map(|c| c - self.margin)
    }

    fn label(&self, at: [usize; 3]) -> u32 {
        if self.is_within(at) { self.volume.at(at.map(|c| c - self.margin)) as u32 } else { 0 }
    }

    /// Adds the polygons of a cell.
    fn polygons(&self, cell: [usize; 3], found: &mut Vec<Polygon>) {
        let at = |bits: u8| [0, 1, 2].map(|axis| cell[axis] + usize::from(bits >> axis & 1));
        let labels: [u32; 8] = std::array::from_fn(|bits| self.label(at(bits as u8)));
        if labels.iter().all(|label| *label == labels[0]) {
            return;
        }
        for path in PATHS {
            let own = path.map(|bits| labels[usize::from(bits)]);
            for piece in pieces(own) {
                // Nodes in the margin do not count, which puts what is there on the volume's border.
                let key = |corners: Corners| {
                    let own = (0..4).filter(|k| corners >> k & 1 == 1).map(|k| path[k]);
                    let mut bits = own.filter(|bits| self.is_within(at(*bits)));
                    let low = bits.next().unwrap_or_default();
                    let ways = bits.enumerate().map(|(k, bits)| u64::from(bits ^ low) << (3 * k));
                    (self.index(at(low)) as u64) << 9 | ways.sum::<u64>()
                };
                let sides = piece.sides.map(|corner| own[usize::from(corner)]);
                let turned = looks_to_first(piece, path) == (sides[0] > sides[1]);
                let sides = [sides[0].max(sides[1]), sides[0].min(sides[1])];
                found.extend(Polygon::new(&piece.around.map(key)[..piece.count], turned, sides));
            }
        }
    }

    /// Where the fields of the labels of a vertex's nodes are equal, or the place on a sharp edge next to it;
    /// and whether it is on a sharp edge.
    fn place(&self, key: Key, fields: &Fields) -> (DVec3, bool) {
        let low = (key >> 9) as usize;
        let ways = [key & 7, key >> 3 & 7, key >> 6 & 7].into_iter().take_while(|way| *way > 0);
        let step = |way: u64| {
            let along = |axis: usize| (way >> axis & 1) as usize;
            along(0) + self.size[0] * (along(1) + self.size[1] * along(2))
        };
        let nodes = std::iter::once(low).chain(ways.map(|way| low + step(way)));
        let nodes: Vec<[usize; 3]> = nodes.map(|index| self.coordinates(index)).collect();
        let shares = balance(fields, &nodes, self.volume);
        let place = |at: &[usize; 3]| DVec3::from_array(at.map(|c| c as f64));
        let smooth = nodes.iter().zip(shares).map(|(at, share)| share * place(at)).sum();
        let middle = nodes.iter().map(place).sum::<DVec3>() / nodes.len() as f64;
        let sharp = snapped(&fields.sharp, self.volume.size, &nodes, middle);
        (sharp.unwrap_or(smooth), sharp.is_some())
    }
}

impl Polygon {
    /// The polygon around these vertices, or the other way round, each counted once; `None` if too few are
    /// left.
    fn new(around: &[Key], turned: bool, sides: [u32; 2]) -> Option<Self> {
        let mut own = [0; 4];
        let mut count = 0;
        for (k, key) in around.iter().enumerate() {
            if !around[..k].contains(key) {
                own[count] = *key;
                count += 1;
            }
        }
        if turned {
            own[..count].reverse();
        }
        (count > 2).then_some(Self { around: own, count, sides })
    }
}

/// Vertices keep this share away from nodes.
const CLEARANCE: f64 = 0.02;

/// The shares of one to four nodes of different labels in the place between them where the labels' fields,
/// linear between nodes, are equal.
fn balance(fields: &Fields, nodes: &[[usize; 3]], volume: &Volume) -> [f64; 4] {
    let count = nodes.len();
    // Of the label of one node, at another.
    let field = |row: usize, column: usize| {
        let label = volume.at(nodes[row]) as u32;
        let node = volume.index(nodes[column]) as u32;
        fields.at(label, node).map_or(if row == column { 0.5 } else { -0.5 }, f64::from)
    };
    // The first row is the sum of shares; the others are differences of fields, which vanish.
    let mut matrix = DMat4::IDENTITY;
    for column in 0..count {
        matrix.col_mut(column)[0] = 1.0;
        for row in 1..count {
            matrix.col_mut(column)[row] = field(row, column) - field(0, column);
        }
    }
    let shares = (matrix.inverse() * DVec4::X).to_array();
    let sum: f64 = shares[..count].iter().sum();
    let mut clear = [0.0; 4];
    for k in 0..count {
        let share = shares[k] / sum;
        clear[k] = if share.is_finite() { share.clamp(CLEARANCE, 1.0) } else { 1.0 };
    }
    let sum: f64 = clear.iter().sum();
    clear.map(|share| share / sum)
}

/// Whether a polygon's normal points to the first of its sides.
fn looks_to_first(piece: &Piece, path: [u8; 4]) -> bool {
    let at = |corners: Corners| {
        let own = (0..4).filter(|k| corners >> k & 1 == 1);
        own.clone().map(|k| corner(path[k])).sum::<DVec3>() / own.count() as f64
    };
    let [a, b, c] = [0, 1, 2].map(|k| at(piece.around[k]));
    let [first, second] = piece.sides.map(|k| corner(path[usize::from(k)]));
    (b - a).cross(c - a).dot(first - second) > 0.0
}
