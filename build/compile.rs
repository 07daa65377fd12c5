//! Compiles GLSL to SPIR-V with shaderc, with includes from `glsl/`, and checks the header comments of
//! kernels.

use std::path::{Path, PathBuf};

/// Lines that the opening comment of every kernel must have.
const HEADER: [&str; 4] = ["// Purpose:", "// Invocation:", "// Reads:", "// Writes:"];

/// Every `*.comp` below `root`, sorted, so that the generated code is the same on every machine.
pub fn shader_files(root: &Path) -> Result<Vec<PathBuf>, String> {
    let mut files = Vec::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        for entry in entries {
            let path = entry.map_err(|e| format!("{}: {e}", folder.display()))?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "comp") {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

/// Compiles one kernel; the error text has shaderc's file and line. With `texels`, as it reads vectors from
/// texel buffers; see `glsl/common/vectors.glsl`.
pub fn compile(file: &Path, texels: bool) -> Result<Vec<u32>, String> {
    let source = std::fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
    for wanted in HEADER {
        if !source.lines().take_while(|l| l.starts_with("//")).any(|l| l.starts_with(wanted)) {
            return Err(format!("{}:1: the opening comment has no line '{wanted}'", file.display()));
        }
    }
    let compiler = shaderc::Compiler::new().map_err(|e| format!("shaderc: {e}"))?;
    let mut options = shaderc::CompileOptions::new().map_err(|e| format!("shaderc: {e}"))?;
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_2 as u32);
    options.set_target_spirv(shaderc::SpirvVersion::V1_5);
    options.set_warnings_as_errors();
    // Reflection needs the names. Drivers optimise anyway: shaderc's optimiser makes no run shorter.
    options.set_generate_debug_info();
    if texels {
        options.add_macro_definition("TEXELS", None);
    }
    options.set_include_callback(|name, _, _, _| {
        let path = Path::new("glsl").join(name);
        let content = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        Ok(shaderc::ResolvedInclude { resolved_name: path.display().to_string(), content })
    });
    let label = file.display().to_string();
    compiler
        .compile_into_spirv(&source, shaderc::ShaderKind::Compute, &label, "main", Some(&options))
        .map(|artifact| artifact.as_binary().to_vec())
        .map_err(|e| e.to_string())
}
