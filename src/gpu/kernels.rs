//! The kernels as declared in `glsl/`, generated at build time: one module a stage, one a kernel.

use super::{
    Access, BindingInfo, BindingSet, Buffer, Kernel, KernelInfo, RawBuffer, SpecializationConstants,
};
#[allow(unused_imports, reason = "which vector types are used depends on the shaders")]
use glam::{UVec2, UVec4, Vec2, Vec4};
use std::sync::Arc;

include!(concat!(env!("OUT_DIR"), "/kernels.rs"));
