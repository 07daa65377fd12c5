//! What tests share: one validated device, point sets, conversions, made-up meshes and files.

pub mod cell_faces;
pub mod curve_scene;
pub mod dirty;
pub mod files;
pub mod generators;
pub mod painted;
pub mod passes;
pub mod place;
pub mod polygons;
pub mod shapes;
pub mod vtk;

use glam::{DVec3, Vec4};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rtfmesh::gpu::{Buffer, Device, DeviceOptions};
use rtfmesh::mesh::NONE;
use rtfmesh::{Summary, WarningCode};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;
use std::sync::OnceLock;

/// The device of the whole test binary, under core and synchronization validation. A machine without Vulkan
/// fails.
pub fn device() -> &'static Device {
    static DEVICE: OnceLock<Device> = OnceLock::new();
    DEVICE.get_or_init(|| {
        let options = DeviceOptions::from_env().validation(true).timings(true);
        // Together with the least limits, so that all kernels are tested in parts, too.
        let is_least = std::env::var_os("RTFMESH_LEAST_LIMITS").is_some_and(|value| value == "1");
        let options = if is_least { options.dispatch_threads(1000) } else { options };
        Device::open(&options).expect("tests need a Vulkan device with validation layers: run ci/setup.sh")
    })
}

/// Fails if the validation layers have reported anything.
pub fn assert_valid(device: &Device) {
    let messages = device.take_validation_messages();
    assert!(messages.is_empty(), "validation: {}", messages.join("\n"));
}

/// The warnings of a run but those that few vertices may cause, however good the mesh is.
pub fn faults(summary: &Summary) -> Vec<String> {
    let of_few = [
        WarningCode::Distance,
        WarningCode::Volume,
        WarningCode::SharpEdges,
        WarningCode::NarrowFacets,
        WarningCode::SmallAngles,
        WarningCode::FoldedEdges,
        WarningCode::FacesInwards,
    ];
    let all = summary.warnings.iter().zip(&summary.warning_codes);
    all.filter(|(_, code)| !of_few.contains(code)).map(|(text, _)| text.clone()).collect()
}

/// Stores a GLB file for ci/gltf.sh to check.
pub fn store_glb(bytes: &[u8]) {
    let mut hasher = DefaultHasher::new();
    bytes.hash(&mut hasher);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("gltf");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join(format!("{:016x}.glb", hasher.finish())), bytes).unwrap();
}

pub fn vec4(points: &[DVec3]) -> Vec<Vec4> {
    points.iter().map(|p| p.as_vec3().extend(0.0)).collect()
}

pub fn upload(name: &str, points: &[DVec3]) -> Buffer<Vec4> {
    Buffer::from_slice(device(), name, &vec4(points)).unwrap()
}

/// The points as the device sees them: rounded to f32.
pub fn rounded(points: &[DVec3]) -> Vec<DVec3> {
    points.iter().map(|p| p.as_vec3().as_dvec3()).collect()
}

/// One list per query from `values[slot * queries + query]`, up to the first NONE.
pub fn lists(values: &[u32], queries: usize) -> Vec<Vec<u32>> {
    let k = values.len().checked_div(queries).unwrap_or(0);
    (0..queries)
        .map(|q| (0..k).map(|s| values[s * queries + q]).take_while(|v| *v != NONE).collect())
        .collect()
}

/// Lists as the kernels store them, `values[slot * queries + query]`: the first `slots` of each, padded with
/// NONE.
pub fn slots(lists: &[Vec<u32>], slots: usize) -> Vec<u32> {
    (0..slots).flat_map(|s| lists.iter().map(move |l| l.get(s).copied().unwrap_or(NONE))).collect()
}

pub fn rng(seed: u64) -> Pcg64Mcg {
    Pcg64Mcg::seed_from_u64(seed)
}

/// Uniform in the cube of edge `size` around the origin.
pub fn cloud(count: usize, size: f64, seed: u64) -> Vec<DVec3> {
    let mut rng = rng(seed);
    (0..count)
        .map(|_| DVec3::from_array(std::array::from_fn(|_| size * (rng.random::<f64>() - 0.5))))
        .collect()
}

/// Uniformly random on a sphere of radius 0.4, with the outward normals.
pub fn on_sphere(count: usize, seed: u64) -> (Vec<DVec3>, Vec<DVec3>) {
    let mut rng = rng(seed);
    let normals: Vec<DVec3> = std::iter::repeat_with(|| {
        DVec3::from_array(std::array::from_fn(|_| 2.0 * rng.random::<f64>() - 1.0))
    })
    .filter(|p| (0.01..=1.0).contains(&p.length_squared()))
    .map(DVec3::normalize)
    .take(count)
    .collect();
    (normals.iter().map(|n| *n * 0.4).collect(), normals)
}

/// The spacing of so many sites on the sphere of [`on_sphere`].
pub fn spacing_on_sphere(sites: usize) -> f64 {
    (2.0 * 4.0 * std::f64::consts::PI * 0.16 / (3.0_f64.sqrt() * sites.max(1) as f64)).sqrt()
}

/// Integer coordinates: distances are exact in f32 and full of ties.
pub fn lattice(side: usize) -> Vec<DVec3> {
    let at = |i: usize| DVec3::new((i % side) as f64, (i / side % side) as f64, (i / side / side) as f64);
    (0..side * side * side).map(at).collect()
}
