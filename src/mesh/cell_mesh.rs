//! The cells of a result's vertices as polygons.

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use super::TriMesh;
use super::csr::triangles_around;
use super::hash_grid::HashGrid;
use super::unit_frame::UnitFrame;

/// Corners of a cell closer than this fraction of its surface's diagonal are one.
const WELD: f64 = 1e-10;

/// What a cell is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CellKind {
    /// A face in the tangent plane of a site.
    Tangent,
    /// All that is closer to a vertex than to any other, on the surface.
    Exact,
}

/// Cells as polygons, each a flat part of the cell of one vertex of a result. Polygons of one cell share
/// their corners, those of different cells do not.
#[derive(Debug, Clone, PartialEq)]
pub struct CellMesh {
    /// What they are.
    pub kind: CellKind,
    /// The corners of all polygons.
    pub vertices: Vec<DVec3>,
    /// Indices of vertices: the corners of the polygons, counter-clockwise seen from outside.
    pub corners: Vec<u32>,
    /// Where each polygon begins in `corners`, and the end of the last.
    pub starts: Vec<u32>,
    /// The vertex of the result whose cell each polygon is a part of, in ascending order.
    pub cells: Vec<u32>,
}

/// Figures of cells.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct CellSummary {
    /// What they are.
    pub kind: CellKind,
    /// Number of vertices that have one.
    pub cells: usize,
    /// Number of polygons.
    pub polygons: usize,
    /// Sum of their areas relative to the surface's.
    pub area: f64,
}

/// What colours of cells tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellColours {
    /// Their areas: white for the mean, blue for half of it or less, red for double or more.
    Area,
    /// The numbers of neighbours of their vertices: white for six, blue for fewer, red for more.
    Valence,
}

impl CellMesh {
    /// Of the polygons of each cell, in the frame of a surface of diagonal 1.
    pub(crate) fn new(kind: CellKind, cells: Vec<Vec<Vec<DVec3>>>) -> Self {
        let welded: Vec<(Vec<DVec3>, Vec<Vec<u32>>)> = cells.into_par_iter().map(weld).collect();
        let mut mesh =
            Self { kind, vertices: Vec::new(), corners: Vec::new(), starts: vec![0], cells: Vec::new() };
        for (cell, (vertices, polygons)) in (0..).zip(welded) {
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend(vertices);
            for polygon in polygons {
                mesh.corners.extend(polygon.into_iter().map(|v| first + v));
                mesh.starts.push(mesh.corners.len() as u32);
                mesh.cells.push(cell);
            }
        }
        mesh
    }

    /// In the units of a mesh.
    pub(crate) fn in_units_of(mut self, frame: &UnitFrame) -> Self {
        self.vertices.par_iter_mut().for_each(|p| *p = frame.to_input_units(*p));
        self
    }

    /// The corners of a polygon. Panics if it is not there.
    pub fn polygon(&self, index: usize) -> &[u32] {
        &self.corners[self.starts[index] as usize..self.starts[index + 1] as usize]
    }

    /// The area of each cell of a result with this number of vertices; 0 if it has no polygons.
    pub fn areas(&self, vertices: usize) -> Vec<f64> {
        let mut areas = vec![0.0; vertices];
        for (index, cell) in self.cells.iter().enumerate() {
            let corners = self.polygon(index).iter().map(|v| self.vertices[*v as usize]);
            areas[*cell as usize] += area(&corners.collect::<Vec<_>>());
        }
        areas
    }

    /// The polygons as triangles, with the polygon of each.
    pub fn triangles(&self) -> (TriMesh, Vec<u32>) {
        let (mut triangles, mut origin) = (Vec::new(), Vec::new());
        for index in 0..self.cells.len() {
            let Some((first, rest)) = self.polygon(index).split_first() else { continue };
            for pair in rest.windows(2) {
                triangles.push([*first, pair[0], pair[1]]);
                origin.push(index as u32);
            }
        }
        (TriMesh { vertices: self.vertices.clone(), triangles }, origin)
    }

    /// Figures of cells on a surface of this area.
    pub(crate) fn summary(&self, surface: f64) -> CellSummary {
        let areas = self.areas(self.cells.last().map_or(0, |last| *last as usize + 1));
        CellSummary {
            kind: self.kind,
            cells: areas.iter().filter(|area| **area > 0.0).count(),
            polygons: self.cells.len(),
            area: areas.iter().sum::<f64>() / surface,
        }
    }

    /// A colour for each polygon: red, green and blue. `result` is the mesh of the cells' vertices.
    pub fn colours(&self, by: CellColours, result: &TriMesh) -> Vec<[u8; 3]> {
        let count = result.vertices.len();
        let shares: Vec<f64> = match by {
            CellColours::Area => {
                let areas = self.areas(count);
                let mean = areas.iter().sum::<f64>() / areas.iter().filter(|a| **a > 0.0).count() as f64;
                areas.iter().map(|area| (area / mean).log2()).collect()
            }
            CellColours::Valence => {
                let around = triangles_around(count, &result.triangles);
                (0..count as u32).map(|v| 0.6 * (around.of(v).len() as f64 - 6.0)).collect()
            }
        };
        self.cells.iter().map(|cell| colour(shares[*cell as usize])).collect()
    }
}

/// White at 0, blue at -1, red at 1.
fn colour(share: f64) -> [u8; 3] {
    const WHITE: DVec3 = DVec3::new(246.0, 246.0, 240.0);
    const ENDS: [DVec3; 2] = [DVec3::new(43.0, 108.0, 176.0), DVec3::new(196.0, 52.0, 45.0)];
    let end = ENDS[usize::from(share > 0.0)];
    WHITE.lerp(end, share.abs().min(1.0)).round().to_array().map(|value| value as u8)
}

/// The area of a flat polygon.
pub(crate) fn area(corners: &[DVec3]) -> f64 {
    let Some((a, rest)) = corners.split_first() else { return 0.0 };
    0.5 * rest.windows(2).map(|pair| (pair[0] - *a).cross(pair[1] - *a)).sum::<DVec3>().length()
}

/// The polygons of a cell with common corners; those without an area are left out.
fn weld(polygons: Vec<Vec<DVec3>>) -> (Vec<DVec3>, Vec<Vec<u32>>) {
    let mut vertices: Vec<DVec3> = Vec::new();
    let mut grid = HashGrid::new(WELD, polygons.iter().map(Vec::len).sum());
    let mut number = |p: DVec3| {
        let mut found = None;
        grid.any(p, |v: u32| {
            let is_same = vertices[v as usize].distance_squared(p) <= WELD * WELD;
            found = found.or(is_same.then_some(v));
            is_same
        });
        found.unwrap_or_else(|| {
            let new = vertices.len() as u32;
            vertices.push(p);
            grid.insert(p, new);
            new
        })
    };
    let with_numbers = |polygon: Vec<DVec3>| {
        let mut corners: Vec<u32> = polygon.into_iter().map(&mut number).collect();
        corners.dedup();
        if corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        corners
    };
    let polygons: Vec<Vec<u32>> =
        polygons.into_iter().map(with_numbers).filter(|corners| corners.len() > 2).collect();
    (vertices, polygons)
}
