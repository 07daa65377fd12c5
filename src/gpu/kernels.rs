//! The kernels as declared in `glsl/`, generated at build time: one module a stage, one a kernel.

use super::{
    Access, BindingInfo, BindingSet, Bound, Buffer, Kernel, KernelInfo, SpecializationConstants, Texels,
};
#[allow(unused_imports, reason = "which vector types are used depends on the shaders")]
use glam::{UVec2, UVec4, Vec2, Vec4};

#[cfg(feature = "internals")]
fn compile<K: Kernel>(device: &super::Device) -> crate::Result<()> {
    super::Pipeline::<K>::new(device, K::Constants::default()).map(drop)
}

include!(concat!(env!("OUT_DIR"), "/kernels.rs"));
