//! What a forked process may do with Vulkan.
//!
//! Drivers have threads, and a GPU's driver has a connection to the device; none of these survive a fork. So
//! what the parent opened is neither used nor destroyed in a child. A child opens devices of its own where
//! all are CPUs, whose driver begins again with each instance. GPUs' drivers keep state for a whole process
//! and may wait for ever.

use crate::{Error, Result};
use std::sync::atomic::{AtomicU32, Ordering};

/// The process that first listed devices that a fork of it must not open; 0 for none.
static CLOSED_BY: AtomicU32 = AtomicU32::new(0);

/// Notes that this process has listed devices.
pub(super) fn remember(has_gpu: bool) {
    if has_gpu || !at_exit::is_guarded() {
        // A process that was forked from another one does not get here.
        CLOSED_BY.store(std::process::id(), Ordering::Relaxed);
    }
}

/// Refuses a process whose parent has used a GPU's driver. Call it before a driver is loaded.
///
/// # Errors
/// [`Error::Device`].
pub(super) fn require_openable() -> Result<()> {
    at_exit::guard();
    require_openable_in(CLOSED_BY.load(Ordering::Relaxed), std::process::id())
}

fn require_openable_in(closed_by: u32, process: u32) -> Result<()> {
    if closed_by == 0 || closed_by == process {
        return Ok(());
    }
    Err(Error::device(
        "this process was forked from one that had used a Vulkan driver, which does not survive a fork",
        "start worker processes with spawn instead of fork, or fork before the first use of a device",
    ))
}

/// The end of forked processes. Lavapipe has a handler that waits at exit for threads which only the parent
/// has, and whose memory may be gone. So a child of a process that has loaded drivers leaves before this
/// handler, as `_exit` does.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod at_exit {
    use std::ffi::{c_int, c_void};
    use std::sync::Once;
    use std::sync::atomic::{AtomicBool, Ordering};

    static ONCE: Once = Once::new();
    static GUARDED: AtomicBool = AtomicBool::new(false);

    unsafe extern "C" {
        fn pthread_atfork(
            before: Option<extern "C" fn()>,
            parent: Option<extern "C" fn()>,
            child: Option<extern "C" fn()>,
        ) -> c_int;
        fn on_exit(handler: extern "C" fn(c_int, *mut c_void), argument: *mut c_void) -> c_int;
        fn fflush(stream: *mut c_void) -> c_int;
        fn _exit(status: c_int) -> !;
    }

    /// In each child from now on: the last handler that is registered runs first.
    pub fn guard() {
        ONCE.call_once(|| {
            // SAFETY: the function is there as long as this library, which nothing unloads once drivers that
            // it has loaded have threads.
            let failed = unsafe { pthread_atfork(None, None, Some(forked)) };
            GUARDED.store(failed == 0, Ordering::Relaxed);
        });
    }

    pub fn is_guarded() -> bool {
        GUARDED.load(Ordering::Relaxed)
    }

    extern "C" fn forked() {
        // SAFETY: as above. Without memory for it, the process ends as it would have without this module.
        unsafe { on_exit(leave, std::ptr::null_mut()) };
    }

    extern "C" fn leave(status: c_int, _: *mut c_void) {
        // SAFETY: null stands for all streams of C, which the rest of `exit` would write out.
        unsafe {
            fflush(std::ptr::null_mut());
            _exit(status)
        }
    }
}

/// Elsewhere it is not known what drivers do at the end of a forked process.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
mod at_exit {
    pub fn guard() {}

    pub fn is_guarded() -> bool {
        false
    }
}

/// The error for a device that another process has opened.
pub(super) fn foreign_device(name: &str) -> Error {
    Error::device(
        format!("device '{name}' was opened by the process that this one was forked from"),
        "open the device again in this process",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn children_of_a_process_with_a_gpu_are_refused() {
        assert_eq!(require_openable_in(0, 7), Ok(()));
        assert_eq!(require_openable_in(7, 7), Ok(()));
        let refused = require_openable_in(6, 7).unwrap_err().to_string();
        assert!(refused.contains("forked") && refused.contains("spawn"), "{refused}");
    }
}
