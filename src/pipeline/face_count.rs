//! Results with a number of triangles that was asked for.
//!
//! By Euler's formula a mesh of V vertices has 2 (V - χ) - b triangles, where b is the sum of 2 - s over all
//! edges with s triangles: the number of boundary edges, on a manifold. It is known from the surface but for
//! b, which depends on V a little.

use super::kept::{Kept, in_units};
use super::outcome::FaultKind;
use super::preview::single_sides;
use super::{Made, Summary, WarningCode};
use crate::mesh::half_edges::EdgeTable;
use crate::mesh::repair::{Repaired, repair_with};
use crate::mesh::topology::topology;
use crate::options::{Method, Options};
use crate::{Result, TriMesh};

/// Maximum number of further runs if the number of triangles was not met.
const FURTHER: usize = 5;
/// The first number of vertices follows from b at the one before it, so many times.
const ROUNDS: u32 = 4;

/// The options with the number of vertices that leads to the number of triangles, as far as that is known
/// before the run.
///
/// # Errors
/// Those of the repair and of [`super::preview`].
pub(super) fn with_vertices(
    mesh: &TriMesh,
    repaired: Option<&Repaired>,
    options: &Options,
) -> Result<Options> {
    let Some(faces) = options.faces else { return Ok(options.clone()) };
    let own;
    let repaired = match repaired {
        Some(repaired) => repaired,
        None => {
            own = repair_with(mesh, &options.repairs())?;
            &own
        }
    };
    let mut rest = repaired.clone();
    let options = &in_units(options, &rest.mesh)?;
    let kept = Kept::cut_off(&mut rest, options, mesh)?;
    let others = kept.as_ref().map_or([0; 2], |kept| [kept.own_vertices(), kept.triangles()]);
    let input = topology(&rest.mesh);
    let vertices = |single: i64| {
        let vertices = (faces as i64 - others[1] as i64 + single).div_euclid(2) + input.euler;
        usize::try_from(vertices + others[0] as i64).unwrap_or(0).max(4)
    };
    let mut found = Options { vertices: vertices(0), ..options.clone() };
    if !may_change(options, &rest.mesh) {
        return Ok(found);
    }
    for _ in 0..ROUNDS {
        let next = vertices(single_sides(mesh, &rest, kept.as_ref(), &found)?);
        if std::mem::replace(&mut found.vertices, next) == next {
            break;
        }
    }
    Ok(found)
}

/// Whether the number of vertices that leads to the triangles asked for is only known after a run on this
/// mesh.
pub(super) fn may_change(options: &Options, mesh: &TriMesh) -> bool {
    let has_single_sides = || EdgeTable::new(&mesh.triangles).edges().any(|sides| sides.len() != 2);
    options.faces.is_some() && can_vary(options) && has_single_sides()
}

/// Whether runs can be made with another number of vertices than that of the options.
fn can_vary(options: &Options) -> bool {
    options.method == Method::CoarseToFine && options.coarse_to_fine.sizing.deviation().is_none()
}

/// What a run came to, and the number of triangles that was asked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct FaceCount {
    asked: usize,
    got: usize,
    /// How bad the mesh's fault is; 0 for none.
    fault: u8,
}

impl FaceCount {
    /// If a number was asked for.
    pub fn of(made: &Made, options: &Options) -> Option<Self> {
        let small = made.prepared.small.iter().map(|part| part.triangles.len()).sum::<usize>();
        let kept = made.prepared.kept.as_ref().map_or(0, Kept::triangles);
        let got = made.outcome.mesh.triangles.len() + small + kept;
        let fault = made.outcome.fault.as_ref().map_or(0, |fault| match fault.kind {
            FaultKind::Slivers(_) => 0,
            FaultKind::Intersections(_) => 1,
            FaultKind::Missing => 2,
            FaultKind::SliversAllOver => 3,
            FaultKind::Topology => 4,
        });
        options.faces.map(|asked| Self { asked, got, fault })
    }

    /// Another number of vertices with which the number of triangles may be met, after these were tried.
    pub fn other_vertices(self, tried: &[usize], options: &Options) -> Option<usize> {
        let more = (self.asked as i64 - self.got as i64).div_euclid(2);
        let mut other = usize::try_from(*tried.last()? as i64 + more).ok().filter(|other| *other >= 4)?;
        if more == 0 || !can_vary(options) || tried.len() > FURTHER {
            return None;
        }
        while tried.contains(&other) {
            other += 1;
        }
        Some(other)
    }

    /// Whether the mesh has a lesser fault; or else whether its number is nearer to what was asked for, and
    /// not more if that of the other one is not.
    pub fn is_better_than(self, other: Self) -> bool {
        let key = |count: Self| (count.fault, count.got > count.asked, count.got.abs_diff(count.asked));
        key(self) < key(other)
    }
}

/// Tells a user if there are not as many triangles as asked for: in a remark if there is no mesh of so many,
/// in a warning otherwise.
pub(super) fn tell(options: &Options, summary: &mut Summary) {
    let Some(asked) = options.faces else { return };
    let topology = &summary.output.topology;
    let (got, is_closed) = (topology.faces, topology.boundary_edges == 0);
    let text = format!("the result has {got} triangles instead of {asked}");
    match asked.checked_sub(got) {
        Some(0) => {}
        Some(1) if is_closed => {
            summary.remarks.push(format!("{text}, because closed surfaces have an even number of triangles"));
        }
        Some(1 | 2) if !is_closed => {
            let cause = "because it depends on the number of boundary edges as well";
            summary.remarks.push(format!("{text}, {cause}"));
        }
        _ => summary.warn(WarningCode::FaceCount, text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_vertices_make_up_for_pairs_of_triangles() {
        let of = |got| FaceCount { asked: 1001, got, fault: 0 };
        assert!(of(990).is_better_than(of(1002)) && of(1000).is_better_than(of(999)));
        let faulty = FaceCount { fault: 1, ..of(1001) };
        assert!(of(990).is_better_than(faulty) && !faulty.is_better_than(of(990)));
        let options = Options::new(500);
        assert_eq!(of(1000).other_vertices(&[500], &options), None);
        assert_eq!(of(997).other_vertices(&[500], &options), Some(502));
        assert_eq!(of(1002).other_vertices(&[500], &options), Some(499));
        assert_eq!(of(1002).other_vertices(&[499, 500], &options), Some(501));
        assert_eq!(of(1002).other_vertices(&[500; FURTHER + 1], &options), None);
    }
}
