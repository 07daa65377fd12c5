//! A result as a file with 32-bit numbers will hold it, and what that changes.

use crate::grammar::counted;
use crate::io::{Format, KEEPING_64_BITS, has_32_bits, lost_precision_note, rounded};
use crate::mesh::intersections::intersecting_faces;
use crate::mesh::position_key;
use crate::mesh::unit_frame::UnitFrame;
use crate::{ProgressToken, Result, TriMesh};
use glam::DVec3;
use std::collections::HashSet;

/// Cosine of the angle, 10 degrees, by which a face may turn.
const TURNED: f64 = 0.985;

/// What rounding to the numbers of a format did to a result.
pub(crate) struct Rounding {
    format: Format,
    before: TriMesh,
    /// Vertices at the place of others.
    merged: usize,
    /// Faces that turned by more than 10 degrees, or lost their area.
    turned: usize,
    /// Faces that intersect others, and did not before.
    pub crossing: usize,
}

impl Rounding {
    /// Rounds the positions of `mesh`; `None` if that changes none, or if the format cannot hold them at all,
    /// which writing will say.
    pub fn apply(mesh: &mut TriMesh, frame: &UnitFrame, format: Format) -> Option<Self> {
        if !has_32_bits(format) {
            return None;
        }
        let after = rounded(mesh, format);
        if after.vertices == mesh.vertices || after.vertices.iter().any(|vertex| !vertex.is_finite()) {
            return None;
        }
        let before = std::mem::replace(mesh, after);
        let normals = |mesh: &TriMesh, t: usize| {
            let [a, b, c] = mesh.corners(t).map(|p| frame.to_unit(p));
            // Of sides about 1 long, so that products do not vanish.
            let size = (b - a).abs().max((c - a).abs()).max_element();
            if size > 0.0 { ((b - a) / size).cross((c - a) / size).normalize_or_zero() } else { DVec3::ZERO }
        };
        let has_turned = |t: &usize| {
            let was = normals(&before, *t);
            was != DVec3::ZERO && was.dot(normals(mesh, *t)) < TURNED
        };
        let places =
            |mesh: &TriMesh| mesh.vertices.iter().map(|p| position_key(*p)).collect::<HashSet<_>>().len();
        let turned = (0..mesh.triangles.len()).filter(has_turned).count();
        let merged = places(&before) - places(mesh);
        Some(Self { format, before, merged, turned, crossing: 0 })
    }

    /// Takes note of the number of faces that intersect others now; `known` is the number before rounding,
    /// if it is known.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn compare(&mut self, now: Option<usize>, known: Option<usize>, token: &ProgressToken) -> Result<()> {
        let Some(now) = now.filter(|now| *now > 0) else { return Ok(()) };
        let before = match known {
            Some(count) => count,
            None => intersecting_faces(&self.before, token)?.len(),
        };
        self.crossing = now.saturating_sub(before);
        Ok(())
    }

    /// What is wrong with the file, if anything is.
    pub fn warning(&self) -> Option<String> {
        let changes = [
            (self.merged, ["vertex falls", "vertices fall"], "on others"),
            (self.turned, ["face collapses or turns", "faces collapse or turn"], "by more than 10 degrees"),
            (self.crossing, ["face intersects", "faces intersect"], "others"),
        ];
        let said: Vec<String> = changes
            .iter()
            .filter(|(count, ..)| *count > 0)
            .map(|(count, words, rest)| format!("{} {rest}", counted(*count, *words)))
            .collect();
        let text = format!(
            "{} stores 32-bit numbers, which are too coarse here: {}; {KEEPING_64_BITS} keep 64 bits",
            self.format.name(),
            said.join(", ")
        );
        (!said.is_empty()).then_some(text)
    }

    /// How far vertices moved, if that is much and there is no warning.
    pub fn remark(&self) -> Option<String> {
        let note = lost_precision_note(&self.before, self.format);
        note.filter(|_| self.warning().is_none())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;

    #[test]
    fn thin_plates_bend() {
        let mut plate = sample("box").unwrap();
        let frame = UnitFrame::of(&plate).unwrap();
        let same = Rounding::apply(&mut plate.clone(), &frame, Format::Glb);
        assert!(same.is_none(), "whole numbers stay");
        plate.vertices.iter_mut().for_each(|v| {
            // Oblique, so that its thickness is in the last digits of all coordinates.
            let [x, y, z] = [v.x - 0.5, v.y - 0.5, 1e-7 * (v.z - 0.5)];
            *v = DVec3::new(0.6 * x - 0.8 * z, 0.48 * x + 0.8 * y + 0.36 * z, 0.64 * x - 0.6 * y + 0.48 * z);
        });
        for format in [Format::Glb, Format::Stl] {
            let mut mesh = plate.clone();
            let rounding = Rounding::apply(&mut mesh, &frame, format).unwrap();
            let warning = rounding.warning().unwrap();
            assert!(mesh != plate && rounding.turned > 0 && rounding.merged == 0, "{warning}");
            assert!(warning.contains("turn by more than 10 degrees"), "{warning}");
            assert_eq!(rounding.remark(), None);
        }
    }
}
