//! Time against the number of patches, components and boundaries, at one size.

use crate::markdown::{Table, number};
use crate::runs::{Bench, median};
use crate::section::Section;
use anyhow::{Context as _, Result};
use glam::DVec3;
use rtfmesh::{Device, MeasureDepth, Options, Remesher, TriMesh};
use std::time::Instant;

/// Input vertices, about, of each surface, and vertices asked for.
const SIZES: [usize; 2] = [100_000, 20_000];
/// Square roots of the numbers of parts.
const SIDES: [usize; 4] = [1, 3, 10, 32];

/// Makes a surface from the square root of its number of parts and about the number of its vertices.
type Make = fn(usize, usize) -> TriMesh;

/// Surfaces of one size in ever more parts, with the default options and nothing measured but what warnings
/// need.
///
/// # Errors
/// Those of the device.
pub fn section(bench: &Bench) -> Result<Section> {
    let [given, asked] = SIZES.map(|size| bench.scaled(size));
    let kinds: [(&str, Make); 3] =
        [("flat patches", patches), ("components", components), ("boundaries", boundaries)];
    let mut table = Table::new(["parts", "number", "#V given", "s", "time over that of one"]);
    for (kind, make) in kinds {
        let mut of_one = None;
        for side in SIDES {
            let mesh = make(side, given);
            println!("{} {kind}, {asked} vertices", side * side);
            let mut walls = Vec::new();
            for _ in 0..bench.runs {
                walls.push(wall(&bench.device, asked, &mesh)?);
            }
            let seconds = median(&mut walls).context("no run")?;
            let ratio = seconds / *of_one.get_or_insert(seconds);
            let vertices = mesh.vertices.len();
            let cells = [kind.to_owned(), (side * side).to_string(), vertices.to_string()];
            let times = [number(Some(seconds), 2), number(Some(ratio), 2)];
            table.push(cells.into_iter().chain(times).collect());
        }
    }
    let text = vec![
        format!("{asked} vertices asked for; wall time of a call, median of {} runs.", bench.runs),
        "Patches: planes that meet in valleys and ridges. Components: balls.".to_owned(),
        "Boundaries: square holes of a wavy sheet.".to_owned(),
    ];
    let title = "Time against the number of parts".to_owned();
    Ok(Section { name: "parts", title, text, table, rows: Vec::new(), charts: Vec::new() })
}

fn wall(device: &Device, vertices: usize, mesh: &TriMesh) -> Result<f64> {
    let options = Options::new(vertices).measures(MeasureDepth::Basic);
    let remesher = Remesher::new(device, options)?;
    let begin = Instant::now();
    remesher.remesh(mesh)?;
    Ok(begin.elapsed().as_secs_f64())
}

/// A sheet folded along `side - 1` lines in either direction, so that every tile is plane.
fn patches(side: usize, vertices: usize) -> TriMesh {
    let cells = side * cells_per_part(side, vertices);
    let fold = |t: f64| {
        let along = t * side as f64;
        (0.5 * along - (0.5 * along).round()).abs() / side as f64
    };
    sheet(cells, |x, y| DVec3::new(x, y, fold(x) + fold(y)), |_, _| true)
}

/// Balls of cubes whose faces are grids, in a square.
fn components(side: usize, vertices: usize) -> TriMesh {
    let grid = (vertices as f64 / (6 * side * side) as f64).sqrt().round().max(2.0) as usize;
    let ball = ball(grid);
    let mut mesh = TriMesh::default();
    for k in 0..side * side {
        let first = mesh.vertices.len() as u32;
        let centre = 3.0 * DVec3::new((k % side) as f64, (k / side) as f64, 0.0);
        mesh.vertices.extend(ball.vertices.iter().map(|v| *v + centre));
        mesh.triangles.extend(ball.triangles.iter().map(|face| face.map(|v| first + v)));
    }
    mesh
}

/// A wavy sheet with a square hole in each tile, a ninth of its area.
fn boundaries(side: usize, vertices: usize) -> TriMesh {
    let tile = 3 * (cells_per_part(side, vertices) / 3).max(1);
    let in_middle = |k: usize| (tile / 3..2 * tile / 3).contains(&(k % tile));
    let wave = |x: f64, y: f64| DVec3::new(x, y, 0.05 * (9.0 * x).sin() * (7.0 * y).cos());
    sheet(side * tile, wave, |i, j| !(in_middle(i) && in_middle(j)))
}

fn cells_per_part(side: usize, vertices: usize) -> usize {
    ((vertices as f64).sqrt() / side as f64).round().max(2.0) as usize
}

/// A grid over the unit square, without the cells that are not to be there.
fn sheet(cells: usize, at: impl Fn(f64, f64) -> DVec3, there: impl Fn(usize, usize) -> bool) -> TriMesh {
    let row = cells + 1;
    let point = |k: usize| at((k % row) as f64 / cells as f64, (k / row) as f64 / cells as f64);
    let mut mesh = TriMesh { vertices: (0..row * row).map(point).collect(), ..TriMesh::default() };
    for k in (0..cells * cells).filter(|k| there(k % cells, k / cells)) {
        mesh.triangles.extend(halves((k / cells * row + k % cells) as u32, row as u32));
    }
    mesh
}

/// The unit ball, from a cube with `grid` by `grid` squares on each face.
fn ball(grid: usize) -> TriMesh {
    let mut mesh = TriMesh::default();
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    for (k, sign) in (0..3).flat_map(|k| [(k, 1.0), (k, -1.0)]) {
        let first = mesh.vertices.len() as u32;
        let row = grid as u32 + 1;
        // Exactly -1 and 1 at the ends, so that neighbouring faces have the same vertices.
        let along = |i: u32| 2.0 * f64::from(i) / grid as f64 - 1.0;
        let [right, up] = if sign > 0.0 { [1, 2] } else { [2, 1] }.map(|turn| axes[(k + turn) % 3]);
        let place = |i: u32| (axes[k] * sign + right * along(i % row) + up * along(i / row)).normalize();
        mesh.vertices.extend((0..row * row).map(place));
        let squares = (0..row * row).filter(|i| i % row + 1 < row && i / row + 1 < row);
        mesh.triangles.extend(squares.flat_map(|i| halves(first + i, row)));
    }
    mesh
}

/// The two triangles of a square of a grid.
fn halves(corner: u32, row: u32) -> [[u32; 3]; 2] {
    [[corner, corner + 1, corner + row + 1], [corner, corner + row + 1, corner + row]]
}
