//! Meshes and lines as data of the page: coordinates of 16 bits, compressed, in base64.

use super::coarsen::coarsen;
use crate::{Error, Result, TriMesh};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use glam::DVec3;
use std::io::Write;

/// Maximum number of faces of a mesh on a page; two meshes of this size take about 8 MB.
pub const MOST_FACES: usize = 200_000;
/// Maximum number of edges of curves on a page.
pub(super) const MOST_LINES: usize = 100_000;

/// The largest coordinate, of 16 bits.
const LARGEST_U16: f64 = 65535.0;

/// The cube in which the page's coordinates are given.
pub(super) struct Space {
    low: DVec3,
    /// Half the longest side.
    half: f64,
    /// Sides of the bounding box, relative to the longest.
    pub sides: DVec3,
}

impl Space {
    /// The cube around both meshes, which must have vertices.
    pub fn around(meshes: [&TriMesh; 2]) -> Self {
        let points = || meshes.into_iter().flat_map(|mesh| &mesh.vertices);
        // Halved, because their difference can overflow.
        let low = points().fold(DVec3::INFINITY, |low, p| low.min(0.5 * *p));
        let high = points().fold(DVec3::NEG_INFINITY, |high, p| high.max(0.5 * *p));
        let half = (high - low).max_element().max(f64::MIN_POSITIVE);
        Self { low, half, sides: (high - low) / half }
    }

    /// A point in the meshes' units, with coordinates from 0 to 1.
    fn unit(&self, point: DVec3) -> DVec3 {
        (0.5 * point - self.low) / self.half
    }
}

/// A mesh as the page has it: `u32` corners of the faces, `u16` coordinates of the vertices in 65535ths of
/// the longest side, a byte for each face's quality and one for its distance; all little-endian, as a zlib
/// stream in base64.
pub(super) struct Packed {
    pub data: String,
    pub vertices: usize,
    pub faces: usize,
}

/// Packs a mesh; `quality` and `distance` are shares, 0..=1, for its faces.
pub(super) fn pack(mesh: &TriMesh, space: &Space, quality: &[f64], distance: &[f64]) -> Result<Packed> {
    let points: Vec<DVec3> = mesh.vertices.iter().map(|p| space.unit(*p)).collect();
    if mesh.triangles.len() <= MOST_FACES {
        return encode(&points, &mesh.triangles, [quality, distance].map(|shares| shares.iter().copied()));
    }
    let coarsened = coarsen(&points, &mesh.triangles, MOST_FACES);
    let shares = [quality, distance].map(|shares| coarsened.faces.iter().map(|face| shares[*face as usize]));
    encode(&coarsened.points, &coarsened.triangles, shares)
}

fn encode<S: Iterator<Item = f64>>(
    points: &[DVec3],
    triangles: &[[u32; 3]],
    shares: [S; 2],
) -> Result<Packed> {
    let mut bytes: Vec<u8> = triangles.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    bytes.extend(points.iter().flat_map(|p| coordinate_bytes(*p)));
    for face_shares in shares {
        bytes.extend(face_shares.map(|share| (255.0 * share).round() as u8));
    }
    Ok(Packed { data: compress(&bytes)?, vertices: points.len(), faces: triangles.len() })
}

/// Lines by their ends, in the meshes' units, as `u16` coordinates packed as in [`Packed`].
pub(super) fn pack_lines(lines: &[[DVec3; 2]], space: &Space) -> Result<String> {
    let bytes: Vec<u8> = lines.as_flattened().iter().flat_map(|p| coordinate_bytes(space.unit(*p))).collect();
    compress(&bytes)
}

fn coordinate_bytes(unit: DVec3) -> impl Iterator<Item = u8> {
    unit.to_array().into_iter().flat_map(|x| ((LARGEST_U16 * x).round() as u16).to_le_bytes())
}

fn compress(bytes: &[u8]) -> Result<String> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    let packed = encoder.write_all(bytes).and_then(|()| encoder.finish());
    packed.map(|bytes| base64(&bytes)).map_err(|e| Error::Internal(e.to_string()))
}

pub(super) fn base64(bytes: &[u8]) -> String {
    STANDARD.encode(bytes)
}
