//! The boundary of the patches: the order of the sites along it, and the cells that reach it in between.

use super::walk::{Cell, CellOnBoundary, OnBoundary, Scene};
use glam::DVec3;
use serde::Serialize;
use std::collections::HashMap;

/// A segment of a curve between two of its sites that lies partly in the cell of a third one: too few sites
/// there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
pub struct Encroached {
    /// The sites at the ends of the segment, in the patch's counter-clockwise order.
    pub segment: [u32; 2],
    /// The site whose cell comes between.
    pub by: u32,
}

/// The sites on the boundary of the patches.
pub(crate) struct PatchBoundary<'a> {
    scene: &'a Scene<'a>,
    /// Sectors on each half-edge with their position along it, in order.
    on: HashMap<u32, Vec<(f64, u32)>>,
    /// The sector at the vertex that a half-edge leads to.
    at_end: HashMap<u32, u32>,
    /// The sectors after and before each one along the boundary.
    next: HashMap<u32, u32>,
    previous: HashMap<u32, u32>,
}

/// A stretch of a cell's outline that lies on the boundary of its patch.
pub(crate) struct BoundaryRun {
    /// The neighbours before and after it, counter-clockwise.
    pub neighbours: [u32; 2],
    /// Where it begins.
    from: OnBoundary,
    /// Whether the cell's own site lies on it.
    pub own: bool,
}

impl<'a> PatchBoundary<'a> {
    pub fn new(scene: &'a Scene<'a>) -> Self {
        let mut boundary = Self {
            scene,
            on: HashMap::new(),
            at_end: HashMap::new(),
            next: HashMap::new(),
            previous: HashMap::new(),
        };
        let sectors = &scene.sectors;
        for s in 0..sectors.len() {
            match sectors.ends[s] {
                Some([into, from]) if into == from => {
                    let position =
                        boundary.position_along(into, scene.sites.positions[sectors.site[s] as usize]);
                    boundary.on.entry(into).or_default().push((position, s as u32));
                }
                Some([into, _]) => {
                    boundary.at_end.insert(into, s as u32);
                }
                None => {}
            }
        }
        boundary
            .on
            .values_mut()
            .for_each(|list| list.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))));
        for s in 0..sectors.len() {
            let Some([into, from]) = sectors.ends[s] else { continue };
            let place =
                boundary.on.get(&into).and_then(|list| list.iter().position(|(_, t)| *t as usize == s));
            let next = match place.filter(|_| into == from) {
                Some(place) => boundary.first_at(from, place + 1),
                None => boundary.first_at(from, 0),
            };
            if let Some(next) = next.filter(|next| *next as usize != s) {
                boundary.next.insert(s as u32, next);
                boundary.previous.insert(next, s as u32);
            }
        }
        boundary
    }

    /// Whether there is no site on it.
    pub fn is_free(&self) -> bool {
        self.on.is_empty() && self.at_end.is_empty()
    }

    /// The sectors before and after one along the boundary.
    pub fn beside(&self, sector: usize) -> [Option<u32>; 2] {
        let s = sector as u32;
        [self.previous.get(&s).copied(), self.next.get(&s).copied()]
    }

    /// Position of a point along a half-edge, as the product with its vector.
    fn position_along(&self, half: u32, point: DVec3) -> f64 {
        let [a, b] = self.scene.surface.ends(half);
        (point - a).dot(b - a)
    }

    /// The first sector along the boundary from the given place among those on a half-edge.
    fn first_at(&self, half: u32, place: usize) -> Option<u32> {
        if let Some((_, s)) = self.on.get(&half).and_then(|list| list.get(place)) {
            return Some(*s);
        }
        let mut at = half;
        loop {
            if let Some(s) = self.at_end.get(&at) {
                return Some(*s);
            }
            at = self.scene.surface.next_on_boundary(at);
            if let Some((_, s)) = self.on.get(&at).and_then(|list| list.first()) {
                return Some(*s);
            }
            if at == half {
                return None;
            }
        }
    }

    /// The stretches of a cell's outline that lie on the boundary; false if some of them have no end.
    pub fn runs_of_cell(&self, sector: usize, cell: &Cell) -> (Vec<BoundaryRun>, bool) {
        let Some(on_boundary) = &cell.on_boundary else { return (Vec::new(), true) };
        let CellOnBoundary { exits, entries, half_edges } = &**on_boundary;
        let mut complete = exits.len() == entries.len();
        let mut runs = Vec::with_capacity(exits.len());
        for &from in exits {
            let mut half = from.half;
            let mut own = false;
            // A run touches no half-edge twice.
            let end = (0..*half_edges).find_map(|_| {
                let end = entries.iter().find(|to| to.half == half);
                own |= self.scene.sectors.ends[sector]
                    .is_some_and(|[into, from]| into == half && (from == half || end.is_none()));
                if end.is_none() {
                    half = self.scene.surface.next_on_boundary(half);
                }
                end
            });
            match end {
                Some(to) => runs.push(BoundaryRun { neighbours: [from.neighbour, to.neighbour], from, own }),
                None => complete = false,
            }
        }
        (runs, complete)
    }

    /// The sites before and after a run along its curve; `None` if the curve has no sites.
    pub fn segment(&self, run: &BoundaryRun) -> Option<[u32; 2]> {
        if self.is_free() {
            return None;
        }
        let position = self.position_along(run.from.half, run.from.point);
        let place =
            self.on.get(&run.from.half).map_or(0, |list| list.partition_point(|(p, _)| *p < position));
        let after = self.first_at(run.from.half, place)?;
        let before = self.previous.get(&after)?;
        Some([before, &after].map(|s| self.scene.sectors.site[*s as usize]))
    }
}
