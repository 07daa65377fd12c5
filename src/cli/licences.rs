//! `rtfmesh licences`.

use super::terminal::print;
use anyhow::Result;
use std::io::Read;

const EXAMPLES: &str = "Examples:
  rtfmesh licences | less";

/// Print the licences of the works of others that the program contains.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {}

/// Made by ci/licenses.py.
const NOTICES: &[u8] = include_bytes!("licences.txt.gz");

/// Prints.
pub fn run() -> Result<()> {
    let mut text = String::new();
    flate2::read::GzDecoder::new(NOTICES).read_to_string(&mut text)?;
    let own = concat!(
        "rtfmesh ",
        env!("CARGO_PKG_VERSION"),
        " is licensed under ",
        env!("CARGO_PKG_LICENSE"),
        ", at your option.\n\n"
    );
    print(&(own.to_owned() + &text))
}
