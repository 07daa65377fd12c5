//! The end of the process while threads of a driver may still run.

use std::ffi::c_int;

unsafe extern "C" {
    fn _exit(code: c_int) -> !;
}

/// Ends the process at once, without what libraries have registered for its end: a driver's threads may still
/// run, and would use what that takes down.
pub(crate) fn end_process(code: u8) -> ! {
    // SAFETY: C's own function, which may be called in any thread at any time.
    unsafe { _exit(c_int::from(code)) }
}
