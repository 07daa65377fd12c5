//! What formats with 32-bit numbers make of positions.

use super::format::Format;
use super::gltf;
use crate::TriMesh;

/// Whether files of this format hold positions as 32-bit numbers, so that [`rounded`] changes them.
pub(crate) fn has_32_bits(format: Format) -> bool {
    match format {
        Format::Stl | Format::Glb => true,
        Format::Obj
        | Format::Ply
        | Format::Off
        | Format::Gltf
        | Format::Medit
        | Format::Xyz
        | Format::Pcd
        | Format::Npy
        | Format::Nrrd
        | Format::Nifti
        | Format::MetaImage
        | Format::Las
        | Format::E57
        | Format::Vtp
        | Format::Vtu
        | Format::Vtk
        | Format::Vti
        | Format::ThreeMf => false,
    }
}

/// The mesh with its positions as a file of this format holds them: rounded for STL and GLB, the same for the
/// others. Positions that a file cannot hold at all, beyond 3.4e38 in STL, become infinite.
pub fn rounded(mesh: &TriMesh, format: Format) -> TriMesh {
    if !has_32_bits(format) {
        return mesh.clone();
    }
    let vertices = match format {
        Format::Glb => gltf::rounded_positions(mesh),
        _ => mesh.vertices.iter().map(|vertex| vertex.as_vec3().as_dvec3()).collect(),
    };
    TriMesh { vertices, triangles: mesh.triangles.clone() }
}

/// How far the format's rounding moves vertices, as a sentence; `None` up to a millionth of the bounding
/// box's diagonal.
pub fn lost_precision_note(mesh: &TriMesh, format: Format) -> Option<String> {
    if !has_32_bits(format) {
        return None;
    }
    let [low, high] = mesh.bounds()?;
    let moved = rounded(mesh, format).vertices;
    let moves = mesh.vertices.iter().zip(moved).map(|(from, to)| (to - *from).abs().max_element());
    let share = moves.fold(0.0, f64::max) / (high - low).length();
    let text = format!(
        "{} stores 32-bit numbers, which moves vertices by up to {share:.2e} of the bounding box's diagonal; \
         {KEEPING_64_BITS} keep them in place",
        format.name()
    );
    (share > 1e-6).then_some(text)
}

/// The extensions of the formats with 64-bit numbers.
pub(crate) const KEEPING_64_BITS: &str = ".ply, .obj, .off, .mesh, .vtp, .vtu, .vtk and .3mf";
