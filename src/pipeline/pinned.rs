//! Vertices that the user wants where they are: points of the surface, and the boundary.

use super::kept::Kept;
use super::memory::MOST_HALVED;
use super::warning::{Warning, WarningCode};
use crate::grammar::counted;
use crate::mesh::NONE;
use crate::mesh::half_edges::{EdgeSet, EdgeTable};
use crate::mesh::insert_points::{FAR, Inserted, KeptParts, ON_SURFACE, PointsOnSurface, Snapping};
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
/// Edges that stay whole may be this many times as long as those next to them.
const COARSE: f64 = 5.0;
/// From so many times the length of others on, edges become longer next to those that are kept.
const LONG: f64 = 1.5;
/// How much shorter they are for each unit of distance from there.
const FALLS: f64 = 1.5;
/// Edges next to one that stays whole may have this share of its length: with shorter ones, its triangle
/// would become flat.
const NEXT_TO_WHOLE: f64 = 0.75;

/// The vertices of a repaired mesh that a result must have, at the same positions.
#[derive(Debug, Clone, Default)]
pub(crate) struct Pinned {
    /// Their indices, rising.
    pub vertices: Vec<u32>,
    /// Edges between them that stay whole.
    pub whole: EdgeSet,
    /// The length that edges are to have next to edges that stay whole, in diagonals, where these are shorter
    /// than others, or much longer.
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
    whole: &WholeEdges,
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
        whole.size((a, b), FINE * spacing + WIDENS * beyond)
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

/// Edges that stay whole, by their ends, for meshes that are divided next to them.
#[derive(Default)]
pub(crate) struct WholeEdges {
    edges: HashSet<[[u64; 3]; 2]>,
    /// The length of the longest one at each end.
    longest: HashMap<[u64; 3], f64>,
}

impl WholeEdges {
    /// Edges of a mesh.
    pub fn new(mesh: &TriMesh, edges: &EdgeSet) -> Self {
        let mut whole = Self::default();
        for (a, b) in edges {
            let ends = [*a, *b].map(|v| mesh.vertices[v as usize]);
            whole.edges.insert(edge_keys(ends));
            for key in edge_keys(ends) {
                let longest = whole.longest.entry(key).or_default();
                *longest = longest.max(ends[0].distance(ends[1]));
            }
        }
        whole
    }

    /// An edge's length over the length that is `allowed`; not above 1 if it is to stay as it is.
    pub fn size(&self, (a, b): (DVec3, DVec3), allowed: f64) -> f64 {
        let size = a.distance(b) / allowed;
        if size <= 1.0 || self.longest.is_empty() {
            return size;
        }
        let at_ends = edge_keys([a, b]);
        if self.edges.contains(&at_ends) {
            return 0.0;
        }
        let longest = at_ends.iter().filter_map(|key| self.longest.get(key)).fold(0.0, |a: f64, b| a.max(*b));
        a.distance(b) / allowed.max(NEXT_TO_WHOLE * longest)
    }
}

/// The ends of an edge, in either order.
pub(super) fn edge_keys(ends: [DVec3; 2]) -> [[u64; 3]; 2] {
    let [a, b] = ends.map(position_key);
    if a < b { [a, b] } else { [b, a] }
}

impl Pinned {
    /// Those that the options name, and those at `kept` triangles; points become vertices of the mesh. Also
    /// the first new vertex, and which edges the new ones divide.
    ///
    /// # Errors
    /// [`Error::Usage`] if so many vertices leave too few for the rest, and those of [`insert_points`].
    pub fn new(
        repaired: &mut Repaired,
        (options, vertices): (&Options, usize),
        kept: Option<&Kept>,
        progress: &ProgressToken,
    ) -> Result<(Self, Divided)> {
        let method = &options.coarse_to_fine;
        let first = repaired.mesh.vertices.len() as u32;
        let mut pinned = Self::default();
        let mut divided = Vec::new();
        if !method.keep_boundary && method.points.is_empty() && kept.is_none() {
            return Ok((pinned, (first, divided)));
        }
        let frame = UnitFrame::of(&repaired.mesh)?;
        let mut whole: Vec<(u32, u32)> =
            kept.iter().flat_map(|kept| kept.cut.iter().map(|cut| cut.0)).collect();
        if method.keep_boundary {
            let table = EdgeTable::new(&repaired.mesh.triangles);
            whole.extend(table.edges().filter(|sides| sides.len() == 1).map(|sides| sides[0].ends()));
            whole.sort_unstable();
            whole.dedup();
        }
        let usual = spacing(repaired.mesh.area(), vertices) / frame.scale;
        pinned.keep_edges(&repaired.mesh, &whole, frame.scale, usual);
        // Some are at no such edge.
        pinned.vertices.extend(kept.iter().flat_map(|kept| &kept.shared));
        pinned.vertices.sort_unstable();
        pinned.vertices.dedup();
        if method.keep_boundary {
            let count = pinned.vertices.len();
            refuse_too_many((count, vertices), "the boundary has", "`keep_boundary` keeps all of them")?;
        }
        let points = kept.map_or(method.points.as_slice(), |kept| &kept.points);
        if !points.is_empty() {
            let snapping = Snapping {
                feature_angle: method.feature_angle,
                distance: SNAP * spacing(repaired.mesh.area(), vertices),
            };
            let located = PointsOnSurface::find(&repaired.mesh, points, progress)?;
            let count = located.count_with(&pinned.vertices);
            let what = "the points and the boundary have";
            refuse_too_many((count, vertices), what, "all of them are kept")?;
            let kept = KeptParts { vertices: &pinned.vertices, edges: &pinned.whole };
            let Inserted { mesh, origin, divides, vertices: at, distances } =
                located.insert(kept, &snapping, progress)?;
            repaired.origin = origin.iter().map(|t| repaired.origin[*t as usize]).collect();
            repaired.mesh = mesh;
            divided = divides;
            let whole = WholeEdges::new(&repaired.mesh, &pinned.whole);
            divide_around(repaired, (&at, vertices), &whole, &mut divided, progress)?;
            pinned.vertices.extend(at.iter().filter(|v| **v != NONE));
            pinned.vertices.sort_unstable();
            pinned.vertices.dedup();
            pinned.warn_of_distances(&distances, frame.scale);
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

    /// Keeps edges of a mesh whole.
    fn keep_edges(&mut self, mesh: &TriMesh, edges: &[(u32, u32)], scale: f64, usual: f64) {
        let mut lengths: HashMap<u32, (f64, f64)> = HashMap::new();
        for &(a, b) in edges {
            self.whole.insert((a, b));
            let length = mesh.vertices[a as usize].distance(mesh.vertices[b as usize]) / scale;
            for v in [a, b] {
                let (sum, count) = lengths.entry(v).or_default();
                (*sum, *count) = (*sum + length, *count + 1.0);
            }
        }
        self.vertices = lengths.keys().copied().collect();
        self.vertices.sort_unstable();
        let mean = |v: &u32| (*v, LOOSE * lengths[v].0 / lengths[v].1);
        // Without other vertices, there is nowhere that lengths could change.
        let is_kept = |v: &u32| lengths.contains_key(v);
        let with_others: HashSet<u32> =
            mesh.triangles.iter().filter(|corners| !corners.iter().all(is_kept)).flatten().copied().collect();
        let differs =
            |(v, length): &(u32, f64)| *length < usual || (*length > LONG * usual && with_others.contains(v));
        self.boundary_lengths = self.vertices.iter().map(mean).filter(differs).collect();
        let others = next_to_long(mesh, edges, scale, |_| usual).into_iter().filter(|(v, _)| !is_kept(v));
        self.boundary_lengths.extend(others);
    }

    /// At each vertex of the mesh, the length below which edges there must not fall, since an edge that stays
    /// whole is much longer than the `wanted` ones next to it; 0 where there is no such edge. In diagonals;
    /// empty if there are none at all.
    pub fn least_lengths(&self, mesh: &TriMesh, wanted: &[f64]) -> Result<Vec<f64>> {
        let mut edges: Vec<(u32, u32)> = self.whole.iter().copied().collect();
        edges.sort_unstable();
        let scale = UnitFrame::of(mesh)?.scale;
        let found = next_to_long(mesh, &edges, scale, |v| wanted[v as usize]);
        let mut least = vec![0.0; if found.is_empty() { 0 } else { wanted.len() }];
        found.into_iter().for_each(|(v, length)| least[v as usize] = length);
        Ok(least)
    }

    /// Refuses edges that stay whole and are much longer than the others next to them; `lengths` are those at
    /// the vertices of the mesh, in diagonals, where they are known.
    ///
    /// # Errors
    /// [`Error::Usage`] with the number of vertices for which they are short enough.
    pub fn refuse_coarse(&self, mesh: &TriMesh, lengths: &[f64], vertices: usize) -> Result<()> {
        let scale = UnitFrame::of(mesh)?.scale;
        let usual = spacing(mesh.area(), vertices);
        let of_vertex = |v: u32| match lengths.get(v as usize) {
            Some(length) if length.is_finite() => length * scale,
            _ => usual,
        };
        let times = |(a, b): &(u32, u32)| {
            let length = mesh.vertices[*a as usize].distance(mesh.vertices[*b as usize]);
            (length / of_vertex(*a).max(of_vertex(*b)), length)
        };
        let (times, length) = self.whole.iter().map(times).fold((0.0, 0.0), |a, b| if b > a { b } else { a });
        if times <= COARSE || vertices == 0 {
            return Ok(());
        }
        let decimals = decimals(scale);
        let problem = format!(
            "an edge that is kept is {length:.decimals$} long, {times:.0} times as long as those next to it \
             would be: the triangles there would be flat or cross each other"
        );
        let most = (vertices as f64 * (COARSE / times).powi(2)).floor();
        let remedy = format!("divide such edges, or ask for longer edges: about {most} vertices");
        Err(Error::option("vertices", problem, remedy))
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

/// Vertices of a mesh close to edges that are much longer than those `wanted` there, with the lengths to have
/// instead, both in diagonals: sites closer to such an edge than to its ends would take its place.
fn next_to_long(
    mesh: &TriMesh,
    edges: &[(u32, u32)],
    scale: f64,
    wanted: impl Fn(u32) -> f64,
) -> Vec<(u32, f64)> {
    let (mut points, mut of_points) = (Vec::new(), Vec::new());
    for (a, b) in edges {
        let [p, q] = [*a, *b].map(|v| mesh.vertices[v as usize]);
        let (length, usual) = (p.distance(q) / scale, wanted(*a).min(wanted(*b)));
        if length > LONG * usual {
            let count = (length / usual).ceil();
            points.extend((0..=count as usize).map(|k| p.lerp(q, k as f64 / count)));
            of_points.resize(points.len(), length);
        }
    }
    let tree = KdTree::new(&points);
    let of = |(v, p): (u32, &DVec3)| {
        let nearest = tree.nearest(*p)? as usize;
        let length = LOOSE * of_points[nearest] - FALLS * points[nearest].distance(*p) / scale;
        (length > wanted(v)).then_some((v, length))
    };
    (0..).zip(&mesh.vertices).filter_map(of).collect()
}

fn refuse_too_many((kept, vertices): (usize, usize), what: &str, why: &str) -> Result<()> {
    if vertices == 0 || kept as f64 <= MOST * vertices as f64 {
        return Ok(());
    }
    let enough = (kept as f64 / MOST).ceil();
    let problem =
        format!("{what} {kept} vertices, {why}, and that leaves too few of {vertices} for the rest");
    Err(Error::option("vertices", problem, format!("ask for at least {enough}")))
}
