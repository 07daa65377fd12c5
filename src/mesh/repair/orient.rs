//! Turns faces over that disagree with those around them.

use glam::DVec3;

use super::counts::RepairCounts;
use crate::TriMesh;
use crate::mesh::half_edges::EdgeTable;

/// Faces of a closed component that disagree with the others say something about it from this share of the
/// area on.
const STRAY: f64 = 0.02;

/// Triangles connected by edges of two faces.
struct Component {
    triangles: Vec<usize>,
    orientable: bool,
    is_closed: bool,
    low: DVec3,
    high: DVec3,
}

impl Component {
    /// Whether its bounding box is inside that of the other one, as a cavity's is.
    fn is_within(&self, other: &Self) -> bool {
        other.low.cmplt(self.low).all() && self.high.cmplt(other.high).all()
    }
}

/// Makes the faces of each orientable component agree, if some do not: closed ones face outwards, unless they
/// are inside another one, and may be a cavity. These, open ones and those with few stray faces are as the
/// larger part of them by area.
/// A component is connected by edges of two faces: where more meet, or only a vertex, either side is right.
/// `table` is that of the mesh.
pub(super) fn orient(mesh: &mut TriMesh, table: &EdgeTable, counts: &mut RepairCounts) {
    if pairs(&mesh.triangles, table).all(|(_, agrees)| agrees) {
        return;
    }
    let across = neighbours(&mesh.triangles, table);
    let (components, turned) = components(mesh, &across);
    for component in &components {
        if !component.orientable {
            counts.unorientable_components += 1;
            continue;
        }
        let mut areas = [0.0; 2];
        let triangles = &component.triangles;
        triangles.iter().for_each(|t| areas[usize::from(turned[*t])] += mesh.doubled_normal(*t).length());
        let disagree = areas[0].min(areas[1]) > STRAY * (areas[0] + areas[1]);
        let is_cavity = || components.iter().any(|other| other.is_closed && component.is_within(other));
        let wrong = if disagree && component.is_closed && !is_cavity() {
            inward(mesh, triangles, &turned)
        } else {
            u8::from(areas[0] >= areas[1])
        };
        for t in triangles.iter().filter(|t| turned[**t] == wrong) {
            mesh.triangles[*t].swap(1, 2);
            counts.faces_turned += 1;
        }
    }
}

/// The components, and for each triangle whether it has to be turned over (1) to agree with the first one of
/// its component (0).
fn components(mesh: &TriMesh, across: &[Vec<(usize, bool)>]) -> (Vec<Component>, Vec<u8>) {
    const UNSEEN: u8 = 2;
    let mut components = Vec::new();
    let mut turned = vec![UNSEEN; mesh.triangles.len()];
    for first in 0..turned.len() {
        if turned[first] != UNSEEN {
            continue;
        }
        turned[first] = 0;
        let mut triangles = vec![first];
        let (mut next, mut orientable) = (0, true);
        while next < triangles.len() {
            let t = triangles[next];
            next += 1;
            for &(other, agrees) in &across[t] {
                let want = turned[t] ^ u8::from(!agrees);
                if turned[other] == UNSEEN {
                    turned[other] = want;
                    triangles.push(other);
                } else {
                    orientable &= turned[other] == want;
                }
            }
        }
        let is_closed = triangles.iter().all(|t| across[*t].len() == 3);
        let corners = || triangles.iter().flat_map(|t| mesh.corners(*t));
        let low = corners().fold(DVec3::INFINITY, DVec3::min);
        let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        components.push(Component { triangles, orientable, is_closed, low, high });
    }
    (components, turned)
}

/// Which of the two orientations has to be turned over so that a closed component faces outwards.
fn inward(mesh: &TriMesh, part: &[usize], turned: &[u8]) -> u8 {
    let [origin, ..] = mesh.corners(part[0]);
    let volume: f64 = part
        .iter()
        .map(|t| {
            let [a, b, c] = mesh.corners(*t).map(|p| p - origin);
            let signed = a.dot(b.cross(c));
            if turned[*t] == 0 { signed } else { -signed }
        })
        .sum();
    // Positive if those that count as not turned face outwards.
    u8::from(volume >= 0.0)
}

/// The faces across the edges of two, each with whether the two agree.
fn neighbours(triangles: &[[u32; 3]], table: &EdgeTable) -> Vec<Vec<(usize, bool)>> {
    let mut across = vec![Vec::new(); triangles.len()];
    for ([one, two], agrees) in pairs(triangles, table) {
        across[one].push((two, agrees));
        across[two].push((one, agrees));
    }
    across
}

/// Triangles with an edge between them, and whether they run through it in opposite directions.
fn pairs(triangles: &[[u32; 3]], table: &EdgeTable) -> impl Iterator<Item = ([usize; 2], bool)> {
    let corners = triangles.as_flattened();
    table.edges().filter_map(|sides| {
        let [one, two] = sides else { return None };
        let agrees = corners[one.corners().0] != corners[two.corners().0];
        Some(([one.triangle(), two.triangle()], agrees))
    })
}
