//! Paints faces and edges into pixels, the farthest first.

use super::camera::{Camera, Projected};
use super::colours::Colour;
use crate::{Error, Result, TriMesh};
use glam::DVec3;
use tiny_skia::{FillRule, Paint, PathBuilder, Pixmap, PixmapPaint, Shader, Stroke, Transform};

/// One of the meshes that a picture shows side by side.
#[derive(Debug, Clone, Copy)]
pub struct Panel<'a> {
    /// The mesh.
    pub mesh: &'a TriMesh,
    /// The colour of each face; empty for one colour.
    pub colours: &'a [Colour],
    /// Lines drawn over the mesh, by their end points, in its units.
    pub lines: &'a [[DVec3; 2]],
}

/// Samples of a pixel along each side.
const SAMPLES: u32 = 2;
/// Faces longer than this many pixels are painted in parts, because a large face has no single depth.
const LONGEST: f64 = 24.0;
/// Most times that a face is halved.
const MOST_HALVINGS: u32 = 16;
/// Most parts of a line.
const MOST_PARTS: f64 = 1000.0;
const SURFACE: Colour = [128, 178, 230];
const INSIDE: Colour = [205, 160, 120];
const EDGE: Colour = [18, 28, 51];
const LINE: Colour = [214, 60, 40];
const LINE_PIXELS: f64 = 2.0;
/// Lines are moved towards the camera by so many radii, so that they are painted after the faces that they
/// lie on.
const LIFT: f64 = 0.01;
/// Directions to the lights in camera coordinates, and their intensity.
const LIGHTS: [(DVec3, f64); 2] = [(DVec3::new(-0.45, 0.65, 0.62), 0.62), (DVec3::new(0.8, 0.1, 0.45), 0.24)];
const AMBIENT: f64 = 0.34;

pub(super) struct Canvas {
    pixels: Pixmap,
}

/// A part of a face or line that is painted at once.
struct Piece {
    corners: [[f32; 2]; 3],
    depth: f64,
    colour: Colour,
    /// Whether a side, from each corner to the next, is an edge of the mesh.
    edges: [bool; 3],
    is_line: bool,
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

fn pieces(panel: &Panel, camera: &Camera) -> Vec<Piece> {
    let seen: Vec<Projected> = panel.mesh.vertices.iter().map(|v| camera.project(*v)).collect();
    let mut pieces = Vec::with_capacity(panel.mesh.triangles.len());
    for (t, triangle) in panel.mesh.triangles.iter().enumerate() {
        let normal = camera.direction(panel.mesh.doubled_normal(t).normalize_or_zero());
        let corners = triangle.map(|v| seen[v as usize]);
        let is_front = signed_area(corners) < 0.0;
        let base = match panel.colours.get(t) {
            Some(colour) => *colour,
            None if is_front => SURFACE,
            None => INSIDE,
        };
        let colour = shaded(base, if is_front { normal } else { -normal });
        let whole = Piece { corners: [[0.0; 2]; 3], depth: 0.0, colour, edges: [true; 3], is_line: false };
        divide(corners, [true; 3], MOST_HALVINGS, &mut |corners, edges| {
            let depth = corners.iter().map(|c| c.depth).sum::<f64>() / 3.0;
            pieces.push(Piece { corners: corners.map(on_canvas), depth, edges, ..whole });
        });
    }
    for line in panel.lines {
        let [a, b] = line.map(|p| camera.project(p));
        let parts = (distance(a, b) / LONGEST).ceil().clamp(1.0, MOST_PARTS);
        for k in 0..parts as u32 {
            let [from, to] = [k, k + 1].map(|k| interpolate(a, b, f64::from(k) / parts));
            let depth = 0.5 * (from.depth + to.depth) + LIFT;
            let corners = [from, to, to].map(on_canvas);
            let edges = [true, false, false];
            pieces.push(Piece { corners, depth, colour: LINE, edges, is_line: true });
        }
    }
    pieces
}

/// Twice the area on the panel, negative if the corners are counter-clockwise, because y points down.
fn signed_area([a, b, c]: [Projected; 3]) -> f64 {
    let ([ax, ay], [bx, by], [cx, cy]) = (a.at, b.at, c.at);
    (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
}

fn on_canvas(seen: Projected) -> [f32; 2] {
    seen.at.map(|x| (f64::from(SAMPLES) * x) as f32)
}

/// The distance on the panel, in pixels.
fn distance(a: Projected, b: Projected) -> f64 {
    (b.at[0] - a.at[0]).hypot(b.at[1] - a.at[1])
}

fn interpolate(a: Projected, b: Projected, share: f64) -> Projected {
    let mix = |a: f64, b: f64| a + share * (b - a);
    Projected { at: [0, 1].map(|k: usize| mix(a.at[k], b.at[k])), depth: mix(a.depth, b.depth) }
}

/// Halves a triangle at its longest side until it is short.
fn divide(
    corners: [Projected; 3],
    edges: [bool; 3],
    left: u32,
    paint: &mut dyn FnMut([Projected; 3], [bool; 3]),
) {
    let length = |k: usize| distance(corners[k], corners[(k + 1) % 3]);
    let longest = (1..3).fold(0, |best, k| if length(k) > length(best) { k } else { best });
    if left == 0 || length(longest) <= LONGEST {
        return paint(corners, edges);
    }
    let [a, b, c] = [0, 1, 2].map(|k| corners[(longest + k) % 3]);
    let [ab, bc, ca] = [0, 1, 2].map(|k| edges[(longest + k) % 3]);
    let middle =
        Projected { at: [0, 1].map(|k: usize| 0.5 * (a.at[k] + b.at[k])), depth: 0.5 * (a.depth + b.depth) };
    divide([a, middle, c], [ab, false, ca], left - 1, paint);
    divide([middle, b, c], [ab, bc, false], left - 1, paint);
}

/// The colour under the lights, with a weak highlight.
fn shaded(base: Colour, normal: DVec3) -> Colour {
    let mut light = AMBIENT;
    for (direction, power) in LIGHTS {
        let light_direction = direction.normalize();
        light += power * normal.dot(light_direction).max(0.0);
        light += 0.15 * power * normal.dot((light_direction + DVec3::Z).normalize()).max(0.0).powi(40);
    }
    base.map(|c| (f64::from(c) * light).clamp(0.0, 255.0) as u8)
}

/// The width of edges on the canvas, thin enough that the colours of small faces stay visible.
fn edge_width(pieces: &[Piece]) -> f32 {
    let sides = pieces.iter().filter(|piece| !piece.is_line).map(|piece| {
        let [[ax, ay], [bx, by], _] = piece.corners;
        f64::from(bx - ax).hypot(f64::from(by - ay))
    });
    let mean = sides.sum::<f64>() / pieces.len().max(1) as f64;
    ((0.07 * mean) as f32).clamp(0.2, SAMPLES as f32)
}

fn paint(pixels: &mut Pixmap, piece: &Piece, edges: Option<f32>) {
    let [a, b, c] = piece.corners;
    if !piece.is_line {
        let mut path = PathBuilder::new();
        path.move_to(a[0], a[1]);
        path.line_to(b[0], b[1]);
        path.line_to(c[0], c[1]);
        path.close();
        if let Some(path) = path.finish() {
            // Without anti-aliasing: between two anti-aliased faces the background would shine through.
            let colour = solid_paint(piece.colour, false);
            pixels.fill_path(&path, &colour, FillRule::Winding, Transform::identity(), None);
        }
    }
    let (colour, width) =
        if piece.is_line { (LINE, Some((LINE_PIXELS * f64::from(SAMPLES)) as f32)) } else { (EDGE, edges) };
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

fn solid_paint([r, g, b]: Colour, smooth: bool) -> Paint<'static> {
    let shader = Shader::SolidColor(tiny_skia::Color::from_rgba8(r, g, b, 255));
    Paint { shader, anti_alias: smooth, ..Paint::default() }
}
