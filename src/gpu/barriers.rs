//! Which commands must wait for which: the one place that decides on barriers.

use super::kernel::Access;
use ash::vk;
use std::ops::Range;

/// Where a buffer is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stage {
    Compute,
    /// A dispatch whose size is read from a buffer, before its kernel begins.
    Indirect,
    Transfer,
}

/// The source scopes of a memory barrier. Its destination is always all stages in use: a barrier towards
/// transfers only would leave a later dispatch unordered after an earlier one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Barrier {
    pub from: vk::PipelineStageFlags,
    pub available: vk::AccessFlags,
}

impl Barrier {
    pub const TO: vk::PipelineStageFlags = vk::PipelineStageFlags::from_raw(
        vk::PipelineStageFlags::COMPUTE_SHADER.as_raw()
            | vk::PipelineStageFlags::TRANSFER.as_raw()
            | vk::PipelineStageFlags::DRAW_INDIRECT.as_raw(),
    );
    pub const VISIBLE: vk::AccessFlags = vk::AccessFlags::from_raw(
        vk::AccessFlags::SHADER_READ.as_raw()
            | vk::AccessFlags::SHADER_WRITE.as_raw()
            | vk::AccessFlags::TRANSFER_READ.as_raw()
            | vk::AccessFlags::TRANSFER_WRITE.as_raw()
            | vk::AccessFlags::INDIRECT_COMMAND_READ.as_raw(),
    );
    /// Orders everything after everything of earlier submissions.
    pub const ALL: Self = Self { from: Self::TO, available: Self::VISIBLE };
}

/// A use of a part of a buffer by a command.
#[derive(Debug, Clone)]
pub(super) struct Use {
    /// Id of the buffer.
    pub buffer: u64,
    /// In bytes.
    pub part: Range<u64>,
    pub access: Access,
}

impl Use {
    /// Of `bytes` bytes from `offset` on.
    pub fn new(buffer: u64, offset: u64, bytes: u64, access: Access) -> Self {
        Self { buffer, part: offset..offset + bytes, access }
    }

    pub fn is_write(&self) -> bool {
        self.access != Access::Read
    }

    /// Whether both use the same bytes, and one of them writes.
    pub fn conflicts(&self, other: &Self) -> bool {
        self.buffer == other.buffer
            && self.part.start < other.part.end
            && other.part.start < self.part.end
            && (self.is_write() || other.is_write())
    }
}

/// Uses of all buffers since the last barrier.
#[derive(Debug, Default)]
pub(super) struct Hazards {
    pending: Vec<Use>,
    stages: vk::PipelineStageFlags,
    writes: vk::AccessFlags,
}

impl Hazards {
    /// Adds one command's uses of buffers and returns the barrier that must precede it, if any.
    ///
    /// One global barrier clears everything before it, which costs less than one barrier a buffer. With
    /// `always` there is a barrier before every command.
    pub fn barrier_before(&mut self, stage: Stage, uses: &[Use], always: bool) -> Option<Barrier> {
        // There are few, since most dispatches need a barrier.
        let conflict = uses.iter().any(|new| self.pending.iter().any(|old| old.conflicts(new)));
        let (flag, write) = match stage {
            Stage::Compute => (vk::PipelineStageFlags::COMPUTE_SHADER, vk::AccessFlags::SHADER_WRITE),
            Stage::Indirect => (
                vk::PipelineStageFlags::COMPUTE_SHADER | vk::PipelineStageFlags::DRAW_INDIRECT,
                vk::AccessFlags::SHADER_WRITE,
            ),
            Stage::Transfer => (vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::TRANSFER_WRITE),
        };
        let barrier = (!self.stages.is_empty() && (conflict || always))
            .then_some(Barrier { from: self.stages, available: self.writes });
        if barrier.is_some() {
            *self = Self::default();
        }
        self.pending.extend_from_slice(uses);
        if uses.iter().any(Use::is_write) {
            self.writes |= write;
        }
        self.stages |= flag;
        barrier
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Access::{Read, ReadWrite, Write};
    use Stage::{Compute, Transfer};

    /// The use of a whole buffer of 64 bytes.
    fn all(buffer: u64, access: Access) -> Use {
        Use::new(buffer, 0, 64, access)
    }

    #[test]
    fn only_conflicts_get_a_barrier() {
        let mut h = Hazards::default();
        assert_eq!(h.barrier_before(Compute, &[all(1, Write), all(2, Read)], false), None);
        assert_eq!(h.barrier_before(Compute, &[all(2, Read), all(3, Write)], false), None, "two readers");
        assert!(h.barrier_before(Compute, &[all(1, Read)], false).is_some(), "read after write");
        assert_eq!(h.barrier_before(Compute, &[all(3, Read)], false), None, "cleared by the same barrier");
        assert!(h.barrier_before(Compute, &[all(3, Write)], false).is_some(), "write after read");
        assert!(h.barrier_before(Compute, &[all(3, ReadWrite)], false).is_some(), "write after write");
    }

    #[test]
    fn parts_that_do_not_overlap_are_independent() {
        let part = |offset, access| Use::new(1, offset, 16, access);
        let mut h = Hazards::default();
        assert_eq!(h.barrier_before(Compute, &[part(0, Write)], false), None);
        assert_eq!(h.barrier_before(Transfer, &[part(16, Write)], false), None, "the next part");
        assert!(h.barrier_before(Compute, &[part(8, Read)], false).is_some(), "half of either");
    }

    #[test]
    fn scopes_name_what_happened() {
        let mut h = Hazards::default();
        h.barrier_before(Transfer, &[all(1, Write)], false);
        h.barrier_before(Compute, &[all(2, Write)], false);
        let b = h.barrier_before(Transfer, &[all(2, Read)], false).unwrap();
        assert_eq!(b.from, vk::PipelineStageFlags::COMPUTE_SHADER | vk::PipelineStageFlags::TRANSFER);
        assert_eq!(b.available, vk::AccessFlags::SHADER_WRITE | vk::AccessFlags::TRANSFER_WRITE);
    }

    #[test]
    fn the_size_of_a_dispatch_is_read_before_it() {
        let mut h = Hazards::default();
        h.barrier_before(Compute, &[all(1, Write)], false);
        assert!(
            h.barrier_before(Stage::Indirect, &[all(2, Write), all(1, Read)], false).is_some(),
            "read after write"
        );
        let b = h.barrier_before(Compute, &[all(1, Write)], false).unwrap();
        assert!(b.from.contains(vk::PipelineStageFlags::DRAW_INDIRECT), "write after read");
    }

    #[test]
    fn the_debug_mode_orders_everything() {
        let mut h = Hazards::default();
        assert_eq!(
            h.barrier_before(Compute, &[all(1, Read)], true),
            None,
            "nothing before the first command"
        );
        assert!(h.barrier_before(Compute, &[all(2, Read)], true).is_some());
    }
}
