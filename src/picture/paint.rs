//! Paints faces, edges and discs into pixels, the farthest first.

use super::camera::Camera;
use super::colours::Colour;
use super::pieces::{LINE, Panel, Piece, Shape, pieces};
use crate::{Error, Result};
use tiny_skia::{FillRule, Paint, PathBuilder, Pixmap, PixmapPaint, Shader, Stroke, Transform};

/// Samples of a pixel along each side.
pub(super) const SAMPLES: u32 = 2;
/// Sides of the polygon that a disc is drawn as.
const DISC_SIDES: u8 = 10;
const EDGE: Colour = [18, 28, 51];
const LINE_PIXELS: f64 = 2.0;
pub(super) struct Canvas {
    pixels: Pixmap,
}

impl Canvas {
    pub fn new([width, height]: [u32; 2]) -> Result<Self> {
        let mut pixels = pixmap(SAMPLES * width, SAMPLES * height)?;
        pixels.fill(tiny_skia::Color::WHITE);
        Ok(Self { pixels })
    }

    /// Draws a panel into the columns from `left`, as many as `width`.
    pub fn draw(&mut self, panel: &Panel, camera: &Camera, [left, width]: [u32; 2], edges: bool) {
        let mut pieces = pieces(panel, camera);
        pieces.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        // Painted separately, so that nothing extends into the next panel.
        let Some(mut part) = Pixmap::new(SAMPLES * width, self.pixels.height()) else { return };
        let thickness = edge_width(&pieces);
        pieces.iter().for_each(|piece| paint(&mut part, piece, edges.then_some(thickness)));
        let at = i32::try_from(SAMPLES * left).unwrap_or(i32::MAX);
        let whole = Transform::identity();
        self.pixels.draw_pixmap(at, 0, part.as_ref(), &PixmapPaint::default(), whole, None);
    }

    /// The mean of each pixel's samples.
    pub fn shrunk(&self) -> Result<Pixmap> {
        let (width, height) = (self.pixels.width() / SAMPLES, self.pixels.height() / SAMPLES);
        let mut small = pixmap(width, height)?;
        let row = 4 * self.pixels.width() as usize;
        let (from, samples) = (self.pixels.data(), SAMPLES as usize);
        for (k, byte) in small.data_mut().iter_mut().enumerate() {
            let (pixel, channel) = (k / 4, k % 4);
            let (x, y) = (pixel % width as usize, pixel / width as usize);
            let sum: u32 = (0..samples * samples)
                .map(|s| {
                    let (dx, dy) = (s % samples, s / samples);
                    u32::from(from[(y * samples + dy) * row + 4 * (x * samples + dx) + channel])
                })
                .sum();
            *byte = (sum / (SAMPLES * SAMPLES)) as u8;
        }
        Ok(small)
    }
}

fn pixmap(width: u32, height: u32) -> Result<Pixmap> {
    Pixmap::new(width, height)
        .ok_or_else(|| Error::Internal(format!("no picture of {width} x {height} can be made")))
}

/// The width of edges on the canvas, thin enough that the colours of small faces stay visible.
fn edge_width(pieces: &[Piece]) -> f32 {
    let sides = pieces.iter().filter(|piece| piece.shape == Shape::Face).map(|piece| {
        let [[ax, ay], [bx, by], _] = piece.corners;
        f64::from(bx - ax).hypot(f64::from(by - ay))
    });
    let mean = sides.sum::<f64>() / pieces.len().max(1) as f64;
    ((0.07 * mean) as f32).clamp(0.2, SAMPLES as f32)
}

fn paint(pixels: &mut Pixmap, piece: &Piece, edges: Option<f32>) {
    let [a, b, c] = piece.corners;
    if piece.shape != Shape::Line {
        let mut path = PathBuilder::new();
        match piece.shape {
            Shape::Disc => add_disc(&mut path, piece.corners),
            _ => {
                path.move_to(a[0], a[1]);
                path.line_to(b[0], b[1]);
                path.line_to(c[0], c[1]);
            }
        }
        path.close();
        if let Some(path) = path.finish() {
            // Without anti-aliasing: between two anti-aliased faces the background would shine through.
            let colour = solid_paint(piece.colour, false);
            pixels.fill_path(&path, &colour, FillRule::Winding, Transform::identity(), None);
        }
    }
    let (colour, width) = match piece.shape {
        Shape::Line => (LINE, Some((LINE_PIXELS * f64::from(SAMPLES)) as f32)),
        Shape::Face => (EDGE, edges),
        Shape::Disc => return,
    };
    let Some(width) = width else { return };
    let mut path = PathBuilder::new();
    for (k, _) in piece.edges.iter().enumerate().filter(|(_, is_edge)| **is_edge) {
        let (from, to) = (piece.corners[k], piece.corners[(k + 1) % 3]);
        path.move_to(from[0], from[1]);
        path.line_to(to[0], to[1]);
    }
    if let Some(path) = path.finish() {
        let stroke = Stroke { width, line_cap: tiny_skia::LineCap::Round, ..Stroke::default() };
        pixels.stroke_path(&path, &solid_paint(colour, true), &stroke, Transform::identity(), None);
    }
}

/// An ellipse with this centre through two points that are a quarter of it apart.
fn add_disc(path: &mut PathBuilder, [centre, a, b]: [[f32; 2]; 3]) {
    for k in 0..DISC_SIDES {
        let (sin, cos) = (std::f32::consts::TAU * k as f32 / DISC_SIDES as f32).sin_cos();
        let at = [0, 1].map(|i: usize| centre[i] + cos * (a[i] - centre[i]) + sin * (b[i] - centre[i]));
        if k == 0 { path.move_to(at[0], at[1]) } else { path.line_to(at[0], at[1]) }
    }
}

fn solid_paint([r, g, b]: Colour, smooth: bool) -> Paint<'static> {
    let shader = Shader::SolidColor(tiny_skia::Color::from_rgba8(r, g, b, 255));
    Paint { shader, anti_alias: smooth, ..Paint::default() }
}
