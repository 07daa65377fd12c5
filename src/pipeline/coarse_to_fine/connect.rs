//! From relaxed sites to a mesh: connected, compared with the input, and densified where cells are broken.

use super::densify::{ConnectedSites, densify};
use super::level_mesh::{LevelMesh, LevelSites};
use super::shared::CoarseToFine;
use crate::mesh::topology::{closed_topology, topology};
use crate::pipeline::near_sites::near_sites;
use crate::progress::{ProgressReporter, ProgressToken};
use crate::sites::cells::{BrokenCell, CellSites, CellSurface, KnownCells, cells_after_moves, tangent_cells};
use crate::sites::connect::ConnectCounts;
use crate::sites::ears::turn_ears;
use crate::sites::on_surface::SitesOnSurface;
use crate::sites::place::Place;
use crate::{Result, TriMesh};

/// At most so many times sites are moved into broken cells,
const DENSIFICATIONS: u32 = 12;
/// and at most so many times in a row without fewer broken cells than ever before.
const PATIENCE: u32 = 4;

/// Nor on a defective surface once there are more broken cells than the fewest times this: on others that
/// often comes right.
const WORSE: f64 = 1.4;

/// The faces over some sites.
struct Connection {
    faces: Vec<[u32; 3]>,
    counts: ConnectCounts,
    broken: Vec<BrokenCell>,
    /// Whether the faces have the input's topology.
    is_sound: bool,
}

impl CoarseToFine<'_> {
    /// A mesh over the sites of a level that is to be refined: from tangent planes where that gives the
    /// input's topology, else as [`CoarseToFine::connect`].
    pub(crate) fn connect_coarse(
        &self,
        on: &CellSurface,
        level: LevelSites,
        spacing: f64,
        progress: &mut ProgressReporter,
    ) -> Result<LevelMesh> {
        if level.on_curves.is_none() {
            let SitesOnSurface { positions, triangles } = &level.sites;
            let (places, lengths) =
                (&Place::inside(triangles), &self.model.sizes.at_all(positions, triangles));
            let sites = &CellSites { positions, places, near: &level.near, spacing, lengths };
            if let Some(triangles) = progress.during(|progress| tangent_cells(on, sites, progress))? {
                let mesh = TriMesh { vertices: positions.clone(), triangles };
                if closed_topology(&mesh).matches(self.input) {
                    let mesh = LevelMesh::new(level, mesh, ConnectCounts::default());
                    return Ok(LevelMesh { is_sound: true, ..mesh });
                }
            }
        }
        self.connect(on, level, spacing, progress)
    }

    /// A mesh over the sites; where cells are broken for lack of sites, some are moved there from elsewhere.
    pub(crate) fn connect(
        &self,
        on: &CellSurface,
        mut level: LevelSites,
        spacing: f64,
        progress: &mut ProgressReporter,
    ) -> Result<LevelMesh> {
        let fixed = level.fixed();
        let sizes = &self.model.sizes;
        let (mut left, mut patience, mut fewest) = (DENSIFICATIONS, PATIENCE, usize::MAX);
        let mut known = KnownCells::default();
        loop {
            progress.poll()?;
            let connection = progress
                .during(|progress| self.connect_once(on, &mut level, (spacing, &mut known), progress))?;
            let Connection { broken, faces, counts, is_sound } = connection;
            patience = if broken.len() < fewest { PATIENCE } else { patience - 1 };
            let is_hopeless = !self.input.is_manifold() && broken.len() as f64 > WORSE * fewest as f64;
            fewest = fewest.min(broken.len());
            let is_over = is_sound || left == 0 || patience == 0 || is_hopeless || progress.leave_out();
            let of = ConnectedSites { faces: &faces, fixed: &fixed, spacing, sizes };
            if is_over || !densify(&mut level.sites, &of, &broken) {
                let faulty_place = broken.first().map(|b| b.farthest.0);
                let mesh = TriMesh { vertices: level.sites.positions.clone(), triangles: faces };
                return Ok(LevelMesh { is_sound, faulty_place, ..LevelMesh::new(level, mesh, counts) });
            }
            left -= 1;
            level.near = near_sites(self.device, &level.sites.positions)?;
        }
    }

    /// Connects the sites as they are; what is known of their cells is used and kept.
    fn connect_once(
        &self,
        on: &CellSurface,
        level: &mut LevelSites,
        (spacing, known): (f64, &mut KnownCells),
        progress: &ProgressToken,
    ) -> Result<Connection> {
        let LevelSites { sites: SitesOnSurface { positions, triangles }, on_curves, near } = level;
        let mut places = Place::inside(triangles);
        if let Some(curves) = on_curves {
            curves.pinned().for_each(|(v, pin)| places[v] = curves.sites.places[pin]);
        }
        let lengths = &self.model.sizes.at_all(positions, triangles);
        let sites = CellSites { positions, places: &places, near, spacing, lengths };
        let cells = cells_after_moves(on, &sites, known, progress)?;
        let (mut triangles, counts) = cells.connect(positions);
        if let Some(curves) = on_curves {
            turn_ears(&mut triangles, positions, &curves.edges());
        }
        progress.poll()?;
        let mesh = TriMesh { vertices: std::mem::take(positions), triangles };
        let got = if cells.is_closed { closed_topology(&mesh) } else { topology(&mesh) };
        let is_sound = got.matches(self.input) && got.vertices == mesh.vertices.len();
        *positions = mesh.vertices;
        Ok(Connection { broken: cells.broken, faces: mesh.triangles, counts, is_sound })
    }
}
