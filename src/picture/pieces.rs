//! What a picture is painted of: parts of faces and lines, and discs, as the camera sees them.

use super::camera::{Camera, Projected};
use super::colours::Colour;
use super::paint::SAMPLES;
use crate::TriMesh;
use glam::DVec3;
use std::collections::HashSet;

/// One of the meshes that a picture shows next to each other.
#[derive(Debug, Clone, Copy)]
pub struct Panel<'a> {
    /// The mesh, or points.
    pub mesh: &'a TriMesh,
    /// The colour of each face, or of each vertex if those are drawn; empty for one colour.
    pub colours: &'a [Colour],
    /// Lines drawn over the mesh, by their end points, in its units.
    pub lines: &'a [[DVec3; 2]],
    /// Draws the vertices as discs instead of triangles; `None` draws triangles.
    pub discs: Option<Discs<'a>>,
    /// Draws only edges that a single triangle has, such as the outlines of cells.
    pub outlines: bool,
}

/// Discs at the vertices of a mesh.
#[derive(Debug, Clone, Copy)]
pub struct Discs<'a> {
    /// In the mesh's units.
    pub diameter: f64,
    /// Normals that orient and light the discs. Discs with a zero normal, or without normals, face the
    /// camera.
    pub normals: &'a [DVec3],
    /// Whether the normals are oriented outwards. Otherwise both sides look alike.
    pub oriented: bool,
}

/// Faces longer than this many pixels are painted in parts, because a large face has no single depth.
const LONGEST: f64 = 24.0;
/// Maximum number of times that a face is halved.
const MOST_HALVINGS: u32 = 16;
/// Maximum number of parts of a line.
const MOST_PARTS: f64 = 1000.0;
const SURFACE: Colour = [128, 178, 230];
const INSIDE: Colour = [205, 160, 120];
pub(super) const LINE: Colour = [214, 60, 40];
/// Lines are moved towards the camera by this many radii, so that they are painted after the faces that they
/// lie on.
const LIFT: f64 = 0.01;
/// Directions to the lights in camera coordinates, and their intensity.
const LIGHTS: [(DVec3, f64); 2] = [(DVec3::new(-0.45, 0.65, 0.62), 0.62), (DVec3::new(0.8, 0.1, 0.45), 0.24)];
const AMBIENT: f64 = 0.34;

/// What is painted at once.
pub(super) struct Piece {
    /// Of a disc, its centre and two points on it, a quarter apart.
    pub corners: [[f32; 2]; 3],
    pub depth: f64,
    pub colour: Colour,
    /// Whether a side, from each corner to the next, is an edge of the mesh.
    pub edges: [bool; 3],
    pub shape: Shape,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    /// A part of a face.
    Face,
    /// A part of a line.
    Line,
    /// A disc at a vertex.
    Disc,
}

pub(super) fn pieces(panel: &Panel, camera: &Camera) -> Vec<Piece> {
    if let Some(discs) = &panel.discs {
        let mut pieces = discs_of(panel, discs, camera);
        add_lines(panel.lines, camera, &mut pieces);
        return pieces;
    }
    let seen: Vec<Projected> = panel.mesh.vertices.iter().map(|v| camera.project(*v)).collect();
    let sides = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
    let inside: HashSet<(u32, u32)> = match panel.outlines {
        true => panel.mesh.triangles.iter().flat_map(|triangle| sides(*triangle)).collect(),
        false => HashSet::new(),
    };
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
        let whole =
            Piece { corners: [[0.0; 2]; 3], depth: 0.0, colour, edges: [true; 3], shape: Shape::Face };
        let edges = sides(*triangle).map(|(a, b)| !inside.contains(&(b, a)));
        divide(corners, edges, MOST_HALVINGS, camera, &mut |corners, edges| {
            let depth = corners.iter().map(|c| c.depth).sum::<f64>() / 3.0;
            pieces.push(Piece { corners: corners.map(on_canvas), depth, edges, ..whole });
        });
    }
    add_lines(panel.lines, camera, &mut pieces);
    pieces
}

fn add_lines(lines: &[[DVec3; 2]], camera: &Camera, pieces: &mut Vec<Piece>) {
    for line in lines {
        let [a, b] = line.map(|p| camera.project(p));
        let parts = (distance(a, b) / LONGEST).ceil().clamp(1.0, MOST_PARTS);
        for k in 0..parts as u32 {
            let [from, to] = [k, k + 1].map(|k| interpolate(a, b, f64::from(k) / parts));
            let depth = 0.5 * (from.depth + to.depth) + LIFT;
            if !camera.may_see([from, to, to]) {
                continue;
            }
            let corners = [from, to, to].map(on_canvas);
            let edges = [true, false, false];
            pieces.push(Piece { corners, depth, colour: LINE, edges, shape: Shape::Line });
        }
    }
}

/// Discs that face where normals say, or the camera.
fn discs_of(panel: &Panel, discs: &Discs, camera: &Camera) -> Vec<Piece> {
    let radius = 0.5 * discs.diameter;
    let disc = |(i, p): (usize, &DVec3)| {
        let normal = discs.normals.get(i).and_then(|normal| normal.try_normalize());
        let (along, across) =
            normal.map_or_else(|| camera.sideways(), |normal| normal.any_orthonormal_pair());
        let seen = normal.map_or(DVec3::Z, |normal| camera.direction(normal));
        let is_inside = seen.z < 0.0 && discs.oriented;
        let base = if is_inside { INSIDE } else { SURFACE };
        let base = panel.colours.get(i).copied().unwrap_or(base);
        let centre = camera.project(*p);
        let [a, b] = [along, across].map(|axis| camera.project(*p + radius * axis));
        Piece {
            corners: [centre, a, b].map(on_canvas),
            depth: centre.depth,
            colour: shaded(base, if seen.z < 0.0 { -seen } else { seen }),
            edges: [false; 3],
            shape: Shape::Disc,
        }
    };
    panel.mesh.vertices.iter().enumerate().map(disc).collect()
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

/// Halves a triangle at its longest side until it is short, and leaves out the parts outside the panel.
fn divide(
    corners: [Projected; 3],
    edges: [bool; 3],
    left: u32,
    camera: &Camera,
    paint: &mut dyn FnMut([Projected; 3], [bool; 3]),
) {
    // With a large zoom, nearly all is outside.
    if !camera.may_see(corners) {
        return;
    }
    let length = |k: usize| distance(corners[k], corners[(k + 1) % 3]);
    let longest = (1..3).fold(0, |best, k| if length(k) > length(best) { k } else { best });
    if left == 0 || length(longest) <= LONGEST {
        return paint(corners, edges);
    }
    let [a, b, c] = [0, 1, 2].map(|k| corners[(longest + k) % 3]);
    let [ab, bc, ca] = [0, 1, 2].map(|k| edges[(longest + k) % 3]);
    let middle =
        Projected { at: [0, 1].map(|k: usize| 0.5 * (a.at[k] + b.at[k])), depth: 0.5 * (a.depth + b.depth) };
    divide([a, middle, c], [ab, false, ca], left - 1, camera, paint);
    divide([middle, b, c], [ab, bc, false], left - 1, camera, paint);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;
    use crate::picture::View;

    #[test]
    fn a_large_zoom_makes_no_more_pieces_than_the_panel_has_room_for() {
        let mesh = sample("box").unwrap();
        let panel = Panel {
            mesh: &mesh,
            colours: &[],
            lines: &[[DVec3::ZERO, DVec3::splat(1e3)]],
            discs: None,
            outlines: false,
        };
        let count = |zoom: f64| {
            let view = View { zoom, ..View::default() };
            pieces(&panel, &Camera::around(&mesh, &view, [720, 540]).unwrap()).len()
        };
        let whole = count(1.0);
        // 720 x 540 pixels are some 3,000 triangles with sides of 24; front and back, and those at the edges.
        for zoom in [10.0, 1e3, 1e6, 1e12] {
            assert!((1..20_000).contains(&count(zoom)), "{} at {zoom}, {whole} at 1", count(zoom));
        }
    }
}
