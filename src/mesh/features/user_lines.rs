//! A user's lines, matched to the edges of a mesh.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::mesh::TriMesh;
use crate::mesh::half_edges::{EdgeTable, edge_key};
use crate::mesh::hash_grid::HashGrid;
use crate::mesh::unit_frame::UnitFrame;
use crate::{Error, Result};

/// Points match a vertex within this share of the bounding box's diagonal.
const NEAR: f64 = 1e-6;

/// A line that the user draws along edges of a mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FeatureLine {
    /// Its line in the file, from 1.
    pub line: u64,
    /// Its points in order, at least two, all finite; in the mesh's units.
    pub points: Vec<DVec3>,
}

/// The edges of `mesh` along the lines, as pairs of vertices.
///
/// # Errors
///
/// [`Error::Input`] with the line in the file: a point is not at a vertex (within a millionth of the bounding
/// box's diagonal), or two points in a row are not joined by an edge. Also for a mesh without
/// extent or with a coordinate that is not finite.
pub fn user_edges(mesh: &TriMesh, lines: &[FeatureLine]) -> Result<Vec<[u32; 2]>> {
    let places = Places::new(mesh)?;
    let table = EdgeTable::new(&mesh.triangles);
    let edges: Vec<(u32, u32)> = table.edges().map(|sides| sides[0].ends()).collect();
    let mut found = Vec::new();
    for FeatureLine { line, points } in lines {
        let fault =
            |problem: String, remedy: &str| Error::input(Some(format!("line {line}")), problem, remedy);
        let vertices: Vec<u32> = points
            .iter()
            .map(|&point| {
                places.vertex_at(point).ok_or_else(|| {
                    let problem =
                        format!("no vertex of the mesh is at ({}, {}, {})", point.x, point.y, point.z);
                    fault(problem, "draw lines from vertex to vertex, in the mesh's own coordinates")
                })
            })
            .collect::<Result<_>>()?;
        for (pair, ends) in vertices.windows(2).zip(points.windows(2)) {
            let (a, b) = edge_key(pair[0], pair[1]);
            if edges.binary_search(&(a, b)).is_err() {
                let [p, q] = [ends[0], ends[1]].map(|p| format!("({}, {}, {})", p.x, p.y, p.z));
                let problem = format!("no edge of the mesh joins {p} and {q}");
                return Err(fault(problem, "name every vertex that the line passes"));
            }
            found.push([a, b]);
        }
    }
    Ok(found)
}

/// Vertices found by their position.
struct Places<'a> {
    mesh: &'a TriMesh,
    frame: UnitFrame,
    grid: HashGrid<u32>,
}

impl<'a> Places<'a> {
    fn new(mesh: &'a TriMesh) -> Result<Self> {
        let frame = UnitFrame::of(mesh)?;
        let mut grid = HashGrid::new(NEAR, mesh.vertices.len());
        (0..).zip(&mesh.vertices).for_each(|(v, at)| grid.insert(frame.to_unit(*at), v));
        Ok(Self { mesh, frame, grid })
    }

    /// The nearest vertex within [`NEAR`]; of equally near ones the first.
    fn vertex_at(&self, point: DVec3) -> Option<u32> {
        let at = self.frame.to_unit(point);
        let mut nearest: Option<(f64, u32)> = None;
        self.grid.any(at, |v| {
            let distance = at.distance(self.frame.to_unit(self.mesh.vertices[v as usize]));
            if distance <= NEAR && nearest.is_none_or(|best| (distance, v) < best) {
                nearest = Some((distance, v));
            }
            false
        });
        nearest.map(|(_, v)| v)
    }
}
