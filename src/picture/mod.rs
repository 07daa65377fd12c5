//! Draws pictures of meshes on the CPU: flat shaded, with edges, coloured by quality or by distance; and of
//! points as discs.

mod camera;
mod colours;
mod drawable;
mod paint;
mod pieces;

pub use camera::View;
pub use colours::{Colour, DistanceColours, distance_colours, quality_colours};
#[cfg(feature = "html")]
pub(crate) use colours::{WORST, centre_distances, distance_colour, quality_colour, quality_shares};

use crate::{Error, Result};
use camera::Camera;
pub(crate) use drawable::check;
use drawable::check_indices;
use paint::Canvas;
pub use pieces::{Discs, Panel};
use tiny_skia::Pixmap;

/// Maximum number of pixels along a side of a picture.
pub const MAX_SIDE: u32 = 8192;

/// Settings of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureOptions {
    /// Width and height of each panel in pixels, 16 to [`MAX_SIDE`].
    pub size: [u32; 2],
    /// The camera.
    pub view: View,
    /// Whether edges are drawn.
    pub edges: bool,
}

impl Default for PictureOptions {
    fn default() -> Self {
        Self { size: [720, 540], view: View::default(), edges: true }
    }
}

impl PictureOptions {
    /// Checks the camera; the size is checked with the number of panels.
    ///
    /// # Errors
    /// [`Error::Usage`] that names what is out of range.
    pub fn validate(&self) -> Result<()> {
        let View { azimuth, elevation, zoom, .. } = self.view;
        if azimuth.is_finite() && (-90.0..=90.0).contains(&elevation) && zoom > 0.0 && zoom.is_finite() {
            return Ok(());
        }
        Err(Error::usage(
            format!("`azimuth` {azimuth} `elevation` {elevation} `zoom` {zoom} is out of range"),
            "use any azimuth, -90 to 90 degrees of elevation, and a zoom above 0",
        ))
    }
}

/// Draws panels next to each other, with the camera that frames the first mesh, as a PNG.
///
/// # Errors
/// [`Error::Usage`] if there is no panel or an option is out of range, [`Error::Input`] for a mesh without
/// faces where its vertices are not drawn, or with vertices that are not finite.
pub fn png(panels: &[Panel], options: &PictureOptions) -> Result<Vec<u8>> {
    let encoded = draw(panels, options)?.encode_png();
    encoded.map_err(|error| Error::Internal(format!("a picture could not be encoded: {error}")))
}

/// Like [`png`], but returns red, green, blue and opacity of each pixel, row by row from the top left. A row
/// spans all panels.
///
/// # Errors
/// As [`png`].
pub fn rgba(panels: &[Panel], options: &PictureOptions) -> Result<Vec<u8>> {
    // Everything is opaque, so that it does not matter that opacity is multiplied in.
    draw(panels, options).map(Pixmap::take)
}

fn draw(panels: &[Panel], options: &PictureOptions) -> Result<Pixmap> {
    options.validate()?;
    let [width, height] = options.size;
    let count = u32::try_from(panels.len()).unwrap_or(u32::MAX);
    let whole = width.saturating_mul(count);
    if width < 16 || height < 16 || whole > MAX_SIDE || height > MAX_SIDE {
        return Err(Error::usage(
            format!("a picture of {whole} x {height} pixels cannot be drawn"),
            format!(
                "use panels of at least 16 pixels and a picture of at most {MAX_SIDE} pixels along each \
            side"
            ),
        ));
    }
    let Some(first) = panels.first() else {
        return Err(Error::usage("there is no mesh to draw", "give at least one"));
    };
    for panel in panels {
        match panel.discs {
            None => check(panel.mesh)?,
            Some(_) => check_indices(panel.mesh)?,
        }
    }
    let mut canvas = Canvas::new([whole, height])?;
    let camera = Camera::around(first.mesh, &options.view, options.size)?;
    for (k, panel) in (0..).zip(panels) {
        canvas.draw(panel, &camera, [k * width, width], options.edges);
    }
    canvas.shrunk()
}
