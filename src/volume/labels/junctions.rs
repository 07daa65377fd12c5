//! Curves where three labels or more meet, made smooth. Their vertices are where three rounded fields are
//! equal, which is not as smooth as the fields.

use glam::DVec3;
use rayon::prelude::*;

use super::extract::Borders;
use crate::mesh::csr::Csr;
use crate::mesh::half_edges::EdgeTable;

/// Pairs of steps, one that shrinks and one that grows as much (Taubin 1995).
const PAIRS: usize = 60;
const SHRINKING: f64 = 0.5;
const GROWING: f64 = -0.505;
/// Vertices of the borders move, too, up to this many edges away from a curve.
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
    is_free.iter_mut().zip(&borders.is_sharp).for_each(|(free, sharp)| *free &= !sharp);
    for (v, place) in borders.vertices.iter().enumerate() {
        let is_border = |axis: usize| place[axis] <= 0.0 || place[axis] >= size[axis] as f64 - 1.0;
        is_free[v] &= matches!(degree[v], 0 | 2) && !(0..3).any(is_border);
    }
    let free: Vec<u32> = (0..is_free.len() as u32).filter(|v| is_free[*v as usize]).collect();
    let linked = links(borders, &curves, &degree, &is_free);
    let mut moved = vec![DVec3::ZERO; free.len()];
    for step in 0..2 * PAIRS {
        let share = if step % 2 == 0 { SHRINKING } else { GROWING };
        let vertices = &borders.vertices;
        let place = |(v, moved): (&u32, &mut DVec3)| {
            let (own, others) = (vertices[*v as usize], linked.of(*v));
            let mean = others.iter().map(|from| vertices[*from as usize]).sum::<DVec3>()
                / others.len().max(1) as f64;
            *moved = if others.is_empty() { own } else { own + share * (mean - own) };
        };
        free.par_iter().zip(&mut moved).for_each(place);
        free.iter().zip(&moved).for_each(|(v, place)| borders.vertices[*v as usize] = *place);
    }
}

/// For each free vertex, those that it is drawn to: on a curve its neighbours along the curve, elsewhere the
/// vertices of each of its triangles.
fn links(borders: &Borders, curves: &[[u32; 2]], degree: &[u32], is_free: &[bool]) -> Csr {
    let mut links = Vec::new();
    let mut add = |to: u32, from: u32| {
        if is_free[to as usize] {
            links.push((to, from));
        }
    };
    for [a, b] in curves {
        add(*a, *b);
        add(*b, *a);
    }
    for triangle in &borders.triangles {
        for k in 0..3 {
            // Curves follow curves alone.
            if degree[triangle[k] as usize] == 0 {
                add(triangle[k], triangle[(k + 1) % 3]);
                add(triangle[k], triangle[(k + 2) % 3]);
            }
        }
    }
    Csr::group(is_free.len(), links.into_iter())
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
