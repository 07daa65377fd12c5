//! Curves where three labels or more meet, made smooth. Their vertices are where three rounded fields are
//! equal, which is not as smooth as the fields.

use glam::DVec3;

use super::extract::Borders;
use crate::mesh::half_edges::EdgeTable;

/// Pairs of steps, one that shrinks and one that grows as much (Taubin 1995).
const PAIRS: usize = 60;
const SHRINKING: f64 = 0.5;
const GROWING: f64 = -0.505;
/// Vertices of the borders move, too, up to so many edges away from a curve.
const RINGS: usize = 3;

/// Smooths the curves of a volume of this size, and the borders near them. Ends of curves, points where
/// curves meet, and what lies at the volume's border stay.
pub(super) fn smooth(borders: &mut Borders, size: [usize; 3]) {
    let edges = EdgeTable::new(&borders.triangles);
    let many = edges.edges().filter(|edge| edge.len() > 2);
    let curves: Vec<[u32; 2]> = many.map(|edge| <[u32; 2]>::from(edge[0].ends())).collect();
    if curves.is_empty() {
        return;
    }
    let mut degree = vec![0_u32; borders.vertices.len()];
    curves.as_flattened().iter().for_each(|v| degree[*v as usize] += 1);
    let is_open = edges.edges().filter(|edge| edge.len() == 1);
    let open: Vec<u32> = is_open.flat_map(|edge| <[u32; 2]>::from(edge[0].ends())).collect();
    let near = near(borders, &degree);
    let mut is_free: Vec<bool> = near.iter().map(|ring| *ring <= RINGS).collect();
    open.iter().for_each(|v| is_free[*v as usize] = false);
    for (v, place) in borders.vertices.iter().enumerate() {
        let is_border = |axis: usize| place[axis] <= 0.0 || place[axis] >= size[axis] as f64 - 1.0;
        is_free[v] &= matches!(degree[v], 0 | 2) && !(0..3).any(is_border);
    }
    let is_local =
        |triangle: &&[u32; 3]| triangle.iter().any(|v| is_free[*v as usize] && degree[*v as usize] == 0);
    let local: Vec<[u32; 3]> = borders.triangles.iter().filter(is_local).copied().collect();
    let mut sums = vec![(DVec3::ZERO, 0_u32); borders.vertices.len()];
    let free: Vec<u32> = (0..is_free.len() as u32).filter(|v| is_free[*v as usize]).collect();
    for step in 0..2 * PAIRS {
        free.iter().for_each(|v| sums[*v as usize] = (DVec3::ZERO, 0));
        let mut add = |to: u32, from: u32| {
            let sum = &mut sums[to as usize];
            *sum = (sum.0 + borders.vertices[from as usize], sum.1 + 1);
        };
        for [a, b] in &curves {
            add(*a, *b);
            add(*b, *a);
        }
        for triangle in &local {
            for k in 0..3 {
                let (to, others) = (triangle[k], [triangle[(k + 1) % 3], triangle[(k + 2) % 3]]);
                // Curves follow curves alone.
                if degree[to as usize] == 0 {
                    others.iter().for_each(|from| add(to, *from));
                }
            }
        }
        let share = if step % 2 == 0 { SHRINKING } else { GROWING };
        for v in &free {
            let (sum, count) = sums[*v as usize];
            let place = &mut borders.vertices[*v as usize];
            *place += share * (sum / f64::from(count.max(1)) - *place) * f64::from(count.min(1));
        }
    }
}

/// How many edges each vertex is away from a curve, as far as that matters.
fn near(borders: &Borders, degree: &[u32]) -> Vec<usize> {
    let mut rings: Vec<usize> =
        degree.iter().map(|degree| if *degree > 0 { 0 } else { usize::MAX }).collect();
    for ring in 0..RINGS {
        for triangle in &borders.triangles {
            if triangle.iter().any(|v| rings[*v as usize] == ring) {
                triangle.iter().for_each(|v| rings[*v as usize] = rings[*v as usize].min(ring + 1));
            }
        }
    }
    rings
}
