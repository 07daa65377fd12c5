//! Writes the Rust side of every kernel: bindings, push constants, specialization constants.

use crate::reflect::Kernel;
use std::fmt::Write;

/// One module per stage with one module per kernel, and the list of all kernels.
pub fn emit(kernels: &[Kernel]) -> String {
    let mut out = String::new();
    let mut stages: Vec<&str> = kernels.iter().map(|k| k.stage.as_str()).collect();
    stages.dedup();
    for stage in stages {
        line(&mut out, format_args!("/// Kernels of `glsl/{stage}`."));
        line(
            &mut out,
            format_args!("#[allow(clippy::module_inception, reason = \"named as the kernel's file\")]"),
        );
        line(&mut out, format_args!("pub mod {stage} {{"));
        for kernel in kernels.iter().filter(|k| k.stage == stage) {
            emit_kernel(&mut out, kernel);
        }
        line(&mut out, format_args!("}}"));
    }
    line(&mut out, format_args!("/// Every kernel of the crate.\npub const ALL: &[&KernelInfo] = &["));
    for k in kernels {
        line(&mut out, format_args!("    <{}::{}::Shader as Kernel>::INFO,", k.stage, k.stem));
    }
    line(&mut out, format_args!("];"));
    line(&mut out, format_args!("/// Compiles each kernel of the crate with the constants of its shader."));
    line(&mut out, format_args!("#[cfg(feature = \"internals\")]"));
    line(&mut out, format_args!("pub const COMPILE: &[fn(&super::Device) -> crate::Result<()>] = &["));
    for k in kernels {
        line(&mut out, format_args!("    compile::<{}::{}::Shader>,", k.stage, k.stem));
    }
    line(&mut out, format_args!("];"));
    out
}

fn emit_kernel(out: &mut String, k: &Kernel) {
    line(out, format_args!("/// `glsl/{}/{}.comp`.\npub mod {} {{", k.stage, k.stem, k.stem));
    line(out, format_args!("use super::super::*;\n/// Marks the kernel in types.\npub enum Shader {{}}"));
    emit_push(out, k);
    emit_constants(out, k);
    emit_bindings(out, k);
    line(out, format_args!("impl Kernel for Shader {{"));
    line(
        out,
        format_args!("type Push = Push; type Constants = Constants; type Bindings<'a> = Bindings<'a>;"),
    );
    line(out, format_args!("const INFO: &'static KernelInfo = &KernelInfo {{ name: {:?},", k.name()));
    let file = |ending: &str| {
        let file = format!("/{}.{ending}", k.name());
        format!("include_bytes!(concat!(env!(\"OUT_DIR\"), {file:?}))")
    };
    let texels = k.texel_spirv.as_ref().map_or_else(|| "&[]".to_owned(), |_| file("texels.spv"));
    line(out, format_args!("spirv: {}, texel_spirv: {texels},", file("spv")));
    line(out, format_args!("bindings: &["));
    for b in &k.bindings {
        let (name, access) = (&b.name, b.access);
        let texels = if b.texels { format!("Some(Texels::{})", b.element) } else { "None".to_owned() };
        line(
            out,
            format_args!("BindingInfo {{ name: {name:?}, access: Access::{access}, texels: {texels} }},"),
        );
    }
    line(out, format_args!("] }};\n}}\n}}"));
}

fn emit_push(out: &mut String, k: &Kernel) {
    line(out, format_args!("/// Push constants, laid out as in the shader.\n#[repr(C)]"));
    line(out, format_args!("#[derive(Debug, Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]"));
    line(out, format_args!("pub struct Push {{"));
    for m in &k.push {
        line(out, format_args!("/// `{}` of the shader.\npub {}: {},", m.name, m.name, m.ty));
    }
    line(out, format_args!("}}"));
    for m in &k.push {
        line(
            out,
            format_args!("const _: () = assert!(std::mem::offset_of!(Push, {}) == {});", m.name, m.offset),
        );
    }
}

fn emit_constants(out: &mut String, k: &Kernel) {
    line(out, format_args!("/// Specialization constants; `default()` has the shader's own values."));
    line(out, format_args!("#[derive(Debug, Clone, Copy, PartialEq, Eq)]\npub struct Constants {{"));
    for c in &k.constants {
        line(
            out,
            format_args!("/// `{}` of the shader, id {}.\npub {}: u32,", c.name.to_uppercase(), c.id, c.name),
        );
    }
    line(out, format_args!("}}\nimpl Default for Constants {{ fn default() -> Self {{ Self {{"));
    for c in &k.constants {
        line(out, format_args!("{}: {},", c.name, c.default));
    }
    line(out, format_args!("}} }} }}\nimpl SpecializationConstants for Constants {{"));
    line(out, format_args!("fn workgroup(&self) -> u32 {{ self.workgroup }}"));
    line(out, format_args!("fn values(&self) -> Vec<(u32, u32)> {{ vec!["));
    for c in &k.constants {
        line(out, format_args!("({}, self.{}),", c.id, c.name));
    }
    line(out, format_args!("] }}\n}}"));
}

fn emit_bindings(out: &mut String, k: &Kernel) {
    line(out, format_args!("/// The buffers of one dispatch.\npub struct Bindings<'a> {{"));
    for b in &k.bindings {
        line(
            out,
            format_args!("/// `{}` of the shader.\npub {}: &'a Buffer<{}>,", b.name, b.name, b.element),
        );
    }
    line(
        out,
        format_args!("}}\nimpl BindingSet for Bindings<'_> {{ fn buffers(&self) -> Vec<Bound<'_>> {{ vec!["),
    );
    for b in &k.bindings {
        line(out, format_args!("self.{}.bound(),", b.name));
    }
    line(out, format_args!("] }} }}"));
}

fn line(out: &mut String, text: std::fmt::Arguments<'_>) {
    // Writing to a String cannot fail.
    let _ = writeln!(out, "{text}");
}
