//! What a driver's compiler makes of the kernels. Prints a line for each, and fails if one spills vector
//! registers, needs scratch memory or lets too few subgroups run at a time. `ci/compilers.sh` runs it on
//! RADV.

use anyhow::{Result, bail, ensure};
use rtfmesh::gpu::kernels::face::{planar, planar_exact, planar_rest};
use rtfmesh::gpu::kernels::neighbours::lists;
use rtfmesh::gpu::kernels::{COMPILE, exact, face};
use rtfmesh::gpu::{CompiledKernel, Device, DeviceOptions, Pipeline};
use std::collections::BTreeSet;

/// Minimum number of subgroups of a SIMD unit. GFX9 has half as many registers for a lane.
const MIN_SUBGROUPS: f64 = 4.0;
const MIN_OF_GFX9: f64 = 1.0;
/// A kernel of the paper's preset that needs 1.5 KB of shared memory for each invocation.
const LARGE: &str = "face.cell";

fn main() -> Result<()> {
    // A null device has no self-test to pass.
    let device = Device::open(&DeviceOptions::from_env().statistics(true).self_test(false))?;
    let name = &device.info().name;
    compile_as_in_runs(&device)?;
    let in_runs = device.compiled_kernels()?;
    for compile in COMPILE {
        compile(&device)?;
    }
    let mut kernels = device.compiled_kernels()?;
    let count = kernels.iter().map(|kernel| kernel.name).collect::<BTreeSet<_>>().len();
    ensure!(count == COMPILE.len(), "only {count} of {} kernels were compiled", COMPILE.len());
    kernels.retain(|kernel| in_runs.contains(kernel) || in_runs.iter().all(|run| run.name != kernel.name));
    let mut faults = Vec::new();
    for kernel in &kernels {
        ensure!(!kernel.statistics.is_empty(), "the driver of {name} says nothing about {}", kernel.name);
        println!("{}", line(kernel)?);
        let is_small = kernel.name == LARGE || name.contains("VEGA");
        faults.extend(faults_of(kernel, if is_small { MIN_OF_GFX9 } else { MIN_SUBGROUPS })?);
    }
    if !faults.is_empty() {
        bail!("{name}:\n  {}", faults.join("\n  "));
    }
    println!("{name}: {count} kernels without spills and scratch memory");
    Ok(())
}

/// Compiles the kernels whose constants in runs are not those of the shader, as `src/stages` does. The null
/// device records no commands, so the stages themselves cannot be made on it.
fn compile_as_in_runs(device: &Device) -> Result<()> {
    let subgroup = device.info().limits.subgroup_size;
    let (k, near) = (20, 12);
    let wide = |workgroup: u32| workgroup.max(subgroup);
    let lists = lists::Constants { workgroup: subgroup, k, near, lanes: 0, ..Default::default() };
    Pipeline::<lists::Shader>::new(device, lists)?;
    Pipeline::<planar::Shader>::new(device, planar::Constants { k: near, ..Default::default() })?;
    let mut rest = planar_rest::Constants { k, ..Default::default() };
    rest.workgroup = wide(rest.workgroup);
    Pipeline::<planar_rest::Shader>::new(device, rest)?;
    let mut exact_faces = planar_exact::Constants::default();
    exact_faces.workgroup = wide(exact_faces.workgroup);
    Pipeline::<planar_exact::Shader>::new(device, exact_faces)?;
    let polygons = face::polygons::Constants { k, ..Default::default() };
    Pipeline::<face::polygons::Shader>::new(device, polygons)?;
    Pipeline::<exact::listed::Shader>::new(device, exact::listed::Constants { k, ..Default::default() })?;
    let mut walked = exact::walked::Constants::default();
    walked.workgroup = wide(walked.workgroup);
    Pipeline::<exact::walked::Shader>::new(device, walked)?;
    Ok(())
}

/// A number that the driver tells, by the name that RADV has for it.
fn number(kernel: &CompiledKernel, what: &str) -> Result<f64> {
    let found = kernel.statistics.iter().find(|(name, _)| name.eq_ignore_ascii_case(what));
    match found {
        Some((_, number)) => Ok(*number),
        None => bail!("no '{what}' among {:?}", kernel.statistics.keys()),
    }
}

fn faults_of(kernel: &CompiledKernel, min_subgroups: f64) -> Result<Vec<String>> {
    let name = kernel.name;
    let mut faults = Vec::new();
    // Scalar registers are spilled to lanes of vector registers, which is cheap.
    for what in ["Spilled VGPRs", "Scratch size"] {
        let number = number(kernel, what)?;
        if number > 0.0 {
            faults.push(format!("{name}: {what} {number}"));
        }
    }
    let subgroups = number(kernel, "Subgroups per SIMD")?;
    if subgroups < min_subgroups {
        faults.push(format!("{name}: {subgroups} subgroups per SIMD, fewer than {min_subgroups}"));
    }
    Ok(faults)
}

/// What is worth comparing.
const SHOWN: [&str; 6] = ["VGPRs", "SGPRs", "Spilled SGPRs", "LDS size", "Code size", "Subgroups per SIMD"];

fn line(kernel: &CompiledKernel) -> Result<String> {
    let constants: Vec<String> = kernel.constants.iter().map(|(id, value)| format!("{id}={value}")).collect();
    let name = format!("{} ({})", kernel.name, constants.join(" "));
    let numbers = SHOWN.iter().map(|what| Ok(format!("{what} {}", number(kernel, what)?)));
    Ok(format!("{name:44} {}", numbers.collect::<Result<Vec<_>>>()?.join(", ")))
}
