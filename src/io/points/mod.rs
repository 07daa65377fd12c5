//! Formats of points without faces.

mod columns;
pub(crate) mod e57;
pub(crate) mod las;
pub(crate) mod pcd;
pub(crate) mod xyz;

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

use super::loaded::Loaded;
use crate::{Error, Result};

thread_local! {
    /// Whether this thread's panics are errors.
    static IS_GUARDED: Cell<bool> = const { Cell::new(false) };
}
/// Sets the hook that says nothing of such panics.
static HOOK: Once = Once::new();

/// What `read` returns; an error where it panics, as decoders that are not ours do at some broken files.
fn without_panics(read: impl FnOnce() -> Result<Loaded>) -> Result<Loaded> {
    HOOK.call_once(|| {
        let others = take_hook();
        set_hook(Box::new(move |panic| {
            if !IS_GUARDED.get() {
                others(panic);
            }
        }));
    });
    IS_GUARDED.set(true);
    let read = catch_unwind(AssertUnwindSafe(read));
    IS_GUARDED.set(false);
    read.unwrap_or_else(|_| Err(broken_file("its points cannot be decoded")))
}

fn broken_file(problem: impl std::fmt::Display) -> Error {
    let problem = format!("the file is broken: {problem}").replace('\n', " ");
    Error::input(None, problem, "get the complete file, or export it again")
}
