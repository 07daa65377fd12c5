//! Vertices that no triangle uses, as those inside volume cells.

use crate::TriMesh;

/// Keeps the vertices that triangles use, and returns their old numbers.
pub(super) fn keep_used(mesh: &mut TriMesh) -> Vec<u32> {
    let mut numbers = vec![u32::MAX; mesh.vertices.len()];
    mesh.triangles.as_flattened().iter().for_each(|v| numbers[*v as usize] = 0);
    let used: Vec<u32> = (0..).zip(&numbers).filter(|(_, n)| **n == 0).map(|(v, _): (u32, _)| v).collect();
    for (new, old) in (0..).zip(&used) {
        numbers[*old as usize] = new;
    }
    mesh.vertices = used.iter().map(|old| mesh.vertices[*old as usize]).collect();
    mesh.triangles.as_flattened_mut().iter_mut().for_each(|v| *v = numbers[*v as usize]);
    used
}
