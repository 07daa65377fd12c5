//! Exact restricted Voronoi cells, of the presets `rvd` and `cvd`.

use crate::check::ROUNDING;
use crate::context::{Context, Group, Work};
use crate::iteration::LIST;
use crate::reference::exact::cell;
use crate::results::Row;
use anyhow::{Result, ensure};
use glam::DVec3;
use rtfmesh::gpu::Recorder;
use rtfmesh::stages::exact::{Aim, CutTriangles, ExactCells, ExactCounts};

/// The search for parts of cells, the parts, and where the sites go. Sorting and scans are measured by
/// themselves.
pub const GROUPS: [Group; 1] = [Group {
    kernels: &[
        "exact.listed",
        "exact.enough",
        "exact.walked",
        "exact.pairs",
        "exact.pieces",
        "exact.sums",
        "exact.aim",
    ],
    most_sites: usize::MAX,
    run: cells,
}];

/// Longest move, in spacings.
const LONGEST: f64 = 0.25;
/// Neighbours that may cut a cell, and the distance from a site in spacings within which its cell lies.
const NEAR: usize = 32;
const REACH: f64 = 1.5;
/// Candidates of a triangle: the sites of its parts, the nearest one and their number.
const SLOTS: usize = 14;

fn cells(context: &Context) -> Result<Vec<Row>> {
    let (n, device) = (context.len(), context.device);
    let triangles = CutTriangles::new(device, &context.model.surface, context.spacing)?;
    let mut cells = ExactCells::new(device, &triangles, &context.points, LIST, None, None)?;
    let aim = Aim::new(device, n, None)?;
    let counts = round(context, &triangles, &mut cells, &aim)?;
    check(context, &cells, &aim)?;
    let (t, pairs) = (triangles.len(), counts.pairs);
    let works = [
        Work {
            note: format!("{t} triangles, {pairs} parts"),
            ..Work::new("exact.listed", t * (48 + 4 + 8 + 4) + n * (16 + 4 * LIST as usize + 8) + 4 * pairs)
        },
        Work::new("exact.enough", 8 + 16),
        Work {
            note: format!("{} triangles that lists do not decide", counts.undecided),
            ..Work::new("exact.walked", counts.undecided * (48 + 4 * SLOTS))
        },
        Work::new("exact.pairs", 4 * t + 4 * pairs + 12 * pairs),
        Work::new("exact.pieces", 48 * t + 16 * n + (4 + 4 + 16 + 4) * pairs),
        Work::new("exact.sums", (4 + 4 + 16 + 4) * pairs + (16 + 4) * n),
        Work::new("exact.aim", n * (16 + 16 + 16 + 2 * 16)),
    ];
    context.time_runs(&works, &mut |_| round(context, &triangles, &mut cells, &aim).map(|_| ()))
}

/// In two submissions, as in a run: the host learns in between how many parts there are.
fn round(
    context: &Context,
    triangles: &CutTriangles,
    cells: &mut ExactCells,
    aim: &Aim,
) -> Result<ExactCounts> {
    let (device, it) = (context.device, &context.iteration);
    let mut recorder = Recorder::new(device)?;
    let parts = cells.record_parts(&mut recorder, triangles, &it.sites, &it.lists)?;
    let found = recorder.submit()?;
    let mut recorder = Recorder::new(device)?;
    let counts = cells.record_cells(device, &mut recorder, triangles, &it.sites, (&found, &parts))?;
    aim.record(&mut recorder, &it.sites, cells, 0.0, (LONGEST * context.spacing) as f32)?;
    recorder.submit()?;
    Ok(counts)
}

/// Checks the areas and centroids of samples against the reference, and that all cells cover the surface.
fn check(context: &Context, cells: &ExactCells, aim: &Aim) -> Result<()> {
    let (found, energies) = (cells.cells.to_vec(context.device)?, cells.energies.to_vec(context.device)?);
    let targets = aim.targets.to_vec(context.device)?;
    let whole: f64 = found.iter().map(|cell| f64::from(cell.w)).sum();
    let area = context.model.surface.area();
    ensure!((whole / area - 1.0).abs() < 1e-4, "all cells have an area of {whole} instead of {area}");
    let reach = REACH * context.density * context.spacing;
    for (&i, near) in context.samples.iter().zip(&context.near) {
        let at = context.points[i];
        let is_near = |corners: &&[DVec3; 3]| {
            crate::reference::closest::onto_triangle(at, **corners).distance(at) < reach
        };
        let around: Vec<[DVec3; 3]> = context.model.corners.iter().filter(is_near).copied().collect();
        let sites: Vec<DVec3> =
            std::iter::once(at).chain(near.iter().take(NEAR).map(|j| context.points[*j as usize])).collect();
        let want = cell(&around, &sites, 0);
        let size = want.area.sqrt();
        let off = (f64::from(found[i].w) - want.area).abs();
        ensure!(off < 1e-3 * want.area, "site {i}: the area is {off} off {}", want.area);
        let off = found[i].truncate().as_dvec3().distance(want.first);
        ensure!(off < 1e-3 * want.area * size, "site {i}: the first moment is {off} off");
        let off = (f64::from(energies[i]) - want.energy).abs();
        ensure!(off < 1e-3 * want.energy, "site {i}: the energy is {off} off {}", want.energy);
        let to = at + (want.first / want.area).clamp_length_max(LONGEST * context.spacing);
        let off = targets[i].truncate().as_dvec3().distance(to);
        ensure!(off < ROUNDING + 1e-3 * context.spacing, "site {i}: the target is {off} off");
    }
    Ok(())
}
