//! Records a sequence of dispatches and copies, with the barriers that they need, and runs it.

use super::barriers::{Barrier, Hazards, Stage};
use super::buffer::{Bound, Buffer, RawBuffer};
use super::device::{Device, Shared, lock};
use super::errors::vk_error;
use super::kernel::{Access, BindingSet, Kernel, Pipeline, RawPipeline, descriptor_type};
use super::submitted::{Download, Submitted};
use crate::{Error, Result};
use ash::vk;
use glam::UVec4;
use gpu_allocator::MemoryLocation;
use std::collections::HashMap;
use std::slice;
use std::sync::Arc;
use std::time::{Duration, Instant};

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
    shared: Arc<Shared>,
    command_pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    descriptor_pools: Vec<vk::DescriptorPool>,
    sets_left: u32,
    query_pools: Vec<vk::QueryPool>,
    /// All commands, in order.
    recorded: Vec<Recorded>,
    /// How many of them are timed.
    timed: u32,
    hazards: Hazards,
    pub(super) staging: Vec<RawBuffer>,
    /// What the commands use; shared so that nobody else can free it before the device is done.
    buffers: HashMap<u64, Arc<RawBuffer>>,
    pipelines: Vec<Arc<RawPipeline>>,
    /// Set while the device may still use what this recorder owns.
    running: bool,
}

/// A command, for the timings.
struct Recorded {
    name: &'static str,
    /// Number of invocations; 0 if it is not known.
    threads: usize,
    is_timed: bool,
}

const SETS_PER_POOL: u32 = 128;
const TIMED_PER_POOL: u32 = 512;
/// More than any kernel binds; checked when sets are allocated.
const BUFFERS_PER_SET: u32 = 12;

impl Recorder {
    /// Starts a list of commands.
    ///
    /// # Errors
    /// [`Error::Device`] if the driver has no memory for it.
    pub fn new(device: &Device) -> Result<Self> {
        let shared = &device.shared;
        shared.require_own()?;
        let failed = |e| vk_error("starting a command buffer", e);
        let pool_info = vk::CommandPoolCreateInfo::default().queue_family_index(shared.queue_family);
        // SAFETY: the device is alive (Arc).
        let command_pool = unsafe { shared.raw.create_command_pool(&pool_info, None) }.map_err(failed)?;
        let mut this = Self {
            shared: shared.clone(),
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
        let mut uses: Vec<_> =
            buffers.iter().zip(K::INFO.bindings).map(|(b, info)| (b.id, info.access)).collect();
        let mut stage = Stage::Compute;
        if let Groups::Indirect(groups, _) = groups {
            buffers.push(groups.raw());
            uses.push((groups.raw().id, Access::Read));
            stage = Stage::Indirect;
        }
        for (i, (id, access)) in uses.iter().enumerate() {
            if uses.iter().enumerate().any(|(j, (other, _))| i != j && id == other && *access != Access::Read)
            {
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
        if values.len() > target.len() {
            return Err(Error::Internal(format!(
                "{} values do not fit in {}",
                values.len(),
                target.raw().name()
            )));
        }
        let bytes: &[u8] = bytemuck::cast_slice(values);
        if bytes.is_empty() {
            return Ok(());
        }
        let mut staging = self.staging_buffer(bytes.len(), vk::BufferUsageFlags::TRANSFER_SRC)?;
        let mapped = staging.mapped_mut().get_mut(..bytes.len());
        mapped
            .ok_or_else(|| Error::Internal("staging memory is not mapped".to_owned()))?
            .copy_from_slice(bytes);
        self.buffers.insert(target.raw().id, target.raw().clone());
        self.copy((&staging, 0), (target.raw(), target.offset()), bytes.len(), "copy.upload")?;
        self.staging.push(staging);
        Ok(())
    }

    /// Sets all 32-bit words of `target` to `word`.
    ///
    /// # Errors
    /// [`Error::Device`] if the driver has no memory.
    pub fn fill<T: bytemuck::Pod>(&mut self, target: &Buffer<T>, word: u32) -> Result<()> {
        let (buffer, offset) = (target.raw(), target.offset());
        let bytes = target.bound().bytes;
        self.barrier_before_transfer(&[(buffer.id, Access::Write)]);
        self.buffers.insert(buffer.id, buffer.clone());
        let raw = self.shared.raw.clone();
        // SAFETY: buffers are made for transfers, of whole words; this recorder shares the buffer until the
        // submission was waited for.
        self.record_timed("copy.fill", 0, |commands| unsafe {
            raw.cmd_fill_buffer(commands, buffer.handle, offset, bytes, word);
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
        let staging = self.staging_buffer(bytes, vk::BufferUsageFlags::TRANSFER_DST)?;
        if bytes > 0 {
            self.buffers.insert(source.raw().id, source.raw().clone());
            self.copy((source.raw(), source.offset()), (&staging, 0), bytes, "copy.download")?;
        }
        self.staging.push(staging);
        Ok(Download::new(self.staging.len() - 1, len))
    }

    /// Runs the list and waits until the device is done.
    ///
    /// # Errors
    /// [`Error::DeviceLost`] or [`Error::Device`].
    pub fn submit(mut self) -> Result<Submitted> {
        self.shared.require_own()?;
        let last = self.recorded.last().map_or("an empty submission", |command| command.name);
        let failed = |e| vk_error(last, e);
        let (raw, longest) = (self.shared.raw.clone(), self.shared.longest_wait());
        let to_host = vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
            .dst_access_mask(vk::AccessFlags::HOST_READ);
        let commands = [self.commands];
        let submit = [vk::SubmitInfo::default().command_buffers(&commands)];
        // SAFETY: recording is on; the queue is locked during the submission, as Vulkan requires; the fence
        // outlives the wait, and so does all that the commands use, unless `device_is_done` says that it is
        // no longer used.
        unsafe {
            raw.cmd_pipeline_barrier(
                self.commands,
                vk::PipelineStageFlags::TRANSFER,
                vk::PipelineStageFlags::HOST,
                vk::DependencyFlags::empty(),
                &[to_host],
                &[],
                &[],
            );
            raw.end_command_buffer(self.commands).map_err(failed)?;
            let fence = raw.create_fence(&vk::FenceCreateInfo::default(), None).map_err(failed)?;
            let sent = raw.queue_submit(*lock(&self.shared.queue), &submit, fence);
            let done = sent.and_then(|()| {
                let began = Instant::now();
                let most = longest.map_or(u64::MAX, |longest| longest.as_nanos() as u64);
                let waited = raw.wait_for_fences(&[fence], true, most);
                self.shared.count_waited(began.elapsed());
                self.running = waited.is_err_and(|error| !self.device_is_done(error));
                waited
            });
            if !self.running {
                raw.destroy_fence(fence, None);
            }
            match (done, longest) {
                (Err(vk::Result::TIMEOUT), Some(longest)) => return Err(self.hung(longest)),
                (done, _) => done.map_err(failed)?,
            }
        }
        self.collect_timings()?;
        Ok(Submitted::new(self))
    }

    /// After a failed wait: whether the device no longer uses what this recorder owns.
    fn device_is_done(&self, error: vk::Result) -> bool {
        if error == vk::Result::TIMEOUT && self.shared.longest_wait().is_some() {
            return false;
        }
        // Vulkan counts the work of a lost device as done. Otherwise the wait itself failed, and the work
        // continues.
        error == vk::Result::ERROR_DEVICE_LOST || {
            let _queue = lock(&self.shared.queue);
            // SAFETY: the device is alive, and its queue locked, as Vulkan requires.
            let idle = unsafe { self.shared.raw.device_wait_idle() };
            matches!(idle, Ok(()) | Err(vk::Result::ERROR_DEVICE_LOST))
        }
    }

    /// The error for a submission that does not end. Of commands that are timed, the first one is named that
    /// has no end.
    fn hung(&self, longest: Duration) -> Error {
        let has_ended = |command: u32| {
            let pool = self.query_pools.get((command / TIMED_PER_POOL) as usize).copied();
            let mut end = [0_u64; 2];
            let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
            let query = 2 * (command % TIMED_PER_POOL) + 1;
            // SAFETY: the pool belongs to this recorder; without a flag to wait, the call returns at once.
            let known = pool.is_some_and(|pool| unsafe {
                self.shared.raw.get_query_pool_results(pool, query, slice::from_mut(&mut end), flags).is_ok()
            });
            known && end[1] != 0
        };
        let timed = self.recorded.iter().filter(|command| command.is_timed);
        let open = (0..).zip(timed).find(|(k, _)| !has_ended(*k)).map(|(_, command)| command.name);
        let name = open.or_else(|| self.recorded.last().map(|command| command.name)).unwrap_or("commands");
        Error::DeviceLost(format!("{name}, which did not end within {} s", longest.as_secs()))
    }

    /// Omits the next barrier, to test that a missing one is detected.
    #[cfg(test)]
    pub(super) fn forget_hazards(&mut self) {
        self.hazards = Hazards::default();
    }

    fn staging_buffer(&self, bytes: usize, usage: vk::BufferUsageFlags) -> Result<RawBuffer> {
        let location = if usage == vk::BufferUsageFlags::TRANSFER_SRC {
            MemoryLocation::CpuToGpu
        } else {
            MemoryLocation::GpuToCpu
        };
        RawBuffer::new(&self.shared, "gpu.staging", bytes.max(1).next_multiple_of(16) as u64, usage, location)
    }

    /// Copies bytes between buffers, in both from an offset on.
    fn copy(
        &mut self,
        (from, from_offset): (&RawBuffer, u64),
        (to, to_offset): (&RawBuffer, u64),
        bytes: usize,
        name: &'static str,
    ) -> Result<()> {
        self.barrier_before_transfer(&[(from.id, Access::Read), (to.id, Access::Write)]);
        let region =
            [vk::BufferCopy::default().src_offset(from_offset).dst_offset(to_offset).size(bytes as u64)];
        let raw = self.shared.raw.clone();
        // SAFETY: both buffers are at least `bytes` long; this recorder shares or owns them until the
        // submission was waited for.
        self.record_timed(name, 0, |commands| unsafe {
            raw.cmd_copy_buffer(commands, from.handle, to.handle, &region);
        })
    }

    /// Records the barrier before a copy or a fill, if one is needed.
    fn barrier_before_transfer(&mut self, uses: &[(u64, Access)]) {
        if let Some(b) = self.hazards.barrier_before(Stage::Transfer, uses, self.shared.full_barriers) {
            self.barrier(b);
        }
    }

    fn barrier(&self, b: Barrier) {
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

    fn collect_timings(&mut self) -> Result<()> {
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

impl Drop for Recorder {
    fn drop(&mut self) {
        if !self.shared.is_own() {
            return;
        }
        if self.running {
            // The device may still use all this for an unknown time, so it is never freed, nor is the device.
            std::mem::forget(std::mem::take(&mut self.staging));
            std::mem::forget(std::mem::take(&mut self.buffers));
            std::mem::forget(std::mem::take(&mut self.pipelines));
            std::mem::forget(Arc::clone(&self.shared));
            return;
        }
        // SAFETY: no submission is running, see `submit`.
        unsafe {
            for pool in &self.descriptor_pools {
                self.shared.raw.destroy_descriptor_pool(*pool, None);
            }
            for pool in &self.query_pools {
                self.shared.raw.destroy_query_pool(*pool, None);
            }
            self.shared.raw.destroy_command_pool(self.command_pool, None);
        }
    }
}
