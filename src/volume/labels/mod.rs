//! The borders between the labels of a volume, such as a segmentation.

mod band;
mod contract;
mod extract;
mod fair;
mod fields;
mod junctions;
mod sharp;
mod simplex;
mod specks;

use std::borrow::Cow;

use rayon::prelude::*;

use super::coarse::surface_or_coarse;
use crate::grammar::counted;
use crate::io::Volume;
use crate::mesh::attributes::{Attribute, Attributes, Kind, Role};
use crate::progress::ProgressReporter;
use crate::{Error, Flow, Phase, Progress, ProgressToken, Result, TriMesh};
use contract::contract;
use extract::{Borders, extract};
use fields::Fields;
use junctions::smooth;
use specks::without_specks;

/// Name of the triangle attribute with the label behind; [`LABEL_BEFORE`] has the label in front.
pub const LABEL_BEHIND: &str = "label_behind";
/// See [`LABEL_BEHIND`].
pub const LABEL_BEFORE: &str = "label_before";

/// Settings of the borders between labels.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct LabelOptions {
    /// Whether the borders are closed at the volume's border; otherwise they are open there.
    pub closed: bool,
    /// Whether to keep specks: parts of a label so small, compared with its largest part, that they are
    /// noise. Otherwise they take the label around them.
    pub keep_specks: bool,
}

impl LabelOptions {
    /// Sets [`LabelOptions::closed`].
    #[must_use]
    pub fn closed(self, closed: bool) -> Self {
        Self { closed, ..self }
    }

    /// Sets [`LabelOptions::keep_specks`].
    #[must_use]
    pub fn keep_specks(self, keep_specks: bool) -> Self {
        Self { keep_specks, ..self }
    }
}

/// The borders between labels.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct LabelSurface {
    /// All borders as one mesh in the volume's space, which has more than two faces at edges where more than
    /// two labels meet. The border of each label is a manifold. Faces look from the greater of their labels
    /// to the smaller.
    pub mesh: TriMesh,
    /// [`LABEL_BEHIND`] and [`LABEL_BEFORE`] of each triangle.
    pub attributes: Attributes,
    /// Half-edges `3 * triangle + k` of the mesh on sharp edges, those of boxes and where closed borders meet
    /// the volume's border, for
    /// [`crate::options::CoarseToFineOptions::fixed_half_edges`].
    pub rim: Vec<u32>,
    /// Number of different labels, without 0.
    pub labels: usize,
    /// Number of parts of labels left out as specks.
    pub specks: usize,
    /// The borders are those of every `step`-th node along each axis: 1, or more to finish early.
    pub step: usize,
}

/// The borders between the labels of a volume, which are whole numbers; 0 is outside.
///
/// # Errors
/// [`Error::Input`] for values that are not whole numbers from 0 to [`MOST_LABEL`], or only one label.
pub fn label_surface(volume: &Volume, options: &LabelOptions) -> Result<LabelSurface> {
    label_surface_with_progress(volume, options, |_| {})
}

/// Like [`label_surface`], calling `progress` several times a second, as [`crate::remesh_with_progress`]
/// does.
///
/// # Errors
/// As [`label_surface`], and [`Error::Cancelled`] if `progress` asks for it.
pub fn label_surface_with_progress<F: Into<Flow>>(
    volume: &Volume,
    options: &LabelOptions,
    mut progress: impl FnMut(Progress) -> F,
) -> Result<LabelSurface> {
    check(volume)?;
    let mut callback = |now| progress(now).into();
    let mut reporter = ProgressReporter::new(&mut callback);
    reporter.phase(Phase::Surface, 1.0, 1.0)?;
    surface_or_coarse(&mut reporter, volume, FEW, |volume, step, token| {
        run(volume, options, token).map(|found| LabelSurface { step, ..found })
    })
}

/// Approximate number of values that are used to finish early.
const FEW: f64 = 3e5;
/// Rounds of contraction at most.
const ROUNDS: usize = 3;

/// The maximum label. Larger ones may have been rounded to 32-bit floating-point numbers.
pub const MOST_LABEL: f32 = 16_777_215.0;

fn check(volume: &Volume) -> Result<()> {
    if u32::try_from(volume.values.len()).is_err() {
        let problem = format!("the volume has {} values, more than an index can count", volume.values.len());
        return Err(Error::input(None, problem, "cut it into parts"));
    }
    let is_label = |value: &f32| value.fract() == 0.0 && (0.0..=MOST_LABEL).contains(value);
    let Some(value) = volume.values.iter().find(|value| !is_label(value)) else { return Ok(()) };
    let remedy = "use whole numbers from 0 to 16777215, or make an isosurface";
    Err(Error::input(None, format!("{value} is not a valid label"), remedy))
}

fn run(volume: &Volume, options: &LabelOptions, progress: &ProgressToken) -> Result<LabelSurface> {
    let (volume, specks) = match options.keep_specks {
        true => (Cow::Borrowed(volume), 0),
        false => without_specks(volume, progress)?,
    };
    let volume = volume.as_ref();
    let fields = Fields::new(volume, progress)?;
    let mut borders = extract(volume, &fields, options.closed, progress)?;
    if borders.triangles.is_empty() {
        let all = volume.values.first().copied().unwrap_or_default();
        let (but, remedy) = match specks {
            0 => (String::new(), "give a volume with two labels, or close the surface at the border"),
            _ => {
                let specks = counted(specks, ["speck", "specks"]);
                (format!(" but for {specks}"), "keep specks with `keep_specks`")
            }
        };
        return Err(Error::input(None, format!("all values of the volume are {all}{but}"), remedy));
    }
    // Smooth curves are shorter.
    for _ in 0..ROUNDS {
        progress.poll()?;
        let is_changed = contract(&mut borders);
        smooth(&mut borders, volume.size);
        if !is_changed {
            break;
        }
    }
    contract(&mut borders);
    progress.done(0.95)?;
    let sharp = sharp::half_edges(&borders);
    let Borders { vertices, triangles, sides, .. } = borders;
    let mut mesh = TriMesh { vertices, triangles };
    let mut rim = if options.closed { super::border::rim(&mesh, volume.size) } else { Vec::new() };
    rim.extend(sharp);
    mesh.vertices.par_iter_mut().for_each(|vertex| *vertex = volume.frame.transform_point3(*vertex));
    if volume.frame.matrix3.determinant() < 0.0 {
        super::border::turn(&mut mesh, &mut rim);
    }
    let of = |name: &str, side: usize| {
        let values = sides.iter().map(|labels| f64::from(labels[side])).collect();
        Attribute::new(name, Role::Label, Kind::U32, 1, values)
    };
    let face = vec![of(LABEL_BEHIND, 0), of(LABEL_BEFORE, 1)];
    let attributes = Attributes { face, ..Attributes::default() };
    let labels = fields.labels().filter(|label| *label > 0).count();
    Ok(LabelSurface { mesh, attributes, rim, labels, specks, step: 1 })
}
