//! Submission of what a recorder has recorded, and the wait for its end.

use super::device::lock;
use super::errors::vk_error;
use super::recorder::{Recorder, TIMED_PER_POOL};
use super::submitted::Submitted;
use super::transfers::{Content, Transfer};
use crate::{Error, Result};
use ash::vk;
use std::slice;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

impl Recorder {
    /// Runs the list and waits until the device is done. Ahead of it run the transfers that wait for a
    /// submission, whoever they are from.
    ///
    /// # Errors
    /// [`Error::DeviceLost`] or [`Error::Device`].
    pub fn submit(mut self) -> Result<Submitted> {
        self.shared.require_own()?;
        let last = self.recorded.last().map_or("uploads that waited", |command| command.name);
        let failed = |e| vk_error(last, e);
        let (raw, longest) = (self.shared.raw.clone(), self.shared.longest_wait());
        let transfers = self.transfers.clone();
        self.end().map_err(failed)?;
        let mut waiting = transfers.waiting();
        self.ahead = self.record_waiting(&waiting)?.map(Box::new);
        let commands: Vec<_> = self.ahead.iter().map(|ahead| ahead.commands).chain([self.commands]).collect();
        let submit = [vk::SubmitInfo::default().command_buffers(&commands)];
        // SAFETY: recording has ended; the queue is locked during the submission, as Vulkan requires; the
        // fence outlives the wait, and so does all that the commands use, unless `device_is_done` says that
        // it is no longer used.
        unsafe {
            let fence = raw.create_fence(&vk::FenceCreateInfo::default(), None).map_err(failed)?;
            let sent = raw.queue_submit(*lock(&self.shared.queue), &submit, fence);
            if sent.is_ok() {
                self.shared.submissions.fetch_add(1, Ordering::Relaxed);
                self.staging.extend(waiting.drain(..).filter_map(|transfer| match transfer.content {
                    Content::Staged(staging) => Some(staging),
                    Content::Word(_) => None,
                }));
            }
            drop(waiting);
            let done = sent.and_then(|()| {
                let began = Instant::now();
                let most = longest.map_or(u64::MAX, |longest| longest.as_nanos() as u64);
                let waited = raw.wait_for_fences(&[fence], true, most);
                self.shared.count_waited(began.elapsed());
                let running = waited.is_err_and(|error| !self.device_is_done(error));
                self.running = running;
                if let Some(ahead) = &mut self.ahead {
                    ahead.running = running;
                }
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
        if let Some(ahead) = &self.ahead {
            ahead.collect_timings()?;
        }
        self.collect_timings()?;
        Ok(Submitted::new(self))
    }

    /// Ends recording; what was downloaded becomes visible to the host.
    fn end(&self) -> std::result::Result<(), vk::Result> {
        let to_host = vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
            .dst_access_mask(vk::AccessFlags::HOST_READ);
        let raw = &self.shared.raw;
        // SAFETY: recording is on.
        unsafe {
            if self.staging.iter().any(|staging| staging.usage() == vk::BufferUsageFlags::TRANSFER_DST) {
                self.shared.barriers.fetch_add(1, Ordering::Relaxed);
                raw.cmd_pipeline_barrier(
                    self.commands,
                    vk::PipelineStageFlags::TRANSFER,
                    vk::PipelineStageFlags::HOST,
                    vk::DependencyFlags::empty(),
                    &[to_host],
                    &[],
                    &[],
                );
            }
            raw.end_command_buffer(self.commands)
        }
    }

    /// Transfers as commands; nothing if nobody has their targets any more. The staging memory stays theirs.
    fn record_waiting(&self, waiting: &[Transfer]) -> Result<Option<Self>> {
        let mut commands = None;
        for Transfer { target, offset, bytes, content } in waiting {
            let Some(target) = target.upgrade() else { continue };
            let commands = match &mut commands {
                Some(commands) => commands,
                None => commands.insert(Self::start(&self.shared, &self.transfers)?),
            };
            match content {
                Content::Staged(staging) => commands.record_upload(staging, (&target, *offset), *bytes)?,
                Content::Word(word) => commands.record_fill((&target, *offset), *bytes, *word)?,
            }
        }
        if let Some(commands) = &commands {
            commands.end().map_err(|e| vk_error("transfers", e))?;
        }
        Ok(commands)
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
        let mut all = self.ahead.iter().map(Box::as_ref).chain([self]);
        let open = all.find_map(Self::first_without_end);
        let name = open.or_else(|| self.recorded.last().map(|command| command.name)).unwrap_or("commands");
        Error::DeviceLost(format!("{name}, which did not end within {} s", longest.as_secs()))
    }

    fn first_without_end(&self) -> Option<&'static str> {
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
        (0..).zip(timed).find(|(k, _)| !has_ended(*k)).map(|(_, command)| command.name)
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
        self.transfers.keep(std::mem::take(&mut self.staging));
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
