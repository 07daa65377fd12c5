//! `rtfmesh demo`.

use super::method::{DeviceArgs, refuse_messages};
use super::render::refuse_other_than_png;
use super::terminal::print;
use crate::error::shown;
use anyhow::Result;
use rtfmesh::io;
use rtfmesh::measure::{Measures, measure};
use rtfmesh::mesh::samples::sample;
use rtfmesh::picture::{Panel, PictureOptions, png};
use rtfmesh::{Device, Options, Remeshed, TriMesh, remesh};
use std::path::PathBuf;

const EXAMPLES: &str = "Examples:
  rtfmesh demo
  rtfmesh demo rings.png --device cpu";

/// Remesh a built-in model, and draw it before and after.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Picture to write
    #[arg(value_name = "OUT.png", default_value = "rtfmesh-demo.png")]
    output: PathBuf,
    #[command(flatten)]
    device: DeviceArgs,
}

/// The model of the demo and of self-tests.
pub const MODEL: &str = "genus3";
/// Its number of vertices after remeshing.
pub const VERTICES: usize = 2000;

/// The model before and after.
pub struct Demo {
    pub input: TriMesh,
    pub result: Remeshed,
}

/// Remeshes the model.
///
/// # Errors
/// Those of [`remesh`] and [`refuse_messages`].
pub fn remesh_model(device: &Device) -> rtfmesh::Result<Demo> {
    let input = sample(MODEL)?;
    let result = remesh(device, &input, &Options::new(VERTICES))?;
    refuse_messages(device)?;
    Ok(Demo { input, result })
}

/// Remeshes, draws, tells.
pub fn run(args: &Args) -> Result<()> {
    refuse_other_than_png(&args.output)?;
    io::check_text_target(&args.output)?;
    let device = args.device.open(false)?;
    let Demo { input, result } = remesh_model(&device)?;
    let panel = |mesh| Panel { mesh, colours: &[], lines: &[], discs: None, outlines: false };
    let picture = png(&[panel(&input), panel(&result.mesh)], &PictureOptions::default())?;
    io::write_bytes(&args.output, &picture)?;
    let before = measure(&input, None)?;
    let summary = &result.summary;
    let row = |name: &str, of: &dyn Fn(&Measures) -> String| {
        format!("  {name:20}{:>14}{:>14}\n", of(&before), of(&summary.output))
    };
    print(&format!(
        "{MODEL}, a built-in model, remeshed with exactly {VERTICES} vertices in {:.2} s on {}:\n\n\
         {:22}{:>14}{:>14}\n{}{}{}{}\n\
         The picture {} shows both. Next, remesh your own mesh:\n\n  \
         rtfmesh remesh scan.ply scan-10k.ply -n 10k\n",
        summary.timings.wall_milliseconds / 1000.0,
        device.info().name,
        "",
        "before",
        "after",
        row("vertices", &|m| m.vertices.to_string()),
        row("triangles", &|m| m.faces.to_string()),
        row("mean quality", &|m| format!("{:.3}", m.quality.mean_quality)),
        row("smallest angle", &|m| format!("{:.1}°", m.quality.min_angle)),
        shown(&args.output),
    ))
}
