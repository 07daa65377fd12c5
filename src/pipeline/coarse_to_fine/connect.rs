//! From sites at rest to a mesh: connected, compared with the input, mended where it is wrong, polished and
//! fitted.

use super::CoarseToFine;
use super::densify::{ConnectedSites, densify};
use crate::mesh::NONE;
use crate::mesh::intersections::intersecting_faces;
use crate::mesh::polyline::Polyline;
use crate::mesh::topology::topology;
use crate::mesh::unit_frame::{UnitFrame, decimals};
use crate::pipeline::Clock;
use crate::pipeline::cost::AttemptCost;
use crate::pipeline::near_sites::near_sites;
use crate::polish::{FitOptions, OutlierOptions, PolishOptions, SlidingCurve, fit, polish, reduce_outliers};
use crate::progress::{ProgressReporter, ProgressToken};
use crate::sites::cells::{BrokenCell, CellSites, CellSurface, connected_cells};
use crate::sites::connect::{ConnectCounts, connect};
use crate::sites::curve_sites::{CurvePosition, CurveSites};
use crate::sites::on_surface::SitesOnSurface;
use crate::sites::place::Place;
use crate::{Phase, Result, TriMesh};
use glam::DVec3;
use std::sync::OnceLock;

/// Times that sites are moved into broken cells,
const DENSIFICATIONS: u32 = 12;
/// and times in a row that leave no fewer of these than ever before.
const PATIENCE: u32 = 4;
/// Times that sites are moved to faces that run through others.
const UNCROSSINGS: u32 = 4;

/// More rounds of polish where vertices slide along curves.
const ROUNDS_ON_CURVES: u32 = 10;

/// Sites at rest, in the unit-diagonal frame.
pub(crate) struct LevelSites {
    pub sites: SitesOnSurface,
    /// On surfaces with curves.
    pub held: Option<Held>,
    /// Near sites of each, as [`CellSites::near`] has them.
    pub near: Vec<u32>,
}

/// A level's mesh in the unit-diagonal frame.
pub(crate) struct Found {
    pub mesh: TriMesh,
    /// The same before the polish, once it is polished.
    pub rested: TriMesh,
    pub under: Vec<u32>,
    pub held: Option<Held>,
    pub counts: ConnectCounts,
    /// Whether it has the input's topology.
    pub sound: bool,
    /// A place where it has not.
    pub trouble: Option<DVec3>,
    /// Faces that run through others, once that is known.
    pub crossing: Option<usize>,
    pub open: usize,
    pub steps: Vec<f64>,
}

impl Found {
    /// The sites that are not on curves, in Morton order.
    pub fn moving(&self) -> SitesOnSurface {
        let on_curve = self.held.as_ref().map_or_else(Vec::new, Held::on_curve);
        let moves = |v: &usize| !on_curve.get(*v).copied().unwrap_or(false);
        let moving: Vec<usize> = (0..self.under.len()).filter(moves).collect();
        let positions = moving.iter().map(|v| self.mesh.vertices[*v]).collect();
        let triangles = moving.iter().map(|v| self.under[*v]).collect();
        SitesOnSurface { positions, triangles }.in_morton_order()
    }
}

/// The triangles over some sites.
struct Tied {
    triangles: Vec<[u32; 3]>,
    counts: ConnectCounts,
    broken: Vec<BrokenCell>,
    /// Whether they have the input's topology.
    sound: bool,
}

/// The curve sites of a level.
pub(crate) struct Held {
    pub sites: CurveSites,
    /// Which of them each site is, [`NONE`] for an interior one.
    pub pins: Vec<u32>,
}

/// What is wrong with a result for lack of vertices.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fault {
    pub what: String,
    /// A place where it is, in the unit-diagonal frame.
    pub at: Option<DVec3>,
}

impl Fault {
    /// With the place in the file's units.
    pub fn in_words(&self, frame: &UnitFrame) -> String {
        let Some(at) = self.at else { return self.what.clone() };
        let decimals = decimals(frame.scale);
        let [x, y, z] = frame.from_unit(at).to_array();
        format!("{} near ({x:.decimals$}, {y:.decimals$}, {z:.decimals$})", self.what)
    }
}

impl Held {
    /// Puts curve sites where they stand.
    pub fn put(&self, positions: &mut [DVec3]) {
        for (v, pin) in self.pinned() {
            positions[v] = self.sites.positions[pin];
        }
    }

    /// Of each site, whether it is on a curve.
    fn on_curve(&self) -> Vec<bool> {
        self.pins.iter().map(|pin| *pin != NONE).collect()
    }

    /// Sites on curves, and which they are there.
    fn pinned(&self) -> impl Iterator<Item = (usize, usize)> {
        let pins = self.pins.iter().enumerate();
        pins.filter(|(_, pin)| **pin != NONE).map(|(v, pin)| (v, *pin as usize))
    }
}

impl CoarseToFine<'_> {
    /// A mesh over the sites; where cells tell that there are too few, some are moved there from elsewhere.
    pub(crate) fn connected(
        &self,
        on: &CellSurface,
        mut level: LevelSites,
        spacing: f64,
        progress: &mut ProgressReporter,
    ) -> Result<Found> {
        let fixed = level.held.as_ref().map_or_else(Vec::new, Held::on_curve);
        let sizes = &self.ground.sizes;
        let (mut left, mut patience, mut fewest) = (DENSIFICATIONS, PATIENCE, usize::MAX);
        loop {
            progress.poll()?;
            let tied = progress.during(|progress| self.tied(on, &mut level, spacing, progress))?;
            let Tied { broken, triangles, counts, sound } = tied;
            patience = if broken.len() < fewest { PATIENCE } else { patience - 1 };
            fewest = fewest.min(broken.len());
            let over = sound || left == 0 || patience == 0;
            let of = ConnectedSites { faces: &triangles, fixed: &fixed, spacing, sizes };
            if over || !densify(&mut level.sites, &of, &broken) {
                return Ok(Found {
                    counts,
                    sound,
                    trouble: broken.first().map(|b| b.farthest.0),
                    crossing: None,
                    mesh: TriMesh { vertices: level.sites.positions, triangles },
                    rested: TriMesh::default(),
                    under: level.sites.triangles,
                    held: level.held,
                    open: 0,
                    steps: Vec::new(),
                });
            }
            left -= 1;
            level.near = near_sites(self.device, &level.sites.positions)?;
        }
    }

    /// A mesh over the sites as they are.
    fn tied(
        &self,
        on: &CellSurface,
        level: &mut LevelSites,
        spacing: f64,
        progress: &ProgressToken,
    ) -> Result<Tied> {
        let LevelSites { sites: SitesOnSurface { positions, triangles }, held, near } = level;
        let mut places = Place::inside(triangles);
        for (held, (v, pin)) in held.iter().flat_map(|held| held.pinned().map(move |pin| (held, pin))) {
            places[v] = held.sites.places[pin];
        }
        let lengths = &self.ground.sizes.at_all(positions, triangles);
        let sites_now = CellSites { positions, places: &places, near, spacing, lengths };
        let cells = connected_cells(on, &sites_now, progress)?;
        let (triangles, counts) = connect(positions, &cells.fans);
        progress.poll()?;
        let mesh = TriMesh { vertices: std::mem::take(positions), triangles };
        let got = topology(&mesh);
        let sound = got.matches(self.input) && got.vertices == mesh.vertices.len();
        *positions = mesh.vertices;
        let counts = ConnectCounts { cells: Some(cells.certificate), ..counts };
        Ok(Tied { broken: cells.broken, triangles: mesh.triangles, counts, sound })
    }

    /// A mesh polished and fitted, and what is wrong with it. If faces run through others, sites are moved
    /// there from elsewhere.
    pub(crate) fn finished(
        &self,
        on: &CellSurface,
        mut found: Found,
        spacing: f64,
        (cost, progress, clock): (&AttemptCost, &mut ProgressReporter, &mut Clock),
    ) -> Result<(Found, Option<Fault>)> {
        let mut left = UNCROSSINGS;
        loop {
            found.rested = found.mesh.clone();
            self.finish(&mut found, cost, progress, clock)?;
            if !found.sound {
                let fault = Fault {
                    what: "components, handles or rims of the surface are lost".to_owned(),
                    at: found.trouble,
                };
                return Ok((found, Some(fault)));
            }
            progress.phase(Phase::Check, cost.check.until, cost.check.after)?;
            let crossing = progress.during(|progress| crossing_faces(&found.mesh, self.frame, progress))?;
            found.crossing = Some(crossing.len());
            clock.phase("check");
            let of_input = |progress: &ProgressToken| crossing_of_input(self.crossing, self.mesh, progress);
            if crossing.is_empty() || crossing.len() <= progress.during(of_input)? {
                return Ok((found, None));
            }
            let wanted: Vec<BrokenCell> =
                crossing.iter().filter_map(|t| self.beside(&found.mesh, *t)).collect();
            let rested = found.rested.clone();
            let sites = SitesOnSurface { positions: rested.vertices, triangles: found.under };
            let mut level = LevelSites { sites, held: found.held, near: Vec::new() };
            let fixed = level.held.as_ref().map_or_else(Vec::new, Held::on_curve);
            let sizes = &self.ground.sizes;
            let of = ConnectedSites { faces: &rested.triangles, fixed: &fixed, spacing, sizes };
            if left == 0 || !densify(&mut level.sites, &of, &wanted) {
                let what = format!("{} faces run through others", crossing.len());
                let at = wanted.first().map(|b| b.farthest.0);
                return Ok((
                    Found { under: level.sites.triangles, held: level.held, ..found },
                    Some(Fault { what, at }),
                ));
            }
            left -= 1;
            level.near = near_sites(self.device, &level.sites.positions)?;
            found = self.connected(on, level, spacing, progress)?;
        }
    }

    /// Where another site would help a face that runs through others: on the surface beside its middle.
    fn beside(&self, mesh: &TriMesh, t: u32) -> Option<BrokenCell> {
        let [a, b, c] = mesh.corners(t as usize);
        let (point, triangle) = self.ground.target.nearest((a + b + c) / 3.0)?;
        let [p, q, r] = self.surface.triangles[triangle as usize].map(|v| self.surface.vertices[v as usize]);
        // Inside the triangle, for a curve may run along its edges.
        let farthest = (point.lerp((p + q + r) / 3.0, 0.05), triangle);
        Some(BrokenCell { site: mesh.triangles[t as usize][0], farthest })
    }

    /// Better triangles and a closer fit. Vertices on curves keep to their curve.
    fn finish(
        &self,
        found: &mut Found,
        cost: &AttemptCost,
        progress: &mut ProgressReporter,
        clock: &mut Clock,
    ) -> Result<()> {
        let target = &self.ground.target;
        let fixed = found.held.as_ref().map_or_else(Vec::new, Held::on_curve);
        let patches = self.patches(found, &fixed);
        let mesh = &mut found.mesh;
        progress.phase(Phase::Polish, cost.polish.until, cost.polish.after)?;
        let sliding_curves = found.held.as_ref().map_or_else(Vec::new, |held| self.sliding_curves(held));
        let rounds = self.options.coarse_to_fine.polish_rounds
            + if sliding_curves.is_empty() { 0 } else { ROUNDS_ON_CURVES };
        let lengths = self.ground.sizes.at_all(&mesh.vertices, &found.under);
        let options = PolishOptions { rounds, fixed, patches, sliding_curves, lengths, ..Default::default() };
        progress.during(|progress| polish(mesh, target, &options, progress))?;
        clock.phase("polish");
        let PolishOptions { fixed, patches, lengths, .. } = options;
        if self.options.coarse_to_fine.fit {
            let options = FitOptions { fixed, patches, ..Default::default() };
            progress.phase(Phase::Fit, cost.fit.until, cost.fit.after)?;
            progress.during(|progress| fit(mesh, target, &options, progress))?;
            clock.phase("fit");
            let FitOptions { fixed, patches, .. } = options;
            let edge = crate::pipeline::spacing(self.surface.area(), mesh.vertices.len());
            progress.phase(Phase::Outliers, cost.outliers.until, cost.outliers.after)?;
            let options = OutlierOptions { fixed, patches, lengths, ..Default::default() };
            progress.during(|progress| reduce_outliers(mesh, target, edge, &options, progress))?;
            clock.phase("spots");
        }
        Ok(())
    }

    /// The curves with the sites that may slide along them.
    fn sliding_curves(&self, held: &Held) -> Vec<SlidingCurve> {
        let Some(curves) = &self.ground.curves else { return Vec::new() };
        let sliding_curve = |line: &Polyline| SlidingCurve { line: line.clone(), sliders: Vec::new() };
        let mut sliding_curves: Vec<SlidingCurve> = curves.polylines().map(sliding_curve).collect();
        let mut sliders: Vec<(usize, usize)> = held.pinned().map(|(v, pin)| (pin, v)).collect();
        // Pins are in order along each curve.
        sliders.sort_unstable();
        for (pin, v) in sliders {
            let CurvePosition { curve, arc_length } = held.sites.curve_positions[pin];
            if let Some(sliding_curve) = sliding_curves.get_mut(curve as usize) {
                sliding_curve.sliders.push((v as u32, arc_length));
            }
        }
        sliding_curves
    }

    /// The patch of every triangle of a mesh, [`NONE`] where all corners are on curves; nothing if there are
    /// none.
    fn patches(&self, found: &Found, on_curve: &[bool]) -> Vec<u32> {
        let Some(curves) = &self.ground.curves else { return Vec::new() };
        let of = |triangle: &[u32; 3]| {
            let inner = triangle.iter().find(|v| !on_curve[**v as usize]);
            inner.map_or(NONE, |v| curves.patches[found.under[*v as usize] as usize])
        };
        found.mesh.triangles.iter().map(of).collect()
    }
}

/// The faces of a mesh in the unit-diagonal frame that intersect others in the file's coordinates: rounding to
/// those may fold what is thin.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn crossing_faces(
    mesh: &TriMesh,
    frame: &UnitFrame,
    progress: &ProgressToken,
) -> Result<Vec<u32>> {
    let vertices = mesh.vertices.iter().map(|p| frame.from_unit(*p)).collect();
    intersecting_faces(&TriMesh { vertices, triangles: mesh.triangles.clone() }, progress)
}

/// How many faces of the `input` intersect others, counted once.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn crossing_of_input(
    known: &OnceLock<usize>,
    input: &TriMesh,
    progress: &ProgressToken,
) -> Result<usize> {
    if let Some(count) = known.get() {
        return Ok(*count);
    }
    let count = intersecting_faces(input, progress)?.len();
    Ok(*known.get_or_init(|| count))
}
