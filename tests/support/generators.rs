//! Surfaces of known topology from a few parameters, for property tests.

use super::shapes::{moved, plane, sphere, union};
use glam::{DQuat, DVec3};
use rtfmesh::TriMesh;
use rtfmesh::mesh::repair::repair;
use std::collections::HashMap;

/// A surface and its parameters.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A plate with this many holes through it, `thickness` of its width high; smoothed in `rounds`.
    Plate { holes: u32, thickness: f64, parts: u32, rounds: u32 },
    /// A sheet with this many holes in it, bent by `bend`.
    Sheet { holes: u32, bend: f64, parts: u32 },
    /// Two sheets, or spheres inside each other, `gap` apart.
    Near { gap: f64, closed: bool },
    /// A bar with a triangle for its cross-section, this many degrees sharp.
    Wedge { degrees: f64, length: f64, parts: u32 },
    /// Pages of a book, their angles in degrees.
    Book { pages: Vec<f64>, parts: u32 },
    /// Spheres of these radii, apart from each other.
    Spheres { radii: Vec<f64> },
}

impl Shape {
    pub fn mesh(&self) -> TriMesh {
        // Rotated, so that nothing is parallel to an axis.
        let rotation = DQuat::from_axis_angle(DVec3::new(0.3, 0.9, 0.2).normalize(), 0.7);
        moved(&self.axis_aligned(), |v| rotation * v)
    }

    fn axis_aligned(&self) -> TriMesh {
        match self {
            Self::Plate { holes, thickness, parts, rounds } => {
                let all = (0..=2 * holes).flat_map(|x| (0..3).map(move |y| [x, y]));
                let cells: Vec<[u32; 2]> = all.filter(|[x, y]| x % 2 == 0 || *y != 1).collect();
                let plate = slab(&cells, *parts);
                let smooth = (0..*rounds).fold(plate, |mesh, _| relaxed(&mesh));
                moved(&smooth, |v| DVec3::new(v.x, v.y, 3.0 * thickness * v.z))
            }
            Self::Sheet { holes, bend, parts } => {
                let all = (0..=2 * holes).flat_map(|x| (0..3).map(move |y| [x, y]));
                let cells: Vec<[u32; 2]> = all.filter(|[x, y]| x % 2 == 0 || *y != 1).collect();
                let mut flat = slab(&cells, *parts);
                let top: Vec<bool> = flat.vertices.iter().map(|v| v.z == 1.0).collect();
                flat.triangles.retain(|t| t.iter().all(|v| top[*v as usize]));
                let sheet = repair(&flat).unwrap().mesh;
                moved(&sheet, |v| DVec3::new(v.x, v.y, bend * ((1.3 * v.x).sin() + (1.1 * v.y).cos())))
            }
            Self::Near { gap, closed: false } => union(&plane(12, 0.0), &plane(10, *gap)),
            Self::Near { gap, closed: true } => {
                // The inner one faces inwards, as the inside of a hollow ball.
                let mut inner = sphere(1.0 - gap, 4);
                inner.triangles.iter_mut().for_each(|t| t.swap(1, 2));
                union(&sphere(1.0, 4), &inner)
            }
            Self::Wedge { degrees, length, parts } => wedge(*degrees, *length, *parts),
            Self::Book { pages, parts } => {
                let page = |degrees: &f64| {
                    let (sin, cos) = degrees.to_radians().sin_cos();
                    moved(&plane(*parts, 0.0), |v| DVec3::new(v.x * cos, v.y, v.x * sin))
                };
                let all = pages.iter().map(page).reduce(|all, page| union(&all, &page)).unwrap();
                repair(&all).unwrap().mesh
            }
            Self::Spheres { radii } => {
                let place = |i: usize| DVec3::new((i % 7) as f64, (i / 7) as f64, 0.1 * (i % 3) as f64);
                let ball = |(i, r): (usize, &f64)| {
                    moved(&sphere(0.45 * r, if *r > 0.3 { 4 } else { 3 }), |v| v + place(i))
                };
                radii.iter().enumerate().map(ball).reduce(|all, ball| union(&all, &ball)).unwrap()
            }
        }
    }
}

/// The boundary of unit cells side by side, with `parts` quads per side.
fn slab(cells: &[[u32; 2]], parts: u32) -> TriMesh {
    let mut quads: HashMap<[[u32; 3]; 4], [[u32; 3]; 4]> = HashMap::new();
    // No closure: rustc 1.95 lets one change the caller's copy of an argument in memory
    // (rust-lang/rust#155241).
    fn step(mut p: [u32; 3], axis: usize, by: u32) -> [u32; 3] {
        p[axis] += by;
        p
    }
    for [x, y] in cells {
        for (i, j, k) in (0..parts).flat_map(|i| (0..parts).flat_map(move |j| (0..1).map(move |k| (i, j, k))))
        {
            let low = [x * parts + i, y * parts + j, k];
            for axis in 0..3 {
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                for far in 0..2 {
                    let a = step(low, axis, far);
                    let mut quad = [a, step(a, u, 1), step(step(a, u, 1), v, 1), step(a, v, 1)];
                    if far == 0 {
                        quad.reverse();
                    }
                    let mut key = quad;
                    key.sort_unstable();
                    // Shared by two cells: inside.
                    if quads.remove(&key).is_none() {
                        quads.insert(key, quad);
                    }
                }
            }
        }
    }
    let mut quads: Vec<[[u32; 3]; 4]> = quads.into_values().collect();
    quads.sort_unstable();
    let mut number: HashMap<[u32; 3], u32> = HashMap::new();
    let mut mesh = TriMesh::default();
    let side = f64::from(parts);
    for quad in quads {
        let [a, b, c, d] = quad.map(|p| {
            *number.entry(p).or_insert_with(|| {
                mesh.vertices.push(DVec3::new(
                    f64::from(p[0]) / side,
                    f64::from(p[1]) / side,
                    f64::from(p[2]),
                ));
                mesh.vertices.len() as u32 - 1
            })
        });
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

/// Every vertex moves half of the way to the mean of its neighbours.
fn relaxed(mesh: &TriMesh) -> TriMesh {
    let mut sums = vec![(DVec3::ZERO, 0.0); mesh.vertices.len()];
    for [a, b, c] in &mesh.triangles {
        for (v, w) in [(a, b), (b, c), (c, a), (b, a), (c, b), (a, c)] {
            sums[*v as usize].0 += mesh.vertices[*w as usize];
            sums[*v as usize].1 += 1.0;
        }
    }
    let vertices = mesh.vertices.iter().zip(sums).map(|(v, (sum, count))| v.lerp(sum / count, 0.5)).collect();
    TriMesh { vertices, triangles: mesh.triangles.clone() }
}

/// A bar over the unit triangle with this angle, closed at both ends.
fn wedge(degrees: f64, length: f64, parts: u32) -> TriMesh {
    let half = 0.5 * degrees.to_radians();
    let corners = [[0.0, 0.0], [half.cos(), -half.sin()], [half.cos(), half.sin()]];
    let along = f64::from(parts);
    // A fan around the middle closes each end.
    let ring = 3 * parts;
    let mut mesh = TriMesh::default();
    for s in 0..=parts {
        for k in 0..ring {
            let (side, share) = ((k / parts) as usize, f64::from(k % parts) / along);
            let [p, q] = [corners[side], corners[(side + 1) % 3]];
            let mix = |axis: usize| p[axis] + share * (q[axis] - p[axis]);
            mesh.vertices.push(DVec3::new(mix(0), mix(1), length * f64::from(s) / along));
        }
    }
    for s in 0..parts {
        for k in 0..ring {
            let at = |s: u32, k: u32| s * ring + k % ring;
            let [a, b, c, d] = [at(s, k), at(s, k + 1), at(s + 1, k + 1), at(s + 1, k)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    for (s, z) in [(0, 0.0), (parts, length)] {
        let middle = mesh.vertices.len() as u32;
        mesh.vertices.push(DVec3::new(2.0 * half.cos() / 3.0, 0.0, z));
        for k in 0..ring {
            let [a, b] = [s * ring + k, s * ring + (k + 1) % ring];
            mesh.triangles.push(if s == 0 { [b, a, middle] } else { [a, b, middle] });
        }
    }
    mesh
}
