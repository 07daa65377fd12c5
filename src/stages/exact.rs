//! Exact restricted Voronoi cells on the device, whether connected or not: area, first moment and energy of
//! each.
//!
//! First the sites that may own a part of each triangle are found, then every part is computed by itself, and
//! last the parts are sorted by site and summed. In between the host learns how many parts there are, and
//! computes those triangles that too many sites share.

use super::neighbours::lists::Lists;
use super::spatial::{Scan, Sort};
use crate::Result;
use crate::gpu::kernels::exact::{aim, enough, listed, pairs, pieces, sums, walked};
use crate::gpu::{Buffer, Device, Download, Pipeline, Recorder, Submitted, Threads};
use crate::mesh::NONE;
use crate::mesh::kd_tree::KdTree;
use crate::mesh::triangle::doubled_normal;
use crate::sites::morton::morton_order;
use crate::sites::restricted_voronoi::{RestrictedVoronoi, bisect};
use crate::sites::surface::Surface;
use glam::{DVec3, UVec4, Vec4};
use rayon::prelude::*;

/// Triangles with a side longer than this many spacings are bisected, which does not change the cells.
const LONGEST_SIDE: f64 = 0.8;
/// A triangle of smaller height has no area in f32 in the unit-diagonal frame.
const FLAT: f64 = 1e-8;
/// Capacity over the number of parts, so that buffers seldom have to grow.
const SPARE: f64 = 1.25;
/// Parts of a site that are summed by one dispatch, and in one round of a kernel's loop: lavapipe ends a
/// thread after 65,535 rounds.
const PARTS_A_DISPATCH: u32 = 400_000;

/// The surface's triangles, bisected until none is much larger than the cells.
pub struct CutTriangles {
    triangles: Vec<[DVec3; 3]>,
    corners: Buffer<Vec4>,
}

impl CutTriangles {
    /// For cells of sites that are `spacing` apart.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] if they do not fit on the device.
    pub fn new(device: &Device, surface: &Surface, spacing: f64) -> Result<Self> {
        let mut cut = Vec::with_capacity(surface.triangles.len());
        for triangle in &surface.triangles {
            cut_into(longest_first(triangle.map(|v| surface.vertices[v as usize])), spacing, &mut cut);
        }
        let middles: Vec<DVec3> = cut.iter().map(|[a, b, c]| (*a + *b + *c) / 3.0).collect();
        let triangles: Vec<[DVec3; 3]> = morton_order(&middles)
            .into_iter()
            .map(|t| cut[t as usize].map(|p| p.as_vec3().as_dvec3()))
            .collect();
        let corners: Vec<Vec4> = triangles.as_flattened().iter().map(|p| p.as_vec3().extend(0.0)).collect();
        let corners = Buffer::from_slice(device, "exact.corners", &corners)?;
        Ok(Self { triangles, corners })
    }

    /// The site nearest to the middle of each; empty without sites.
    fn nearest(&self, sites: &[DVec3]) -> Vec<u32> {
        let tree = KdTree::new(sites);
        let middle = |[a, b, c]: &[DVec3; 3]| (*a + *b + *c) / 3.0;
        self.triangles.par_iter().filter_map(|t| tree.nearest(middle(t))).collect()
    }

    /// Number of triangles after the cutting.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Whether no triangle has an area.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }
}

/// The same triangle, its longest side from the first corner to the second.
fn longest_first([a, b, c]: [DVec3; 3]) -> [DVec3; 3] {
    let [ab, bc, ca] = [a.distance_squared(b), b.distance_squared(c), c.distance_squared(a)];
    if ab >= bc && ab >= ca {
        [a, b, c]
    } else if bc >= ca {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

fn cut_into(triangle: [DVec3; 3], spacing: f64, cut: &mut Vec<[DVec3; 3]>) {
    let [a, b, _] = triangle;
    let longest = a.distance(b);
    if doubled_normal(triangle).length() <= FLAT * longest {
        return;
    }
    if longest <= LONGEST_SIDE * spacing {
        cut.push(triangle);
        return;
    }
    for half in bisect(triangle) {
        cut_into(longest_first(half), spacing, cut);
    }
}

/// What happened in a computation of the cells.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ExactCounts {
    /// Pairs of a triangle and a site that may own a part of it.
    pub pairs: usize,
    /// Triangles whose sites the neighbour lists did not decide.
    pub undecided: usize,
    /// Triangles computed on the host.
    pub crowded: usize,
}

/// Buffers for pairs of a triangle and a site.
struct Pairs {
    triangle: Buffer<u32>,
    moments: Buffer<Vec4>,
    energies: Buffer<f32>,
    sort: Sort,
}

impl Pairs {
    fn new(device: &Device, room: usize, sites: usize, workgroup: Option<u32>) -> Result<Self> {
        let bits = u32::BITS - (sites as u32).leading_zeros();
        Ok(Self {
            triangle: Buffer::new(device, "exact.pair_triangle", room)?,
            moments: Buffer::new(device, "exact.moments", room)?,
            energies: Buffer::new(device, "exact.energies", room)?,
            sort: Sort::new(device, room, bits, workgroup)?,
        })
    }

    fn room(&self) -> usize {
        self.triangle.len()
    }
}

/// Downloads of [`ExactCells::record_parts`].
pub struct Parts {
    pairs: Download<u32>,
    counters: Download<u32>,
}

/// Kernels and buffers.
pub struct ExactCells {
    listed: Pipeline<listed::Shader>,
    enough: Pipeline<enough::Shader>,
    walked: Pipeline<walked::Shader>,
    walked_group: u32,
    walked_groups: Buffer<UVec4>,
    pairs_kernel: Pipeline<pairs::Shader>,
    pieces: Pipeline<pieces::Shader>,
    sums: Pipeline<sums::Shader>,
    workgroup: Option<u32>,
    slots: usize,
    candidates: Buffer<u32>,
    starts: Buffer<u32>,
    counters: Buffer<u32>,
    scan: Scan,
    pairs: Option<Pairs>,
    extra: Buffer<Vec4>,
    /// For each site the integral of the way from it over its cell (xyz), and the cell's area (w).
    pub cells: Buffer<Vec4>,
    /// The integral of the squared distance to the site.
    pub energies: Buffer<f32>,
}

impl ExactCells {
    /// For sites that begin at `sites`, with lists of `k` neighbours, at most 23. A triangle may have parts
    /// of `pieces` sites (1 to 24; `None`: 12) before it is left to the host.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(
        device: &Device,
        triangles: &CutTriangles,
        sites: &[DVec3],
        k: u32,
        pieces: Option<u32>,
        workgroup: Option<u32>,
    ) -> Result<Self> {
        let by_list = listed::Constants { k, ..Default::default() };
        let pieces = pieces.unwrap_or(by_list.pieces);
        let group = |own: u32| workgroup.unwrap_or(own);
        let mut by_walk = walked::Constants::default();
        // Smaller workgroups than a subgroup would leave lanes idle.
        by_walk.workgroup = by_walk.workgroup.max(device.info().limits.subgroup_size);
        let count = triangles.len();
        let slots = pieces as usize + 1;
        let mut candidates = vec![NONE; count * (slots + 2)];
        for (t, nearest) in triangles.nearest(sites).into_iter().enumerate() {
            candidates[t * slots] = nearest;
        }
        let sites = sites.len();
        Ok(Self {
            listed: Pipeline::new(
                device,
                listed::Constants { workgroup: group(by_list.workgroup), pieces, ..by_list },
            )?,
            enough: Pipeline::new(device, enough::Constants::default())?,
            walked: Pipeline::new(
                device,
                walked::Constants { workgroup: group(by_walk.workgroup), pieces, ..by_walk },
            )?,
            walked_group: group(by_walk.workgroup),
            walked_groups: Buffer::new(device, "exact.walked_groups", 1)?,
            pairs_kernel: Pipeline::new(
                device,
                pairs::Constants { workgroup: group(pairs::Constants::default().workgroup), pieces },
            )?,
            pieces: Pipeline::new(
                device,
                pieces::Constants { workgroup: group(pieces::Constants::default().workgroup), pieces },
            )?,
            sums: Pipeline::new(
                device,
                sums::Constants { workgroup: group(sums::Constants::default().workgroup) },
            )?,
            workgroup,
            slots,
            candidates: Buffer::from_slice(device, "exact.candidates", &candidates)?,
            starts: Buffer::new(device, "exact.starts", count + 1)?,
            counters: Buffer::new(device, "exact.counters", 2)?,
            scan: Scan::new(device, count + 1, workgroup)?,
            pairs: None,
            extra: Buffer::new(device, "exact.extra", 2 * sites)?,
            cells: Buffer::new(device, "exact.cells", sites)?,
            energies: Buffer::new(device, "exact.cell_energies", sites)?,
        })
    }

    /// Records the search for the sites that may own a part of each triangle. `lists` are those of the sites,
    /// refreshed.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record_parts(
        &self,
        recorder: &mut Recorder,
        triangles: &CutTriangles,
        sites: &Buffer<Vec4>,
        lists: &Lists,
    ) -> Result<Parts> {
        recorder.fill(&self.counters, 0)?;
        let (triangle_count, site_count) = (triangles.len() as u32, sites.len() as u32);
        if sites.is_empty() || triangles.is_empty() {
            recorder.fill(&self.starts, 0)?;
        }
        let found = if sites.is_empty() { 0 } else { triangles.len() };
        let bindings = listed::Bindings {
            corners: &triangles.corners,
            sites,
            neighbours: lists.neighbours.whole()?,
            away: &lists.away,
            status: &lists.status,
            candidates: &self.candidates,
            counts: &self.starts,
            counters: &self.counters,
        };
        recorder.dispatch(
            &self.listed,
            Threads(found),
            &listed::Push { triangle_count, site_count },
            &bindings,
        )?;
        let tree = lists.tree();
        let push = walked::Push {
            starts_low: tree.starts[0],
            starts_high: tree.starts[1],
            levels: tree.levels,
            triangle_count,
            site_count,
        };
        let bindings = walked::Bindings {
            corners: &triangles.corners,
            sites,
            boxes: tree.boxes,
            away: &lists.away,
            status: &lists.status,
            candidates: &self.candidates,
            counts: &self.starts,
            counters: &self.counters,
        };
        // On a CPU an idle thread costs as much as a busy one.
        let most_x = recorder.groups(&self.walked, Threads(found)).x;
        let enough = enough::Push { group_size: self.walked_group, most_x };
        let counted = enough::Bindings { counters: &self.counters, groups: &self.walked_groups };
        recorder.dispatch(&self.enough, Threads(1), &enough, &counted)?;
        recorder.dispatch_indirect(&self.walked, &self.walked_groups, 0, &push, &bindings)?;
        self.scan.record(recorder, &self.starts)?;
        Ok(Parts {
            pairs: recorder.download(self.scan.total())?,
            counters: recorder.download(&self.counters)?,
        })
    }

    /// Records the cells from the downloads of the submission that found the parts.
    ///
    /// # Errors
    /// As [`ExactCells::new`] and [`Recorder::dispatch`].
    pub fn record_cells(
        &mut self,
        device: &Device,
        recorder: &mut Recorder,
        triangles: &CutTriangles,
        sites: &Buffer<Vec4>,
        (found, parts): (&Submitted, &Parts),
    ) -> Result<ExactCounts> {
        let count = |list: Vec<u32>, i: usize| list.get(i).copied().unwrap_or(0);
        let pair_count = count(found.read(&parts.pairs)?, 0);
        let counters: Vec<u32> = found.read(&parts.counters)?;
        let counts = ExactCounts {
            pairs: pair_count as usize,
            undecided: count(counters.clone(), 0) as usize,
            crowded: count(counters, 1) as usize,
        };
        if counts.crowded > 0 {
            let extra = self.crowded_parts(device, triangles, sites, counts.crowded)?;
            recorder.upload(&self.extra, &extra)?;
        }
        let pairs = match self.pairs.take().filter(|pairs| pairs.room() >= counts.pairs) {
            Some(pairs) => pairs,
            None => Pairs::new(device, (SPARE * counts.pairs as f64) as usize, sites.len(), self.workgroup)?,
        };
        self.record_pieces(recorder, triangles, sites, &pairs, pair_count)?;
        pairs.sort.record(recorder)?;
        let use_extra = u32::from(counts.crowded > 0);
        self.record_sums(recorder, sites.len(), &pairs, pair_count, use_extra)?;
        self.pairs = Some(pairs);
        Ok(counts)
    }

    fn record_pieces(
        &self,
        recorder: &mut Recorder,
        triangles: &CutTriangles,
        sites: &Buffer<Vec4>,
        room: &Pairs,
        pair_count: u32,
    ) -> Result<()> {
        let push = pairs::Push {
            triangle_count: triangles.len() as u32,
            site_count: sites.len() as u32,
            pair_count,
            capacity: room.room() as u32,
        };
        let bindings = pairs::Bindings {
            starts: &self.starts,
            candidates: &self.candidates,
            pair_triangle: &room.triangle,
            keys: &room.sort.keys,
            values: &room.sort.values,
        };
        let threads = Threads(triangles.len().max(room.room()));
        recorder.dispatch(&self.pairs_kernel, threads, &push, &bindings)?;
        let bindings = pieces::Bindings {
            corners: &triangles.corners,
            sites,
            candidates: &self.candidates,
            starts: &self.starts,
            pair_triangle: &room.triangle,
            moments: &room.moments,
            energies: &room.energies,
        };
        recorder.dispatch(&self.pieces, Threads(pair_count as usize), &pieces::Push { pair_count }, &bindings)
    }

    fn record_sums(
        &self,
        recorder: &mut Recorder,
        sites: usize,
        room: &Pairs,
        pair_count: u32,
        use_extra: u32,
    ) -> Result<()> {
        let bindings = sums::Bindings {
            keys: &room.sort.keys,
            values: &room.sort.values,
            moments: &room.moments,
            energies: &room.energies,
            extra: &self.extra,
            cells: &self.cells,
            cell_energies: &self.energies,
        };
        for from in (0..pair_count.max(1)).step_by(PARTS_A_DISPATCH as usize) {
            let until = from.saturating_add(PARTS_A_DISPATCH);
            let push = sums::Push { site_count: sites as u32, pair_count, from, until, use_extra };
            recorder.dispatch(&self.sums, Threads(sites), &push, &bindings)?;
        }
        Ok(())
    }

    /// The parts of the crowded triangles, as `extra` of the sums.
    fn crowded_parts(
        &self,
        device: &Device,
        triangles: &CutTriangles,
        sites: &Buffer<Vec4>,
        count: usize,
    ) -> Result<Vec<Vec4>> {
        let sites: Vec<DVec3> =
            sites.to_vec(device)?.iter().map(|s: &Vec4| s.truncate().as_dvec3()).collect();
        let candidates = self.candidates.to_vec(device)?;
        let first = triangles.len() * (self.slots + 1);
        let mut crowded = candidates[first..first + count].to_vec();
        crowded.sort_unstable();
        let crowded: Vec<[DVec3; 3]> = crowded.iter().map(|t| triangles.triangles[*t as usize]).collect();
        let cells = RestrictedVoronoi::new(&sites).cells_on(&crowded);
        Ok(cells
            .iter()
            .flat_map(|c| [c.first.as_vec3().extend(c.area as f32), Vec4::splat(c.energy as f32)])
            .collect())
    }
}

/// The step of a site to the centroid of its cell.
pub struct Aim {
    pipeline: Pipeline<aim::Shader>,
    /// Where the sites go, w = 0.
    pub targets: Buffer<Vec4>,
    centroids: Buffer<Vec4>,
}

impl Aim {
    /// For `sites` sites.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, sites: usize, workgroup: Option<u32>) -> Result<Self> {
        let mut constants = aim::Constants::default();
        constants.workgroup = workgroup.unwrap_or(constants.workgroup);
        Ok(Self {
            pipeline: Pipeline::new(device, constants)?,
            targets: Buffer::new(device, "exact.targets", sites)?,
            centroids: Buffer::zeros(device, "exact.centroids", sites)?,
        })
    }

    /// Records the targets; `momentum` (0 to 1) is the share of the last motion that is added, and no move is
    /// longer than `largest_move`.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        sites: &Buffer<Vec4>,
        cells: &ExactCells,
        momentum: f32,
        largest_move: f32,
    ) -> Result<()> {
        let push = aim::Push { site_count: sites.len() as u32, momentum, largest_move };
        let bindings =
            aim::Bindings { sites, cells: &cells.cells, targets: &self.targets, centroids: &self.centroids };
        recorder.dispatch(&self.pipeline, Threads(sites.len()), &push, &bindings)
    }
}
