//! A surface cut along a loop, and both sides capped.

use crate::mesh::TriMesh;
use crate::mesh::bvh::{Aabb, Bvh};
use crate::mesh::half_edges::{next, previous};
use crate::mesh::intersections::any_intersects;
use glam::DVec3;

/// The sides move apart by one of these fractions of the way to their neighbours, the first with which
/// nothing intersects: caps at one place would touch.
const APART: [f64; 3] = [0.5, 0.25, 0.1];

/// One side of a cut.
struct Side {
    /// The vertices of the loop, in the order that the triangles closing it have.
    around: Vec<u32>,
    /// For each, the middle of its neighbours that are not on the loop; its own place without any.
    beyond: Vec<DVec3>,
    /// The vertex in the middle of the cap; none if that is one triangle.
    centre: Option<u32>,
}

/// Cuts the surface along a loop of three or more vertices with complete fans, and caps both sides; returns
/// false, and leaves all as it is, if the caps would meet other triangles. `tree` is of the mesh, or was
/// before some other cuts; `at` has a triangle at each vertex.
pub(super) fn cut_along(
    mesh: &mut TriMesh,
    tree: &Bvh,
    twins: &[u32],
    at: impl Fn(u32) -> u32,
    around: &[u32],
) -> bool {
    let count = around.len();
    let fans: Vec<[Vec<u32>; 2]> = (0..count)
        .map(|k| {
            let beside = [around[(k + 1) % count], around[(k + count - 1) % count]];
            sides(mesh, twins, (around[k], at(around[k])), beside)
        })
        .collect();
    let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
    let mut near = near(mesh, tree, around);
    let places: Vec<DVec3> = around.iter().map(|v| mesh.vertices[*v as usize]).collect();
    mesh.vertices.extend_from_slice(&places);
    let copies: Vec<u32> = (vertices as u32..).take(count).collect();
    relabel(mesh, &fans, &copies);
    let mut right = Side::new(mesh, &places, around, fans.iter().map(|[_, right]| right));
    let mut left = Side::new(mesh, &places, &copies, fans.iter().map(|[left, _]| left));
    left.around.reverse();
    left.beyond.reverse();
    let reversed: Vec<DVec3> = places.iter().rev().copied().collect();
    right.cap(mesh);
    left.cap(mesh);
    near.extend(triangles as u32..mesh.triangles.len() as u32);
    let is_apart = APART.iter().any(|apart| {
        right.move_apart(mesh, &places, *apart);
        left.move_apart(mesh, &reversed, *apart);
        !meets_others(mesh, &near, vertices as u32, around)
    });
    if !is_apart {
        mesh.triangles.truncate(triangles);
        mesh.vertices.truncate(vertices);
        relabel(mesh, &fans, around);
        around.iter().zip(places).for_each(|(v, place)| mesh.vertices[*v as usize] = place);
    }
    is_apart
}

impl Side {
    fn new<'a>(
        mesh: &TriMesh,
        places: &[DVec3],
        around: &[u32],
        fans: impl Iterator<Item = &'a Vec<u32>>,
    ) -> Self {
        let corners = mesh.triangles.as_flattened();
        let beyond = |(fan, place): (&Vec<u32>, &DVec3)| {
            let ends = fan.iter().flat_map(|corner| [next(*corner), previous(*corner)]);
            let ends = ends.map(|c| corners[c as usize]).filter(|w| !around.contains(w));
            let ends: Vec<DVec3> = ends.map(|w| mesh.vertices[w as usize]).collect();
            if ends.is_empty() { *place } else { ends.iter().sum::<DVec3>() / ends.len() as f64 }
        };
        Self { around: around.to_vec(), beyond: fans.zip(places).map(beyond).collect(), centre: None }
    }

    /// Adds triangles that close the side.
    fn cap(&mut self, mesh: &mut TriMesh) {
        if let [a, b, c] = self.around[..] {
            mesh.triangles.push([a, b, c]);
            return;
        }
        let centre = mesh.vertices.len() as u32;
        mesh.vertices.push(DVec3::ZERO);
        let ends = self.around.iter().zip(self.around.iter().cycle().skip(1));
        mesh.triangles.extend(ends.map(|(v, w)| [*v, *w, centre]));
        self.centre = Some(centre);
    }

    /// Moves the side from where the loop was.
    fn move_apart(&self, mesh: &mut TriMesh, places: &[DVec3], apart: f64) {
        let mut sum = DVec3::ZERO;
        for (v, (place, beyond)) in self.around.iter().zip(places.iter().zip(&self.beyond)) {
            let to = place.lerp(*beyond, apart);
            mesh.vertices[*v as usize] = to;
            sum += to;
        }
        if let Some(centre) = self.centre {
            mesh.vertices[centre as usize] = sum / self.around.len() as f64;
        }
    }
}

/// Gives the corners to the left of a loop these vertices.
fn relabel(mesh: &mut TriMesh, fans: &[[Vec<u32>; 2]], vertices: &[u32]) {
    let corners = mesh.triangles.as_flattened_mut();
    for ([left, _], v) in fans.iter().zip(vertices) {
        left.iter().for_each(|corner| corners[*corner as usize] = *v);
    }
}

/// The triangles around a loop, up to its own size away.
fn near(mesh: &TriMesh, tree: &Bvh, around: &[u32]) -> Vec<u32> {
    let at = || around.iter().map(|v| mesh.vertices[*v as usize]);
    let (min, max) =
        at().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let wide = max.distance(min);
    let mut near = Vec::new();
    tree.overlapping(&Aabb { min: min - wide, max: max + wide }, |t| near.push(t));
    near
}

/// Whether one of these triangles with a vertex of a cut intersects another: with one `from` on, or on its
/// loop.
fn meets_others(mesh: &TriMesh, near: &[u32], from: u32, around: &[u32]) -> bool {
    let triangles: Vec<[u32; 3]> = near.iter().map(|t| mesh.triangles[*t as usize]).collect();
    let is_moved = |t: &usize| triangles[*t].iter().any(|v| *v >= from || around.contains(v));
    let moved: Vec<usize> = (0..triangles.len()).filter(is_moved).collect();
    any_intersects(&triangles, &moved, |v| mesh.vertices[v as usize])
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
