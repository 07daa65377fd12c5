//! Turns faces over that disagree with those around them.

use super::counts::RepairCounts;
use crate::TriMesh;
use crate::mesh::half_edges::EdgeTable;

/// Where the smaller part of a closed component has more than this share of the area, the larger one says too
/// little, and outwards is right.
const UNDECIDED: f64 = 0.4;

/// Makes the faces of each orientable component agree with the larger part of it by area, or, if it is closed
/// and the parts are about equal, face outwards. A component is connected by edges of two faces: where more
/// meet, or only a vertex, either side is right.
pub(super) fn orient(mesh: &mut TriMesh, counts: &mut RepairCounts) {
    let across = neighbours(&mesh.triangles);
    if !across.iter().flatten().any(|(_, agrees)| !agrees) {
        return;
    }
    const UNSEEN: u8 = 2;
    let mut turned = vec![UNSEEN; mesh.triangles.len()];
    for first in 0..turned.len() {
        if turned[first] != UNSEEN {
            continue;
        }
        turned[first] = 0;
        let mut part = vec![first];
        let (mut next, mut orientable) = (0, true);
        while next < part.len() {
            let t = part[next];
            next += 1;
            for &(other, agrees) in &across[t] {
                let want = turned[t] ^ u8::from(!agrees);
                if turned[other] == UNSEEN {
                    turned[other] = want;
                    part.push(other);
                } else {
                    orientable &= turned[other] == want;
                }
            }
        }
        if !orientable {
            counts.unorientable_components += 1;
            continue;
        }
        let mut areas = [0.0; 2];
        part.iter().for_each(|t| areas[usize::from(turned[*t])] += mesh.doubled_normal(*t).length());
        let mut smaller = u8::from(areas[0] >= areas[1]);
        let is_closed = part.iter().all(|t| across[*t].len() == 3);
        if is_closed && areas[usize::from(smaller)] > UNDECIDED * (areas[0] + areas[1]) {
            smaller = inward(mesh, &part, &turned);
        }
        for t in part {
            if turned[t] == smaller {
                mesh.triangles[t].swap(1, 2);
                counts.faces_turned += 1;
            }
        }
    }
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
fn neighbours(triangles: &[[u32; 3]]) -> Vec<Vec<(usize, bool)>> {
    let corners = triangles.as_flattened();
    let mut across = vec![Vec::new(); triangles.len()];
    for sides in EdgeTable::new(triangles).edges() {
        if let [one, two] = sides {
            let agrees = corners[one.corners().0] != corners[two.corners().0];
            across[one.triangle()].push((two.triangle(), agrees));
            across[two.triangle()].push((one.triangle(), agrees));
        }
    }
    across
}
