//! Fans: the neighbours of every site in cyclic order.

use crate::mesh::chunks::{begins, par_concat, par_map_chunks};
use glam::Vec2;
use rayon::prelude::*;

/// Counter-clockwise neighbours of every site, or of every sector of sites on curves.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Fans {
    pub(crate) start: Vec<u32>,
    pub(crate) neighbours: Vec<u32>,
    /// The site of each sector; empty if sites and sectors are the same.
    sites: Vec<u32>,
    /// Whether the fan begins and ends at a curve; empty if none does.
    open: Vec<bool>,
}

impl Fans {
    /// From one list a site.
    pub fn from_lists<L: AsRef<[u32]>>(lists: impl IntoIterator<Item = L>) -> Self {
        let mut fans = Self { start: vec![0], ..Self::default() };
        for list in lists {
            fans.neighbours.extend_from_slice(list.as_ref());
            fans.start.push(fans.neighbours.len() as u32);
        }
        fans
    }

    /// From parts of the lists, in their order.
    pub(crate) fn from_parts(parts: Vec<FansPart>) -> Self {
        let (neighbours, mut ends): (Vec<Vec<u32>>, Vec<Vec<u32>>) =
            parts.into_iter().map(|part| (part.neighbours, part.counts)).unzip();
        ends.par_iter_mut().zip(begins(&neighbours)).for_each(|(counts, mut end)| {
            for count in counts {
                end += *count;
                *count = end;
            }
        });
        ends.insert(0, vec![0]);
        Self { start: par_concat(&ends), neighbours: par_concat(&neighbours), ..Self::default() }
    }

    /// From one list of sectors a sector. `sites` has the site of each; where it is `open`, a curve runs from
    /// the last of the list through the site to the first, with the surface on its left.
    pub fn of_sectors<L: AsRef<[u32]>>(
        lists: impl IntoIterator<Item = L>,
        sites: Vec<u32>,
        open: Vec<bool>,
    ) -> Self {
        Self { sites, open, ..Self::from_lists(lists) }
    }

    /// Number of sites or sectors.
    pub fn len(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The fan of one site or sector. Panics if it is out of range.
    pub fn of(&self, sector: usize) -> &[u32] {
        &self.neighbours[self.start[sector] as usize..self.start[sector + 1] as usize]
    }

    /// The site of a sector.
    pub fn site(&self, sector: u32) -> u32 {
        self.sites.get(sector as usize).copied().unwrap_or(sector)
    }

    /// Whether the fan begins and ends at a curve.
    pub fn is_open(&self, sector: u32) -> bool {
        self.open.get(sector as usize).copied().unwrap_or(false)
    }

    /// Whether a curve runs along `slot`, which is one of `from`'s, so that there is no face to its left.
    pub(crate) fn is_outside(&self, from: u32, slot: usize) -> bool {
        self.is_open(from) && slot + 1 == self.start[from as usize + 1] as usize
    }

    /// Only the edges that both ends list. Entries that are not a site, or are the site itself, such as those
    /// of the bounding box of an unbounded face, are also removed.
    pub(crate) fn symmetric(&self) -> Self {
        let lists = |i: u32, j: u32| (j as usize) < self.len() && i != j && self.of(j as usize).contains(&i);
        let parts = par_map_chunks(self.len(), |range| {
            let mut part = FansPart::default();
            for i in range {
                let begin = part.neighbours.len();
                for &j in self.of(i) {
                    // A neighbour that bounds two stretches of a degenerate face counts once.
                    if lists(i as u32, j) && !part.neighbours[begin..].contains(&j) {
                        part.neighbours.push(j);
                    }
                }
                part.counts.push((part.neighbours.len() - begin) as u32);
            }
            part
        });
        Self { sites: self.sites.clone(), open: self.open.clone(), ..Self::from_parts(parts) }
    }

    /// The triangles of closed fans that agree: of the three sites of each, one is followed in every fan by
    /// the next in the other's. In the order that [`super::connect::connect`] has.
    pub(crate) fn triangles(&self) -> Vec<[u32; 3]> {
        let parts = par_map_chunks(self.len(), |range| {
            let mut triangles: Vec<[u32; 3]> = Vec::with_capacity(2 * range.len());
            for i in range {
                let (fan, i) = (self.of(i), i as u32);
                let pairs = fan.iter().zip(fan[1..].iter().chain(&fan[..1]));
                // Each is seen from all three, and taken from the first.
                let own = pairs.filter(|(j, k)| i < **j && i < **k);
                triangles.extend(own.map(|(j, k)| [i, *j, *k]));
            }
            triangles
        });
        par_concat(&parts)
    }
}

/// The fans of a part of the sites.
#[derive(Default)]
pub(crate) struct FansPart {
    pub neighbours: Vec<u32>,
    /// How many of them each site has.
    pub counts: Vec<u32>,
}

/// The sites behind the edges of a face, without those behind an edge shorter than a tenth of the face's
/// radius: its two corners are one cluster (Sect. 4.4). Four nearly co-circular sites then leave a face of
/// four corners, where rounding and the different tangent planes could let both diagonals stand.
///
/// `corners[m]` ends the edge with `fan[m]` behind it.
pub fn clustered_fan(corners: &[Vec2], fan: &[u32]) -> Vec<u32> {
    let shortest = 0.1 * corners.iter().map(|c| c.length()).fold(0.0, f32::max);
    let before = |m: usize| corners[(m + corners.len() - 1) % corners.len()];
    let long = |m: &usize| corners[*m].distance(before(*m)) > shortest;
    (0..corners.len()).filter(long).map(|m| fan[m]).collect()
}
