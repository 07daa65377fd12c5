//! `exact/*` and the same cells on the host, against clipping every triangle with every pair of sites.

use crate::reference::exact;
use crate::reference::exact::Moments;
use crate::support::{assert_valid, cloud, device, lattice, on_sphere, rng, rounded, upload};
use glam::{DVec3, Vec4};
use rand::RngExt;
use rtfmesh::TriMesh;
use rtfmesh::gpu::Recorder;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::unit_frame::UnitFrame;
use rtfmesh::sites::restricted_voronoi::RestrictedVoronoi;
use rtfmesh::sites::surface::Surface;
use rtfmesh::stages::exact::{Aim, CutTriangles, ExactCells, ExactCounts};
use rtfmesh::stages::neighbours::lists::{ListOptions, Lists};

/// Lists as long as the runs have them.
const LIST: u32 = 20;

struct Model {
    surface: Surface,
    corners: Vec<[DVec3; 3]>,
    spacing: f64,
}

/// Cells as the device has them, and how they came about.
#[derive(Debug, Clone, PartialEq)]
struct Found {
    cells: Vec<Vec4>,
    energies: Vec<f32>,
    counts: ExactCounts,
}

impl Model {
    fn new(mesh: &TriMesh, sites: usize) -> Self {
        let surface = Surface::new(mesh, &UnitFrame::of(mesh).unwrap());
        let corners = surface.triangles.iter().map(|t| t.map(|v| surface.vertices[v as usize])).collect();
        let spacing = (2.0 * surface.area() / (3f64.sqrt() * sites.max(1) as f64)).sqrt();
        Self { surface, corners, spacing }
    }

    fn of(name: &str, sites: usize) -> Self {
        Self::new(&sample(name).unwrap(), sites)
    }

    /// Uniform over the area, off the surface by up to `off` spacings.
    fn scattered(&self, count: usize, off: f64, seed: u64) -> Vec<DVec3> {
        let mut rng = rng(seed);
        let sites: Vec<DVec3> = cloud(count, 2.0 * off * self.spacing, seed)
            .into_iter()
            .map(|off| {
                let mut pick = rng.random::<f64>() * self.surface.area();
                let t = self.surface.areas.iter().position(|a| {
                    pick -= a;
                    pick <= 0.0
                });
                let [a, b, c] = self.corners[t.unwrap_or(0)];
                let (q, s) = (rng.random::<f64>().sqrt(), rng.random::<f64>());
                a * (1.0 - q) + b * (q * (1.0 - s)) + c * (q * s) + off
            })
            .collect();
        rounded(&sites)
    }

    /// The cells of `before`, then those of `sites` with what is kept from then.
    fn cells(
        &self,
        before: &[DVec3],
        sites: &[DVec3],
        pieces: Option<u32>,
        group: Option<u32>,
    ) -> [Found; 2] {
        let device = device();
        let triangles = CutTriangles::new(device, &self.surface, self.spacing).unwrap();
        let n = sites.len();
        let mut cells = ExactCells::new(device, &triangles, before, LIST, pieces, group).unwrap();
        let lists = Lists::new(device, n, &ListOptions::new(LIST)).unwrap();
        let buffer = upload("test.sites", before);
        let mut rounds = [before, sites].into_iter().enumerate().map(|(round, sites)| {
            let mut recorder = Recorder::new(device).unwrap();
            recorder.upload(&buffer, &crate::support::vec4(sites)).unwrap();
            if round == 0 {
                lists.record_build(&mut recorder, &buffer).unwrap();
            } else {
                lists.record_refresh(&mut recorder, &buffer, 0.14).unwrap();
            }
            let parts = cells.record_parts(&mut recorder, &triangles, &buffer, &lists).unwrap();
            let done = recorder.submit().unwrap();
            let mut recorder = Recorder::new(device).unwrap();
            let counts =
                cells.record_cells(device, &mut recorder, &triangles, &buffer, (&done, &parts)).unwrap();
            recorder.submit().unwrap();
            assert_valid(device);
            let (of_sites, energies) = (&cells.cells, &cells.energies);
            Found {
                cells: of_sites.to_vec(device).unwrap(),
                energies: energies.to_vec(device).unwrap(),
                counts,
            }
        });
        [rounds.next().unwrap(), rounds.next().unwrap()]
    }

    /// Cells of the device, from scratch and from what is known, and of the host are those of the reference.
    /// Gives the counts from scratch.
    fn assert_cells(&self, sites: &[DVec3]) -> ExactCounts {
        let want = exact::cells(&self.corners, sites);
        let mesh = self.surface.mesh();
        let host: Vec<Moments> = RestrictedVoronoi::new(sites)
            .cells(&mesh)
            .iter()
            .map(|c| Moments { area: c.area, first: c.first, energy: c.energy })
            .collect();
        self.assert_near(&host, &want, 1e-11);
        let [fresh, known] = self.cells(sites, sites, None, None);
        for found in [&fresh, &known] {
            self.assert_near(&moments(found), &want, 2e-5);
            let whole: f64 = found.cells.iter().map(|c| f64::from(c.w)).sum();
            assert!((whole / self.surface.area() - 1.0).abs() < 1e-5, "{whole} of {}", self.surface.area());
        }
        fresh.counts
    }

    /// Up to a share of the square of the spacing and of the site's distance to its cell.
    fn assert_near(&self, got: &[Moments], want: &[Moments], share: f64) {
        assert_eq!(got.len(), want.len());
        for (i, (got, want)) in got.iter().zip(want).enumerate() {
            let far_sq = self.spacing * self.spacing + want.energy / want.area.max(1e-30);
            let near = share * (self.spacing * self.spacing + want.area);
            assert!((got.area - want.area).abs() < near, "area {i}: {got:?} instead of {want:?}");
            let off = got.first.distance(want.first);
            assert!(off < 2.0 * near * far_sq.sqrt(), "moment {i}: {got:?} instead of {want:?}");
            let off = (got.energy - want.energy).abs();
            assert!(off < 4.0 * near * far_sq, "energy {i}: {got:?} instead of {want:?}");
        }
    }
}

fn moments(found: &Found) -> Vec<Moments> {
    let one = |(cell, energy): (&Vec4, &f32)| Moments {
        area: f64::from(cell.w),
        first: cell.truncate().as_dvec3(),
        energy: f64::from(*energy),
    };
    found.cells.iter().zip(&found.energies).map(one).collect()
}

#[test]
fn cells_are_those_of_the_maths() {
    for (name, count) in
        [("torus", 150), ("genus3", 60), ("box", 200), ("thin-plate", 120), ("two-components", 40)]
    {
        let model = Model::of(name, count);
        for off in [0.0, 0.3] {
            let counts = model.assert_cells(&model.scattered(count, off, 1));
            assert!(counts.undecided < counts.pairs / 4, "{name}, the first time: {counts:?}");
        }
    }
}

#[test]
fn few_sites_and_huge_triangles() {
    for count in [1, 2, 3, 4, 9] {
        let model = Model::of("tetrahedron", count);
        model.assert_cells(&model.scattered(count, 0.2, 3));
        // Larger than the surface, and than what the triangles were cut for.
        model.assert_cells(&rounded(&cloud(count, 2.0, 4)));
    }
    let model = Model::of("tetrahedron", 1);
    let fine = model.scattered(300, 0.0, 5);
    let counts = model.assert_cells(&fine);
    assert!(counts.crowded > 0, "triangles of many sites are the host's: {counts:?}");
}

#[test]
fn sites_on_one_spot_on_lines_and_on_spheres() {
    let model = Model::of("torus", 64);
    let mut twice = model.scattered(32, 0.0, 6);
    twice.extend_from_within(..);
    model.assert_cells(&twice);
    model.assert_cells(&vec![twice[0]; 40]);
    let line: Vec<DVec3> = (0..64).map(|i| DVec3::new(0.01 * f64::from(i) - 0.3, 0.0, 0.0)).collect();
    model.assert_cells(&rounded(&line));
    let grid: Vec<DVec3> = lattice(4).iter().map(|p| (*p - 1.5) * 0.25).collect();
    model.assert_cells(&rounded(&grid));
    // All are as far from the middle of a box.
    Model::of("box", 100).assert_cells(&rounded(&on_sphere(100, 7).0));
}

#[test]
fn slivers() {
    let mut rng = rng(8);
    let mut mesh = TriMesh::default();
    for i in 0..200_u32 {
        let from = DVec3::from_array(std::array::from_fn(|_| rng.random::<f64>()));
        let along = DVec3::from_array(std::array::from_fn(|_| rng.random::<f64>() - 0.5));
        let height = 10f64.powf(-7.0 * rng.random::<f64>());
        let up = along.any_orthonormal_vector() * height;
        mesh.vertices.extend([from, from + along, from + along * rng.random::<f64>() + up]);
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let model = Model::new(&mesh, 120);
    model.assert_cells(&model.scattered(120, 0.1, 9));
}

#[test]
fn moved_sites_keep_what_is_known() {
    let model = Model::of("torus", 300);
    for (step, seed) in [(0.05, 10), (0.25, 11), (3.0, 12)] {
        let before = model.scattered(300, 0.0, 13);
        let moved: Vec<DVec3> =
            before.iter().zip(cloud(300, step * model.spacing, seed)).map(|(p, by)| *p + by).collect();
        let moved = rounded(&moved);
        let [_, found] = model.cells(&before, &moved, None, None);
        model.assert_near(&moments(&found), &exact::cells(&model.corners, &moved), 2e-5);
    }
}

#[test]
fn sizes_capacity_and_threads_do_not_change_results() {
    for count in [1, 15, 16, 17, 63, 64, 65] {
        let model = Model::of("torus", count);
        let sites = model.scattered(count, 0.1, 14);
        let [fresh, known] = model.cells(&sites, &sites, None, Some(64));
        // The walk finds sites in another order than the list.
        model.assert_near(&moments(&fresh), &moments(&known), 1e-6);
        assert_eq!(model.cells(&sites, &sites, None, Some(16)), [fresh, known.clone()], "{count} sites");
        // With so little room the host does most triangles.
        let [_, tight] = model.cells(&sites, &sites, Some(2), None);
        assert!(count < 10 || tight.counts.crowded > 10, "{:?}", tight.counts);
        model.assert_near(&moments(&tight), &moments(&known), 1e-5);
    }
    let none = Model::of("torus", 1).cells(&[], &[], None, None);
    assert!(none.iter().all(|found| found.cells.is_empty() && found.counts == ExactCounts::default()));
}

#[test]
fn aims_are_centroids_with_momentum() {
    let (device, model) = (device(), Model::of("torus", 65));
    let sites = model.scattered(65, 0.1, 15);
    let triangles = CutTriangles::new(device, &model.surface, model.spacing).unwrap();
    let cells = ExactCells::new(device, &triangles, &sites, LIST, None, None).unwrap();
    let aim = Aim::new(device, 65, Some(16)).unwrap();
    let buffer = upload("test.sites", &sites);
    // Cells of made-up shapes: every fifth has none, and their centroids are off by `by`.
    let made = |by: DVec3| -> Vec<Vec4> {
        (0..65).map(|i| (by.as_vec3() * 0.5).extend(if i % 5 == 0 { 0.0 } else { 0.5 })).collect()
    };
    let step = |by: DVec3| {
        let mut recorder = Recorder::new(device).unwrap();
        recorder.upload(&cells.cells, &made(by)).unwrap();
        aim.record(&mut recorder, &buffer, &cells, 0.5, 0.1).unwrap();
        recorder.submit().unwrap();
        let targets = aim.targets.to_vec(device).unwrap();
        assert_valid(device);
        (0..65).map(move |i| targets[i].truncate().as_dvec3()).collect::<Vec<_>>()
    };
    let check = |got: Vec<DVec3>, want: DVec3| {
        for (i, got) in got.iter().enumerate() {
            let want = if i % 5 == 0 { sites[i] } else { sites[i] + want };
            assert!(got.distance(want) < 1e-6, "site {i}: {got} instead of {want}");
        }
    };
    // No motion yet; then half of the motion on top; none against it; no farther than asked for.
    check(step(DVec3::X * 0.01), DVec3::X * 0.01);
    check(step(DVec3::X * 0.03), DVec3::X * 0.04);
    check(step(DVec3::X * 0.01), DVec3::X * 0.01);
    check(step(DVec3::X * 0.2), DVec3::X * 0.1);
}
