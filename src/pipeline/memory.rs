//! Device memory that a run needs, by estimate, and the refusal of runs that need more than there is.

use super::near_sites::LIST;
use crate::gpu::Device;
use crate::gpu::kernels::face::cell;
use crate::mesh::features::spacing_of;
use crate::mesh::subdivide::halved_count;
use crate::options::{Face, Projection};
use crate::options::{Method, Options, Sizing};
use crate::{Error, Result, TriMesh};

/// Device bytes for each vertex of the input in `sites/surface.rs`, except with the default pipeline.
const VERTEX_BYTES: u64 = 20;
/// Device bytes for each triangle of the input in `sites/surface.rs`, except with the default pipeline.
const TRIANGLE_BYTES: u64 = 44;
/// Device bytes for each vertex of the input for walks over it: `stages/records.rs`,
/// `stages/project/bvh.rs`.
const WEDGE_BYTES: u64 = 16;
/// Device bytes for each triangle of the input for walks over it: `stages/records.rs`,
/// `stages/project/bvh.rs`.
const RECORD_BYTES: u64 = 39;
/// The part of [`RECORD_BYTES`] in the largest buffer.
const LARGEST_OF_RECORD: u64 = 12;
/// The part of [`TRIANGLE_BYTES`] in the largest buffer.
const LARGEST_OF_TRIANGLE: u64 = 16;
/// Device bytes for each site in addition to its lists and vectors, such as those for sorting; as measured.
const SITE_BYTES: u64 = 75;
/// Further device bytes for each site on surfaces with curves; as measured.
const PINNED_BYTES: u64 = 40;
/// Halving long edges adds at most this many triangles for each site. Five suffice, except for slivers.
pub(crate) const MOST_HALVED: usize = 16;

/// Remedy where memory is short.
const LARGER: &str = "use a larger device, or raise `memory_bytes` if that is the limit";

/// Refuses a vertex count whose largest buffer exceeds the device's limit, or that needs more memory than
/// there is. On surfaces with `curves` both are a little more.
pub(crate) fn check_memory(
    device: &Device,
    input: &TriMesh,
    options: &Options,
    vertices: usize,
    curves: bool,
) -> Result<()> {
    let name = &device.info().name;
    let sites = vertices as u64;
    let refuse = |what: &str, bytes: u64, problem: String, most: u64| {
        let remedy = match most {
            0 => format!("simplify the input first, or {LARGER}"),
            most => format!("ask for at most {most} vertices, or {LARGER}"),
        };
        Err(Error::OutOfMemory { what: what.to_owned(), bytes, problem, remedy, source: None })
    };
    let in_one = site_bytes(options, curves).largest_buffer;
    let limit = device.info().limits.storage_buffer_bytes;
    if sites.saturating_mul(in_one) > limit {
        let problem = format!("but device '{name}' allows {limit} in one buffer");
        return refuse(
            "the largest buffer of all sites",
            sites.saturating_mul(in_one),
            problem,
            limit / in_one,
        );
    }
    let DeviceInput { in_one, .. } = device_input(options);
    let triangles = sizes_on_device(input, options, vertices)?[1];
    if triangles.saturating_mul(in_one) > limit {
        let most = limit.checked_div(in_one).unwrap_or(triangles);
        return Err(Error::OutOfMemory {
            what: format!("a list of all {triangles} triangles of the input"),
            bytes: triangles.saturating_mul(in_one),
            problem: format!("but device '{name}' allows {limit} in one buffer"),
            remedy: format!(
                "simplify the input to {most} triangles first, or use a device with larger buffers"
            ),
            source: None,
        });
    }
    let total = bytes_needed(input, options, vertices, curves)?;
    let available = device.available_bytes();
    if total > available {
        let problem = format!("but device '{name}' has {available} for it");
        let most = most_sites(input, options, vertices, curves, available)?;
        return refuse("the run", total, problem, most);
    }
    Ok(())
}

/// Device bytes of a run, by estimate. On surfaces with `curves` it takes a little more.
///
/// # Errors
/// As [`crate::mesh::unit_frame::UnitFrame::of`].
pub(crate) fn bytes_needed(input: &TriMesh, options: &Options, vertices: usize, curves: bool) -> Result<u64> {
    let sizes = sizes_on_device(input, options, vertices)?;
    let DeviceBytes { fixed, per_site } = device_bytes(sizes, options, curves);
    Ok(fixed.saturating_add(per_site.saturating_mul(vertices as u64)))
}

/// The largest vertex count, below `vertices`, for which the available bytes suffice; 0 if there is none.
fn most_sites(
    input: &TriMesh,
    options: &Options,
    vertices: usize,
    curves: bool,
    available: u64,
) -> Result<u64> {
    let (mut enough, mut too_many) = (0, vertices);
    while too_many - enough > 1 {
        let middle = enough + (too_many - enough) / 2;
        if bytes_needed(input, options, middle, curves)? <= available {
            enough = middle;
        } else {
            too_many = middle;
        }
    }
    Ok(enough as u64)
}

/// The longest edge allowed where edge lengths vary, in spacings.
const SHORTER: f64 = 0.5;

/// The longest edge allowed, in the mesh's units, where sites search for nearby vertices; `None` if they do
/// not.
pub(crate) fn longest_edge(mesh: &TriMesh, options: &Options, vertices: usize) -> Result<Option<f64>> {
    let searches_vertices = options.method == Method::AllAtOnce && options.all_at_once.looks_for_vertices();
    // Some sites are closer together than the spacing where edge lengths vary.
    let share = if options.is_weighted() { SHORTER } else { 1.0 };
    searches_vertices.then(|| Ok(share * spacing_of(mesh, vertices)?)).transpose()
}

/// Estimated numbers of vertices and triangles of this input on the device.
///
/// # Errors
/// As [`UnitFrame::of`].
fn sizes_on_device(mesh: &TriMesh, options: &Options, sites: usize) -> Result<[u64; 2]> {
    let [vertices, triangles] = [mesh.vertices.len(), mesh.triangles.len()];
    let Some(length) = longest_edge(mesh, options, sites)? else {
        return Ok([vertices, triangles].map(|n| n as u64));
    };
    let most = MOST_HALVED as f64 * sites as f64;
    let more = (halved_count(mesh, length) - triangles as f64).min(most) as u64;
    Ok([vertices as u64 + more / 2, triangles as u64 + more])
}

/// Device bytes of a run, by estimate.
struct DeviceBytes {
    /// For the input.
    fixed: u64,
    /// For each vertex of the result.
    per_site: u64,
}

/// The estimate for an input with these numbers of vertices and triangles.
fn device_bytes([vertices, triangles]: [u64; 2], options: &Options, curves: bool) -> DeviceBytes {
    let more = match options.method {
        Method::CoarseToFine => SITE_BYTES + if curves { PINNED_BYTES } else { 0 },
        Method::AllAtOnce => 0,
    };
    let DeviceInput { vertex, triangle, .. } = device_input(options);
    // With a size field: a slope for each triangle, a length for each site.
    let method = &options.coarse_to_fine;
    let is_even = method.sizing == Sizing::Uniform && method.refine.is_empty();
    let (slope, length) = if is_even { (0, 0) } else { (16, 4) };
    let each = site_bytes(options, curves).total;
    let fixed = vertex * vertices + (triangle + slope) * triangles;
    DeviceBytes { fixed, per_site: each + more + length }
}

/// Device bytes of the input.
struct DeviceInput {
    /// For each vertex.
    vertex: u64,
    /// For each triangle.
    triangle: u64,
    /// For each triangle, in the largest buffer.
    in_one: u64,
}

fn device_input(options: &Options) -> DeviceInput {
    let walks = matches!(options.all_at_once.projection, Projection::Walk | Projection::Exact);
    let (vertex, triangle, in_one) = match (options.method, options.all_at_once.face) {
        (Method::CoarseToFine, _) => (WEDGE_BYTES, RECORD_BYTES, LARGEST_OF_RECORD),
        (Method::AllAtOnce, Face::Exact) if options.iterations == 0 => (0, 0, 0),
        // Three corners, candidates and a count.
        (Method::AllAtOnce, Face::Exact) => (0, 3 * 16 + 15 * 4 + 4, 3 * 16),
        (Method::AllAtOnce, _) if walks => {
            (VERTEX_BYTES + WEDGE_BYTES, TRIANGLE_BYTES + RECORD_BYTES, LARGEST_OF_TRIANGLE)
        }
        (Method::AllAtOnce, _) => (VERTEX_BYTES, TRIANGLE_BYTES, LARGEST_OF_TRIANGLE),
    };
    DeviceInput { vertex, triangle, in_one }
}

/// Device bytes of a site, without those that [`device_bytes`] adds for single methods.
struct SiteBytes {
    /// In the largest buffer.
    largest_buffer: u64,
    /// In all buffers.
    total: u64,
}

fn site_bytes(options: &Options, curves: bool) -> SiteBytes {
    let (largest_buffer, total) = match options.method {
        // Positions, with marks if there are curves, for kernels get all others in parts; the list; six
        // vectors, two reaches, eight words, and the boxes.
        Method::CoarseToFine => {
            (if curves { 16 } else { 12 }, 4 * u64::from(LIST) + 6 * 16 + 2 * 8 + 8 * 4 + 5)
        }
        // The list, for connecting; vectors, reaches, words and boxes.
        Method::AllAtOnce if options.has_exact_faces() && options.iterations == 0 => {
            (4 * u64::from(LIST), 4 * u64::from(LIST) + 3 * 16 + 2 * 8 + 8 * 4 + 5)
        }
        // Parts of triangles, about ten for each site; the list; vectors, reaches, words and boxes.
        Method::AllAtOnce if options.has_exact_faces() => {
            let list = 4 * u64::from(LIST);
            (10 * 16, 10 * 44 + list + 6 * 16 + 2 * 8 + 8 * 4 + 5)
        }
        // Corners of two floats; their fan; both lists; five vectors; triangle, count and flags. Lists and
        // walks take less beyond that than the list of nearest vertices.
        Method::AllAtOnce => {
            let corners = u64::from(cell::Constants::default().max_corners);
            let k_sites = u64::from(options.all_at_once.neighbour_count());
            let lists = 4 * (k_sites + u64::from(options.all_at_once.k_project));
            ((8 * corners).max(4 * k_sites), 12 * corners + lists + 5 * 16 + 3 * 4)
        }
    };
    SiteBytes { largest_buffer, total }
}
