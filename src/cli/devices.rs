//! `rtfmesh devices`.

use super::table;
use super::terminal::print;
use anyhow::Result;
use rtfmesh::device::tested_devices;
use rtfmesh::gpu::no_device;
use rtfmesh::report::to_json;

const EXAMPLES: &str = "Examples:
  rtfmesh devices
  rtfmesh devices --json";

/// List the Vulkan devices with their drivers and limits, and whether each can be used.
///
/// The first time that a driver is used, it runs a self-test: small kernels with known results. A device that
/// fails is only used if --device names it.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Lists.
pub fn run(args: &Args) -> Result<()> {
    let list = tested_devices()?;
    if list.is_empty() {
        return Err(no_device().into());
    }
    print(&if args.json { to_json(&list)? } else { table::devices(&list) })
}
