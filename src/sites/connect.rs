//! From faces to triangles: the rotation system of the fans.
//!
//! A fan is the cyclic list of sites behind a face's edges. Keep the edge i–j only if each lists the other;
//! order the kept neighbours of every site by its fan; trace faces by "arrive at j from i, leave to the
//! neighbour just before i in j's counter-clockwise order". Every directed edge lies in exactly one traced
//! face, so the result is a closed surface. It contains the paper's clustering (Sect. 4.4): three faces that
//! meet give a triangle, four or more co-circular sites give a larger face, which is split by quality.

use super::cells::Certificate;
use super::fans::Fans;
use crate::mesh::chunks::par_map_chunks;
use crate::mesh::half_edges::edge_key;
use crate::mesh::quality::TriangleQuality;
use glam::DVec3;
use serde::Serialize;
use std::collections::HashSet;
use std::ops::Range;

/// Counts of what joining the fans to triangles found and did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ConnectCounts {
    /// Fan entries without their counterpart, dropped.
    pub one_sided_edges: usize,
    /// Traced faces of four or more corners, split by quality.
    pub split_faces: usize,
    /// Traced faces that could not be filled without repeating an edge; they are holes in the result.
    pub unfilled_faces: usize,
    /// Sites that no triangle uses; in runs with tangent and power faces they are moved into large triangles.
    pub unconnected_sites: usize,
    /// What certifies the exact cells; `None` if the result is not made of them alone: the faces' fans were
    /// enough, or components were remeshed by local operations.
    pub cells: Option<Certificate>,
}

/// Triangles over the sites, with counts of irregularities.
pub fn connect(sites: &[DVec3], fans: &Fans) -> (Vec<[u32; 3]>, ConnectCounts) {
    let symmetric = fans.symmetric();
    let mut counts = ConnectCounts {
        one_sided_edges: fans.neighbours.len() - symmetric.neighbours.len(),
        ..Default::default()
    };
    // Needed for few surfaces only.
    let mut edges: Option<HashSet<(u32, u32)>> = None;
    let mut triangles = Vec::with_capacity(2 * sites.len());
    for part in par_map_chunks(symmetric.len(), |range| Faces::of(&symmetric, range)) {
        let mut done = 0;
        for (before, face) in part.others {
            triangles.extend_from_slice(&part.triangles[done..before]);
            done = before;
            counts.split_faces += usize::from(face.len() > 3);
            match split(&face, sites, edges.get_or_insert_with(|| edges_of(&symmetric))) {
                Some(parts) => triangles.extend(parts),
                None => counts.unfilled_faces += 1,
            }
        }
        triangles.extend_from_slice(&part.triangles[done..]);
    }
    let mut used = vec![false; sites.len()];
    triangles.iter().flatten().for_each(|v| used[*v as usize] = true);
    counts.unconnected_sites = used.iter().filter(|u| !**u).count();
    (triangles, counts)
}

/// All edges between sites.
fn edges_of(fans: &Fans) -> HashSet<(u32, u32)> {
    (0..fans.len() as u32)
        .flat_map(|i| fans.of(i as usize).iter().map(move |&j| (i, j)))
        .filter(|(i, j)| i < j)
        .map(|(i, j)| edge_key(fans.site(i), fans.site(j)))
        .collect()
}

/// Some faces of the rotation system, in the order of their first directed edge.
#[derive(Default)]
struct Faces {
    triangles: Vec<[u32; 3]>,
    /// Faces that are not triangles, as cycles of sites, each with the number of triangles before it.
    others: Vec<(usize, Vec<u32>)>,
}

impl Faces {
    /// The faces whose first directed edge leaves one of these sites. There are none beyond curves, nor at
    /// the two sides of an edge without triangles.
    fn of(fans: &Fans, sites: Range<usize>) -> Self {
        let mut faces = Self::default();
        let mut face = Vec::new();
        for i in sites {
            for slot in fans.start[i] as usize..fans.start[i + 1] as usize {
                if !trace(fans, i as u32, slot, &mut face) {
                    continue;
                }
                match face[..] {
                    [a, b, c] if a != b && b != c && c != a => faces.triangles.push([a, b, c]),
                    [_, _] => {}
                    _ => faces.others.push((faces.triangles.len(), face.clone())),
                }
            }
        }
        faces
    }
}

/// Sets `face` to the cycle of sites that begins with the directed edge of a slot; false if another of its
/// edges comes first, or if it is beyond a curve.
fn trace(fans: &Fans, from: u32, first: usize, face: &mut Vec<u32>) -> bool {
    face.clear();
    let (mut from, mut slot, mut outside) = (from, first, false);
    // Slots follow each other as a permutation, so that every cycle comes back.
    loop {
        face.push(fans.site(from));
        outside |= fans.is_outside(from, slot);
        let to = fans.neighbours[slot];
        slot = leave(fans, from, to);
        from = to;
        if slot <= first {
            return slot == first && !outside;
        }
    }
}

/// The slot by which a face leaves `at` after arriving from `from`.
fn leave(fans: &Fans, from: u32, at: u32) -> usize {
    let fan = fans.of(at as usize);
    // Fans are symmetric here, so `from` is always found.
    let arrival = fan.iter().position(|&j| j == from).unwrap_or(0);
    fans.start[at as usize] as usize + (arrival + fan.len() - 1) % fan.len()
}

/// Triangulates a face by cutting off ears, the best triangle first, never along an edge that exists. `None`
/// if no ear can be cut, or if the last triangle has a site twice; then no edge was added.
fn split(face: &[u32], sites: &[DVec3], edges: &mut HashSet<(u32, u32)>) -> Option<Vec<[u32; 3]>> {
    let mut rest = face.to_vec();
    let mut triangles = Vec::with_capacity(rest.len().saturating_sub(2));
    let mut added = Vec::new();
    while rest.len() > 3 {
        let ear = (0..rest.len())
            .filter_map(|m| {
                let [a, b, c] = corner(&rest, m);
                let open = a != b && b != c && a != c && !edges.contains(&edge_key(a, c));
                // A face of four has two diagonals, and the better is the one whose worse half is better.
                let other =
                    if rest.len() == 4 { quality(sites, corner(&rest, m + 2)) } else { f64::INFINITY };
                open.then(|| (m, quality(sites, [a, b, c]).min(other)))
            })
            .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        let Some((m, _)) = ear else { break };
        let [a, b, c] = corner(&rest, m);
        triangles.push([a, b, c]);
        edges.insert(edge_key(a, c));
        added.push(edge_key(a, c));
        rest.remove((m + 1) % rest.len());
    }
    if let &[a, b, c] = rest.as_slice()
        && a != b
        && b != c
        && c != a
    {
        triangles.push([a, b, c]);
        return Some(triangles);
    }
    for edge in added {
        edges.remove(&edge);
    }
    None
}

fn corner(cycle: &[u32], m: usize) -> [u32; 3] {
    [0, 1, 2].map(|k| cycle[(m + k) % cycle.len()])
}

fn quality(sites: &[DVec3], triangle: [u32; 3]) -> f64 {
    TriangleQuality::new(triangle.map(|v| sites[v as usize])).q
}
