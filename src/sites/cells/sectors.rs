//! The sectors of the sites: one for a site inside a patch, one for each part of the surface that meets at a
//! curve.

use super::surface::CellSurface;
use crate::mesh::NONE;
use crate::mesh::chunks::CHUNK;
use crate::mesh::csr::Csr;
use crate::mesh::half_edges::previous;
use crate::sites::place::Place;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;

/// All sectors in the order of their sites.
#[derive(Debug, PartialEq)]
pub(crate) struct Sectors {
    /// First sector of each site, and the end of the last.
    first: Vec<u32>,
    /// The site of each.
    pub site: Vec<u32>,
    pub patch: Vec<u32>,
    /// Unit normal, or zero where the triangles' normals cancel out.
    pub normal: Vec<DVec3>,
    /// First entry of each in `around`, and the end of the last.
    start: Vec<u32>,
    /// The triangles at the site.
    around: Vec<u32>,
    /// The boundary's half-edges that lead to the site and away from it, the patch on their left; `None` for
    /// a site inside the patch.
    pub ends: Vec<Option<[u32; 2]>>,
    /// Whether each site has one sector, so that their numbers are the same.
    pub are_sites: bool,
    /// Whether all are in the same patch.
    pub in_one_patch: bool,
}

impl Sectors {
    pub fn new(surface: &CellSurface, places: &[Place]) -> Self {
        let inside = places.par_iter().with_min_len(CHUNK).map(|place| match place {
            Place::Inside(t) => *t,
            Place::Edge(..) | Place::Vertex(_) => NONE,
        });
        let inside: Vec<u32> = inside.collect();
        if !inside.par_iter().with_min_len(CHUNK).any(|t| *t == NONE) {
            return Self::inside(surface, inside);
        }
        Self::anywhere(surface, places)
    }

    /// Like [`Sectors::new`], for any places.
    fn anywhere(surface: &CellSurface, places: &[Place]) -> Self {
        let lookup = PlaceLookup::new(surface, places);
        let n = places.len();
        let mut sectors = Self {
            first: Vec::with_capacity(n + 1),
            site: Vec::with_capacity(n),
            patch: Vec::with_capacity(n),
            normal: Vec::with_capacity(n),
            start: vec![0],
            around: Vec::with_capacity(n),
            ends: Vec::with_capacity(n),
            are_sites: false,
            in_one_patch: false,
        };
        for (site, place) in (0..).zip(places) {
            sectors.first.push(sectors.site.len() as u32);
            match *place {
                Place::Inside(t) => sectors.push(surface, site, &[t], None),
                Place::Edge(t, side) => {
                    let half = 3 * t + u32::from(side);
                    match surface.twins[half as usize] {
                        NONE => {
                            for &half in lookup.halves_along(surface, half) {
                                sectors.push(surface, site, &[half / 3], Some([half; 2]));
                            }
                        }
                        twin => sectors.push(surface, site, &[t, twin / 3], None),
                    }
                }
                Place::Vertex(v) => {
                    for (triangles, ends) in lookup.fans(surface, v) {
                        sectors.push(surface, site, &triangles, ends);
                    }
                }
            }
        }
        sectors.first.push(sectors.site.len() as u32);
        sectors.are_sites = sectors.first.windows(2).all(|range| range[0] + 1 == range[1]);
        sectors.in_one_patch = sectors.patch.windows(2).all(|pair| pair[0] == pair[1]);
        sectors
    }

    /// Like [`Sectors::new`], for sites that all lie in triangles.
    fn inside(surface: &CellSurface, triangles: Vec<u32>) -> Self {
        let triangles_of = || triangles.par_iter().with_min_len(CHUNK);
        let patch: Vec<u32> = triangles_of().map(|t| surface.patch(*t)).collect();
        let numbers = || (0..triangles.len() as u32 + 1).into_par_iter().with_min_len(CHUNK);
        Self {
            first: numbers().collect(),
            site: numbers().take(triangles.len()).collect(),
            in_one_patch: patch.windows(2).all(|pair| pair[0] == pair[1]),
            patch,
            normal: triangles_of().map(|t| surface.normals[*t as usize]).collect(),
            start: numbers().collect(),
            ends: triangles_of().map(|_| None).collect(),
            around: triangles,
            are_sites: true,
        }
    }

    fn push(&mut self, surface: &CellSurface, site: u32, triangles: &[u32], ends: Option<[u32; 2]>) {
        let normal = match *triangles {
            [t] => surface.normals[t as usize],
            _ => triangles.iter().map(|t| surface.normals[*t as usize]).sum::<DVec3>().normalize_or_zero(),
        };
        self.site.push(site);
        self.patch.push(triangles.first().map_or(0, |t| surface.patch(*t)));
        self.normal.push(normal);
        self.around.extend_from_slice(triangles);
        self.start.push(self.around.len() as u32);
        self.ends.push(ends);
    }

    pub fn len(&self) -> usize {
        self.site.len()
    }

    /// The sectors of a site.
    pub fn of(&self, site: u32) -> std::ops::Range<usize> {
        self.first[site as usize] as usize..self.first[site as usize + 1] as usize
    }

    /// The sectors of a site in a patch.
    pub fn in_patch(&self, site: u32, patch: u32) -> impl Iterator<Item = usize> {
        self.of(site).filter(move |s| self.patch[*s] == patch)
    }

    /// The triangles in which a sector's cell begins.
    pub fn around(&self, sector: usize) -> &[u32] {
        &self.around[self.start[sector] as usize..self.start[sector + 1] as usize]
    }
}

/// Finds the half-edges and corners at places on edges and vertices.
struct PlaceLookup {
    /// The boundary's half-edges, sorted by the edge they lie on.
    half_edges: Vec<u32>,
    /// The corners `3 * triangle + k` at vertices with sites.
    corners: HashMap<u32, Vec<u32>>,
}

impl PlaceLookup {
    fn new(surface: &CellSurface, places: &[Place]) -> Self {
        let mut half_edges = Vec::new();
        if places.iter().any(|place| matches!(place, Place::Edge(..))) {
            half_edges.extend((0..surface.twins.len() as u32).filter(|h| surface.is_boundary(*h)));
            half_edges.sort_by_key(|h| surface.edge(*h));
        }
        let mut corners: HashMap<u32, Vec<u32>> = HashMap::new();
        corners.extend(places.iter().filter_map(|place| match place {
            Place::Vertex(v) => Some((*v, Vec::new())),
            _ => None,
        }));
        if !corners.is_empty() {
            for (corner, v) in (0..).zip(surface.triangles.as_flattened()) {
                if let Some(list) = corners.get_mut(v) {
                    list.push(corner);
                }
            }
        }
        Self { half_edges, corners }
    }

    /// The boundary's half-edges on the edge of one of them.
    fn halves_along(&self, surface: &CellSurface, half: u32) -> &[u32] {
        let edge = surface.edge(half);
        let from = self.half_edges.partition_point(|h| surface.edge(*h) < edge);
        let count = self.half_edges[from..].partition_point(|h| surface.edge(*h) == edge);
        &self.half_edges[from..from + count]
    }

    /// The fans of triangles around a vertex between boundary edges, counter-clockwise, each with the
    /// half-edges by which the boundary reaches and leaves the vertex.
    fn fans(&self, surface: &CellSurface, v: u32) -> Vec<(Vec<u32>, Option<[u32; 2]>)> {
        let Some(corners) = self.corners.get(&v) else { return Vec::new() };
        let mut visited: Vec<u32> = Vec::with_capacity(corners.len());
        let mut fans = Vec::new();
        // A corner is also the number of the half-edge that leaves the vertex.
        let open = corners.iter().filter(|h| surface.is_boundary(**h));
        for first in open.chain(corners) {
            if visited.contains(first) {
                continue;
            }
            let mut fan = Vec::new();
            let mut half = *first;
            let ends = loop {
                visited.push(half);
                fan.push(half / 3);
                let into = previous(half);
                match surface.twins[into as usize] {
                    NONE => break Some([into, *first]),
                    twin if twin == *first => break None,
                    twin => half = twin,
                }
            };
            fans.push((fan, ends));
        }
        fans
    }
}

/// The sites in or at each triangle.
pub(crate) fn sites_by_triangle(triangles: usize, sectors: &Sectors) -> Csr {
    let of = |s: usize| sectors.around(s).iter().map(move |t| (*t, sectors.site[s]));
    Csr::group(triangles, (0..sectors.len()).flat_map(of))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;

    #[test]
    fn sites_in_triangles_have_the_same_sectors_in_both_ways() {
        let mesh = sample("genus3").unwrap();
        let count = mesh.triangles.len();
        let normals: Vec<DVec3> = (0..count).map(|t| mesh.doubled_normal(t).normalize()).collect();
        let thirds: Vec<u32> = (0..count as u32).map(|t| t % 3).collect();
        for patches in [&[], thirds.as_slice()] {
            let surface = CellSurface::new(&mesh.vertices, &mesh.triangles, &normals).cut_along(&[], patches);
            for sites in [0, 1, 3 * CHUNK + 5] {
                let triangles: Vec<u32> = (0..sites).map(|i| (i * i % count) as u32).collect();
                let anywhere = Sectors::anywhere(&surface, &Place::inside(&triangles));
                assert!(Sectors::inside(&surface, triangles) == anywhere, "{sites} sites");
            }
        }
    }
}
