//! `rtfmesh render`.

use super::files::{InputFormat, input_name, is_standard, tell_notes};
use super::heading::{CAMERA, COLOURS};
use super::points::Drawn;
use super::remesh::same_file;
use super::terminal::tell;
use crate::error::shown;
use anyhow::Result;
use glam::DVec3;
use rtfmesh::io;
use rtfmesh::io::Loaded;
use rtfmesh::mesh::attributes::Role;
use rtfmesh::mesh::features::{Curve, FeatureOptions, find_features, spacing_of};
use rtfmesh::picture::{Colour, Discs, Panel, PictureOptions, View, distance_colours, png, quality_colours};
use rtfmesh::{Error, TriMesh};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "Examples:
  rtfmesh render kitten-10k.ply kitten-10k.png
  rtfmesh render kitten.ply kitten-10k.ply both.png --color quality
  rtfmesh render points.ply mesh.ply both.png --no-edges
  rtfmesh render part-5k.ply off.png --color distance --against part.ply --z-up --curves";

/// Draw meshes or points next to each other into a PNG.
///
/// Meshes are flat shaded with their edges, points are discs. Points have their own colours, if any. They are
/// lit by their normals; without normals, by planes through the nearest points, the same from both sides.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Meshes or points to draw, with the camera that frames the first; - is standard input
    #[arg(required = true)]
    meshes: Vec<PathBuf>,
    /// Picture to write
    #[arg(required = true, value_name = "OUT.png")]
    output: PathBuf,
    /// Meaning of the colours
    #[arg(long, value_enum, default_value_t = Colouring::Plain, help_heading = COLOURS)]
    color: Colouring,
    /// With --color distance: the mesh to which distances are measured
    #[arg(long, value_name = "REFERENCE", required_if_eq("color", "distance"), help_heading = COLOURS)]
    against: Option<PathBuf>,
    /// Draw cells, as remesh --cells writes them: in their colours, with nothing but outlines
    #[arg(long, conflicts_with_all = ["color", "curves"], help_heading = COLOURS)]
    cells: bool,
    /// Draw sharp edges and boundaries as lines
    #[arg(long, help_heading = COLOURS)]
    curves: bool,
    /// Do not draw the triangles' edges
    #[arg(long, help_heading = COLOURS)]
    no_edges: bool,
    /// Width and height of each mesh's panel in pixels
    #[arg(long, value_name = "WxH", default_value = "720x540", value_parser = size, help_heading = CAMERA)]
    size: [u32; 2],
    /// Rotation around the up axis in degrees
    #[arg(long, value_name = "DEGREES", default_value_t = View::default().azimuth,
        allow_negative_numbers = true, help_heading = CAMERA)]
    azimuth: f64,
    /// Angle of the camera above the horizon in degrees
    #[arg(long, value_name = "DEGREES", default_value_t = View::default().elevation,
        allow_negative_numbers = true, help_heading = CAMERA)]
    elevation: f64,
    /// Magnification; below 1 the meshes are smaller
    #[arg(long, value_name = "TIMES", default_value_t = 1.0, help_heading = CAMERA)]
    zoom: f64,
    /// The z axis points up, not y
    #[arg(long, help_heading = CAMERA)]
    z_up: bool,
    #[command(flatten)]
    input_format: InputFormat,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Colouring {
    /// None: outsides are blue, insides brown; points have their own
    Plain,
    /// Triangle quality: light for equilateral, dark for slivers
    Quality,
    /// Distance from --against: pale where it is small, dark red where it is largest
    Distance,
}

/// Reads, draws, writes.
pub fn run(args: &Args) -> Result<()> {
    let options = options(args)?;
    refuse_overwriting(args)?;
    io::check_text_target(&args.output)?;
    let drawn = args.meshes.iter().map(|path| load(args, path)).collect::<rtfmesh::Result<Vec<Drawn>>>()?;
    let reference =
        args.against.as_ref().map(|path| Ok::<_, Error>((path, args.input_format.load_other(path)?.mesh)));
    let reference = reference.transpose()?;
    let colours: Vec<Vec<Colour>> = match (args.color, &reference) {
        (Colouring::Quality, _) => drawn.iter().map(|drawn| quality_colours(&drawn.mesh)).collect(),
        (Colouring::Distance, Some((against, reference))) => {
            let meshes: Vec<TriMesh> = drawn.iter().map(|drawn| drawn.mesh.clone()).collect();
            let found = distance_colours(&meshes, reference).map_err(|e| e.in_file(input_name(against)))?;
            for (path, found) in args.meshes.iter().zip(&found) {
                tell(&format!("{}: largest distance {:.6}\n", shown(input_name(path)), found.largest));
            }
            found.into_iter().map(|found| found.colours).collect()
        }
        (Colouring::Plain | Colouring::Distance, _) => {
            drawn.iter().map(|drawn| drawn.colours.clone()).collect()
        }
    };
    let mut lines = Vec::new();
    for (path, drawn) in args.meshes.iter().zip(&drawn) {
        lines.push(if args.curves {
            curves(&drawn.mesh).map_err(|e| e.in_file(input_name(path)))?
        } else {
            Vec::new()
        });
    }
    let panels = drawn.iter().zip(&colours).zip(&lines);
    let panels = panels.map(|((drawn, colours), lines)| panel(drawn, colours, lines));
    let panels: Vec<Panel> = panels.map(|panel| Panel { outlines: args.cells, ..panel }).collect();
    let name = args.meshes.first().map_or(Path::new(""), |path| input_name(path));
    let picture = png(&panels, &options).map_err(|e| e.in_file(name))?;
    Ok(io::write_bytes(&args.output, &picture)?)
}

fn load(args: &Args, path: &Path) -> rtfmesh::Result<Drawn> {
    let in_file = |error: Error| error.in_file(input_name(path));
    let loaded = args.input_format.load_any(path, false)?.mesh_or_points().map_err(in_file)?;
    tell_notes(path, &loaded.notes);
    let given = [("--color quality", args.color == Colouring::Quality), ("--curves", args.curves)];
    let given = given.iter().find(|(_, given)| *given && loaded.mesh.triangles.is_empty());
    if let Some((name, _)) = given {
        let input = shown(input_name(path));
        let problem = format!("{name} works only with meshes, and {input} has points without faces");
        return Err(Error::usage(problem, "remove it"));
    }
    let own = if args.cells { face_colours(&loaded) } else { Vec::new() };
    let drawn = Drawn::new(loaded).map_err(in_file)?;
    Ok(if own.is_empty() { drawn } else { Drawn { colours: own, ..drawn } })
}

/// The colours of the triangles, or of their first corners.
fn face_colours(loaded: &Loaded) -> Vec<Colour> {
    let Loaded { mesh, attributes, .. } = loaded;
    let of_faces = attributes.face.iter().find(|attribute| attribute.role == Role::Colour);
    let byte = |share: f64| (255.0 * share.clamp(0.0, 1.0)).round() as u8;
    let of_one = |(t, triangle): (usize, &[u32; 3])| {
        let of_corner = || Some(attributes.vertex_role(Role::Colour)?.unit_colour(triangle[0] as usize));
        let [red, green, blue, _] = of_faces.map(|colour| colour.unit_colour(t)).or_else(of_corner)?;
        Some([red, green, blue].map(byte))
    };
    mesh.triangles.iter().enumerate().map(of_one).collect::<Option<_>>().unwrap_or_default()
}

fn panel<'a>(drawn: &'a Drawn, colours: &'a [Colour], lines: &'a [[DVec3; 2]]) -> Panel<'a> {
    let discs =
        drawn.diameter.map(|diameter| Discs { diameter, normals: &drawn.normals, oriented: drawn.oriented });
    Panel { mesh: &drawn.mesh, colours, lines, discs, outlines: false }
}

fn options(args: &Args) -> rtfmesh::Result<PictureOptions> {
    let Args { azimuth, elevation, zoom, z_up, .. } = *args;
    if args.against.is_some() && args.color != Colouring::Distance {
        return Err(Error::usage("--against needs --color distance", "remove one, or add the other"));
    }
    let view = View { azimuth, elevation, zoom, z_up };
    let options = PictureOptions { size: args.size, view, edges: !args.no_edges };
    options.validate()?;
    Ok(options)
}

/// Checks the extension of a picture, which is the last argument.
pub(super) fn refuse_other_than_png(picture: &Path) -> rtfmesh::Result<()> {
    if picture.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
        return Ok(());
    }
    let problem = format!("{} does not end in .png", shown(picture));
    Err(Error::usage(problem, "give the picture as the last argument, such as out.png"))
}

fn refuse_overwriting(args: &Args) -> rtfmesh::Result<()> {
    // Whoever forgets the picture names a mesh last.
    refuse_other_than_png(&args.output)?;
    let read = args.meshes.iter().chain(&args.against);
    if read.clone().any(|path| same_file(path, &args.output)) {
        let problem = format!("the picture would overwrite the mesh in {}", shown(&args.output));
        return Err(Error::usage(problem, "give the picture as the last argument, with a name of its own"));
    }
    if read.filter(|path| is_standard(path)).count() > 1 {
        return Err(Error::usage("standard input can provide only one mesh", "read the others from files"));
    }
    Ok(())
}

/// The sharp and open edges, as lines.
pub(super) fn curves(mesh: &TriMesh) -> rtfmesh::Result<Vec<[DVec3; 2]>> {
    let found = find_features(mesh, &FeatureOptions::new(spacing_of(mesh, mesh.vertices.len())?))?;
    let ends = found.curves.iter().flat_map(Curve::edge_ends);
    Ok(ends.map(|pair| pair.map(|v| mesh.vertices[v as usize])).collect())
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let sides =
        text.split_once('x').and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    sides.ok_or_else(|| "give width and height in pixels, as in 720x540".to_owned())
}
