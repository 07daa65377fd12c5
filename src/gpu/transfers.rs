//! Uploads and fills that ride in the next submission, and staging memory that is used again.
//!
//! A submission costs the host 0.1 to 0.3 ms on a GPU, more than most of these copies take.

use super::buffer::RawBuffer;
use super::device::{Shared, lock};
use super::recorder::Recorder;
use crate::Result;
use ash::vk;
use gpu_allocator::MemoryLocation;
use std::sync::{Arc, Mutex, MutexGuard, Weak};

/// Most bytes of uploads that wait for other work. With more, they are sent at once, since until then the
/// memory has them twice.
const WAITING_BYTES: u64 = 128 << 20;
/// Most bytes of unused staging memory that are kept.
const KEPT_BYTES: u64 = 64 << 20;

/// New content of a part of a buffer.
pub(super) struct Transfer {
    /// Not kept alive by this: what nobody can use any more needs no content.
    pub target: Weak<RawBuffer>,
    /// In bytes, as is the length.
    pub offset: u64,
    pub bytes: u64,
    pub content: Content,
}

pub(super) enum Content {
    /// The start of this staging memory.
    Staged(RawBuffer),
    /// This word again and again.
    Word(u32),
}

/// What waits for the next submission of a device, and its unused staging memory.
#[derive(Default)]
pub(super) struct Transfers {
    /// In this order. Whoever sends them keeps this locked until then, so that no later submission of another
    /// thread, which may rely on them, overtakes them.
    waiting: Mutex<Vec<Transfer>>,
    /// What was used last is at the end.
    kept: Mutex<Vec<RawBuffer>>,
}

impl Transfers {
    /// Everything that waits, for a submission to take.
    pub fn waiting(&self) -> MutexGuard<'_, Vec<Transfer>> {
        lock(&self.waiting)
    }

    /// Lets a transfer wait for the next submission.
    ///
    /// # Errors
    /// As [`Recorder::submit`], if so much waits that it is sent at once.
    pub fn add(self: &Arc<Self>, shared: &Arc<Shared>, transfer: Transfer) -> Result<()> {
        let mut waiting = self.waiting();
        waiting.push(transfer);
        let staged = waiting.iter().filter(|transfer| matches!(transfer.content, Content::Staged(_)));
        let bytes: u64 = staged.map(|transfer| transfer.bytes).sum();
        drop(waiting);
        if bytes > WAITING_BYTES { self.send(shared) } else { Ok(()) }
    }

    /// Sends what waits in a submission of its own.
    fn send(self: &Arc<Self>, shared: &Arc<Shared>) -> Result<()> {
        Recorder::start(shared, self)?.submit().map(drop)
    }

    /// Staging memory for copies in one direction, at least this many bytes long.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn staging(
        self: &Arc<Self>,
        shared: &Arc<Shared>,
        bytes: usize,
        usage: vk::BufferUsageFlags,
    ) -> Result<RawBuffer> {
        let bytes = bytes.max(1).next_multiple_of(16) as u64;
        if let Some(kept) = self.take_kept(bytes, usage) {
            return Ok(kept);
        }
        self.make_room(shared, bytes)?;
        let location = if usage == vk::BufferUsageFlags::TRANSFER_SRC {
            MemoryLocation::CpuToGpu
        } else {
            MemoryLocation::GpuToCpu
        };
        RawBuffer::new(shared, "gpu.staging", bytes, usage, location)
    }

    /// The smallest of the kept ones that suffice, if it is not much too large.
    fn take_kept(&self, bytes: u64, usage: vk::BufferUsageFlags) -> Option<RawBuffer> {
        let mut kept = lock(&self.kept);
        let fits =
            |buffer: &RawBuffer| buffer.usage() == usage && (bytes..=2 * bytes).contains(&buffer.bytes());
        let fitting = kept.iter().enumerate().filter(|(_, buffer)| fits(buffer));
        let smallest = fitting.min_by_key(|(_, buffer)| buffer.bytes()).map(|(place, _)| place)?;
        Some(kept.remove(smallest))
    }

    /// Keeps staging memory that no submission uses any more; what was not used for longest is freed.
    pub fn keep(&self, staging: Vec<RawBuffer>) {
        let mut kept = lock(&self.kept);
        kept.extend(staging);
        let mut bytes: u64 = kept.iter().map(RawBuffer::bytes).sum();
        let surplus = kept.iter().take_while(|buffer| {
            let is_surplus = bytes > KEPT_BYTES;
            bytes -= if is_surplus { buffer.bytes() } else { 0 };
            is_surplus
        });
        let surplus = surplus.count();
        kept.drain(..surplus);
    }

    /// Where the limit on the memory of all buffers forbids this many more bytes: frees the staging memory
    /// that can be done without.
    ///
    /// # Errors
    /// As [`Recorder::submit`].
    pub fn make_room(self: &Arc<Self>, shared: &Arc<Shared>, bytes: u64) -> Result<()> {
        if shared.may_allocate(bytes) {
            return Ok(());
        }
        if !self.waiting().is_empty() {
            self.send(shared)?;
        }
        lock(&self.kept).clear();
        Ok(())
    }
}
