//! Vertices without finite coordinates, as depth cameras write them where they saw nothing: they are left out
//! with the faces on them.

use super::loaded::Loaded;
use crate::grammar::counted;
use crate::mesh::attributes::Attribute;
use crate::{Error, Result, WarningCode};

/// Leaves such vertices and faces out, with a note, or with a warning if there were faces on them.
///
/// # Errors
/// [`Error::Input`] if nothing is left of the vertices, or of the faces.
pub(super) fn leave_out(loaded: &mut Loaded) -> Result<()> {
    let Loaded { mesh, attributes, .. } = loaded;
    let stays: Vec<bool> = mesh.vertices.iter().map(|p| p.is_finite()).collect();
    let lost = stays.iter().filter(|stays| !**stays).count();
    if lost == 0 {
        return Ok(());
    }
    let face_stays: Vec<bool> =
        mesh.triangles.iter().map(|face| face.iter().all(|v| stays[*v as usize])).collect();
    let lost_faces = face_stays.iter().filter(|stays| !**stays).count();
    if lost == stays.len() || (lost_faces > 0 && lost_faces == face_stays.len()) {
        let what = if lost == stays.len() { "vertex" } else { "face" };
        let problem = format!("no {what} has finite coordinates");
        return Err(Error::input(None, problem, "export the mesh again"));
    }
    // Where each vertex goes.
    let mut next = 0;
    let numbers: Vec<u32> = stays
        .iter()
        .map(|stays| {
            let own = next;
            next += u32::from(*stays);
            own
        })
        .collect();
    keep(&mut mesh.vertices, 1, &stays);
    keep(&mut mesh.triangles, 1, &face_stays);
    mesh.triangles.iter_mut().flatten().for_each(|v| *v = numbers[*v as usize]);
    let rows = |list: &mut [Attribute], stays: &[bool]| {
        list.iter_mut().for_each(|own| keep(&mut own.values, own.components, stays));
    };
    rows(&mut attributes.vertex, &stays);
    rows(&mut attributes.face, &face_stays);
    if let Some(uv) = &mut attributes.uv {
        keep(&mut uv.values, 3, &face_stays);
    }
    if let Some(skin) = &mut attributes.skin {
        keep(&mut skin.vertices, 1, &stays);
    }
    let lost =
        counted(lost, ["vertex without finite coordinates was", "vertices without finite coordinates were"]);
    if lost_faces == 0 {
        loaded.notes.push(format!("{lost} left out"));
    } else {
        let faces = counted(lost_faces, ["face", "faces"]);
        let remedy = "fill the holes with `fill_holes`, or export the mesh again";
        let text = format!("{lost} left out, with {faces}: {remedy}");
        loaded.warnings.push((WarningCode::LeftOut, text));
    }
    Ok(())
}

/// Keeps the rows of `width` values that stay.
fn keep<T>(list: &mut Vec<T>, width: usize, stays: &[bool]) {
    let mut position = 0;
    list.retain(|_| {
        let row = position / width.max(1);
        position += 1;
        stays.get(row).copied().unwrap_or(false)
    });
}
