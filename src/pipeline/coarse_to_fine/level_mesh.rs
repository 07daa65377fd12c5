//! The sites of a level, relaxed and connected.

use crate::TriMesh;
use crate::mesh::NONE;
use crate::mesh::half_edges::{EdgeSet, edge_key};
use crate::sites::connect::ConnectCounts;
use crate::sites::curve_sites::CurveSites;
use crate::sites::on_surface::SitesOnSurface;
use crate::stages::flags::FlagCounts;
use glam::DVec3;

/// Relaxed sites, in the unit-diagonal frame.
pub(crate) struct LevelSites {
    pub sites: SitesOnSurface,
    /// On surfaces with curves.
    pub on_curves: Option<LevelCurves>,
    /// Near sites of each, as [`crate::sites::cells::CellSites::near`].
    pub near: Vec<u32>,
}

impl LevelSites {
    /// For each site whether it is on a curve; empty on surfaces without curves.
    pub fn fixed(&self) -> Vec<bool> {
        self.on_curves.as_ref().map_or_else(Vec::new, LevelCurves::fixed)
    }
}

/// A level's mesh, in the unit-diagonal frame.
#[derive(Clone)]
pub(crate) struct LevelMesh {
    /// The connected sites.
    pub mesh: TriMesh,
    pub sites: SitesOnSurface,
    /// On surfaces with curves.
    pub on_curves: Option<LevelCurves>,
    /// For each vertex whether it was pulled onto a ridge; empty if none was.
    pub on_ridges: Vec<bool>,
    /// The root mean square distance from the surface beyond which the mesh is of no use.
    pub most_rms: f64,
    pub counts: ConnectCounts,
    /// Whether the mesh has the input's topology.
    pub is_sound: bool,
    /// A place where it has not.
    pub faulty_place: Option<DVec3>,
    /// Of the last iteration.
    pub flags: FlagCounts,
    /// Root mean square step of every iteration, in spacings.
    pub steps: Vec<f64>,
}

impl LevelMesh {
    /// The mesh over the sites, of which nothing is known yet.
    pub fn new(level: LevelSites, mesh: TriMesh, counts: ConnectCounts) -> Self {
        Self {
            mesh,
            sites: level.sites,
            on_curves: level.on_curves,
            on_ridges: Vec::new(),
            most_rms: f64::INFINITY,
            counts,
            is_sound: false,
            faulty_place: None,
            flags: FlagCounts::default(),
            steps: Vec::new(),
        }
    }

    /// The interior sites in Morton order.
    pub fn interior_sites(&self) -> SitesOnSurface {
        let fixed = self.fixed();
        let is_interior = |v: &u32| !fixed.get(*v as usize).copied().unwrap_or(false);
        let interior: Vec<u32> = (0..self.sites.len() as u32).filter(is_interior).collect();
        self.sites.select(&interior).in_morton_order()
    }

    /// For each site whether it is on a curve; empty on surfaces without curves.
    pub fn fixed(&self) -> Vec<bool> {
        self.on_curves.as_ref().map_or_else(Vec::new, LevelCurves::fixed)
    }
}

/// The curve sites of a level, which stay in place.
#[derive(Clone)]
pub(crate) struct LevelCurves {
    pub sites: CurveSites,
    /// The index of each site of the level among these, [`NONE`] for an interior one.
    pub pins: Vec<u32>,
}

impl LevelCurves {
    /// Restores the positions of the curve sites.
    pub fn restore(&self, positions: &mut [DVec3]) {
        for (v, pin) in self.pinned() {
            positions[v] = self.sites.positions[pin];
        }
    }

    /// Pairs of sites of the level that are neighbours along a curve.
    pub fn edges(&self) -> EdgeSet {
        let mut sites = vec![NONE; self.sites.positions.len()];
        self.pinned().for_each(|(v, pin)| sites[pin] = v as u32);
        let at = |pin: u32| sites.get(pin as usize).copied().unwrap_or(NONE);
        let edges = self.sites.segments.iter().map(|pair| pair.map(at));
        edges.filter(|[a, b]| *a != NONE && *b != NONE).map(|[a, b]| edge_key(a, b)).collect()
    }

    /// For each site of the level whether it is on a curve.
    pub fn fixed(&self) -> Vec<bool> {
        self.pins.iter().map(|pin| *pin != NONE).collect()
    }

    /// The sites on curves, with their index among the curve sites.
    pub fn pinned(&self) -> impl Iterator<Item = (usize, usize)> {
        let pins = self.pins.iter().enumerate();
        pins.filter(|(_, pin)| **pin != NONE).map(|(v, pin)| (v, *pin as usize))
    }
}
