//! The build script of the published package: `ci/package.sh` has compiled the kernels, so that users need no
//! shader compiler.

use std::io::{Error, Result};
use std::path::PathBuf;

fn main() -> Result<()> {
    println!("cargo::rerun-if-changed=kernels");
    let out = PathBuf::from(std::env::var_os("OUT_DIR").ok_or_else(|| Error::other("OUT_DIR is not set"))?);
    for entry in std::fs::read_dir("kernels")? {
        let entry = entry?;
        // A copy would be as read-only as sources are on some systems, and the next one would fail.
        std::fs::write(out.join(entry.file_name()), std::fs::read(entry.path())?)?;
    }
    Ok(())
}
