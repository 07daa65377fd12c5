//! `rtfmesh sample`.

use super::files::Target;
use super::terminal::print;
use anyhow::Result;
use rtfmesh::io::Encoding;
use rtfmesh::mesh::attributes::Attributes;
use rtfmesh::mesh::samples;
use std::path::PathBuf;

const EXAMPLES: &str = "Examples:
  rtfmesh sample
  rtfmesh sample genus3 genus3.ply";

/// Write one of the built-in models; without arguments, list them.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Name of the model
    #[arg(requires = "output")]
    name: Option<String>,
    /// Mesh to write; - is standard output
    output: Option<PathBuf>,
    /// Output format, regardless of the extension
    ///
    /// One of obj, ply, stl, off, glb, mesh, vtp, vtu, vtk and 3mf, each also with .gz.
    #[arg(long, value_name = "FORMAT")]
    format: Option<Encoding>,
}

/// Makes and writes, or lists.
pub fn run(args: &Args) -> Result<()> {
    let (Some(name), Some(output)) = (&args.name, &args.output) else {
        return print(
            &samples::names().iter().map(|(name, what)| format!("{name:16} {what}\n")).collect::<String>(),
        );
    };
    let mesh = samples::sample(name)?;
    Target::new(output, args.format)?.write(&mesh, &Attributes::default(), true)
}
