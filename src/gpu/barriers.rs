//! Which commands must wait for which: the one place that decides on barriers.

use super::kernel::Access;
use ash::vk;
use std::collections::HashMap;

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

/// Uses of all buffers since the last barrier.
#[derive(Debug, Default)]
pub(super) struct Hazards {
    /// Buffer id → whether it was written.
    pending: HashMap<u64, bool>,
    stages: vk::PipelineStageFlags,
    writes: vk::AccessFlags,
}

impl Hazards {
    /// Adds one command's uses of buffers (by id) and returns the barrier that must precede it, if any.
    ///
    /// Two uses conflict when one of them writes. One global barrier clears everything before it, which costs
    /// less than one barrier a buffer. With `always` there is a barrier before every command.
    pub fn barrier_before(&mut self, stage: Stage, uses: &[(u64, Access)], always: bool) -> Option<Barrier> {
        let conflict = uses.iter().any(|(id, access)| {
            self.pending.get(id).is_some_and(|&written| written || *access != Access::Read)
        });
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
        for (id, access) in uses {
            let written = *access != Access::Read;
            *self.pending.entry(*id).or_default() |= written;
            if written {
                self.writes |= write;
            }
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

    #[test]
    fn only_conflicts_get_a_barrier() {
        let mut h = Hazards::default();
        assert_eq!(h.barrier_before(Compute, &[(1, Write), (2, Read)], false), None);
        assert_eq!(h.barrier_before(Compute, &[(2, Read), (3, Write)], false), None, "two readers");
        assert!(h.barrier_before(Compute, &[(1, Read)], false).is_some(), "read after write");
        assert_eq!(h.barrier_before(Compute, &[(3, Read)], false), None, "cleared by the same barrier");
        assert!(h.barrier_before(Compute, &[(3, Write)], false).is_some(), "write after read");
        assert!(h.barrier_before(Compute, &[(3, ReadWrite)], false).is_some(), "write after write");
    }

    #[test]
    fn scopes_name_what_happened() {
        let mut h = Hazards::default();
        h.barrier_before(Transfer, &[(1, Write)], false);
        h.barrier_before(Compute, &[(2, Write)], false);
        let b = h.barrier_before(Transfer, &[(2, Read)], false).unwrap();
        assert_eq!(b.from, vk::PipelineStageFlags::COMPUTE_SHADER | vk::PipelineStageFlags::TRANSFER);
        assert_eq!(b.available, vk::AccessFlags::SHADER_WRITE | vk::AccessFlags::TRANSFER_WRITE);
    }

    #[test]
    fn the_size_of_a_dispatch_is_read_before_it() {
        let mut h = Hazards::default();
        h.barrier_before(Compute, &[(1, Write)], false);
        assert!(
            h.barrier_before(Stage::Indirect, &[(2, Write), (1, Read)], false).is_some(),
            "read after write"
        );
        let b = h.barrier_before(Compute, &[(1, Write)], false).unwrap();
        assert!(b.from.contains(vk::PipelineStageFlags::DRAW_INDIRECT), "write after read");
    }

    #[test]
    fn the_debug_mode_orders_everything() {
        let mut h = Hazards::default();
        assert_eq!(h.barrier_before(Compute, &[(1, Read)], true), None, "nothing before the first command");
        assert!(h.barrier_before(Compute, &[(2, Read)], true).is_some());
    }
}
