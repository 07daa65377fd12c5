//! Formats of points without faces.

mod columns;
pub(crate) mod e57;
pub(crate) mod las;
pub(crate) mod pcd;
pub(crate) mod xyz;

use std::panic::{AssertUnwindSafe, catch_unwind};

use super::loaded::Loaded;
use crate::{Error, Result};

/// What `read` returns; an error where it panics, as decoders that are not ours do at some broken files.
fn guarded(read: impl FnOnce() -> Result<Loaded>) -> Result<Loaded> {
    catch_unwind(AssertUnwindSafe(read)).unwrap_or_else(|_| Err(broken("its points cannot be decoded")))
}

fn broken(problem: impl std::fmt::Display) -> Error {
    let problem = format!("the file is broken: {problem}").replace('\n', " ");
    Error::input(None, problem, "get the whole file or write it again")
}
