//! Kernels: their declarations, and their compiled pipelines.

use super::buffer::Bound;
use super::device::{Device, Shared, lock};
use super::errors::vk_error;
use crate::{Error, Result};
use ash::vk;
use std::collections::HashMap;
use std::marker::PhantomData;
use std::sync::{Arc, Mutex, OnceLock};

/// How a kernel uses a buffer, read from `readonly` and `writeonly` in its GLSL.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// `readonly`
    Read,
    /// `writeonly`
    Write,
    /// neither
    ReadWrite,
}

/// What a buffer has where a kernel reads it as texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Texels {
    /// `vec2`
    Vec2,
    /// `vec4`
    Vec4,
    /// `uvec2`
    UVec2,
    /// `uvec4`
    UVec4,
}

impl Texels {
    pub(super) fn format(self) -> vk::Format {
        match self {
            Self::Vec2 => vk::Format::R32G32_SFLOAT,
            Self::Vec4 => vk::Format::R32G32B32A32_SFLOAT,
            Self::UVec2 => vk::Format::R32G32_UINT,
            Self::UVec4 => vk::Format::R32G32B32A32_UINT,
        }
    }
}

/// One storage buffer of a kernel; its binding number is its place in [`KernelInfo::bindings`].
#[derive(Debug)]
pub struct BindingInfo {
    /// Name in the GLSL block.
    pub name: &'static str,
    /// Use by the kernel.
    pub access: Access,
    /// What it has if it is a texel buffer in [`KernelInfo::texel_spirv`].
    pub texels: Option<Texels>,
}

/// The untyped declaration of a kernel.
#[derive(Debug)]
pub struct KernelInfo {
    /// Dotted name, `stage.kernel`.
    pub name: &'static str,
    /// SPIR-V, little-endian words.
    pub spirv: &'static [u8],
    /// The same kernel reading vectors from texel buffers, for devices on which that is faster; empty if it
    /// reads none.
    pub texel_spirv: &'static [u8],
    /// Storage buffers by binding number.
    pub bindings: &'static [BindingInfo],
}

/// A kernel's declaration, generated from its GLSL; see [`super::kernels`].
pub trait Kernel {
    /// The untyped part.
    const INFO: &'static KernelInfo;
    /// Push constants.
    type Push: bytemuck::Pod;
    /// Specialization constants.
    type Constants: SpecializationConstants;
    /// Buffers of a dispatch.
    type Bindings<'a>: BindingSet;
}

/// Specialization constants of a kernel, all `uint`.
pub trait SpecializationConstants: Default + Copy {
    /// Invocations per workgroup.
    fn workgroup(&self) -> u32;
    /// Pairs of id and value.
    fn values(&self) -> Vec<(u32, u32)>;
}

/// The buffers of one dispatch, by binding number.
pub trait BindingSet {
    /// The buffers in order.
    fn buffers(&self) -> Vec<Bound<'_>>;
}

/// A kernel compiled for a device with given specialization constants.
pub struct Pipeline<K: Kernel> {
    pub(super) raw: Arc<RawPipeline>,
    kernel: PhantomData<fn() -> K>,
}

pub(super) struct RawPipeline {
    pub pipeline: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    pub set_layout: vk::DescriptorSetLayout,
    pub workgroup: u32,
    /// For each binding that is a texel buffer its format.
    pub texels: Vec<Option<vk::Format>>,
    shared: Arc<Shared>,
}

impl<K: Kernel> Pipeline<K> {
    /// Compiles the kernel, or returns the pipeline that was compiled before with the same constants.
    ///
    /// # Errors
    /// [`Error::Device`] if the workgroup is larger than the device's limit or the driver refuses the kernel.
    pub fn new(device: &Device, constants: K::Constants) -> Result<Self> {
        let key = (K::INFO.name, constants.values());
        let cell = lock(&device.pipelines).entry(key.clone()).or_default().clone();
        // Not under the lock, so that threads can compile different kernels at the same time.
        let compiled = cell.get_or_init(|| {
            let push_bytes = size_of::<K::Push>() as u32;
            RawPipeline::new(&device.shared, K::INFO, &constants, push_bytes).map(Arc::new)
        });
        match compiled {
            Ok(raw) => Ok(Self { raw: raw.clone(), kernel: PhantomData }),
            Err(error) => {
                // A later attempt may succeed, for example with more free memory.
                lock(&device.pipelines).remove(&key);
                Err(error.clone())
            }
        }
    }

    /// Invocations of a workgroup.
    pub fn workgroup(&self) -> u32 {
        self.raw.workgroup
    }
}

/// The pipelines of a device by kernel and specialization constants. A thread that needs one being compiled
/// waits for it.
pub(super) type Pipelines = Mutex<HashMap<(&'static str, Vec<(u32, u32)>), Arc<OnceLock<Compiled>>>>;
type Compiled = Result<Arc<RawPipeline>>;

/// The type of a binding with this texel format or none.
pub(super) fn descriptor_type(texels: Option<vk::Format>) -> vk::DescriptorType {
    if texels.is_some() {
        vk::DescriptorType::UNIFORM_TEXEL_BUFFER
    } else {
        vk::DescriptorType::STORAGE_BUFFER
    }
}

impl RawPipeline {
    fn new(
        shared: &Arc<Shared>,
        info: &KernelInfo,
        constants: &impl SpecializationConstants,
        push_bytes: u32,
    ) -> Result<Self> {
        shared.require_own()?;
        let workgroup = constants.workgroup();
        let most = shared.info.limits.workgroup_invocations;
        if workgroup == 0 || workgroup > most {
            return Err(Error::device(
                format!("kernel {}: a workgroup of {workgroup} is outside 1 to {most}", info.name),
                "use a smaller workgroup",
            ));
        }
        let failed = |what: &str, e| vk_error(&format!("{what} of kernel {}", info.name), e);
        let format = |b: &BindingInfo| b.texels.filter(|_| shared.reads_texels).map(Texels::format);
        let texels: Vec<_> = info.bindings.iter().map(format).collect();
        let bindings: Vec<_> = (0..)
            .zip(&texels)
            .map(|(i, texels)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(i)
                    .descriptor_type(descriptor_type(*texels))
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let set_info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the device is alive (Arc) and `set_info` outlives the call.
        let set_layout = unsafe { shared.raw.create_descriptor_set_layout(&set_info, None) }
            .map_err(|e| failed("the descriptor layout", e))?;
        // From here on Drop frees what exists; null handles are ignored by Vulkan.
        let mut this = Self {
            pipeline: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout,
            workgroup,
            texels,
            shared: shared.clone(),
        };
        let set_layouts = [set_layout];
        let ranges = [vk::PushConstantRange::default()
            .stage_flags(vk::ShaderStageFlags::COMPUTE)
            .size(push_bytes.max(4))];
        let mut layout_info = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts);
        if push_bytes > 0 {
            layout_info = layout_info.push_constant_ranges(&ranges);
        }
        // SAFETY: as above.
        this.layout = unsafe { shared.raw.create_pipeline_layout(&layout_info, None) }
            .map_err(|e| failed("the pipeline layout", e))?;
        this.pipeline = compile(shared, info, constants, this.layout)?;
        shared.name_object(this.pipeline, info.name);
        Ok(this)
    }
}

fn compile(
    shared: &Shared,
    info: &KernelInfo,
    constants: &impl SpecializationConstants,
    layout: vk::PipelineLayout,
) -> Result<vk::Pipeline> {
    let failed = |what: &str, e| vk_error(&format!("{what} kernel {}", info.name), e);
    let as_texels = shared.reads_texels && !info.texel_spirv.is_empty();
    let spirv = if as_texels { info.texel_spirv } else { info.spirv };
    let words: Vec<u32> = bytemuck::allocation::pod_collect_to_vec(spirv);
    let module_info = vk::ShaderModuleCreateInfo::default().code(&words);
    // SAFETY: the SPIR-V was made by shaderc at build time and is checked by spirv-val in the tests.
    let module =
        unsafe { shared.raw.create_shader_module(&module_info, None) }.map_err(|e| failed("loading", e))?;
    let pairs = constants.values();
    let entries: Vec<_> = pairs
        .iter()
        .enumerate()
        .map(|(i, (id, _))| vk::SpecializationMapEntry { constant_id: *id, offset: 4 * i as u32, size: 4 })
        .collect();
    let values: Vec<u32> = pairs.iter().map(|(_, value)| *value).collect();
    let specialization =
        vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(&values));
    let stage = vk::PipelineShaderStageCreateInfo::default()
        .stage(vk::ShaderStageFlags::COMPUTE)
        .module(module)
        .name(c"main")
        .specialization_info(&specialization);
    let mut flags = vk::PipelineCreateFlags::empty();
    if shared.rates.is_some() {
        flags |= vk::PipelineCreateFlags::DISPATCH_BASE;
    }
    if shared.statistics.is_some() {
        flags |= vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR;
    }
    let create = [vk::ComputePipelineCreateInfo::default().flags(flags).stage(stage).layout(layout)];
    // SAFETY: module and layout are alive and everything `create` points to outlives the call; the module may
    // go as soon as the pipeline exists.
    let made = unsafe {
        let made = shared.raw.create_compute_pipelines(shared.pipeline_cache, &create, None);
        shared.raw.destroy_shader_module(module, None);
        made
    };
    made.map_err(|(_, e)| failed("compiling", e))?
        .first()
        .copied()
        .ok_or_else(|| Error::Internal(format!("no pipeline for kernel {}", info.name)))
}

impl Drop for RawPipeline {
    fn drop(&mut self) {
        if !self.shared.is_own() {
            return;
        }
        // SAFETY: recorders share the pipelines that they use until the device is done, so nothing uses this
        // any more.
        unsafe {
            self.shared.raw.destroy_pipeline(self.pipeline, None);
            self.shared.raw.destroy_pipeline_layout(self.layout, None);
            self.shared.raw.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}
