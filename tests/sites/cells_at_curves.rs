//! Connected cells between curves: the input's topology and curves, wherever the sites inside are.

use crate::support::shapes::{cube, moved, plane, sphere, torus, union};
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rtfmesh::mesh::features::{Curve, CurveKind, FeatureOptions, Features, find_features, spacing_of};
use rtfmesh::mesh::repair::repair;
use rtfmesh::mesh::topology::topology;
use rtfmesh::sites::cells::{CellSites, CellSurface, ConnectedCells, Encroached, connected_cells};
use rtfmesh::sites::connect::{ConnectCounts, connect};
use rtfmesh::sites::place::Place;
use rtfmesh::{ProgressToken, TriMesh};
use std::collections::{HashMap, HashSet};

/// Sites on the curves of a surface at equal distances, and scattered ones between them.
pub struct Scene {
    pub mesh: TriMesh,
    pub normals: Vec<DVec3>,
    pub features: Features,
    pub spacing: f64,
    pub sites: Vec<DVec3>,
    pub places: Vec<Place>,
    /// Neighbours along the curves.
    pub segments: Vec<([u32; 2], CurveKind)>,
}

impl Scene {
    pub fn new(mesh: &TriMesh, interior: usize, seed: u64) -> Self {
        let mesh = repair(mesh).unwrap().mesh;
        let spacing = spacing_of(&mesh, interior).unwrap();
        let features = find_features(&mesh, &FeatureOptions::new(spacing)).unwrap();
        let crosses: Vec<DVec3> = (0..mesh.triangles.len())
            .map(|t| {
                let [a, b, c] = mesh.corners(t);
                (b - a).cross(c - a)
            })
            .collect();
        let mut scene = Self {
            normals: crosses.iter().map(|n| n.normalize()).collect(),
            mesh,
            features,
            spacing,
            sites: Vec::new(),
            places: Vec::new(),
            segments: Vec::new(),
        };
        scene.put_on_curves();
        scene.scatter(&crosses, interior, seed);
        scene
    }

    fn put(&mut self, site: DVec3, place: Place) -> u32 {
        self.sites.push(site);
        self.places.push(place);
        self.sites.len() as u32 - 1
    }

    fn scatter(&mut self, crosses: &[DVec3], count: usize, seed: u64) {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let area: f64 = crosses.iter().map(|n| 0.5 * n.length()).sum();
        let end = self.sites.len() + count;
        let mut passed = 0.0;
        for (t, n) in crosses.iter().enumerate() {
            passed += 0.5 * n.length();
            while self.sites.len() < end - count + (passed / area * count as f64).round() as usize {
                let [r, s] = [rng.random::<f64>().sqrt(), rng.random::<f64>()];
                let [a, b, c] = self.mesh.corners(t);
                self.put(a * (1.0 - r) + b * (r * (1.0 - s)) + c * (r * s), Place::Inside(t as u32));
            }
        }
    }

    fn put_on_curves(&mut self) {
        let mut halves = HashMap::new();
        for (half, (a, b)) in
            self.mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).enumerate()
        {
            halves.insert((a.min(b), a.max(b)), half);
        }
        let mut at_corner = HashMap::new();
        for v in self.features.corners.clone() {
            at_corner.insert(v, self.put(self.mesh.vertices[v as usize], Place::Vertex(v)));
        }
        let ends = |c: &Curve| [c.vertices[0], c.vertices[c.vertices.len() - 1]];
        let curves = self.features.curves.clone();
        for curve in &curves {
            let doubled = curves
                .iter()
                .filter(|c| !c.closed && (ends(c) == ends(curve) || ends(c).iter().rev().eq(&ends(curve))))
                .count();
            let fewest = match curve.closed || ends(curve)[0] == ends(curve)[1] {
                true => 3,
                false if doubled > 1 => 2,
                false => 1,
            };
            let count = ((curve.length / self.spacing).round() as usize).max(fewest);
            let mut chain = Vec::new();
            for s in 0..count + usize::from(!curve.closed) {
                if !curve.closed && (s == 0 || s == count) {
                    chain.push(at_corner[&ends(curve)[usize::from(s > 0)]]);
                } else {
                    let (site, place) = self.on_curve(curve, s as f64 / count as f64, &halves);
                    chain.push(self.put(site, place));
                }
            }
            if curve.closed {
                chain.push(chain[0]);
            }
            self.segments.extend(chain.windows(2).map(|w| ([w[0], w[1]], curve.kind)));
        }
    }

    fn on_curve(&self, curve: &Curve, share: f64, halves: &HashMap<(u32, u32), usize>) -> (DVec3, Place) {
        let mut left = share * curve.length;
        let n = curve.vertices.len();
        for e in 0..curve.edges() {
            let [a, b] = [curve.vertices[e], curve.vertices[(e + 1) % n]];
            let [p, q] = [a, b].map(|v| self.mesh.vertices[v as usize]);
            let length = p.distance(q);
            if left < 1e-9 * curve.length {
                return (p, Place::Vertex(a));
            }
            if left < length - 1e-9 * curve.length {
                let half = halves[&(a.min(b), a.max(b))];
                return (p.lerp(q, left / length), Place::Edge((half / 3) as u32, (half % 3) as u8));
            }
            left -= length;
        }
        let last = curve.vertices[curve.edges() % n];
        (self.mesh.vertices[last as usize], Place::Vertex(last))
    }

    pub fn cells(&self, k: usize) -> ConnectedCells {
        let mut on_curve = HashSet::new();
        for curve in &self.features.curves {
            for e in 0..curve.edges() {
                let [a, b] = [e, (e + 1) % curve.vertices.len()].map(|m| curve.vertices[m]);
                on_curve.insert((a.min(b), a.max(b)));
            }
        }
        let curves: Vec<bool> = self
            .mesh
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(a, b)| on_curve.contains(&(a.min(b), a.max(b))))
            .collect();
        let surface = CellSurface::new(&self.mesh.vertices, &self.mesh.triangles, &self.normals)
            .cut_along(&curves, &self.features.patches);
        let near = near(&self.sites, k);
        let sites = CellSites {
            positions: &self.sites,
            places: &self.places,
            near: &near,
            spacing: self.spacing,
            lengths: &[],
        };
        connected_cells(&surface, &sites, &ProgressToken::default()).unwrap()
    }

    pub fn connected(&self, cells: &ConnectedCells) -> (TriMesh, ConnectCounts) {
        let (triangles, counts) = connect(&self.sites, &cells.fans);
        (TriMesh { vertices: self.sites.clone(), triangles }, counts)
    }

    fn segments_of(&self, kind: CurveKind) -> usize {
        self.segments.iter().filter(|s| s.1 == kind).count()
    }
}

/// The nearest `k` of each site, as the device lists them.
pub fn near(sites: &[DVec3], k: usize) -> Vec<u32> {
    let n = sites.len();
    let mut near = vec![u32::MAX; k * n];
    for i in 0..n {
        let d = |j: &usize| sites[*j].distance_squared(sites[i]);
        let mut order: Vec<usize> = (0..n).filter(|j| *j != i).collect();
        let by = |a: &usize, b: &usize| d(a).total_cmp(&d(b));
        if order.len() > k {
            order.select_nth_unstable_by(k, by);
            order.truncate(k);
        }
        order.sort_by(by);
        order.iter().enumerate().for_each(|(slot, j)| near[slot * n + i] = *j as u32);
    }
    near
}

#[track_caller]
fn assert_same_topology(name: &str, mesh: &TriMesh, interior: usize) {
    for seed in 0..5 {
        let scene = Scene::new(mesh, interior, seed);
        let name = format!("{name}, seed {seed}");
        let cells = scene.cells(24);
        let c = cells.certificate;
        assert!((c.area - 1.0).abs() < 1e-9 && c.unshared_corners == 0, "{name}: {c:?}");
        for Encroached { segment: [a, b], by } in &cells.encroached {
            let is_segment = scene.segments.iter().any(|(s, _)| *s == [*a, *b] || *s == [*b, *a]);
            assert!(is_segment && by != a && by != b, "{name}: {by} between {a} and {b}");
        }
        let (mesh, counts) = scene.connected(&cells);
        assert_eq!((counts.unfilled_faces, counts.unconnected_sites), (0, 0), "{name}: {counts:?}");
        let (got, want) = (topology(&mesh), topology(&scene.mesh));
        assert_eq!(
            (got.vertices, got.components, got.euler, got.boundary_loops, got.genus),
            (scene.sites.len(), want.components, want.euler, want.boundary_loops, want.genus),
            "{name}: {got:?}"
        );
        assert_eq!(got.boundary_edges, scene.segments_of(CurveKind::Boundary), "{name}");
        assert_eq!(got.nonmanifold_edges, scene.segments_of(CurveKind::NonManifold), "{name}");
        assert_eq!((got.nonmanifold_vertices, got.duplicate_faces), (want.nonmanifold_vertices, 0), "{name}");
        let edges: HashSet<[u32; 2]> =
            mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
        for ([a, b], kind) in &scene.segments {
            assert!(
                edges.contains(&[*a, *b]) || edges.contains(&[*b, *a]),
                "{name}: no {kind:?} edge {a}-{b}"
            );
        }
    }
}

fn cylinder(around: u32, along: u32) -> TriMesh {
    let mut mesh = TriMesh::default();
    for j in 0..=along {
        for i in 0..around {
            let (sin, cos) = (f64::from(i) / f64::from(around) * std::f64::consts::TAU).sin_cos();
            mesh.vertices.push(DVec3::new(cos, sin, 2.0 * f64::from(j) / f64::from(along)));
        }
    }
    for j in 0..along {
        for i in 0..around {
            let at = |i: u32, j: u32| j * around + i % around;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// A strip of `n` quads with half a turn, whose triangles agree all around but for one edge.
fn moebius(n: u32) -> TriMesh {
    const WIDE: u32 = 6;
    let mut mesh = TriMesh::default();
    for i in 0..n {
        let turn = f64::from(i) / f64::from(n) * std::f64::consts::TAU;
        for j in 0..=WIDE {
            let v = 0.35 * (f64::from(j) / f64::from(WIDE) * 2.0 - 1.0);
            let r = 1.0 + v * (0.5 * turn).cos();
            mesh.vertices.push(DVec3::new(r * turn.cos(), r * turn.sin(), v * (0.5 * turn).sin()));
        }
    }
    for i in 0..n {
        for j in 0..WIDE {
            let at = |i: u32, j: u32| if i == n { WIDE - j } else { i * (WIDE + 1) + j };
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// The upper half of a sphere, cut along its triangles.
fn shell(radius: f64) -> TriMesh {
    let mut shell = sphere(radius, 4);
    let above = |t: &[u32; 3]| t.iter().all(|v| shell.vertices[*v as usize].z > 0.0);
    shell.triangles = shell.triangles.iter().filter(|t| above(t)).copied().collect();
    repair(&shell).unwrap().mesh
}

#[test]
fn cubes_and_plates_keep_their_creases() {
    assert_same_topology("cube", &cube(), 600);
    assert_same_topology("coarse cube", &cube(), 60);
    assert_same_topology("plate", &moved(&cube(), |v| v * DVec3::new(1.0, 1.0, 0.01)), 600);
    assert_same_topology("thinner plate", &moved(&cube(), |v| v * DVec3::new(1.0, 1.0, 1e-4)), 600);
    assert_same_topology("rod", &moved(&cube(), |v| v * DVec3::new(1.0, 0.01, 0.01)), 200);
}

#[test]
fn open_surfaces_keep_their_boundaries() {
    assert_same_topology("square", &plane(1, 0.0), 300);
    assert_same_topology("fine square", &plane(40, 0.0), 300);
    assert_same_topology("cylinder", &cylinder(40, 10), 500);
    assert_same_topology("ring", &moved(&cylinder(40, 3), |v| v * DVec3::new(1.0, 1.0, 0.01)), 100);
    assert_same_topology("close shells", &union(&shell(1.0), &shell(0.99)), 1000);
}

/// A square with a wedge-shaped slit from one side to the middle, `width` of 1/16 wide there.
fn slit(width: f64) -> TriMesh {
    let square = plane(16, 0.0);
    let in_slit = |t: &[u32; 3]| {
        let corners = t.map(|v| square.vertices[v as usize]);
        corners.iter().any(|v| v.x == 0.5 && v.y < 0.5) && corners.iter().any(|v| v.x < 0.5)
    };
    let triangles = square.triangles.iter().filter(|t| !in_slit(t)).copied().collect();
    let open = TriMesh { triangles, ..square.clone() };
    moved(&open, |v| {
        let close = (1.0 - width) / 16.0 * (1.0 - 2.0 * v.y).max(0.0);
        if v.x < 0.5 { v + close * DVec3::X } else { v }
    })
}

/// A flat grid whose fold along x = 0.5 fades from `angle` degrees at y = 0 to none at y = 0.7.
fn fading(n: u32, angle: f64) -> TriMesh {
    moved(&plane(n, 0.0), |v| {
        let fold = (0.5 * angle.to_radians()).tan() * (1.0 - v.y / 0.7).max(0.0);
        DVec3::new(v.x, v.y, -fold * (v.x - 0.5).abs())
    })
}

#[test]
fn what_lies_beyond_a_gap_or_a_fold_does_not_count() {
    for width in [0.5, 0.05] {
        assert_same_topology("slit", &slit(width), 800);
    }
    assert_same_topology("fold", &fading(40, 80.0), 600);
    assert_same_topology("sharp fold", &fading(40, 150.0), 600);
}

#[test]
fn sheets_on_one_edge_share_it() {
    let sheets = (0..3).fold(TriMesh::default(), |all, k| {
        let (sin, cos) = (f64::from(k) * 2.1 + 0.3).sin_cos();
        union(&all, &moved(&plane(8, 0.0), |v| DVec3::new(v.x * cos, v.x * sin, v.y)))
    });
    assert_same_topology("three sheets", &sheets, 500);
}

#[test]
fn bands_with_half_a_turn_stay_such() {
    assert_same_topology("Moebius band", &moebius(60), 500);
}

#[test]
fn closed_surfaces_have_sites_for_sectors() {
    let mesh = torus(40, 24);
    assert_same_topology("torus", &mesh, 600);
    let scene = Scene::new(&mesh, 600, 0);
    let with_curves = scene.cells(24);
    let surface = CellSurface::new(&scene.mesh.vertices, &scene.mesh.triangles, &scene.normals);
    let near = near(&scene.sites, 24);
    let sites = CellSites {
        positions: &scene.sites,
        places: &scene.places,
        near: &near,
        spacing: scene.spacing,
        lengths: &[],
    };
    assert_eq!(connected_cells(&surface, &sites, &ProgressToken::default()).unwrap().fans, with_curves.fans);
    assert!(with_curves.encroached.is_empty());
}

#[test]
fn sites_on_edges_and_vertices_without_curves_are_like_others() {
    let mut scene = Scene::new(&torus(40, 24), 500, 1);
    for t in (0..scene.mesh.triangles.len()).step_by(16) {
        let [a, b, _] = scene.mesh.corners(t);
        scene.put(0.5 * (a + b), Place::Edge(t as u32, 0));
    }
    for v in (0..scene.mesh.vertices.len()).step_by(8) {
        scene.put(scene.mesh.vertices[v], Place::Vertex(v as u32));
    }
    let cells = scene.cells(24);
    let c = cells.certificate;
    assert!((c.area - 1.0).abs() < 1e-9 && (c.unshared_corners, c.broken_cells) == (0, 0), "{c:?}");
    let got = topology(&scene.connected(&cells).0);
    assert!(got.is_closed_manifold() && (got.euler, got.vertices) == (0, scene.sites.len()), "{got:?}");
    assert!(cells.is_closed);
    // A site on a vertex of no triangle has no cell, and the others are what they were.
    let lost = scene.mesh.vertices.len() as u32;
    scene.mesh.vertices.push(2.0 * scene.mesh.vertices[0]);
    scene.put(scene.mesh.vertices[lost as usize], Place::Vertex(lost));
    let with_lost = scene.cells(24);
    assert!(!with_lost.is_closed && with_lost.certificate == c);
    let (mesh, counts) = scene.connected(&with_lost);
    assert_eq!((counts.unconnected_sites, topology(&mesh)), (1, got));
}

#[test]
fn curves_with_too_few_sites_are_reported() {
    let mut scene = Scene::new(&plane(1, 0.0), 40, 0);
    let before: HashSet<Encroached> = scene.cells(24).encroached.into_iter().collect();
    // Right above the middle of a segment.
    let ([a, b], _) = scene.segments[0];
    let middle = 0.5 * (scene.sites[a as usize] + scene.sites[b as usize]);
    let near = middle + 1e-3 * (DVec3::new(0.5, 0.5, 0.0) - middle);
    let by = scene.put(near, Place::Inside(u32::from(near.y > near.x)));
    let cells = scene.cells(24);
    let new: Vec<&Encroached> = cells.encroached.iter().filter(|e| !before.contains(e)).collect();
    assert!(new.iter().any(|e| e.by == by && e.segment.contains(&a) && e.segment.contains(&b)), "{new:?}");
    let (mesh, _) = scene.connected(&cells);
    assert!(mesh.triangles.iter().any(|t| [a, b, by].iter().all(|v| t.contains(v))), "the gap is closed");
}
