//! The surface where a volume has one value.

use rayon::prelude::*;

use super::border::{rim, turn};
use super::coarse::surface_or_coarse;
use super::noise::{Extracted, Extraction};
use crate::io::Volume;
use crate::mesh::handles::{most_handles, remove_small_handles};
use crate::progress::ProgressReporter;
use crate::{Error, Flow, Phase, Progress, ProgressToken, Result, TriMesh};

/// The side of the isosurface that is inside the object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Inside {
    /// The side with less of the volume's border.
    #[default]
    Automatic,
    /// Values above the isovalue, as in densities and probabilities.
    Above,
    /// Values below the isovalue, as in signed distances.
    Below,
}

/// Settings of an isosurface.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct IsoOptions {
    /// The isovalue.
    pub iso: f64,
    /// The side that is inside.
    pub inside: Inside,
    /// Whether the surface is closed at the volume's border; otherwise it is open there.
    pub closed: bool,
    /// Whether to keep noise: components so small, compared with the largest, that they are specks; handles;
    /// and values that are otherwise smoothed where noise makes too many handles.
    pub keep_specks: bool,
    /// Whether the values are smoothed where noise makes too many handles, unless specks are kept.
    pub smooth_noise: bool,
}

impl IsoOptions {
    /// The isosurface at this value, open at the volume's border.
    pub fn new(iso: f64) -> Self {
        Self { iso, inside: Inside::Automatic, closed: false, keep_specks: false, smooth_noise: true }
    }

    /// Sets [`IsoOptions::inside`].
    #[must_use]
    pub fn inside(self, inside: Inside) -> Self {
        Self { inside, ..self }
    }

    /// Sets [`IsoOptions::closed`].
    #[must_use]
    pub fn closed(self, closed: bool) -> Self {
        Self { closed, ..self }
    }

    /// Sets [`IsoOptions::keep_specks`].
    #[must_use]
    pub fn keep_specks(self, keep_specks: bool) -> Self {
        Self { keep_specks, ..self }
    }

    /// Sets [`IsoOptions::smooth_noise`].
    #[must_use]
    pub fn smooth_noise(self, smooth_noise: bool) -> Self {
        Self { smooth_noise, ..self }
    }
}

/// An isosurface of a volume.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct IsoSurface {
    /// The surface in the volume's space, outward: manifold, with uneven triangles about as wide as cells,
    /// for [`crate::remesh`].
    pub mesh: TriMesh,
    /// The side that was used.
    pub inside: Inside,
    /// Half-edges `3 * triangle + k` of the mesh where a closed surface meets the volume's border, for
    /// [`crate::options::CoarseToFineOptions::fixed_half_edges`].
    pub rim: Vec<u32>,
    /// Number of components left out as specks.
    pub specks: usize,
    /// Number of handles removed because they are as small as specks.
    pub handles: usize,
    /// How often the values were smoothed, each time over one node in standard deviation, because noise gave
    /// the surface too many handles to remove them one by one; at most three times.
    pub smoothings: usize,
    /// The surface is that of every `step`-th node along each axis: 1, or more to finish early.
    pub step: usize,
}

/// Handles within half of this distance, in voxels, of a point of the surface are removed.
const HANDLE: f64 = 3.0;

/// Approximate number of values that are used to finish early.
const FEW: f64 = 2e6;

/// The isosurface of a volume's trilinear field, by marching cubes; of smoothed values where noise makes too
/// many handles, unless the options keep it.
///
/// # Errors
/// [`Error::Input`] if there is none; [`Error::Usage`] for a value that is not finite.
pub fn iso_surface(volume: &Volume, options: &IsoOptions) -> Result<IsoSurface> {
    iso_surface_with_progress(volume, options, |_| {})
}

/// Like [`iso_surface`], calling `progress` several times a second, as [`crate::remesh_with_progress`] does.
///
/// # Errors
/// As [`iso_surface`], and [`Error::Cancelled`] if `progress` asks for it.
pub fn iso_surface_with_progress<F: Into<Flow>>(
    volume: &Volume,
    options: &IsoOptions,
    mut progress: impl FnMut(Progress) -> F,
) -> Result<IsoSurface> {
    if !options.iso.is_finite() {
        let problem = format!("`iso` {} is not finite", options.iso);
        return Err(Error::option("iso", problem, "give a number"));
    }
    let mut callback = |now| progress(now).into();
    let mut reporter = ProgressReporter::new(&mut callback);
    reporter.phase(Phase::Surface, 1.0, 1.0)?;
    surface_or_coarse(&mut reporter, volume, FEW, |volume, step, token| {
        run(volume, options, token).map(|found| IsoSurface { step, ..found })
    })
}

fn run(volume: &Volume, options: &IsoOptions, progress: &ProgressToken) -> Result<IsoSurface> {
    let iso = options.iso as f32;
    let inside = match options.inside {
        Inside::Automatic => rarer_at_border(volume, iso),
        side => side,
    };
    let (closed, keeps_specks) = (options.closed, options.keep_specks);
    let smooths = options.smooth_noise && !keeps_specks;
    let extraction = Extraction { iso, inside, closed, keeps_specks, smooths };
    let Extracted { mut mesh, specks, smoothings } = extraction.without_noise(volume, progress)?;
    if mesh.triangles.is_empty() {
        return Err(no_surface(volume, options.iso));
    }
    progress.done(0.9)?;
    let handles = match options.keep_specks {
        true => 0,
        false => {
            let most = most_handles(&mesh);
            remove_small_handles(&mut mesh, HANDLE, most, progress)?
        }
    };
    let mut rim = if options.closed { rim(&mesh, volume.size) } else { Vec::new() };
    mesh.vertices.par_iter_mut().for_each(|vertex| *vertex = volume.frame.transform_point3(*vertex));
    if volume.frame.matrix3.determinant() < 0.0 {
        turn(&mut mesh, &mut rim);
    }
    Ok(IsoSurface { mesh, inside, rim, specks, handles, smoothings, step: 1 })
}

/// The side that fewer nodes at the volume's border are on.
fn rarer_at_border(volume: &Volume, iso: f32) -> Inside {
    let [nx, ny, nz] = volume.size;
    let count_row = |row: usize| {
        let (y, z) = (row % ny, row / ny);
        let is_border = y == 0 || z == 0 || y + 1 == ny || z + 1 == nz;
        let step = if is_border { 1 } else { nx - 1 };
        let values = (0..nx).step_by(step).map(|x| volume.at([x, y, z]));
        values.fold([0_usize; 2], |[above, below], value| {
            [above + usize::from(value > iso), below + usize::from(value < iso)]
        })
    };
    let [above, below] =
        (0..ny * nz).into_par_iter().map(count_row).reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    if above <= below { Inside::Above } else { Inside::Below }
}

/// The error for a value at which there is no surface.
pub(super) fn no_surface(volume: &Volume, iso: f64) -> Error {
    let range = match volume.range() {
        Some([low, high]) => format!("all values go from {low} to {high}"),
        None => "no value is finite".to_owned(),
    };
    let problem = format!("the volume has no surface at {iso}: {range}");
    Error::input(None, problem, "choose a value between those of neighbouring nodes")
}
