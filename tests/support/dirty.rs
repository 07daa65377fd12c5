//! Surfaces as files have them: several bodies, apart or through each other, with needles, thin plates and
//! caps, and with the defects that exports and scans leave behind.

use super::shapes::{Random, cube, mesh, moved, sphere, torus, union};
use glam::{DQuat, DVec3};
use rtfmesh::TriMesh;

/// Where the bodies are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Arrangement {
    /// Anywhere in a box that is too small for them.
    Through,
    /// In a row, with gaps of this share of their size between them.
    Row(f64),
    /// Small ones around a large one.
    Around,
}

/// What is wrong with the triangles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Defect {
    None,
    /// Each has corners of its own, off by this share of the size.
    Shattered(f64),
    /// One in ten is there twice.
    Doubled,
    /// One in ten is turned over.
    Turned,
    /// One in fifty is missing.
    Missing,
    /// One in ten has a vertex in the middle of an edge that its neighbour there does not have.
    Joints,
}

/// A surface by its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Dirty {
    pub bodies: usize,
    pub arrangement: Arrangement,
    pub defect: Defect,
    pub seed: u64,
}

impl Dirty {
    pub fn mesh(&self) -> TriMesh {
        let mut random = Random(self.seed);
        let mut all = TriMesh::default();
        let mut along = 0.0;
        for k in 0..self.bodies {
            let size = match self.arrangement {
                Arrangement::Around if k == 0 => 4.0,
                Arrangement::Around => 10f64.powf(-2.0 * random.unit()),
                _ => 0.5 + random.unit(),
            };
            let body = moved(&body(&mut random), |v| size * v);
            let turn = DQuat::from_scaled_axis(3.0 * random.point());
            let body = moved(&body, |v| turn * v);
            let [low, high] = body.bounds().unwrap();
            let offset = match self.arrangement {
                Arrangement::Through => random.point(),
                Arrangement::Row(gap) => {
                    let offset = along - low.x;
                    along += high.x - low.x + gap * size;
                    DVec3::X * offset
                }
                Arrangement::Around if k == 0 => DVec3::ZERO,
                Arrangement::Around => 7.0 * random.point().normalize_or(DVec3::X),
            };
            all = union(&all, &moved(&body, |v| v + offset));
        }
        self.spoilt(all, &mut random)
    }

    fn spoilt(&self, mesh: TriMesh, random: &mut Random) -> TriMesh {
        let TriMesh { vertices, triangles } = &mesh;
        let mut chosen = |one_in: u64| random.below(one_in) == 0;
        match self.defect {
            Defect::None => mesh,
            Defect::Shattered(off) => {
                let [low, high] = mesh.bounds().unwrap();
                let off = off * low.distance(high);
                let vertices = triangles.as_flattened().iter().map(|v| vertices[*v as usize]);
                let vertices: Vec<DVec3> = vertices.map(|v| v + off * random.point()).collect();
                let triangles =
                    (0..vertices.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
                TriMesh { vertices, triangles }
            }
            Defect::Doubled => {
                let again: Vec<[u32; 3]> = triangles.iter().copied().filter(|_| chosen(10)).collect();
                TriMesh { triangles: [triangles.clone(), again].concat(), ..mesh }
            }
            Defect::Turned => {
                let turned = |[a, b, c]: [u32; 3]| if chosen(10) { [a, c, b] } else { [a, b, c] };
                TriMesh { triangles: triangles.iter().copied().map(turned).collect(), ..mesh }
            }
            Defect::Missing => {
                TriMesh { triangles: triangles.iter().copied().filter(|_| !chosen(50)).collect(), ..mesh }
            }
            Defect::Joints => {
                let mut vertices = vertices.clone();
                let mut split = Vec::new();
                for [a, b, c] in triangles.iter().copied() {
                    if chosen(10) {
                        let middle = vertices.len() as u32;
                        vertices.push(vertices[a as usize].midpoint(vertices[b as usize]));
                        split.extend([[a, middle, c], [middle, b, c]]);
                    } else {
                        split.push([a, b, c]);
                    }
                }
                TriMesh { vertices, triangles: split }
            }
        }
    }
}

/// Some body about the origin, of a size of about one.
fn body(random: &mut Random) -> TriMesh {
    match random.below(7) {
        0 => moved(&cube(), |v| v - 0.5),
        1 => sphere(0.5, 3),
        2 => moved(&torus(20, 12), |v| 0.3 * v),
        // A plate to a two-thousandth as thick as it is wide.
        3 => {
            let thickness = 10f64.powf(-1.0 - 2.3 * random.unit());
            moved(&cube(), |v| (v - 0.5) * DVec3::new(1.0, 0.7, thickness))
        }
        4 => needle(random),
        5 => moved(&cylinder(3 + random.below(30) as u32), |v| v - 0.5 * DVec3::Z),
        // A ball with a flat face, all of it one fan of slivers.
        _ => moved(&sphere(0.5, 3), |v| DVec3::new(v.x, v.y, v.z.min(0.2))),
    }
}

/// A ball with a thin pin on it.
fn needle(random: &mut Random) -> TriMesh {
    let mut ball = sphere(0.3, 3);
    let tip =
        (0..ball.vertices.len()).max_by(|a, b| ball.vertices[*a].z.total_cmp(&ball.vertices[*b].z)).unwrap();
    ball.vertices[tip].z += 0.1 + 0.6 * random.unit();
    ball
}

/// A prism of this many sides, with fans of long triangles for its ends.
fn cylinder(sides: u32) -> TriMesh {
    let angle = |k: u32| std::f64::consts::TAU * f64::from(k) / f64::from(sides);
    let ring = |z: f64| (0..sides).map(move |k| [0.4 * angle(k).cos(), 0.4 * angle(k).sin(), z]);
    let vertices: Vec<[f64; 3]> = ring(0.0).chain(ring(1.0)).collect();
    let mut triangles = Vec::new();
    for k in 0..sides {
        let [a, b] = [k, (k + 1) % sides];
        triangles.extend([[a, b, sides + b], [a, sides + b, sides + a]]);
    }
    for k in 1..sides - 1 {
        triangles.extend([[0, k + 1, k], [sides, sides + k, sides + k + 1]]);
    }
    mesh(&vertices, &triangles)
}
