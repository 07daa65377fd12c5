//! A surface cut along a loop, and both sides capped.

use crate::mesh::TriMesh;
use crate::mesh::half_edges::{next, previous};
use glam::DVec3;

/// The sides move apart by this fraction of the way to their neighbours: caps at one place would touch.
const APART: f64 = 0.5;

/// Cuts the surface along a loop of three or more vertices with complete fans, and caps both sides. `at` has
/// a triangle at each vertex.
pub(super) fn cut_along(mesh: &mut TriMesh, twins: &[u32], at: impl Fn(u32) -> u32, around: &[u32]) {
    let count = around.len();
    let fans: Vec<[Vec<u32>; 2]> = (0..count)
        .map(|k| {
            let beside = [around[(k + 1) % count], around[(k + count - 1) % count]];
            sides(mesh, twins, (around[k], at(around[k])), beside)
        })
        .collect();
    let copies: Vec<u32> = (mesh.vertices.len() as u32..).take(count).collect();
    let places: Vec<DVec3> = around.iter().map(|v| mesh.vertices[*v as usize]).collect();
    mesh.vertices.extend(places);
    let corners = mesh.triangles.as_flattened_mut();
    for ([left, _], copy) in fans.iter().zip(&copies) {
        left.iter().for_each(|corner| corners[*corner as usize] = *copy);
    }
    for (side, own) in [(1, around), (0, &copies)] {
        let moved: Vec<DVec3> =
            fans.iter().zip(own).map(|(fans, v)| drawn_back(mesh, *v, &fans[side], own)).collect();
        own.iter().zip(moved).for_each(|(v, moved)| mesh.vertices[*v as usize] = moved);
    }
    cap(mesh, around.iter().copied());
    cap(mesh, copies.into_iter().rev());
}

/// The corners at a vertex of the triangles to the left and to the right of the way to it from the second of
/// these neighbours and on to the first.
fn sides(mesh: &TriMesh, twins: &[u32], (v, triangle): (u32, u32), [to, from]: [u32; 2]) -> [Vec<u32>; 2] {
    let corners = mesh.triangles.as_flattened();
    let Some(start) = (3 * triangle..3 * triangle + 3).find(|corner| corners[*corner as usize] == v) else {
        return Default::default();
    };
    let mut ring = vec![start];
    loop {
        let beyond = twins[previous(ring[ring.len() - 1]) as usize];
        if beyond == start {
            break;
        }
        ring.push(beyond);
    }
    let leading_to = |ring: &[u32], w| ring.iter().position(|h| corners[next(*h) as usize] == w).unwrap_or(0);
    let first = leading_to(&ring, to);
    ring.rotate_left(first);
    let right = ring.split_off(leading_to(&ring, from));
    [ring, right]
}

/// Where a vertex of the loop moves to, towards the neighbours that are not on it.
fn drawn_back(mesh: &TriMesh, v: u32, fan: &[u32], around: &[u32]) -> DVec3 {
    let corners = mesh.triangles.as_flattened();
    let ends = fan.iter().flat_map(|corner| [next(*corner), previous(*corner)]).map(|c| corners[c as usize]);
    let beyond: Vec<DVec3> =
        ends.filter(|w| !around.contains(w)).map(|w| mesh.vertices[w as usize]).collect();
    let own = mesh.vertices[v as usize];
    if beyond.is_empty() {
        return own;
    }
    own.lerp(beyond.iter().sum::<DVec3>() / beyond.len() as f64, APART)
}

/// Closes a loop, in the order that the triangles closing it have.
fn cap(mesh: &mut TriMesh, around: impl ExactSizeIterator<Item = u32>) {
    let around: Vec<u32> = around.collect();
    if let [a, b, c] = around[..] {
        mesh.triangles.push([a, b, c]);
        return;
    }
    let sum: DVec3 = around.iter().map(|v| mesh.vertices[*v as usize]).sum();
    let centre = mesh.vertices.len() as u32;
    mesh.vertices.push(sum / around.len() as f64);
    for (k, v) in around.iter().enumerate() {
        mesh.triangles.push([*v, around[(k + 1) % around.len()], centre]);
    }
}
