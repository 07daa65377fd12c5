//! From faces to triangles: the rotation system of the fans.
//!
//! A fan is the cyclic list of sites behind a face's edges. Keep the edge i–j only if each lists the other; order the
//! kept neighbours of every site by its fan; trace faces by "arrive at j from i, leave to the neighbour just before i
//! in j's counter-clockwise order". Every directed edge lies in exactly one traced face, so the result is a closed
//! surface. It contains the paper's clustering (Sect. 4.4): three faces that meet give a triangle, four or more
//! co-circular sites give a larger face, which is split by quality.

use super::cells::Certificate;
use crate::mesh::quality::TriangleQuality;
use glam::{DVec3, Vec2};
use serde::Serialize;
use std::collections::HashSet;

/// Counter-clockwise neighbours of every site, or of every sector of sites on curves.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Fans {
    start: Vec<u32>,
    neighbours: Vec<u32>,
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

    /// From one list of sectors a sector. `sites` has the site of each; where it is `open`, a curve runs from the last of
    /// the list through the site to the first, with the surface on its left.
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
    fn is_outside(&self, from: u32, slot: usize) -> bool {
        self.is_open(from) && slot + 1 == self.start[from as usize + 1] as usize
    }

    /// Only the edges that both ends list. Entries that are no site or the site itself, as those of the bounding box of
    /// an unbounded face, are dropped too.
    fn symmetric(&self) -> Self {
        let lists = |i: u32, j: u32| (j as usize) < self.len() && i != j && self.of(j as usize).contains(&i);
        let symmetric = (0..self.len()).map(|i| {
            let mut neighbours: Vec<u32> =
                self.of(i).iter().copied().filter(|&j| lists(i as u32, j)).collect();
            // A neighbour that bounds two stretches of a degenerate face counts once.
            let mut seen = HashSet::new();
            neighbours.retain(|j| seen.insert(*j));
            neighbours
        });
        Self::of_sectors(symmetric, self.sites.clone(), self.open.clone())
    }
}

/// The sites behind the edges of a face, without those behind an edge shorter than a tenth of the face's radius: its
/// two corners are one cluster (Sect. 4.4). Four nearly co-circular sites then leave a face of four corners, where
/// rounding and the different tangent planes could let both diagonals stand.
///
/// `corners[m]` ends the edge with `fan[m]` behind it.
pub fn clustered_fan(corners: &[Vec2], fan: &[u32]) -> Vec<u32> {
    let shortest = 0.1 * corners.iter().map(|c| c.length()).fold(0.0, f32::max);
    let before = |m: usize| corners[(m + corners.len() - 1) % corners.len()];
    let long = |m: &usize| corners[*m].distance(before(*m)) > shortest;
    (0..corners.len()).filter(long).map(|m| fan[m]).collect()
}

/// Counts of what [`connect`] found and did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct ConnectCounts {
    /// Fan entries without their counterpart, dropped.
    pub one_sided_edges: usize,
    /// CorrespondenceRequest faces of four or more corners, split by quality.
    pub split_faces: usize,
    /// CorrespondenceRequest faces that could not be filled without repeating an edge; they are holes in the result.
    pub unfilled_faces: usize,
    /// Sites that no triangle uses.
    pub unconnected_sites: usize,
    /// What certifies the exact cells; `None` if the faces' fans were enough.
    pub cells: Option<Certificate>,
}

/// Triangles over the sites, with counts of irregularities.
pub fn connect(sites: &[DVec3], fans: &Fans) -> (Vec<[u32; 3]>, ConnectCounts) {
    let symmetric = fans.symmetric();
    let mut counts = ConnectCounts {
        one_sided_edges: fans.neighbours.len() - symmetric.neighbours.len(),
        ..Default::default()
    };
    let mut edges: HashSet<(u32, u32)> = (0..symmetric.len() as u32)
        .flat_map(|i| symmetric.of(i as usize).iter().map(move |&j| (i, j)))
        .filter(|(i, j)| i < j)
        .map(|(i, j)| key(symmetric.site(i), symmetric.site(j)))
        .collect();
    let mut triangles = Vec::with_capacity(2 * sites.len());
    for face in trace(&symmetric) {
        match face.as_slice() {
            &[a, b, c] if a != b && b != c && c != a => triangles.push([a, b, c]),
            // Two corners: the two sides of an edge without triangles.
            [_, _] => {}
            _ => {
                counts.split_faces += usize::from(face.len() > 3);
                match split(&face, sites, &mut edges) {
                    Some(parts) => triangles.extend(parts),
                    None => counts.unfilled_faces += 1,
                }
            }
        }
    }
    let mut used = vec![false; sites.len()];
    triangles.iter().flatten().for_each(|v| used[*v as usize] = true);
    counts.unconnected_sites = used.iter().filter(|u| !**u).count();
    (triangles, counts)
}

/// All faces of the rotation system, each as its cycle of sites, in the order of their first directed edge. There are none
/// beyond curves.
fn trace(fans: &Fans) -> Vec<Vec<u32>> {
    let mut traced = vec![false; fans.neighbours.len()];
    let mut faces = Vec::new();
    for i in 0..fans.len() {
        for slot in fans.start[i]..fans.start[i + 1] {
            let (mut from, mut slot) = (i as u32, slot as usize);
            let mut face = Vec::new();
            let mut outside = false;
            while !std::mem::replace(&mut traced[slot], true) {
                face.push(fans.site(from));
                outside |= fans.is_outside(from, slot);
                let to = fans.neighbours[slot];
                slot = leave(fans, from, to);
                from = to;
            }
            if !face.is_empty() && !outside {
                faces.push(face);
            }
        }
    }
    faces
}

/// The slot by which a face leaves `at` after arriving from `from`.
fn leave(fans: &Fans, from: u32, at: u32) -> usize {
    let fan = fans.of(at as usize);
    // Fans are symmetric here, so `from` is always found.
    let arrival = fan.iter().position(|&j| j == from).unwrap_or(0);
    fans.start[at as usize] as usize + (arrival + fan.len() - 1) % fan.len()
}

/// Triangulates a face by cutting off ears, the best triangle first, never along an edge that exists. `None` if no ear can
/// be cut, or if the last triangle has a site twice; then no edge was added.
fn split(face: &[u32], sites: &[DVec3], edges: &mut HashSet<(u32, u32)>) -> Option<Vec<[u32; 3]>> {
    let mut rest = face.to_vec();
    let mut triangles = Vec::with_capacity(rest.len().saturating_sub(2));
    let mut added = Vec::new();
    while rest.len() > 3 {
        let ear = (0..rest.len())
            .filter_map(|m| {
                let [a, b, c] = corner(&rest, m);
                let open = a != b && b != c && a != c && !edges.contains(&key(a, c));
                // A face of four has two diagonals, and the better is the one whose worse half is better.
                let other =
                    if rest.len() == 4 { quality(sites, corner(&rest, m + 2)) } else { f64::INFINITY };
                open.then(|| (m, quality(sites, [a, b, c]).min(other)))
            })
            .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        let Some((m, _)) = ear else { break };
        let [a, b, c] = corner(&rest, m);
        triangles.push([a, b, c]);
        edges.insert(key(a, c));
        added.push(key(a, c));
        rest.remove((m + 1) % rest.len());
    }
    if let &[a, b, c] = rest.as_slice()
        && a != b
        && b != c
        && c != a
    {
        triangles.push([a, b, c]);
        return Some(triangles);
    }
    for edge in added {
        edges.remove(&edge);
    }
    None
}

fn corner(cycle: &[u32], m: usize) -> [u32; 3] {
    [0, 1, 2].map(|k| cycle[(m + k) % cycle.len()])
}

fn key(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

fn quality(sites: &[DVec3], triangle: [u32; 3]) -> f64 {
    TriangleQuality::new(triangle.map(|v| sites[v as usize])).q
}
