//! From one level to the next: a new site at the middle of every edge.

use crate::TriMesh;
use crate::mesh::edges::EdgeTable;
use crate::stages::seed::Seeds;

/// The vertices of `mesh`, which lie on the surface's triangles `under`, and new sites at the middles of its edges:
/// `count` in all, which must be at least the number of vertices. Where there are not enough edges for that, the largest
/// triangles get a site in their middle; where there are too many, the shortest edges get none.
///
/// The middle of an edge is off the surface; its triangle is that of one end, from where the surface leads to it.
pub(super) fn refine(mesh: &TriMesh, under: &[u32], count: usize) -> Seeds {
    let mut sites = mesh.vertices.clone();
    let mut triangles = under.to_vec();
    let mut edges: Vec<(u32, u32)> =
        EdgeTable::new(&mesh.triangles).edges().filter_map(|e| e.first().map(|side| side.ends())).collect();
    let wanted = count - sites.len();
    if edges.len() > wanted {
        let length_sq =
            |(a, b): (u32, u32)| mesh.vertices[a as usize].distance_squared(mesh.vertices[b as usize]);
        edges.sort_by(|a, b| length_sq(*b).total_cmp(&length_sq(*a)).then(a.cmp(b)));
        edges.truncate(wanted);
    }
    for (a, b) in edges {
        sites.push(0.5 * (mesh.vertices[a as usize] + mesh.vertices[b as usize]));
        triangles.push(under[a as usize]);
    }
    let mut largest: Vec<(f64, usize)> = (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            ((b - a).cross(c - a).length_squared(), t)
        })
        .collect();
    largest.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    for (round, (_, t)) in (0..).flat_map(|round| largest.iter().map(move |l| (round, l))) {
        if sites.len() >= count {
            break;
        }
        // More than one in a triangle go towards different corners.
        let corners = mesh.corners(*t);
        let towards = corners[round % 3] / (3 + round) as f64;
        sites.push((corners[0] + corners[1] + corners[2]) / 3.0 * (1.0 - 1.0 / (3 + round) as f64) + towards);
        triangles.push(under[mesh.triangles[*t][round % 3] as usize]);
    }
    Seeds { sites, triangles }.in_space_order()
}

/// Sites of every level, from the coarsest to `count`: refining a closed mesh of one of them makes the next one or a few
/// less. Levels end before the next coarser one would have fewer than `coarsest` sites.
pub(super) fn level_counts(count: usize, euler: i64, coarsest: usize) -> Vec<usize> {
    let mut counts = vec![count];
    // V' = 4 V - 3 χ, so V - χ grows by four.
    let mut finest = count;
    // More parts than vertices make it grow towards the coarser side.
    while let Some(next) = coarser(finest, euler).filter(|c| (coarsest..finest).contains(c)) {
        counts.push(next);
        finest = next;
    }
    counts.reverse();
    counts
}

fn coarser(count: usize, euler: i64) -> Option<usize> {
    usize::try_from((count as i64 - euler).div_euclid(4) + euler).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn tetrahedron() -> TriMesh {
        TriMesh {
            vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y, 3.0 * DVec3::Z],
            triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        }
    }

    #[test]
    fn edges_first_then_large_triangles() {
        for (count, edges) in [(4, 0), (6, 2), (10, 6), (13, 6), (20, 6)] {
            let seeds = refine(&tetrahedron(), &[5, 6, 7, 8], count);
            assert_eq!((seeds.sites.len(), seeds.triangles.len()), (count, count));
            let corners = tetrahedron().vertices;
            let middles = (0..4).flat_map(|a| (0..a).map(move |b| (a, b)));
            let found = middles.filter(|(a, b)| seeds.sites.contains(&(0.5 * (corners[*a] + corners[*b]))));
            assert_eq!(found.count(), edges, "{count} sites");
            assert!(seeds.triangles.iter().all(|t| (5..9).contains(t)));
            let mut sorted: Vec<_> = seeds.sites.iter().map(|s| s.to_array().map(f64::to_bits)).collect();
            sorted.sort_unstable();
            sorted.dedup();
            assert_eq!(sorted.len(), count, "sites on one spot");
        }
    }

    #[test]
    fn levels_multiply_by_four_but_for_the_euler_characteristic() {
        assert_eq!(level_counts(10_000, 0, 300), [625, 2500, 10_000]);
        assert_eq!(level_counts(10_002, 2, 300), [627, 2502, 10_002]);
        assert_eq!(level_counts(100, 2, 300), [100]);
        assert_eq!(level_counts(1000, -16, 100), [238, 1000]);
        assert_eq!(level_counts(4, 2, 4), [4]);
        assert_eq!(level_counts(1000, 1000, 300), [1000], "as many parts as vertices");
        assert_eq!(level_counts(1000, 2000, 300), [1000]);
    }
}
