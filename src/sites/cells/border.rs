//! The border of the patches: which sites follow each other along it, and which cells reach it in between.

use super::sectors::after;
use super::walk::{Cell, OnBorder, Scene};
use glam::DVec3;
use serde::Serialize;
use std::collections::HashMap;

/// A stretch of a curve between two of its sites that reaches into the cell of a third one: too few sites there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
pub struct Encroached {
    /// The sites at the ends of the stretch, in the order in which the patch has them counter-clockwise.
    pub segment: [u32; 2],
    /// The site whose cell comes between.
    pub by: u32,
}

/// The sites on the border.
pub(crate) struct Border<'a> {
    scene: &'a Scene<'a>,
    /// Sectors on each half-edge with their way from its start, in order.
    on: HashMap<u32, Vec<(f64, u32)>>,
    /// The sector at the vertex that a half-edge leads to.
    at_end: HashMap<u32, u32>,
    /// The sectors that follow each one along the border and come before it.
    next: HashMap<u32, u32>,
    previous: HashMap<u32, u32>,
}

/// A stretch of a cell's boundary that lies on the border.
pub(crate) struct Run {
    /// The neighbours before and after it, counter-clockwise.
    pub neighbours: [u32; 2],
    /// Where it begins.
    from: OnBorder,
    /// Whether the cell's own site lies on it.
    pub own: bool,
}

impl<'a> Border<'a> {
    pub fn new(scene: &'a Scene<'a>) -> Self {
        let mut border = Self {
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
                    let way = border.way(into, scene.sites.positions[sectors.site[s] as usize]);
                    border.on.entry(into).or_default().push((way, s as u32));
                }
                Some([into, _]) => {
                    border.at_end.insert(into, s as u32);
                }
                None => {}
            }
        }
        border.on.values_mut().for_each(|list| list.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))));
        for s in 0..sectors.len() {
            let Some([into, from]) = sectors.ends[s] else { continue };
            let place = border.on.get(&into).and_then(|list| list.iter().position(|(_, t)| *t as usize == s));
            let next = match place.filter(|_| into == from) {
                Some(place) => border.first_at(from, place + 1),
                None => border.first_at(from, 0),
            };
            if let Some(next) = next.filter(|next| *next as usize != s) {
                border.next.insert(s as u32, next);
                border.previous.insert(next, s as u32);
            }
        }
        border
    }

    /// Whether no site stands on it.
    pub fn is_free(&self) -> bool {
        self.on.is_empty() && self.at_end.is_empty()
    }

    /// The sectors that come before and after one along the border.
    pub fn beside(&self, sector: usize) -> [Option<u32>; 2] {
        let s = sector as u32;
        [self.previous.get(&s).copied(), self.next.get(&s).copied()]
    }

    /// How far along a half-edge a point lies.
    fn way(&self, half: u32, point: DVec3) -> f64 {
        let [a, b] = self.scene.surface.ends(half);
        (point - a).dot(b - a)
    }

    /// The first sector along the border from the given place among those on a half-edge.
    fn first_at(&self, half: u32, place: usize) -> Option<u32> {
        if let Some((_, s)) = self.on.get(&half).and_then(|list| list.get(place)) {
            return Some(*s);
        }
        let mut at = half;
        loop {
            if let Some(s) = self.at_end.get(&at) {
                return Some(*s);
            }
            at = self.scene.surface.border_after(at);
            if let Some((_, s)) = self.on.get(&at).and_then(|list| list.first()) {
                return Some(*s);
            }
            if at == half {
                return None;
            }
        }
    }

    /// The stretches of a cell that lie on the border; false if some of them do not end.
    pub fn runs(&self, sector: usize, cell: &Cell) -> (Vec<Run>, bool) {
        let mut sound = cell.exits.len() == cell.entries.len();
        let mut runs = Vec::with_capacity(cell.exits.len());
        for &from in &cell.exits {
            let mut half = from.half;
            let mut own = false;
            // A run touches no half-edge twice.
            let end = (0..cell.border_halves).find_map(|_| {
                let end = cell.entries.iter().find(|to| to.half == half);
                own |= self.scene.sectors.ends[sector]
                    .is_some_and(|[into, from]| into == half && (from == half || end.is_none()));
                if end.is_none() {
                    half = self.scene.surface.border_after(half);
                }
                end
            });
            match end {
                Some(to) => runs.push(Run { neighbours: [from.neighbour, to.neighbour], from, own }),
                None => sound = false,
            }
        }
        (runs, sound)
    }

    /// The stretch of the curve that a cell's run lies in, if it is not the cell's own; `None` if no site is on it.
    pub fn segment(&self, run: &Run) -> Option<[u32; 2]> {
        if self.is_free() {
            return None;
        }
        let way = self.way(run.from.half, run.from.point);
        let place = self.on.get(&run.from.half).map_or(0, |list| list.partition_point(|(w, _)| *w < way));
        let after = self.first_at(run.from.half, place)?;
        let before = self.previous.get(&after)?;
        Some([before, &after].map(|s| self.scene.sectors.site[*s as usize]))
    }
}

impl super::CellSurface<'_> {
    /// The half-edge that follows one along the border of its patch.
    fn border_after(&self, half: u32) -> u32 {
        let mut half = after(half);
        while !self.is_border(half) {
            half = after(self.twins[half as usize]);
        }
        half
    }
}
