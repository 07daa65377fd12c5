//! Compiles `glsl/**/*.comp` to SPIR-V and writes typed Rust declarations for them.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[path = "build/compile.rs"]
mod compile;
#[path = "build/emit.rs"]
mod emit;
#[path = "build/module.rs"]
mod module;
#[path = "build/reflect.rs"]
mod reflect;

fn main() -> ExitCode {
    println!("cargo::rerun-if-changed=glsl");
    println!("cargo::rerun-if-changed=build");
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(problems) => {
            for line in problems.iter().flat_map(|p| p.lines()) {
                println!("cargo::error={line}");
            }
            ExitCode::FAILURE
        }
    }
}

/// Collects all problems before failing, so that one build shows every invalid kernel.
fn run() -> Result<(), Vec<String>> {
    let out =
        PathBuf::from(std::env::var_os("OUT_DIR").ok_or_else(|| vec!["OUT_DIR is not set".to_owned()])?);
    let files = compile::shader_files(Path::new("glsl")).map_err(|e| vec![e])?;
    let (mut kernels, mut problems) = (Vec::new(), Vec::new());
    for kernel in kernels_of(&files) {
        match kernel {
            Ok(kernel) => kernels.push(kernel),
            Err(problem) => problems.push(problem),
        }
    }
    if !problems.is_empty() {
        return Err(problems);
    }
    let write = |name: &str, bytes: &[u8]| {
        std::fs::write(out.join(name), bytes).map_err(|e| vec![format!("{}: {e}", out.join(name).display())])
    };
    for kernel in &kernels {
        // What tests run is what is shipped, in every profile.
        write(&format!("{}.spv", kernel.name()), &bytes_of(&module::without_debug_info(&kernel.spirv)))?;
        if let Some(spirv) = &kernel.texel_spirv {
            write(&format!("{}.texels.spv", kernel.name()), &bytes_of(&module::without_debug_info(spirv)))?;
        }
    }
    write("kernels.rs", emit::emit(&kernels).as_bytes())
}

/// The kernels in the order of their files, compiled on as many threads as Cargo has jobs.
fn kernels_of(files: &[PathBuf]) -> Vec<Result<reflect::Kernel, String>> {
    let jobs = std::env::var("NUM_JOBS").ok().and_then(|jobs| jobs.parse().ok()).unwrap_or(1_usize);
    let parts = files.chunks(files.len().div_ceil(jobs.max(1)).max(1));
    std::thread::scope(|scope| {
        let compile = |part: &'_ [PathBuf]| part.iter().map(|file| kernel(file)).collect::<Vec<_>>();
        let started: Vec<_> = parts.map(|part| scope.spawn(move || compile(part))).collect();
        let join = |worker: std::thread::ScopedJoinHandle<'_, Vec<_>>| {
            worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        started.into_iter().flat_map(join).collect()
    })
}

/// A kernel, and how it reads vectors from texel buffers if it can.
fn kernel(file: &Path) -> Result<reflect::Kernel, String> {
    let mut kernel = reflect::reflect(file, compile::compile(file, false)?)?;
    let with_texels = compile::compile(file, true)?;
    if reflect::mark_texels(file, &mut kernel, &with_texels)? {
        kernel.texel_spirv = Some(with_texels);
    }
    Ok(kernel)
}

fn bytes_of(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|w| w.to_le_bytes()).collect()
}
