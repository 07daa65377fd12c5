//! From relaxed sites to a mesh: connected, compared with the input, and densified where cells are broken.

use super::densify::{ConnectedSites, densify};
use super::level_mesh::{LevelMesh, LevelSites};
use super::shared::CoarseToFine;
use super::shared_edges::missing_between_curves;
use crate::mesh::chunks::par_clone;
use crate::mesh::topology::{closed_topology, topology};
use crate::pipeline::near_sites::near_sites;
use crate::progress::{ProgressReporter, ProgressToken};
use crate::sites::cells::{BrokenCell, CellSites, CellSurface, KnownCells, cells_after_moves, tangent_cells};
use crate::sites::connect::ConnectCounts;
use crate::sites::ears::turn_ears;
use crate::sites::on_surface::SitesOnSurface;
use crate::sites::place::Place;
use crate::{Result, TriMesh};

/// Maximum number of rounds in which sites are moved into broken cells.
const DENSIFICATIONS: u32 = 12;
/// Maximum number of rounds in a row without fewer broken cells than ever before.
const PATIENCE: u32 = 4;
/// On a surface with junctions or defects, the rounds end once the broken cells exceed the fewest so far by
/// this factor; on others that often comes right.
const WORSE: f64 = 1.4;
/// From this many rounds on, the rounds end if too many cells are still broken: both [`MANY`] and
/// [`HARDLY_FEWER`] are exceeded.
const SOON: u32 = 2;
/// More broken cells than this fraction of all cells are many.
const MANY: f64 = 0.05;
/// More broken cells than this fraction of those that were broken at first are hardly fewer: where it comes
/// right, they are halved by then.
const HARDLY_FEWER: f64 = 0.7;

/// The rounds of moves into broken cells so far.
struct Rounds {
    done: u32,
    without_gain: u32,
    at_first: Option<usize>,
    fewest: usize,
}

impl Rounds {
    fn new() -> Self {
        Self { done: 0, without_gain: 0, at_first: None, fewest: usize::MAX }
    }

    /// Whether another round may help, if `broken` of `all` cells are broken.
    fn may_go_on(&mut self, broken: usize, all: usize, is_manifold: bool) -> bool {
        self.without_gain = if broken < self.fewest { 0 } else { self.without_gain + 1 };
        let gets_worse = !is_manifold && broken as f64 > WORSE * self.fewest as f64;
        self.fewest = self.fewest.min(broken);
        let fewest = self.fewest as f64;
        let at_first = *self.at_first.get_or_insert(broken) as f64;
        let stays_bad = self.done >= SOON && fewest > MANY * all as f64 && fewest > HARDLY_FEWER * at_first;
        let goes_on = self.done < DENSIFICATIONS && self.without_gain < PATIENCE && !gets_worse && !stays_bad;
        self.done += 1;
        goes_on
    }
}

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
                let mesh = TriMesh { vertices: par_clone(positions), triangles };
                if closed_topology(&mesh).matches(self.context.input) {
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
        let mut rounds = Rounds::new();
        let mut known = KnownCells::default();
        loop {
            let connection = progress
                .during(|progress| self.connect_once(on, &mut level, (spacing, &mut known), progress))?;
            let Connection { broken, faces, counts, is_sound } = connection;
            progress.would_simplify(!is_sound);
            // That may leave no time for another round.
            progress.poll()?;
            let may_help =
                rounds.may_go_on(broken.len(), level.sites.len(), self.context.input.is_manifold());
            let is_over = is_sound || !may_help || progress.leave_out();
            let of = ConnectedSites { faces: &faces, fixed: &fixed, spacing, sizes };
            if is_over || !densify(&mut level.sites, &of, &broken) {
                let faulty_place = broken.first().map(|b| b.farthest.0);
                let mesh = TriMesh { vertices: par_clone(&level.sites.positions), triangles: faces };
                return Ok(LevelMesh { is_sound, faulty_place, ..LevelMesh::new(level, mesh, counts) });
            }
            level.near = near_sites(self.context.device, &level.sites.positions)?;
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
        let along_curves = on_curves.as_ref().map(|curves| (curves.fixed(), curves.edges()));
        if let Some((_, edges)) = &along_curves {
            turn_ears(&mut triangles, positions, edges);
        }
        progress.poll()?;
        let mesh = TriMesh { vertices: std::mem::take(positions), triangles };
        let got = if cells.is_closed { closed_topology(&mesh) } else { topology(&mesh) };
        let is_sound = got.matches(self.context.input) && got.vertices == mesh.vertices.len();
        let mut broken = cells.broken;
        if let (false, Some((fixed, edges))) = (is_sound, &along_curves) {
            broken.extend(missing_between_curves(&mesh, fixed, edges, |p| self.in_a_triangle(p)));
        }
        *positions = mesh.vertices;
        Ok(Connection { broken, faces: mesh.triangles, counts, is_sound })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After how many rounds of these numbers of broken cells of 1,000 the moves end.
    fn rounds(broken: &[usize], is_manifold: bool) -> usize {
        let mut rounds = Rounds::new();
        broken.iter().take_while(|broken| rounds.may_go_on(**broken, 1000, is_manifold)).count()
    }

    #[test]
    fn moves_end_where_they_do_not_help() {
        // Many that stay, and as many that are halved.
        assert_eq!(rounds(&[84, 81, 70, 73, 60, 40], true), 2);
        assert_eq!(rounds(&[84, 60, 58, 30, 10, 2], true), 6);
        // Few that stay have four rounds to come right.
        assert_eq!(rounds(&[8, 17, 10, 2], true), 4);
        assert_eq!(rounds(&[9, 8, 9, 11, 8, 13, 9], true), 5);
        assert_eq!(rounds(&[8, 17, 10, 2], false), 1);
        assert_eq!(rounds(&(1..=40).rev().collect::<Vec<_>>(), true), DENSIFICATIONS as usize);
    }
}
