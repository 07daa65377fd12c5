//! One cell, traversed from triangle to triangle and clipped by the bisectors with nearby sites.

use super::FEW_CELLS;
use super::clip::{Clipped, Label};
use super::sectors::{Sectors, sites_by_triangle};
use super::surface::{CellSites, CellSurface};
use crate::mesh::csr::Csr;
use crate::mesh::kd_tree::KdTree;
use glam::DVec3;
use rayon::prelude::*;
use smallvec::SmallVec;
use std::sync::OnceLock;

/// A site's weight is below this fraction of the squared spacing. The weights make the triangulation of
/// co-circular sites unique, so that all their cells agree on it.
const WEIGHT: f64 = 1e-6;

/// A site whose normal points the other way counts if the surface connects to it within this many spacings;
/// and a cell in a tangent plane that reaches farther is not taken.
const REACH: f64 = 2.5;

/// Sites around one whose normals are added to its own for its tangent plane.
const RING: usize = 6;

/// Edges shorter than this fraction of the spacing may exist in one of their two cells only.
const NEGLIGIBLE_EDGE: f64 = 1e-6;

/// Input shared by all cells.
pub(crate) struct Scene<'a> {
    pub surface: &'a CellSurface<'a>,
    pub sites: &'a CellSites<'a>,
    pub sectors: Sectors,
    pub by_triangle: Csr,
    /// Of the sites, once [`Scene::complete`] needed it.
    tree: OnceLock<KdTree<'a>>,
}

impl<'a> Scene<'a> {
    pub fn new(surface: &'a CellSurface<'a>, sites: &'a CellSites<'a>, sectors: Sectors) -> Self {
        let by_triangle = sites_by_triangle(surface.triangles.len(), &sectors);
        Self { surface, sites, sectors, by_triangle, tree: OnceLock::new() }
    }

    /// Computes those cells again that the sites listed as near did not bound, with all sites; `compute`
    /// makes the cell at an index. To be called after each time that cells were computed.
    ///
    /// The tree of all sites is not built when the first cell needs it: it is built in parallel, and a thread
    /// that waits for others takes up another cell, which would wait for the same tree for ever.
    pub fn complete(&self, cells: &mut [Cell], compute: impl Fn(&mut Walk, usize) -> Cell + Sync) {
        if self.tree.get().is_some() {
            return;
        }
        // Cells are large, so that even a look at each takes a while.
        let all = cells.par_iter().enumerate().with_min_len(FEW_CELLS);
        let open: Vec<usize> = all.filter(|(_, cell)| cell.needs_more_sites).map(|(k, _)| k).collect();
        if open.is_empty() {
            return;
        }
        self.tree.get_or_init(|| KdTree::new(self.sites.positions));
        let new: Vec<Cell> = open.par_iter().map_init(Walk::default, |walk, k| compute(walk, *k)).collect();
        open.into_iter().zip(new).for_each(|(k, cell)| cells[k] = cell);
    }
}

/// What a cell of a regular layout has six of: kept inside the cell.
pub(crate) type Few<T> = SmallVec<[T; 8]>;

/// One cell.
#[derive(Default)]
pub(crate) struct Cell {
    /// The two other sites at each of its corners, counter-clockwise.
    pub corners: Few<[u32; 2]>,
    pub area: f64,
    /// The neighbours along its outline, each with the triangle in which the edge lies.
    pub edges: Few<[u32; 2]>,
    /// The triangles that it lies in, in ascending order.
    pub triangles: SmallVec<[u32; 4]>,
    /// Whether it is a cell in the site's tangent plane, with nothing but corners.
    pub is_in_tangent_plane: bool,
    /// Whether the sites listed as near were too few to bound it.
    pub needs_more_sites: bool,
    /// What it has of the patch boundary, if it reaches there.
    pub on_boundary: Option<Box<CellOnBoundary>>,
    /// The centre, farthest from the site, of its parts in single triangles, with the triangle.
    pub farthest: (DVec3, u32),
}

/// A cell's part of the patch boundary.
#[derive(Default)]
pub(crate) struct CellOnBoundary {
    /// Where the outline, counter-clockwise, reaches the boundary and leaves it.
    pub exits: Vec<OnBoundary>,
    pub entries: Vec<OnBoundary>,
    /// How many half-edges it touches.
    pub half_edges: usize,
}

/// A cut that does not count.
#[derive(Debug, Clone)]
pub(crate) struct Uncut {
    /// The site that would cut.
    pub by: u32,
    /// The triangles, in ascending order, where it does count.
    pub but_in: Vec<u32>,
}

/// A point on the patch boundary where the cell of a neighbour begins or ends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OnBoundary {
    pub neighbour: u32,
    pub half: u32,
    pub point: DVec3,
}

/// The weight of a site, in squared distances.
#[derive(Clone, Copy)]
struct Weight {
    own: f64,
    /// What it is below.
    most: f64,
}

impl Weight {
    fn of(sites: &CellSites, site: u32) -> Self {
        let most = WEIGHT * sites.spacing_at(site).powi(2);
        Self { own: most * unit_hash(site), most }
    }
}

/// A site that may cut a cell.
struct Candidate {
    distance_sq: f64,
    /// How far the weights move the bisector from the middle, times the distance.
    offset: f64,
    /// The most by which the weights change a squared distance.
    slack: f64,
    site: u32,
    /// Whether it counts; `None` until it would cut, since finding out takes a search over the surface.
    counts: Option<bool>,
}

/// A set of triangles that is cleared in constant time.
#[derive(Default)]
struct Marks {
    round: u32,
    of: Vec<u32>,
}

impl Marks {
    fn clear(&mut self, triangles: usize) {
        self.of.resize(triangles, 0);
        self.round += 1;
    }

    /// Whether `t` was not in the set yet.
    fn insert(&mut self, t: u32) -> bool {
        std::mem::replace(&mut self.of[t as usize], self.round) != self.round
    }
}

/// What candidates for cutting the cell of a sector are compared with.
struct Gathering<'a, 's> {
    scene: &'a Scene<'s>,
    at: DVec3,
    weight: Weight,
    normal: DVec3,
    patch: u32,
}

impl<'a, 's> Gathering<'a, 's> {
    fn new(scene: &'a Scene<'s>, s: usize) -> Self {
        let sectors = &scene.sectors;
        let site = sectors.site[s];
        let (at, weight) = (scene.sites.positions[site as usize], Weight::of(scene.sites, site));
        Self { scene, at, weight, normal: sectors.normal[s], patch: sectors.patch[s] }
    }

    /// Takes a site in the sector's patch as a candidate. It counts if it is on the same side of the surface,
    /// or if the surface connects to it nearby.
    #[inline]
    fn add(&self, candidates: &mut Vec<Candidate>, site: u32) {
        let Scene { sites, sectors, .. } = self.scene;
        let agrees = |other: usize| self.normal.dot(sectors.normal[other]) > 0.0;
        let counts = if sectors.are_sites && sectors.in_one_patch {
            agrees(site as usize)
        } else {
            let mut theirs = sectors.in_patch(site, self.patch).peekable();
            if theirs.peek().is_none() {
                return;
            }
            theirs.any(agrees)
        };
        let theirs = Weight::of(sites, site);
        candidates.push(Candidate {
            distance_sq: self.at.distance_squared(sites.positions[site as usize]),
            offset: 0.5 * (self.weight.own - theirs.own),
            slack: 4.0 * self.weight.most.max(theirs.most),
            site,
            counts: counts.then_some(true),
        });
    }
}

/// The working memory of one thread.
#[derive(Default)]
pub(crate) struct Walk {
    /// Sites that may cut the cell, nearest first.
    candidates: Vec<Candidate>,
    /// The distance up to which `candidates` has all such sites.
    searched: f64,
    found: Vec<u32>,
    /// The sites that the surface connects to nearby, sorted, once computed.
    reached: Option<Vec<u32>>,
    visited: Marks,
    flooded: Marks,
    stack: Vec<u32>,
    clipped: Clipped,
}

impl Walk {
    /// The cell of sector `s`; cuts `without` do not count. It is not complete before [`Scene::complete`].
    pub fn cell(&mut self, scene: &Scene, s: usize, without: &[Uncut]) -> Cell {
        let surface = scene.surface;
        let at = scene.sites.positions[scene.sectors.site[s] as usize];
        let shortest_sq = (NEGLIGIBLE_EDGE * scene.sites.spacing_at(scene.sectors.site[s])).powi(2);
        let mut cell = Cell::default();
        let mut farthest_sq = -1.0;
        self.reached = None;
        let mut all = self.near_candidates(scene, s);
        self.visited.clear(surface.triangles.len());
        self.stack.clear();
        scene.sectors.around(s).iter().for_each(|t| self.visit(*t));
        while let Some(t) = self.stack.pop() {
            while !self.clip(scene, s, t, without) && !all {
                cell.needs_more_sites = true;
                let Some(tree) = scene.tree.get() else { return cell };
                all = self.more_candidates(scene, s, tree);
            }
            let count = self.clipped.polygon.len();
            if count > 0 {
                cell.triangles.push(t);
            }
            let middle = self.clipped.polygon.iter().map(|(p, _)| *p).sum::<DVec3>() / count as f64;
            // For an empty polygon `middle` is NaN and the comparison false.
            if middle.distance_squared(at) > farthest_sq {
                farthest_sq = middle.distance_squared(at);
                cell.farthest = (middle, t);
            }
            for m in 0..count {
                let (point, label) = self.clipped.polygon[m];
                let (next, _) = self.clipped.polygon[if m + 1 == count { 0 } else { m + 1 }];
                let (_, before) = self.clipped.polygon[if m == 0 { count - 1 } else { m - 1 }];
                if let Label::Site(j) = label
                    && point.distance_squared(next) > shortest_sq
                {
                    cell.edges.push([j, t]);
                }
                cell.area += 0.5 * surface.normals[t as usize].dot((point - at).cross(next - at));
                match (before, label) {
                    (Label::Site(j), Label::Site(k)) => cell.corners.push([j, k]),
                    (before, Label::Edge(side)) => match surface.across(t, side) {
                        Some(next) => self.visit(next),
                        None => {
                            let on_boundary = cell.on_boundary.get_or_insert_default();
                            on_boundary.half_edges += 1;
                            if let Label::Site(neighbour) = before {
                                on_boundary.exits.push(OnBoundary {
                                    neighbour,
                                    half: 3 * t + u32::from(side),
                                    point,
                                });
                            }
                        }
                    },
                    (Label::Edge(side), Label::Site(neighbour)) => {
                        if surface.across(t, side).is_none() {
                            let on_boundary = cell.on_boundary.get_or_insert_default();
                            on_boundary.entries.push(OnBoundary {
                                neighbour,
                                half: 3 * t + u32::from(side),
                                point,
                            });
                        }
                    }
                }
            }
        }
        cell.triangles.sort_unstable();
        cell
    }

    /// The cell of sector `s` in its tangent plane, as its corners alone; it has none if the sites listed as
    /// near do not bound it.
    pub fn tangent_cell(&mut self, scene: &Scene, s: usize) -> Cell {
        let all = self.near_candidates(scene, s);
        self.candidates.retain(|candidate| candidate.counts == Some(true));
        // As the device smooths normals: those of single triangles may be at random.
        let around = self.candidates.iter().take(RING).map(|c| scene.sectors.normal[c.site as usize]);
        let normal = (scene.sectors.normal[s] + around.sum::<DVec3>()).normalize_or_zero();
        let site = scene.sectors.site[s];
        let (at, reach) = (scene.sites.positions[site as usize], REACH * scene.sites.spacing_at(site));
        let u = normal.any_orthonormal_vector() * reach;
        let v = normal.cross(u) * 3.0_f64.sqrt();
        self.clipped.start([at - u - v, at + 2.0 * u, at - u + v]);
        let is_bounded = self.cut(scene, s, |_| true) || all;
        let mut cell = Cell { is_in_tangent_plane: true, ..Cell::default() };
        let polygon = &self.clipped.polygon;
        let before = polygon.iter().skip(polygon.len().saturating_sub(1)).chain(polygon);
        for pair in before.zip(polygon) {
            match pair {
                ((_, Label::Site(j)), (_, Label::Site(k))) if is_bounded => cell.corners.push([*j, *k]),
                _ => {
                    cell.corners.clear();
                    return cell;
                }
            }
        }
        cell
    }

    fn visit(&mut self, t: u32) {
        if self.visited.insert(t) {
            self.stack.push(t);
        }
    }

    /// Clips a triangle by the bisectors into `clipped`; false if the candidates ended before the security
    /// radius, so that other sites may cut it too.
    fn clip(&mut self, scene: &Scene, s: usize, t: u32, without: &[Uncut]) -> bool {
        let uncut = |u: &Uncut, by: u32| u.by == by && u.but_in.binary_search(&t).is_err();
        self.clipped.start(scene.surface.corners(t));
        self.cut(scene, s, |by| !without.iter().any(|u| uncut(u, by)))
    }

    /// Cuts `clipped` by the bisectors with the candidates that `cuts` holds for; false if they ended before
    /// the security radius.
    fn cut(&mut self, scene: &Scene, s: usize, cuts: impl Fn(u32) -> bool) -> bool {
        let sites = scene.sites;
        let at = sites.positions[scene.sectors.site[s] as usize];
        let farthest = |polygon: &[(DVec3, Label)]| {
            polygon.iter().map(|(p, _)| p.distance_squared(at)).fold(0.0, f64::max)
        };
        let mut radius_sq = farthest(&self.clipped.polygon);
        for c in 0..self.candidates.len() {
            let Candidate { distance_sq, offset, slack, site: j, counts } = self.candidates[c];
            // The weights shift a bisector slightly.
            if distance_sq > 4.01 * radius_sq + slack {
                return true;
            }
            let other = sites.positions[j as usize];
            let (middle, direction) = (0.5 * (at + other), other - at);
            let beyond = |p: DVec3| (p - middle).dot(direction) - offset;
            if counts != Some(false) && cuts(j) && self.clipped.is_cut(beyond) && self.counts(scene, s, c) {
                self.clipped.cut(Label::Site(j));
                if self.clipped.polygon.is_empty() {
                    return true;
                }
                radius_sq = farthest(&self.clipped.polygon);
            }
        }
        false
    }

    /// Gathers the sites listed as near; true if these are all sites.
    fn near_candidates(&mut self, scene: &Scene, s: usize) -> bool {
        let (n, near) = (scene.sites.positions.len(), scene.sites.near);
        let gathering = Gathering::new(scene, s);
        self.candidates.clear();
        let (mut slot, mut listed, mut farthest_sq) = (scene.sectors.site[s] as usize, 0, 0.0_f64);
        while let Some(&j) = near.get(slot).filter(|j| **j != u32::MAX) {
            gathering.add(&mut self.candidates, j);
            farthest_sq = farthest_sq.max(gathering.at.distance_squared(scene.sites.positions[j as usize]));
            (slot, listed) = (slot + n, listed + 1);
        }
        self.searched = farthest_sq.sqrt();
        self.sort_candidates();
        listed + 1 >= n
    }

    /// Gathers the sites up to twice the previous distance; true if these are all sites.
    fn more_candidates(&mut self, scene: &Scene, s: usize, tree: &KdTree) -> bool {
        let sites = scene.sites;
        let gathering = Gathering::new(scene, s);
        self.searched = 2.0 * self.searched.max(sites.spacing_at(scene.sectors.site[s]));
        tree.within(gathering.at, self.searched, usize::MAX, &mut self.found);
        self.candidates.clear();
        for j in self.found.iter().filter(|j| **j != scene.sectors.site[s]) {
            gathering.add(&mut self.candidates, *j);
        }
        self.sort_candidates();
        self.found.len() == sites.positions.len()
    }

    fn sort_candidates(&mut self) {
        self.candidates
            .sort_unstable_by(|a, b| a.distance_sq.total_cmp(&b.distance_sq).then(a.site.cmp(&b.site)));
    }

    /// Whether candidate `c` of sector `s` counts.
    fn counts(&mut self, scene: &Scene, s: usize, c: usize) -> bool {
        if let Some(known) = self.candidates[c].counts {
            return known;
        }
        let reached = self.reached.take().unwrap_or_else(|| self.flood(scene, s));
        let counts = reached.binary_search(&self.candidates[c].site).is_ok();
        self.reached = Some(reached);
        self.candidates[c].counts = Some(counts);
        counts
    }

    /// The sites, sorted, in triangles connected with those of sector `s` within [`REACH`] spacings of it.
    fn flood(&mut self, scene: &Scene, s: usize) -> Vec<u32> {
        let surface = scene.surface;
        let at = scene.sites.positions[scene.sectors.site[s] as usize];
        let reach = REACH * scene.sites.spacing_at(scene.sectors.site[s]);
        self.flooded.clear(surface.triangles.len());
        let mut stack = scene.sectors.around(s).to_vec();
        stack.iter().for_each(|t| {
            self.flooded.insert(*t);
        });
        let mut reached = Vec::new();
        while let Some(t) = stack.pop() {
            if !surface.is_within(reach, at, t) {
                continue;
            }
            reached.extend_from_slice(scene.by_triangle.of(t));
            for next in (0..3).filter_map(|side| surface.across(t, side)) {
                if self.flooded.insert(next) {
                    stack.push(next);
                }
            }
        }
        reached.sort_unstable();
        reached
    }
}

/// A fixed number in 0..1 for each index (the finaliser of MurmurHash3).
fn unit_hash(i: u32) -> f64 {
    let mut h = i.wrapping_add(0x9e37_79b9);
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    f64::from(h ^ (h >> 16)) / f64::from(u32::MAX)
}
