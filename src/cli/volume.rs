//! Values on a grid in place of a mesh: the surface in them.

use super::files::input_name;
use super::heading::INPUT;
use super::job::SurfaceSource;
use crate::error::shown;
use crate::grammar::counted;
use crate::volume::{ISO, JoinedSurfaces, check_values, join, settle_values};
use clap::ValueEnum;
use rtfmesh::glam::{DMat3, DVec3};
use rtfmesh::io::{Loaded, Volume};
use rtfmesh::mesh::attributes::Attributes;
use rtfmesh::volume::{
    Inside, IsoOptions, IsoSurface, LabelOptions, iso_surface_with_progress, label_surface_with_progress,
};
use rtfmesh::{Error, Flow, Progress, Result, TriMesh, WarningCode};
use serde::Serialize;
use std::borrow::Cow;
use std::collections::HashSet;
use std::path::Path;

/// Which surface is made of a volume.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = INPUT)]
pub struct VolumeArgs {
    /// Volumes: value of the isosurface, or several such as 100,300
    ///
    /// Volumes are .npy, .nrrd, .nii, .mha and .vti files. With several values, the triangle attribute `iso`
    /// holds the value of each triangle's surface.
    #[arg(
        long,
        value_name = "VALUE",
        value_delimiter = ',',
        allow_hyphen_values = true,
        hide_short_help = true
    )]
    iso: Vec<f64>,
    /// Volumes of labels, such as a segmentation: the borders between labels
    ///
    /// Label 0 is outside. Each triangle has the labels on its two sides, `label_behind` and `label_before`.
    #[arg(long, conflicts_with = "iso", hide_short_help = true)]
    labels: bool,
    /// With --iso: the side of the object [default: the one with less of the volume's border]
    ///
    /// With several values, the default for the first applies to all.
    #[arg(long, value_name = "SIDE", requires = "iso", hide_short_help = true)]
    inside: Option<Side>,
    /// Volumes: spacing of the grid along the axes, such as 0.5,0.5,2 [default: the file's]
    #[arg(long, value_name = "X,Y,Z", value_parser = spacing, hide_short_help = true)]
    spacing: Option<DVec3>,
    /// Volumes: keep specks and tiny handles, which are usually noise
    ///
    /// By default parts and cavities are left out if they are smaller than 8 voxels or than a thousandth
    /// of the largest part, and handles if they lie within three voxels. Where noise makes too many
    /// handles for that, the values are smoothed first, unless there are several isovalues; the handles
    /// of a lattice stay. Specks of labels are smaller than 64 voxels and take the label around them.
    #[arg(long, hide_short_help = true)]
    keep_specks: bool,
}

/// A surface in a volume.
pub struct VolumeSurface {
    pub loaded: Loaded,
    /// Its half-edges on the volume's border.
    pub rim: Vec<u32>,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Side {
    /// Values above the isovalue are inside, as in densities
    Above,
    /// Values below the isovalue are inside, as in signed distances
    Below,
}

fn spacing(text: &str) -> std::result::Result<DVec3, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let numbers = numbers.and_then(|numbers| <[f64; 3]>::try_from(numbers).ok());
    let is_length = |number: &f64| number.is_finite() && *number > 0.0;
    match numbers.filter(|numbers| numbers.iter().all(is_length)) {
        Some(numbers) => Ok(DVec3::from_array(numbers)),
        None => Err("give three lengths above 0, such as 0.5,0.5,2".to_owned()),
    }
}

impl VolumeArgs {
    /// The surfaces at values `iso` around one side, `above` or `below`; without any, the borders between
    /// labels.
    ///
    /// # Errors
    /// [`Error::Usage`] for another side.
    pub fn from_words(iso: Vec<f64>, inside: Option<&str>, keep_specks: bool) -> Result<Self> {
        let side = |word: &str| {
            Side::from_str(word, false).map_err(|_| {
                Error::usage(format!("--inside: expected `above` or `below`, got {word}"), "use one of them")
            })
        };
        let inside = inside.map(side).transpose()?;
        Ok(Self { labels: iso.is_empty(), iso, inside, spacing: None, keep_specks })
    }

    /// The volume that was read, with the spacing asked for.
    ///
    /// # Errors
    /// [`Error::Usage`] if no surface is chosen.
    pub fn source(&self, mut volume: Volume, input: &Path, closed: bool) -> Result<SurfaceSource<'_>> {
        if let Some(spacing) = self.spacing {
            let axes = volume.frame.matrix3;
            let along = |axis: DVec3, length: f64| length * axis.normalize();
            volume.frame.matrix3 = DMat3::from_cols(
                along(axes.x_axis, spacing.x),
                along(axes.y_axis, spacing.y),
                along(axes.z_axis, spacing.z),
            );
        }
        if self.iso.is_empty() && !self.labels {
            return Err(no_choice(&volume, input));
        }
        Ok(SurfaceSource::Volume { volume: Cow::Owned(volume), args: self, closed })
    }

    /// The surface of a volume, with what became of that as notes.
    ///
    /// # Errors
    /// Those of [`iso_surface_with_progress`] and [`label_surface_with_progress`].
    pub fn surface(
        &self,
        volume: &Volume,
        closed: bool,
        progress: impl FnMut(Progress) -> Flow,
    ) -> Result<VolumeSurface> {
        if self.labels {
            self.label_surface(volume, closed, progress)
        } else {
            self.isosurfaces(volume, closed, progress)
        }
    }

    /// The isosurfaces of all values; of one alone without its value as an attribute.
    fn isosurfaces(
        &self,
        volume: &Volume,
        closed: bool,
        mut progress: impl FnMut(Progress) -> Flow,
    ) -> Result<VolumeSurface> {
        let count = self.iso.len() as f64;
        check_values(volume, &self.iso, closed)?;
        let mut inside = match self.inside {
            None => Inside::Automatic,
            Some(Side::Above) => Inside::Above,
            Some(Side::Below) => Inside::Below,
        };
        let (mut found, mut notes) = (Vec::new(), Vec::new());
        let mut flow = Flow::Continue;
        for (k, iso) in self.iso.iter().enumerate() {
            let asked = IsoOptions::new(*iso).inside(inside).closed(closed).keep_specks(self.keep_specks);
            // Surfaces of values that are not equally smooth might cross.
            let asked = asked.smooth_noise(self.iso.len() == 1);
            let surface = iso_surface_with_progress(volume, &asked, |mut now| {
                now.fraction = (k as f64 + now.fraction) / count;
                now.to_finish = (now.to_finish + count - 1.0 - k as f64) / count;
                // To finish early counts for the surfaces that follow as well.
                flow = flow.max(progress(now));
                flow
            })?;
            inside = surface.inside;
            notes.extend(iso_notes(volume, *iso, &surface));
            found.push((*iso, surface));
        }
        let mut warnings = coarse_warning(found.iter().map(|(_, surface)| surface.step).max().unwrap_or(1));
        let (mesh, attributes, rim) = if found.len() > 1 {
            let joined = join(found).map_err(|error| match warnings.is_empty() {
                true => error,
                false => too_coarse(error),
            });
            let JoinedSurfaces { mesh, attributes, rim } = joined?;
            (mesh, attributes, rim)
        } else {
            let only = found.pop();
            warnings.extend(only.as_ref().and_then(|(iso, surface)| smoothed_warning(*iso, surface)));
            let (mesh, rim) = only.map(|(_, surface)| (surface.mesh, surface.rim)).unwrap_or_default();
            (mesh, Attributes::default(), rim)
        };
        let loaded = Loaded { mesh, attributes, notes, warnings, unread_images: 0 };
        Ok(VolumeSurface { loaded, rim })
    }

    fn label_surface(
        &self,
        volume: &Volume,
        closed: bool,
        progress: impl FnMut(Progress) -> Flow,
    ) -> Result<VolumeSurface> {
        let asked = LabelOptions::default().closed(closed).keep_specks(self.keep_specks);
        let found = label_surface_with_progress(volume, &asked, progress)?;
        let [x, y, z] = volume.size;
        let mut notes = vec![format!(
            "a volume of {x} x {y} x {z} values with {}: their borders have {}",
            counted(found.labels, ["label", "labels"]),
            counted(found.mesh.triangles.len(), ["triangle", "triangles"])
        )];
        notes.extend(specks_note(found.specks, "smaller than 64 voxels"));
        let (attributes, warnings) = (found.attributes, coarse_warning(found.step));
        let loaded = Loaded { mesh: found.mesh, attributes, notes, warnings, unread_images: 0 };
        Ok(VolumeSurface { loaded, rim: found.rim })
    }

    /// # Errors
    /// [`Error::Usage`] for options of volumes with a mesh or points.
    pub fn refuse_mesh(&self, input: &Path) -> Result<()> {
        let given = [
            ("--iso", !self.iso.is_empty()),
            ("--labels", self.labels),
            ("--spacing", self.spacing.is_some()),
            ("--keep-specks", self.keep_specks),
        ];
        let Some((name, _)) = given.iter().find(|(_, given)| *given) else { return Ok(()) };
        let problem = format!("{name} works only with volumes, and {} is not one", shown(input_name(input)));
        Err(Error::usage(problem, "remove it"))
    }
}

/// The error for a volume without a choice of surface.
fn no_choice(volume: &Volume, input: &Path) -> Error {
    let [x, y, z] = volume.size;
    let values = match volume.range() {
        Some([low, high]) => format!("from {low} to {high}"),
        None => "none of which is finite".to_owned(),
    };
    let problem = format!("{} is a volume of {x} x {y} x {z} values ({values})", shown(input_name(input)));
    Error::usage(problem, "add --iso VALUE for an isosurface, or --labels for the borders between labels")
}

/// What was left out as specks, if there were some.
fn specks_note(specks: usize, which: &str) -> Option<String> {
    let (parts, were, them) = if specks == 1 { ("speck", "was", "it") } else { ("specks", "were", "them") };
    let text = format!("{specks} {parts} {which} {were} left out as noise (--keep-specks keeps {them})");
    (specks > 0).then_some(text)
}

/// The warning that not all nodes were used, if `step` is above 1.
fn coarse_warning(step: usize) -> Vec<(WarningCode, String)> {
    let text = format!(
        "the surface is that of one in {step} values along each axis, to finish early: give more time for all"
    );
    (step > 1).then_some((WarningCode::CutShort, text)).into_iter().collect()
}

/// The warning that the values of an isosurface were smoothed, if they were.
fn smoothed_warning(iso: f64, found: &IsoSurface) -> Option<(WarningCode, String)> {
    let text = format!(
        "noise gave the isosurface at {iso} too many handles to remove them one by one, so the values were \
        smoothed over {:.1} voxels (--keep-specks keeps the noise)",
        (found.smoothings as f64).sqrt() * found.step as f64
    );
    (found.smoothings > 0).then_some((WarningCode::Smoothed, text))
}

/// The error of surfaces that had to be made from few values.
fn too_coarse(error: Error) -> Error {
    let Error::Usage { problem, .. } = error else { return error };
    let problem = format!("{problem}, as far as few of the values show, used to finish early");
    Error::usage(problem, "give more time, or run once for each value")
}

/// Gives the triangles of each part of a result the value of one isosurface, if the surface that it was made
/// from has several.
pub fn settle_isovalues(surface: &Loaded, mesh: &TriMesh, attributes: &mut Attributes) {
    let Some(of_surface) = surface.attributes.face_named(ISO) else { return };
    if let Some(found) = attributes.face.iter_mut().find(|own| own.name == ISO) {
        settle_values(&surface.mesh, &of_surface.values, mesh, &mut found.values);
    }
}

/// What became of the volume, and what is not in an isosurface.
fn iso_notes(volume: &Volume, iso: f64, found: &IsoSurface) -> Vec<String> {
    let mut notes = vec![surface_note(volume, iso, found)];
    notes.extend(specks_note(found.specks, "smaller than 8 voxels or a thousandth of the largest part"));
    if found.handles > 0 {
        let words = ["small handle was removed", "small handles were removed"];
        notes.push(format!("{} as noise (--keep-specks keeps handles)", counted(found.handles, words)));
    }
    notes
}

/// What became of the volume.
fn surface_note(volume: &Volume, iso: f64, found: &IsoSurface) -> String {
    let [x, y, z] = volume.size;
    let (side, other) = match found.inside {
        Inside::Below => ("smaller", "above"),
        _ => ("greater", "below"),
    };
    format!(
        "a volume of {x} x {y} x {z} values: the isosurface at {iso} has {} with {side} values inside \
        (--inside {other} reverses this)",
        counted(found.mesh.triangles.len(), ["triangle", "triangles"])
    )
}

/// What `inspect` prints of a volume.
#[derive(Serialize)]
pub struct Inspection<'a> {
    notes: &'a [String],
    /// Nodes along each axis.
    size: [usize; 3],
    /// Between them.
    spacing: [f64; 3],
    /// The place of the first node.
    origin: [f64; 3],
    /// The least and the greatest value; none if no value is finite.
    range: Option<[f32; 2]>,
    /// Values that are NaN or infinite.
    not_finite: usize,
    /// Different values, if all are whole numbers that may be labels.
    labels: Option<usize>,
}

impl<'a> Inspection<'a> {
    pub fn new(volume: &'a Volume) -> Self {
        Self {
            notes: &volume.notes,
            size: volume.size,
            spacing: volume.spacing().to_array(),
            origin: volume.frame.translation.to_array(),
            range: volume.range(),
            not_finite: volume.values.iter().filter(|value| !value.is_finite()).count(),
            labels: labels(&volume.values),
        }
    }

    pub fn rows(&self) -> Vec<(&'static str, String)> {
        let joined = |all: [f64; 3], between: &str| all.map(|x| format!("{x:.6}")).join(between);
        let [low, high] =
            self.range.map_or(["-".to_owned(), "-".to_owned()], |range| range.map(|x| x.to_string()));
        vec![
            ("values", self.size.map(|n| n.to_string()).join(" x ")),
            ("spacing", joined(self.spacing, ", ")),
            ("first value at", joined(self.origin, ", ")),
            ("minimum, maximum value", format!("{low}, {high}")),
            ("non-finite values", self.not_finite.to_string()),
            (
                "different labels",
                self.labels
                    .map_or_else(|| "-, not all are whole numbers from 0".to_owned(), |n| n.to_string()),
            ),
        ]
    }
}

/// How many different values there are, if [`rtfmesh::volume::label_surface`] takes them.
fn labels(values: &[f32]) -> Option<usize> {
    let mut found = HashSet::new();
    for value in values {
        if value.fract() != 0.0 || !(0.0..=rtfmesh::volume::MOST_LABEL).contains(value) {
            return None;
        }
        found.insert(*value as u32);
    }
    Some(found.len())
}
