//! Hand-made meshes with known properties, and a source of repeatable numbers.

use glam::DVec3;
use rtfmesh::TriMesh;
use std::f64::consts::{PI, TAU};

pub fn mesh(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> TriMesh {
    TriMesh {
        vertices: vertices.iter().map(|&v| DVec3::from_array(v)).collect(),
        triangles: triangles.to_vec(),
    }
}

pub fn tetrahedron() -> TriMesh {
    mesh(
        &[[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]],
        &[[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
    )
}

/// The unit cube with outward faces.
pub fn cube() -> TriMesh {
    let vertices: Vec<[f64; 3]> =
        (0..8).map(|k| [f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2 & 1)]).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<[u32; 3]> = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    mesh(&vertices, &triangles)
}

/// The unit sphere by longitude and latitude: the poles, then row after row from -z up, starting at +x.
pub fn globe(around: u32, along: u32) -> TriMesh {
    let mut mesh = TriMesh { vertices: vec![DVec3::NEG_Z, DVec3::Z], triangles: Vec::new() };
    for j in 1..along {
        let (height, radius) = (PI * (f64::from(j) / f64::from(along) - 0.5)).sin_cos();
        for i in 0..around {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(around)).sin_cos();
            mesh.vertices.push(DVec3::new(radius * cos, radius * sin, height));
        }
    }
    let at = |i: u32, j: u32| 2 + (j - 1) * around + i % around;
    for i in 0..around {
        mesh.triangles.push([0, at(i + 1, 1), at(i, 1)]);
        mesh.triangles.push([1, at(i, along - 1), at(i + 1, along - 1)]);
        for j in 1..along - 1 {
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    mesh
}

/// A globe cut open along the meridian of +x, except at its poles; the vertices on the side of -y move by
/// `gap`.
pub fn cut_open(globe: &TriMesh, gap: f64) -> TriMesh {
    let mut cut = globe.clone();
    let count = globe.vertices.len() as u32;
    let on_cut = |v: u32| globe.vertices[v as usize].y.abs() < 1e-9 && globe.vertices[v as usize].x > 1e-9;
    for (t, triangle) in cut.triangles.iter_mut().enumerate() {
        let behind = globe.corners(t).iter().map(|corner| corner.y).sum::<f64>() < 0.0;
        triangle.iter_mut().filter(|v| behind && on_cut(**v)).for_each(|v| *v += count);
    }
    cut.vertices.extend(globe.vertices.iter().map(|v| *v - DVec3::Y * gap));
    cut
}

/// A flat grid over the unit square at height `z`, `n` by `n` quads, facing upwards.
pub fn plane(n: u32, z: f64) -> TriMesh {
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let side = f64::from(n);
    let vertices = (0..=n)
        .flat_map(|i| (0..=n).map(move |j| DVec3::new(f64::from(i) / side, f64::from(j) / side, z)))
        .collect();
    let triangles = (0..n)
        .flat_map(|i| (0..n).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    TriMesh { vertices, triangles }
}

/// A torus of radii 1 and 0.4 with six edges at each vertex.
pub fn torus(n: u32, m: u32) -> TriMesh {
    let at = |i: u32, j: u32| (i % n) * m + j % m;
    let tau = std::f64::consts::TAU;
    let mut torus = TriMesh::default();
    for i in 0..n {
        for j in 0..m {
            let (a, b) = (tau * f64::from(i) / f64::from(n), tau * f64::from(j) / f64::from(m));
            let r = 1.0 + 0.4 * b.cos();
            torus.vertices.push(DVec3::new(r * a.cos(), r * a.sin(), 0.4 * b.sin()));
            let [p, q, r, s] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            torus.triangles.extend([[p, q, r], [p, r, s]]);
        }
    }
    torus
}

/// A tetrahedron split `levels` times, with its vertices moved onto the sphere about the origin.
pub fn sphere(radius: f64, levels: u32) -> TriMesh {
    let mut sphere = tetrahedron();
    for _ in 0..levels {
        let mut middles = std::collections::HashMap::new();
        let mut triangles = Vec::new();
        for [a, b, c] in std::mem::take(&mut sphere.triangles) {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| {
                *middles.entry((p.min(q), p.max(q))).or_insert_with(|| {
                    let middle = sphere.vertices[p as usize] + sphere.vertices[q as usize];
                    sphere.vertices.push(middle.normalize());
                    sphere.vertices.len() as u32 - 1
                })
            });
            triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        sphere.triangles = triangles;
    }
    sphere.vertices.iter_mut().for_each(|v| *v = v.normalize() * radius);
    sphere
}

/// Both meshes in one, without shared vertices.
pub fn union(first: &TriMesh, second: &TriMesh) -> TriMesh {
    let mut both = first.clone();
    let offset = first.vertices.len() as u32;
    both.vertices.extend(&second.vertices);
    both.triangles.extend(second.triangles.iter().map(|t| t.map(|v| v + offset)));
    both
}

pub fn moved(mesh: &TriMesh, map: impl Fn(DVec3) -> DVec3) -> TriMesh {
    TriMesh { vertices: mesh.vertices.iter().map(|&v| map(v)).collect(), triangles: mesh.triangles.clone() }
}

/// Repeatable random numbers: SplitMix64, Steele, Lea and Flood 2014.
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    pub fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }

    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in the cube from -1 to 1.
    pub fn point(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }
}

/// A closed prism over a polygon in the xy-plane, of this height along z.
pub fn prism(polygon: &[[f64; 2]], height: f64) -> TriMesh {
    let n = polygon.len() as u32;
    let mut vertices: Vec<DVec3> =
        [0.0, height].iter().flat_map(|z| polygon.iter().map(move |[x, y]| DVec3::new(*x, *y, *z))).collect();
    let middle = polygon.iter().fold([0.0, 0.0], |sum, p| [sum[0] + p[0], sum[1] + p[1]]);
    let middle = middle.map(|sum| sum / f64::from(n));
    vertices.extend([0.0, height].map(|z| DVec3::new(middle[0], middle[1], z)));
    let mut triangles = Vec::new();
    for k in 0..n {
        let (a, b) = (k, (k + 1) % n);
        triangles.extend([[a, b, n + b], [a, n + b, n + a], [2 * n, b, a], [2 * n + 1, n + a, n + b]]);
    }
    TriMesh { vertices, triangles }
}

/// A gear around the z axis, of radius 1, with narrow tops; `inner` is the radius between its teeth.
pub fn gear(teeth: u32, inner: f64, height: f64) -> TriMesh {
    let turn = TAU / f64::from(teeth);
    let corners =
        |k: u32| [(0.0, inner), (0.475, 1.0), (0.525, 1.0)].map(|(at, r)| (turn * (f64::from(k) + at), r));
    let outline: Vec<[f64; 2]> = (0..teeth)
        .flat_map(corners)
        .map(|(angle, r): (f64, f64)| [r * angle.cos(), r * angle.sin()])
        .collect();
    prism(&outline, height)
}

/// A regular polygon of radius 1.
pub fn regular(sides: u32) -> Vec<[f64; 2]> {
    let angle = |k: u32| TAU * f64::from(k) / f64::from(sides);
    (0..sides).map(|k| [angle(k).cos(), angle(k).sin()]).collect()
}

/// A closed plate with square studs on it, `across` of them in each direction, of this width and height; the
/// plate's sides are 1, and 0.1.
pub fn studs(across: u32, width: f64, height: f64) -> TriMesh {
    const THICK: f64 = 0.1;
    let mut lines = vec![0.0];
    for k in 0..across {
        let middle = (f64::from(k) + 0.5) / f64::from(across);
        lines.extend([middle - 0.5 * width, middle + 0.5 * width]);
    }
    lines.push(1.0);
    let mut vertices: Vec<DVec3> = Vec::new();
    let mut triangles = Vec::new();
    let mut add = |corners: [[f64; 3]; 4]| {
        let [a, b, c, d] = corners.map(DVec3::from).map(|p| {
            let known = vertices.iter().position(|q| *q == p);
            known.unwrap_or_else(|| {
                vertices.push(p);
                vertices.len() - 1
            }) as u32
        });
        triangles.extend([[a, b, c], [a, c, d]]);
    };
    let mut side = |[a, b]: [[f64; 2]; 2], low: f64, high: f64| {
        add([[a[0], a[1], low], [b[0], b[1], low], [b[0], b[1], high], [a[0], a[1], high]]);
    };
    let cells = || (0..lines.len() - 1).flat_map(|i| (0..lines.len() - 1).map(move |j| [i, j]));
    let ring = |[i, j]: [usize; 2]| {
        let (x, y) = ([lines[i], lines[i + 1]], [lines[j], lines[j + 1]]);
        [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]]
    };
    let is_stud = |[i, j]: [usize; 2]| i % 2 == 1 && j % 2 == 1;
    for ring in cells().filter(|cell| is_stud(*cell)).map(ring) {
        (0..4).for_each(|k| side([ring[k], ring[(k + 1) % 4]], THICK, THICK + height));
    }
    for pair in lines.windows(2) {
        let [a, b] = [pair[0], pair[1]];
        for edge in [[[a, 0.0], [b, 0.0]], [[b, 1.0], [a, 1.0]], [[0.0, b], [0.0, a]], [[1.0, a], [1.0, b]]] {
            side(edge, 0.0, THICK);
        }
    }
    for cell in cells() {
        let [a, b, c, d] = ring(cell);
        let top = if is_stud(cell) { THICK + height } else { THICK };
        add([a, b, c, d].map(|[x, y]| [x, y, top]));
        add([d, c, b, a].map(|[x, y]| [x, y, 0.0]));
    }
    TriMesh { vertices, triangles }
}

/// A block with fillets at all edges: `half` its sides without them, their radius, and the facets across each
/// half of one.
pub fn filleted_block(half: DVec3, radius: f64, across: u32) -> TriMesh {
    let coordinates = |half: f64| -> Vec<f64> {
        let fillet = (0..=across).map(|k| radius * f64::from(k) / f64::from(across));
        let below = fillet.clone().map(|off| -half - radius + off);
        below.chain([-half / 3.0, half / 3.0]).chain(fillet.map(|off| half + off)).collect()
    };
    let mut mesh = TriMesh::default();
    for (axis, side) in [(0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0), (2, -1.0), (2, 1.0)] {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (along, beside) = (coordinates(half[u]), coordinates(half[v]));
        let first = mesh.vertices.len() as u32;
        for x in &along {
            for y in &beside {
                let mut p = DVec3::ZERO;
                (p[axis], p[u], p[v]) = (side * (half[axis] + radius), *x, *y);
                let inside = p.clamp(-half, half);
                // Rounded, so that sides agree about the vertices that they share.
                let p = inside + radius * (p - inside).normalize();
                mesh.vertices.push((p * 1e9).round() / 1e9);
            }
        }
        let columns = beside.len() as u32;
        for i in 0..along.len() as u32 - 1 {
            for j in 0..columns - 1 {
                let a = first + i * columns + j;
                let [b, c, d] = [a + columns, a + columns + 1, a + 1];
                let pair = if side > 0.0 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
                mesh.triangles.extend(pair);
            }
        }
    }
    mesh
}
