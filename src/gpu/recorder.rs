//! Records a sequence of dispatches and copies, with the barriers that they need.

use super::barriers::{Barrier, Hazards, Stage, Use};
use super::buffer::{Bound, Buffer, RawBuffer};
use super::device::{Device, Shared, lock};
use super::errors::vk_error;
use super::kernel::{Access, BindingSet, Kernel, Pipeline, RawPipeline, descriptor_type};
use super::submitted::Download;
use super::transfers::Transfers;
use crate::{Error, Result};
use ash::vk;
use glam::UVec4;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Number of invocations that a dispatch needs; the recorder rounds up to whole workgroups. Kernels get their
/// index from `thread_index()` in `glsl/common/threads.glsl` and must leave when it is past the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Threads(pub usize);

/// How many workgroups a dispatch runs.
#[derive(Clone, Copy)]
enum Groups<'a> {
    Known(UVec4),
    /// Element of a buffer that the device reads when it gets there.
    Indirect(&'a Buffer<UVec4>, usize),
}

/// A sequence of commands that is being recorded; [`Recorder::submit`] runs it.
pub struct Recorder {
    pub(super) shared: Arc<Shared>,
    pub(super) transfers: Arc<Transfers>,
    /// The transfers that waited for this submission.
    pub(super) ahead: Option<Box<Recorder>>,
    pub(super) command_pool: vk::CommandPool,
    pub(super) commands: vk::CommandBuffer,
    pub(super) descriptor_pools: Vec<vk::DescriptorPool>,
    sets_left: u32,
    pub(super) query_pools: Vec<vk::QueryPool>,
    /// All commands, in order.
    pub(super) recorded: Vec<Recorded>,
    /// How many of them are timed.
    timed: u32,
    hazards: Hazards,
    pub(super) staging: Vec<RawBuffer>,
    /// What the commands use; shared so that nobody else can free it before the device is done.
    pub(super) buffers: HashMap<u64, Arc<RawBuffer>>,
    pub(super) pipelines: Vec<Arc<RawPipeline>>,
    /// Set while the device may still use what this recorder owns.
    pub(super) running: bool,
}

/// A command, for the timings.
pub(super) struct Recorded {
    pub name: &'static str,
    /// Number of invocations; 0 if it is not known.
    threads: usize,
    pub is_timed: bool,
}

const SETS_PER_POOL: u32 = 128;
pub(super) const TIMED_PER_POOL: u32 = 512;
/// More than any kernel binds; checked when sets are allocated.
const BUFFERS_PER_SET: u32 = 12;

impl Recorder {
    /// Starts a list of commands.
    ///
    /// # Errors
    /// [`Error::Device`] if the driver has no memory for it.
    pub fn new(device: &Device) -> Result<Self> {
        Self::start(&device.shared, &device.transfers)
    }

    pub(super) fn start(shared: &Arc<Shared>, transfers: &Arc<Transfers>) -> Result<Self> {
        shared.require_own()?;
        let failed = |e| vk_error("starting a command buffer", e);
        let pool_info = vk::CommandPoolCreateInfo::default().queue_family_index(shared.queue_family);
        // SAFETY: the device is alive (Arc).
        let command_pool = unsafe { shared.raw.create_command_pool(&pool_info, None) }.map_err(failed)?;
        let mut this = Self {
            shared: shared.clone(),
            transfers: transfers.clone(),
            ahead: None,
            command_pool,
            commands: vk::CommandBuffer::null(),
            descriptor_pools: Vec::new(),
            sets_left: 0,
            query_pools: Vec::new(),
            recorded: Vec::new(),
            timed: 0,
            hazards: Hazards::default(),
            staging: Vec::new(),
            buffers: HashMap::new(),
            pipelines: Vec::new(),
            running: false,
        };
        let info =
            vk::CommandBufferAllocateInfo::default().command_pool(command_pool).command_buffer_count(1);
        // SAFETY: the pool was just made and is used by this recorder alone.
        unsafe {
            let list = shared.raw.allocate_command_buffers(&info).map_err(failed)?;
            this.commands = list.first().copied().unwrap_or_default();
            let once =
                vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            shared.raw.begin_command_buffer(this.commands, &once).map_err(failed)?;
        }
        this.barrier(Barrier::ALL);
        Ok(this)
    }

    /// Runs `pipeline` on `threads` invocations. With zero threads, nothing is dispatched.
    ///
    /// # Errors
    /// [`Error::Device`] if the driver has no memory; [`Error::Internal`] if a buffer is bound twice and
    /// written.
    pub fn dispatch<K: Kernel>(
        &mut self,
        pipeline: &Pipeline<K>,
        threads: Threads,
        push: &K::Push,
        bindings: &K::Bindings<'_>,
    ) -> Result<()> {
        if threads.0 == 0 {
            return Ok(());
        }
        self.dispatch_groups(pipeline, Groups::Known(self.groups(pipeline, threads)), push, bindings)
    }

    /// Runs as many workgroups of `pipeline` as element `at` of `groups` says when the device gets there (x,
    /// y, z; w is not used). [`Recorder::groups`] gives the element for a number of invocations.
    ///
    /// # Errors As [`Recorder::dispatch`]; [`Error::Internal`] if there is no such element, or the kernel
    /// writes `groups`.
    pub fn dispatch_indirect<K: Kernel>(
        &mut self,
        pipeline: &Pipeline<K>,
        groups: &Buffer<UVec4>,
        at: usize,
        push: &K::Push,
        bindings: &K::Bindings<'_>,
    ) -> Result<()> {
        if at >= groups.len() {
            return Err(Error::Internal(format!("{} has no element {at}", groups.raw().name())));
        }
        self.dispatch_groups(pipeline, Groups::Indirect(groups, at), push, bindings)
    }

    /// Workgroups of `pipeline` for `threads` invocations, folded into y where the device limits x.
    pub fn groups<K: Kernel>(&self, pipeline: &Pipeline<K>, threads: Threads) -> UVec4 {
        let groups = threads.0.div_ceil(pipeline.raw.workgroup as usize);
        let x = groups.clamp(1, self.shared.info.limits.workgroups as usize);
        UVec4::new(x as u32, groups.div_ceil(x) as u32, 1, 0)
    }

    fn dispatch_groups<K: Kernel>(
        &mut self,
        pipeline: &Pipeline<K>,
        groups: Groups<'_>,
        push: &K::Push,
        bindings: &K::Bindings<'_>,
    ) -> Result<()> {
        let bound = bindings.buffers();
        let mut buffers: Vec<_> = bound.iter().map(|b| b.raw).collect();
        let used = |(b, access): (&Bound<'_>, Access)| Use::new(b.raw.id, b.offset, b.bytes, access);
        let mut uses: Vec<_> =
            bound.iter().zip(K::INFO.bindings.iter().map(|info| info.access)).map(used).collect();
        let mut stage = Stage::Compute;
        if let Groups::Indirect(groups, _) = groups {
            buffers.push(groups.raw());
            uses.push(used((&groups.bound(), Access::Read)));
            stage = Stage::Indirect;
        }
        for (i, one) in uses.iter().enumerate() {
            let is_same = |(j, other): (usize, &Use)| i != j && one.buffer == other.buffer;
            if one.is_write() && uses.iter().enumerate().any(is_same) {
                let name = buffers[i].name();
                return Err(Error::Internal(format!(
                    "{name} is bound twice to {} and written",
                    K::INFO.name
                )));
            }
        }
        if let Some(b) = self.hazards.barrier_before(stage, &uses, self.shared.full_barriers) {
            self.barrier(b);
        }
        self.pipelines.push(pipeline.raw.clone());
        self.buffers.extend(buffers.iter().map(|b| (b.id, Arc::clone(b))));
        let set = self.descriptor_set(&pipeline.raw, &bound)?;
        let (raw, layout, commands) = (self.shared.raw.clone(), pipeline.raw.layout, self.commands);
        // SAFETY: recording is on; this recorder shares the pipeline and owns the set until the submission
        // was waited for.
        unsafe {
            let compute = vk::PipelineBindPoint::COMPUTE;
            raw.cmd_bind_pipeline(commands, compute, pipeline.raw.pipeline);
            raw.cmd_bind_descriptor_sets(commands, compute, layout, 0, &[set], &[]);
            if size_of::<K::Push>() > 0 {
                let (stage, bytes) = (vk::ShaderStageFlags::COMPUTE, bytemuck::bytes_of(push));
                raw.cmd_push_constants(commands, layout, stage, 0, bytes);
            }
        }
        match groups {
            Groups::Known(groups) => self.record_groups(K::INFO.name, pipeline.raw.workgroup, groups),
            Groups::Indirect(buffer, at) => {
                let offset = buffer.offset() + (at * size_of::<UVec4>()) as u64;
                // SAFETY: recording is on; this recorder shares the buffer until the submission was waited
                // for.
                self.record_timed(K::INFO.name, 0, |commands| unsafe {
                    raw.cmd_dispatch_indirect(commands, buffer.raw().handle, offset);
                })
            }
        }
    }

    /// Records this many workgroups of the bound kernel, in several dispatches if one might take long.
    fn record_groups(&mut self, kernel: &'static str, workgroup: u32, groups: UVec4) -> Result<()> {
        let (raw, workgroup) = (self.shared.raw.clone(), workgroup as usize);
        let count = groups.x as usize * groups.y as usize;
        let most = self.shared.rates.as_ref().map_or(usize::MAX, |rates| rates.most(kernel) / workgroup);
        if count <= most {
            // SAFETY: recording is on, and all is bound.
            return self.record_timed(kernel, count * workgroup, |commands| unsafe {
                raw.cmd_dispatch(commands, groups.x, groups.y, groups.z);
            });
        }
        // Folded into rows of what may be done at once: then each knows its place by itself.
        let limit = self.shared.info.limits.workgroups as usize;
        let row = most.max(count.div_ceil(limit)).clamp(1, limit);
        for y in 0..count.div_ceil(row) as u32 {
            // SAFETY: recording is on, and all is bound; the pipeline was made for this.
            self.record_timed(kernel, row * workgroup, |commands| unsafe {
                raw.cmd_dispatch_base(commands, 0, y, 0, row as u32, 1, 1);
            })?;
        }
        Ok(())
    }

    /// Overwrites the start of `target` with `values`.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] for the staging copy; [`Error::Internal`] if `target` is too short.
    pub fn upload<T: bytemuck::Pod>(&mut self, target: &Buffer<T>, values: &[T]) -> Result<()> {
        let bytes = target.staged_bytes(values)?;
        if bytes.is_empty() {
            return Ok(());
        }
        let usage = vk::BufferUsageFlags::TRANSFER_SRC;
        let mut staging = self.transfers.staging(&self.shared, bytes.len(), usage)?;
        staging.put(bytes)?;
        self.record_upload(&staging, (target.raw(), target.offset()), bytes.len() as u64)?;
        self.staging.push(staging);
        Ok(())
    }

    pub(super) fn record_upload(
        &mut self,
        staging: &RawBuffer,
        (target, offset): (&Arc<RawBuffer>, u64),
        bytes: u64,
    ) -> Result<()> {
        self.buffers.insert(target.id, target.clone());
        self.copy((staging, 0), (target, offset), bytes, "copy.upload")
    }

    /// Sets all 32-bit words of `target` to `word`.
    ///
    /// # Errors
    /// [`Error::Device`] if the driver has no memory.
    pub fn fill<T: bytemuck::Pod>(&mut self, target: &Buffer<T>, word: u32) -> Result<()> {
        self.record_fill((target.raw(), target.offset()), target.bound().bytes, word)
    }

    pub(super) fn record_fill(
        &mut self,
        (target, offset): (&Arc<RawBuffer>, u64),
        bytes: u64,
        word: u32,
    ) -> Result<()> {
        self.barrier_before_transfer(&[Use::new(target.id, offset, bytes, Access::Write)]);
        self.buffers.insert(target.id, target.clone());
        let raw = self.shared.raw.clone();
        // SAFETY: buffers are made for transfers, of whole words; this recorder shares the buffer until the
        // submission was waited for.
        self.record_timed("copy.fill", 0, |commands| unsafe {
            raw.cmd_fill_buffer(commands, target.handle, offset, bytes, word);
        })
    }

    /// Copies `source` to the host; read it after the submission.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] for the staging copy.
    pub fn download<T: bytemuck::Pod>(&mut self, source: &Buffer<T>) -> Result<Download<T>> {
        self.download_first(source, source.len())
    }

    /// Like [`Recorder::download`], for the first `len` values, or all if there are fewer.
    ///
    /// # Errors
    /// As [`Recorder::download`].
    pub fn download_first<T: bytemuck::Pod>(
        &mut self,
        source: &Buffer<T>,
        len: usize,
    ) -> Result<Download<T>> {
        let len = len.min(source.len());
        let bytes = len * size_of::<T>();
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let staging = self.transfers.staging(&self.shared, bytes, usage)?;
        if bytes > 0 {
            self.buffers.insert(source.raw().id, source.raw().clone());
            self.copy((source.raw(), source.offset()), (&staging, 0), bytes as u64, "copy.download")?;
        }
        self.staging.push(staging);
        Ok(Download::new(self.staging.len() - 1, len))
    }

    /// Omits the next barrier, to test that a missing one is detected.
    #[cfg(test)]
    pub(super) fn forget_hazards(&mut self) {
        self.hazards = Hazards::default();
    }

    /// Copies bytes between buffers, in both from an offset on.
    fn copy(
        &mut self,
        (from, from_offset): (&RawBuffer, u64),
        (to, to_offset): (&RawBuffer, u64),
        bytes: u64,
        name: &'static str,
    ) -> Result<()> {
        let uses = [
            Use::new(from.id, from_offset, bytes, Access::Read),
            Use::new(to.id, to_offset, bytes, Access::Write),
        ];
        self.barrier_before_transfer(&uses);
        let region = [vk::BufferCopy::default().src_offset(from_offset).dst_offset(to_offset).size(bytes)];
        let raw = self.shared.raw.clone();
        // SAFETY: both buffers are at least `bytes` long; this recorder shares or owns them until the
        // submission was waited for.
        self.record_timed(name, 0, |commands| unsafe {
            raw.cmd_copy_buffer(commands, from.handle, to.handle, &region);
        })
    }

    /// Records the barrier before a copy or a fill, if one is needed.
    fn barrier_before_transfer(&mut self, uses: &[Use]) {
        if let Some(b) = self.hazards.barrier_before(Stage::Transfer, uses, self.shared.full_barriers) {
            self.barrier(b);
        }
    }

    fn barrier(&self, b: Barrier) {
        self.shared.barriers.fetch_add(1, Ordering::Relaxed);
        let memory =
            [vk::MemoryBarrier::default().src_access_mask(b.available).dst_access_mask(Barrier::VISIBLE)];
        // SAFETY: recording is on.
        unsafe {
            self.shared.raw.cmd_pipeline_barrier(
                self.commands,
                b.from,
                Barrier::TO,
                vk::DependencyFlags::empty(),
                &memory,
                &[],
                &[],
            );
        }
    }

    /// Records `command`, with this many invocations, between two timestamps if it is to be timed.
    fn record_timed(
        &mut self,
        name: &'static str,
        threads: usize,
        command: impl FnOnce(vk::CommandBuffer),
    ) -> Result<()> {
        let is_wanted = self.shared.times_all || self.shared.rates.as_ref().is_some_and(|r| r.wants(threads));
        let is_timed = is_wanted && self.shared.timestamp_mask != 0;
        self.recorded.push(Recorded { name, threads, is_timed });
        if !is_timed {
            command(self.commands);
            return Ok(());
        }
        let query = 2 * (self.timed % TIMED_PER_POOL);
        self.timed += 1;
        if query == 0 {
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(2 * TIMED_PER_POOL);
            // SAFETY: recording is on; the pool is kept until the submission was waited for.
            unsafe {
                let pool = self
                    .shared
                    .raw
                    .create_query_pool(&info, None)
                    .map_err(|e| vk_error("making timestamp queries", e))?;
                self.query_pools.push(pool);
                self.shared.raw.cmd_reset_query_pool(self.commands, pool, 0, 2 * TIMED_PER_POOL);
            }
        }
        let pool = self.query_pools.last().copied().unwrap_or_default();
        let stamp = |this: &Self, stage, query| {
            // SAFETY: recording is on and both queries were reset above.
            unsafe { this.shared.raw.cmd_write_timestamp(this.commands, stage, pool, query) };
        };
        stamp(self, vk::PipelineStageFlags::TOP_OF_PIPE, query);
        command(self.commands);
        stamp(self, vk::PipelineStageFlags::BOTTOM_OF_PIPE, query + 1);
        Ok(())
    }

    pub(super) fn collect_timings(&self) -> Result<()> {
        let shared = &self.shared;
        let (mask, tick) = (shared.timestamp_mask, f64::from(shared.info.limits.timestamp_ns));
        let mut elapsed = Vec::with_capacity(self.timed as usize);
        for (pool, &queries) in self.query_pools.iter().enumerate() {
            let timed = (self.timed - pool as u32 * TIMED_PER_POOL).min(TIMED_PER_POOL);
            let mut ticks = vec![0_u64; 2 * timed as usize];
            // SAFETY: the submission is done, so all queries of the list are available.
            unsafe {
                shared.raw.get_query_pool_results(queries, 0, &mut ticks, vk::QueryResultFlags::TYPE_64)
            }
            .map_err(|e| vk_error("reading timestamps", e))?;
            let between = |pair: &[u64]| (pair[1] & mask).wrapping_sub(pair[0] & mask) & mask;
            elapsed.extend(ticks.chunks_exact(2).map(|pair| between(pair) as f64 * tick));
        }
        let (mut elapsed, mut timings) = (elapsed.into_iter(), lock(&shared.timings));
        for &Recorded { name, threads, is_timed } in &self.recorded {
            let nanoseconds = if is_timed { elapsed.next() } else { None };
            timings.add(name, nanoseconds.filter(|_| shared.times_all));
            if let (Some(rates), Some(nanoseconds)) = (&shared.rates, nanoseconds) {
                rates.measure(name, threads, nanoseconds);
            }
        }
        Ok(())
    }

    fn descriptor_set(&mut self, pipeline: &RawPipeline, buffers: &[Bound<'_>]) -> Result<vk::DescriptorSet> {
        let most = self.shared.info.limits.storage_buffer_bytes;
        if let Some(large) = buffers.iter().find(|b| b.bytes > most) {
            let (name, bytes) = (large.raw.name(), large.bytes);
            return Err(Error::Internal(format!("{bytes} bytes of {name} are bound at once")));
        }
        let failed = |e| vk_error("making a descriptor set", e);
        let raw = self.shared.raw.clone();
        if self.sets_left == 0 {
            let types = [vk::DescriptorType::STORAGE_BUFFER, vk::DescriptorType::UNIFORM_TEXEL_BUFFER];
            let sizes = types.map(|ty| {
                vk::DescriptorPoolSize::default().ty(ty).descriptor_count(SETS_PER_POOL * BUFFERS_PER_SET)
            });
            let info = vk::DescriptorPoolCreateInfo::default().max_sets(SETS_PER_POOL).pool_sizes(&sizes);
            // SAFETY: the device is alive.
            self.descriptor_pools.push(unsafe { raw.create_descriptor_pool(&info, None) }.map_err(failed)?);
            self.sets_left = SETS_PER_POOL;
        }
        let layouts = [pipeline.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.descriptor_pools.last().copied().unwrap_or_default())
            .set_layouts(&layouts);
        // SAFETY: the pool has enough space: it was sized for SETS_PER_POOL sets of the largest kernel.
        let set = unsafe { raw.allocate_descriptor_sets(&info) }.map_err(failed)?;
        self.sets_left -= 1;
        let set = set.first().copied().unwrap_or_default();
        let infos: Vec<_> = buffers
            .iter()
            .map(|b| {
                let info = vk::DescriptorBufferInfo::default().buffer(b.raw.handle);
                [info.offset(b.offset).range(b.bytes)]
            })
            .collect();
        let view = |(b, texels): (&Bound<'_>, &Option<vk::Format>)| match texels {
            Some(format) => b.raw.texels(b.offset, b.bytes, *format).map(|view| [view]),
            None => Ok([vk::BufferView::null()]),
        };
        let views: Vec<_> = buffers.iter().zip(&pipeline.texels).map(view).collect::<Result<_>>()?;
        let writes: Vec<_> = (0..)
            .zip(&infos)
            .zip(&views)
            .zip(&pipeline.texels)
            .map(|(((i, info), view), texels)| {
                let write = vk::WriteDescriptorSet::default()
                    .dst_set(set)
                    .dst_binding(i)
                    .descriptor_type(descriptor_type(*texels));
                if texels.is_some() { write.texel_buffer_view(view) } else { write.buffer_info(info) }
            })
            .collect();
        // SAFETY: set and buffers are alive; no submission uses the new set yet.
        unsafe { raw.update_descriptor_sets(&writes, &[]) };
        Ok(set)
    }
}
