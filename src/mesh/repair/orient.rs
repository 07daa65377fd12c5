//! Turns faces over that disagree with those around them.

use super::counts::RepairCounts;
use crate::TriMesh;
use crate::mesh::half_edges::EdgeTable;

/// Makes the faces of each orientable component agree with the larger part of it by area. A component is what
/// hangs together by edges of two faces: where more meet, or only a vertex, either side is right.
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
        let smaller = u8::from(areas[0] >= areas[1]);
        for t in part {
            if turned[t] == smaller {
                mesh.triangles[t].swap(1, 2);
                counts.faces_turned += 1;
            }
        }
    }
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
