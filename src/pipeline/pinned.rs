//! Vertices that the user wants where they are: points of the surface, and the boundary.

use super::memory::MOST_HALVED;
use super::warning::{Warning, WarningCode};
use crate::grammar::counted;
use crate::mesh::NONE;
use crate::mesh::half_edges::EdgeTable;
use crate::mesh::insert_points::{FAR, Inserted, ON_SURFACE, Snapping, insert_points};
use crate::mesh::kd_tree::KdTree;
use crate::mesh::position_key;
use crate::mesh::repair::Repaired;
use crate::mesh::spacing;
use crate::mesh::subdivide::{Halved, halve_edges};
use crate::mesh::unit_frame::{UnitFrame, decimals};
use crate::options::Options;
use crate::{Error, ProgressToken, Result, TriMesh};
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// Largest share of the vertices that may be on curves, as for the levels.
const MOST: f64 = 0.6;

/// Edges from a kept boundary are to be this many times as long as its own: sites come to be denser than that
/// where lengths grow fast.
const LOOSE: f64 = 1.2;
/// Sharp edges and boundaries bend to points that are closer than this many spacings: a narrow strip between
/// them would make narrow triangles.
const SNAP: f64 = 0.08;
/// Edges of the mesh may be this many spacings long at points, and longer by [`WIDENS`] away from them.
const FINE: f64 = 0.6;
/// How much longer edges may be for each unit of distance from a point.
const WIDENS: f64 = 0.5;

/// The vertices of a repaired mesh that a result must have, at the same positions.
#[derive(Debug, Clone, Default)]
pub(crate) struct Pinned {
    /// Their indices, rising.
    pub vertices: Vec<u32>,
    /// Whether boundary edges between them stay whole.
    pub keeps_boundary: bool,
    /// The length that edges are to have at each boundary vertex, in diagonals, if the boundary is kept and
    /// its edges are shorter than others.
    pub boundary_lengths: Vec<(u32, f64)>,
    /// The position of each by that in the unit frame, which is rounded.
    positions: HashMap<[u64; 3], DVec3>,
    /// What is wrong with the points.
    warnings: Vec<Warning>,
}

/// A vertex inserted on an edge of the mesh: the ends of that edge; [`NONE`] for one inside a triangle.
pub(super) type Divided = (u32, Vec<[u32; 2]>);

/// Halves long edges of the mesh around its vertices `at`, so that lengths can change from there on. Which
/// edges the new vertices halve comes behind those that are divided already.
fn divide_around(
    repaired: &mut Repaired,
    (at, vertices): (&[u32], usize),
    divided: &mut Vec<[u32; 2]>,
    progress: &ProgressToken,
) -> Result<()> {
    let places: Vec<DVec3> =
        at.iter().filter(|v| **v != NONE).map(|v| repaired.mesh.vertices[*v as usize]).collect();
    let tree = KdTree::new(&places);
    let spacing = spacing(repaired.mesh.area(), vertices);
    let size = |a: DVec3, b: DVec3| {
        let middle = a.midpoint(b);
        let distance = tree.nearest(middle).map_or(f64::INFINITY, |k| places[k as usize].distance(middle));
        let beyond = (distance - 0.5 * a.distance(b)).max(0.0);
        a.distance(b) / (FINE * spacing + WIDENS * beyond)
    };
    let most = repaired.mesh.triangles.len() + MOST_HALVED * vertices;
    let halved = halve_edges(&repaired.mesh, (1.0, size), most, progress)?;
    if let Some(Halved { mesh, origin, halves }) = halved {
        repaired.origin = origin.iter().map(|t| repaired.origin[*t as usize]).collect();
        repaired.mesh = mesh;
        divided.extend(halves);
    }
    Ok(())
}

impl Pinned {
    /// Those that the options name; points become vertices of the mesh. Also the first new vertex, and which
    /// edges the new ones divide.
    ///
    /// # Errors
    /// [`Error::Usage`] if so many vertices leave too few for the rest, and those of [`insert_points`].
    pub fn new(
        repaired: &mut Repaired,
        (options, vertices): (&Options, usize),
        progress: &ProgressToken,
    ) -> Result<(Self, Divided)> {
        let method = &options.coarse_to_fine;
        let first = repaired.mesh.vertices.len() as u32;
        let mut pinned = Self::default();
        let mut divided = Vec::new();
        if !method.keep_boundary && method.points.is_empty() {
            return Ok((pinned, (first, divided)));
        }
        let frame = UnitFrame::of(&repaired.mesh)?;
        if method.keep_boundary {
            let usual = spacing(repaired.mesh.area(), vertices) / frame.scale;
            pinned.keep_boundary(&repaired.mesh, frame.scale, usual);
            pinned.refuse_too_many(vertices, "the boundary has", "`keep_boundary` keeps all of them")?;
        }
        if !method.points.is_empty() {
            let fixed = &pinned.vertices;
            let snapping = Snapping {
                feature_angle: method.feature_angle,
                distance: SNAP * spacing(repaired.mesh.area(), vertices),
            };
            let Inserted { mesh, origin, divides, vertices: at, distances } =
                insert_points(&repaired.mesh, &method.points, fixed, &snapping, progress)?;
            repaired.origin = origin.iter().map(|t| repaired.origin[*t as usize]).collect();
            repaired.mesh = mesh;
            divided = divides;
            divide_around(repaired, (&at, vertices), &mut divided, progress)?;
            pinned.vertices.extend(at.iter().filter(|v| **v != NONE));
            pinned.vertices.sort_unstable();
            pinned.vertices.dedup();
            pinned.warn_of_distances(&distances, frame.scale);
            pinned.refuse_too_many(vertices, "the points and the boundary have", "all of them are kept")?;
        }
        // The box may have become larger by the points.
        let frame = UnitFrame::of(&repaired.mesh)?;
        let own = pinned.vertices.iter().map(|v| repaired.mesh.vertices[*v as usize]);
        pinned.positions = own.map(|p| (position_key(frame.to_unit(p)), p)).collect();
        Ok((pinned, (first, divided)))
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    fn keep_boundary(&mut self, mesh: &TriMesh, scale: f64, usual: f64) {
        let mut lengths: HashMap<u32, (f64, f64)> = HashMap::new();
        for sides in EdgeTable::new(&mesh.triangles).edges().filter(|sides| sides.len() == 1) {
            let (a, b) = sides[0].ends();
            let length = mesh.vertices[a as usize].distance(mesh.vertices[b as usize]) / scale;
            for v in [a, b] {
                let (sum, count) = lengths.entry(v).or_default();
                (*sum, *count) = (*sum + length, *count + 1.0);
            }
        }
        self.keeps_boundary = !lengths.is_empty();
        self.vertices = lengths.keys().copied().collect();
        self.vertices.sort_unstable();
        let mean = |v: &u32| (*v, LOOSE * lengths[v].0 / lengths[v].1);
        // Edges elsewhere do not become longer for those of a coarse boundary.
        self.boundary_lengths =
            self.vertices.iter().map(mean).filter(|(_, length)| *length < usual).collect();
    }

    fn refuse_too_many(&self, vertices: usize, what: &str, why: &str) -> Result<()> {
        let kept = self.vertices.len();
        if vertices == 0 || kept as f64 <= MOST * vertices as f64 {
            return Ok(());
        }
        let enough = (kept as f64 / MOST).ceil();
        let problem =
            format!("{what} {kept} vertices, {why}, and that leaves too few of {vertices} for the rest");
        Err(Error::option("vertices", problem, format!("ask for at least {enough}")))
    }

    fn warn_of_distances(&mut self, distances: &[f64], scale: f64) {
        let decimals = decimals(scale);
        let mut warn = |is_it: &dyn Fn(f64) -> bool, words: [&str; 2], done: &str| {
            let those: Vec<f64> = distances.iter().copied().filter(|d| is_it(*d)).collect();
            let farthest = those.iter().copied().fold(0.0, f64::max) * scale;
            let count = counted(those.len(), words);
            let text = format!("{count} off the surface, by up to {farthest:.decimals$}: {done}");
            if !those.is_empty() {
                self.warnings.push(Warning { code: WarningCode::Points, text });
            }
        };
        let words = ["point is", "points are"];
        warn(&|d| d > ON_SURFACE && d <= FAR, words, "the vertices are at the nearest places of the surface");
        warn(&|d| d > FAR, words, "too far to become vertices");
    }

    /// The indices and the positions, in the units of the input, of the pinned ones among vertices in the
    /// unit frame.
    pub fn among(&self, vertices: &[DVec3]) -> Vec<(usize, DVec3)> {
        if self.is_empty() {
            return Vec::new();
        }
        let found = |(v, p): (usize, &DVec3)| self.positions.get(&position_key(*p)).map(|exact| (v, *exact));
        vertices.iter().enumerate().filter_map(found).collect()
    }

    /// The warnings about these vertices for a result, whose own are in the units of the input.
    pub fn warnings(&self, result: &TriMesh) -> Vec<Warning> {
        let mut list = self.warnings.clone();
        if self.is_empty() {
            return list;
        }
        let there: HashSet<[u64; 3]> = result.vertices.iter().map(|p| position_key(*p)).collect();
        let lost = self.positions.values().filter(|p| !there.contains(&position_key(**p))).count();
        if lost > 0 {
            let of = self.positions.len();
            let text = format!("{lost} of {of} vertices that were to be kept are not: ask for more vertices");
            list.push(Warning { code: WarningCode::Points, text });
        }
        list
    }
}
