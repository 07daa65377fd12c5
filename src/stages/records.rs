//! The triangles of the surface as the searches for closest points read them: in spatial order, each with its
//! corners, adjacent triangles and normals.

use super::octahedral::pack;
use crate::Result;
use crate::gpu::{Buffer, Device};
use crate::mesh::NONE;
use crate::mesh::half_edges::{next, twins};
use crate::mesh::topology::Partition;
use crate::mesh::triangle::angle_at_first;
use crate::sites::morton::morton_code;
use crate::sites::surface::Surface;
use crate::sites::surface_curves::SurfaceCurves;
use glam::{DVec3, UVec4};
use rayon::prelude::*;

/// Buffers over the triangles by *rank*, their place in spatial order.
pub struct TriangleRecords {
    /// `records[3 * rank + k]`: corner k in the bits of three floats, and the half-edge (`3 * rank + side`)
    /// across the side from corner k to the next, [`NONE`] at boundaries, where more than two triangles meet,
    /// where two meet that run the same way along the side, and on curves.
    pub records: Buffer<UVec4>,
    /// Unit normals in octahedral form: of the surface at the three corners, and of the triangle.
    pub corner_normals: Buffer<UVec4>,
    /// The rank of each triangle.
    pub rank: Buffer<u32>,
    /// The triangle of each rank.
    pub order: Buffer<u32>,
}

impl TriangleRecords {
    /// Prepares and uploads the records of `surface`. No walk crosses its `curves`, and normals are those of
    /// the patch.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] if they do not fit.
    pub fn new(device: &Device, surface: &Surface, curves: Option<&SurfaceCurves>) -> Result<Self> {
        let order = sorted(&spatial_keys(surface));
        let mut rank = vec![0; order.len()];
        for (r, t) in (0..).zip(&order) {
            rank[*t as usize] = r;
        }
        let mut twins = twins(&surface.triangles);
        if let Some(curves) = curves {
            let on_curve = twins.iter_mut().zip(&curves.on_curve).filter(|(_, on_curve)| **on_curve);
            on_curve.for_each(|(twin, _)| *twin = NONE);
        }
        let to_rank = |half_edge: u32| {
            if half_edge == NONE { NONE } else { 3 * rank[half_edge as usize / 3] + half_edge % 3 }
        };
        let records: Vec<UVec4> = order
            .par_iter()
            .flat_map_iter(|t| (0..3).map(move |k| 3 * *t as usize + k))
            .map(|corner| {
                let p = surface.vertices[surface.triangles[corner / 3][corner % 3] as usize].as_vec3();
                UVec4::new(p.x.to_bits(), p.y.to_bits(), p.z.to_bits(), to_rank(twins[corner]))
            })
            .collect();
        let meeting = match curves {
            None => surface.triangles.as_flattened().to_vec(),
            Some(_) => fans(&twins),
        };
        let means = mean_normals(surface, &meeting);
        let normals: Vec<UVec4> = order
            .par_iter()
            .map(|t| {
                let t = *t as usize;
                packed_normals(surface.normals[t], [0, 1, 2].map(|k| means[meeting[3 * t + k] as usize]))
            })
            .collect();
        Ok(Self {
            records: Buffer::from_slice(device, "surface.records", &records)?,
            corner_normals: Buffer::from_slice(device, "surface.corner_normals", &normals)?,
            rank: Buffer::from_slice(device, "surface.rank", &rank)?,
            order: Buffer::from_slice(device, "surface.order", &order)?,
        })
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// Whether there are no triangles.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }
}

/// Bits of a Morton code.
const CODE_BITS: u32 = 60;

/// One key a triangle; ascending keys are spatial order. Triangles much larger than most come last, by class
/// of size: among small ones they would inflate every box that holds one.
fn spatial_keys(surface: &Surface) -> Vec<u64> {
    let corners = |t: &[u32; 3]| t.map(|v| surface.vertices[v as usize]);
    let extent = |t: &[u32; 3]| {
        let [a, b, c] = corners(t);
        (a.max(b).max(c) - a.min(b).min(c)).length()
    };
    let mut extents: Vec<f64> = surface.triangles.par_iter().map(extent).collect();
    let middle = extents.len() / 2;
    let usual =
        if extents.is_empty() { 1.0 } else { *extents.select_nth_unstable_by(middle, f64::total_cmp).1 };
    surface
        .triangles
        .par_iter()
        .map(|t| {
            let [a, b, c] = corners(t);
            // Up to 8 times the usual extent is class 0, and each further factor of 4 one more.
            let class = ((extent(t) / (2.0 * usual)).log2() / 2.0).clamp(0.0, 15.0) as u64;
            class << CODE_BITS | morton_code((a + b + c) / 3.0)
        })
        .collect()
}

/// Indices in ascending order of their keys, ties by index.
fn sorted(keys: &[u64]) -> Vec<u32> {
    let mut keyed: Vec<(u64, u32)> = keys.iter().copied().zip(0..).collect();
    keyed.par_sort_unstable();
    keyed.into_iter().map(|(_, i)| i).collect()
}

/// For each corner (`3 * triangle + k`) the first of those around the same vertex that `twins` lead to.
fn fans(twins: &[u32]) -> Vec<u32> {
    let mut partition = Partition::new(twins.len());
    for (corner, twin) in (0..).zip(twins).filter(|(_, twin)| **twin != NONE) {
        // The twin runs against this side, so it ends where this one begins.
        partition.join(corner, next(*twin));
    }
    (0..twins.len() as u32).map(|corner| partition.root(corner)).collect()
}

/// Normals where corners meet, `meeting[corner]` of all of them: each the mean of the triangles by their
/// angles there; zero where they cancel.
fn mean_normals(surface: &Surface, meeting: &[u32]) -> Vec<DVec3> {
    let count = meeting.iter().max().map_or(0, |last| *last as usize + 1);
    let mut sums = vec![DVec3::ZERO; count];
    for (t, normal) in surface.normals.iter().enumerate() {
        for k in 0..3 {
            let [p, q, r] =
                [k, (k + 1) % 3, (k + 2) % 3].map(|c| surface.vertices[surface.triangles[t][c] as usize]);
            let angle = angle_at_first([p, q, r]);
            sums[meeting[3 * t + k] as usize] += *normal * angle;
        }
    }
    sums.into_iter().map(DVec3::normalize_or_zero).collect()
}

/// Cosine of the largest angle, 84 degrees, between the normals of a triangle and of its corners. Where the
/// mesh folds back at a vertex, the triangle's own normal stands in: then all means of the three are on the
/// triangle's side.
const MIN_CORNER_COSINE: f64 = 0.1;

fn packed_normals(own: DVec3, at_corners: [DVec3; 3]) -> UVec4 {
    let [a, b, c] = at_corners.map(|n| pack(if n.dot(own) > MIN_CORNER_COSINE { n } else { own }));
    UVec4::new(a, b, c, pack(own))
}
