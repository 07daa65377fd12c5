//! Connected restricted Voronoi cells: their certificate, the mesh they give, and sites in degenerate
//! positions.

use crate::reference::knn::nearest;
use crate::support::{rng, slots};
use glam::DVec3;
use rand::RngExt;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::sites::cells::{
    CellSites, CellSurface, ConnectedCells, KnownCells, cells_after_moves, connected_cells, tangent_cells,
};
use rtfmesh::sites::connect::connect;
use rtfmesh::sites::place::Place;
use rtfmesh::{ProgressToken, TriMesh};
use std::time::Duration;

struct Scene {
    mesh: TriMesh,
    normals: Vec<DVec3>,
    sites: Vec<DVec3>,
    under: Vec<u32>,
    spacing: f64,
}

impl Scene {
    /// `count` sites scattered evenly over a sample.
    fn new(name: &str, count: usize) -> Self {
        let mesh = sample(name).unwrap();
        let crosses: Vec<DVec3> = (0..mesh.triangles.len())
            .map(|t| {
                let [a, b, c] = mesh.corners(t);
                (b - a).cross(c - a)
            })
            .collect();
        let area: f64 = crosses.iter().map(|n| 0.5 * n.length()).sum();
        let mut scene = Self {
            normals: crosses.iter().map(|n| n.normalize()).collect(),
            mesh,
            sites: Vec::new(),
            under: Vec::new(),
            spacing: (2.0 * area / (3.0_f64.sqrt() * count as f64)).sqrt(),
        };
        let mut rng = rng(7);
        // One site for each equal share of the area, in the order of the triangles.
        let mut passed = 0.0;
        for (t, n) in crosses.iter().enumerate() {
            passed += 0.5 * n.length();
            while scene.sites.len() < (passed / area * count as f64).round() as usize {
                let [r, s] = [rng.random::<f64>().sqrt(), rng.random::<f64>()];
                let [a, b, c] = scene.mesh.corners(t);
                scene.put(a * (1.0 - r) + b * (r * (1.0 - s)) + c * (r * s), t as u32);
            }
        }
        scene
    }

    fn put(&mut self, site: DVec3, triangle: u32) {
        self.sites.push(site);
        self.under.push(triangle);
    }

    /// The nearest `k` of each site, as the device lists them.
    fn near(&self, k: usize) -> Vec<u32> {
        slots(&nearest(&self.sites, &self.sites, k, true), k)
    }

    fn cells(&self, near: &[u32]) -> ConnectedCells {
        self.with(near, |surface, sites| connected_cells(surface, sites, &ProgressToken::default()).unwrap())
    }

    /// Triangles from cells in tangent planes, if these do.
    fn tangent_cells(&self, near: &[u32]) -> Option<TriMesh> {
        let progress = ProgressToken::default();
        let triangles =
            self.with(near, |surface, sites| tangent_cells(surface, sites, &progress).unwrap())?;
        Some(TriMesh { vertices: self.sites.clone(), triangles })
    }

    fn with<T>(&self, near: &[u32], make: impl FnOnce(&CellSurface, &CellSites) -> T) -> T {
        let surface = CellSurface::new(&self.mesh.vertices, &self.mesh.triangles, &self.normals);
        let places = Place::inside(&self.under);
        let sites =
            CellSites { positions: &self.sites, places: &places, near, spacing: self.spacing, lengths: &[] };
        make(&surface, &sites)
    }

    fn connected(&self, cells: &ConnectedCells) -> TriMesh {
        let (triangles, counts) = cells.connect(&self.sites);
        // From closed cells at once, from others by tracing faces, which is right for all.
        let (traced, mut wanted) = connect(&self.sites, &cells.fans);
        wanted.cells = Some(cells.certificate);
        assert_eq!((&triangles, counts), (&traced, wanted));
        TriMesh { vertices: self.sites.clone(), triangles }
    }
}

fn assert_certified(name: &str, cells: &ConnectedCells) {
    let c = cells.certificate;
    let is_whole = c.unshared_corners == 0 && c.broken_cells == 0;
    assert!((c.area - 1.0).abs() < 1e-9 && is_whole && cells.is_closed, "{name}: {c:?}");
}

#[test]
fn scattered_sites_give_the_surface_they_lie_on() {
    for (name, count) in
        [("sphere", 300), ("torus", 1500), ("bumpy-sphere", 1000), ("genus3", 3000), ("two-components", 1200)]
    {
        let scene = Scene::new(name, count);
        let cells = scene.cells(&scene.near(24));
        assert_certified(name, &cells);
        let (got, want) = (topology(&scene.connected(&cells)), topology(&scene.mesh));
        assert!(got.is_closed_manifold(), "{name}: {got:?}");
        assert_eq!(
            (got.vertices, got.components, got.euler),
            (scene.sites.len(), want.components, want.euler),
            "{name}"
        );
    }
}

#[test]
fn threads_do_not_wait_for_each_other_where_cells_need_more_sites_than_are_listed() {
    // More than the tree of all sites is split by one thread alone, and few cells that need it: threads are
    // then free to take a part of that work, and whoever waits for that part takes up other cells.
    let (count, listed) = (9000, 24);
    let (send, receive) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let scene = Scene::new("torus", count);
        let mut near = scene.near(listed);
        (0..count).step_by(40).for_each(|site| near[3 * count + site] = u32::MAX);
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let alone = pool(1).install(|| scene.cells(&near));
        for threads in [2, 3, 4, 8, 16, 16, 16, 16] {
            let together = pool(threads).install(|| scene.cells(&near));
            assert_eq!((&together.fans, together.is_closed), (&alone.fans, true), "{threads} threads");
        }
        send.send(()).unwrap();
    });
    receive.recv_timeout(Duration::from_secs(300)).unwrap();
}

#[test]
fn cells_around_moved_sites_are_computed_anew_and_all_others_are_as_they_were() {
    // So few sites that cells reach around the handles.
    let mut all = 0;
    for (name, count, neighbours) in [("genus3", 90, 24), ("torus", 40, 24), ("thin-plate", 60, 4)] {
        let mut scene = Scene::new(name, count);
        let mut known = KnownCells::default();
        let mut rounds = 0;
        for round in 0..6 {
            let near = scene.near(neighbours);
            let anew = scene.cells(&near);
            let after_moves = scene.with(&near, |surface, sites| {
                cells_after_moves(surface, sites, &mut known, &ProgressToken::default()).unwrap()
            });
            assert_eq!(after_moves.fans, anew.fans, "{name}, round {round}");
            assert_eq!(after_moves.broken, anew.broken, "{name}, round {round}");
            assert_eq!(after_moves.certificate, anew.certificate, "{name}, round {round}");
            if anew.broken.is_empty() {
                break;
            }
            rounds += 1;
            for (k, broken) in anew.broken.iter().take(3).enumerate() {
                let moved = (7 * round + 31 * k) % count;
                (scene.sites[moved], scene.under[moved]) = broken.farthest;
            }
        }
        assert!(rounds > 0, "{name}: {rounds} rounds");
        all += rounds;
    }
    assert!(all > 5, "{all} rounds");
}

/// The triangles, each from its smallest vertex on, in ascending order.
fn sorted(mesh: &TriMesh) -> Vec<[u32; 3]> {
    let turned = |t: &[u32; 3]| {
        let first = (0..3).min_by_key(|k| t[*k]).unwrap();
        [0, 1, 2].map(|k| t[(first + k) % 3])
    };
    let mut triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(turned).collect();
    triangles.sort_unstable();
    triangles
}

#[test]
fn cells_in_tangent_planes_give_nearly_the_triangles_of_exact_cells() {
    for (name, count) in
        [("sphere", 300), ("torus", 1500), ("bumpy-sphere", 3000), ("genus3", 3000), ("two-components", 1200)]
    {
        let scene = Scene::new(name, count);
        let near = scene.near(24);
        let mesh = scene.tangent_cells(&near).unwrap_or_default();
        let (got, want) = (topology(&mesh), topology(&scene.mesh));
        assert!(got.is_closed_manifold(), "{name}: {got:?}");
        assert_eq!((got.vertices, got.components, got.euler), (count, want.components, want.euler), "{name}");
        let exact = sorted(&scene.connected(&scene.cells(&near)));
        let others = sorted(&mesh).iter().filter(|t| exact.binary_search(t).is_err()).count();
        assert!(100 * others <= exact.len(), "{name}: {others} of {}", exact.len());
    }
}

#[test]
fn where_cells_in_tangent_planes_say_little_there_are_none() {
    let closed = Scene::new("torus", 300);
    assert!(closed.tangent_cells(&closed.near(24)).is_some());
    for k in [0, 3] {
        assert_eq!(closed.tangent_cells(&closed.near(k)), None, "{k} near sites");
    }
    let open = Scene::new("open-hemisphere", 300);
    assert_eq!(open.tangent_cells(&open.near(24)), None);
    // A plate in which each site is nearest to those on the other side.
    let thin = Scene::new("thin-plate", 40);
    assert_eq!(thin.tangent_cells(&thin.near(24)), None);
}

#[test]
fn on_a_sphere_the_triangles_are_the_convex_hull() {
    let scene = Scene::new("sphere", 300);
    let mesh = scene.connected(&scene.cells(&scene.near(24)));
    let radius = scene.sites[0].length();
    assert_eq!(mesh.triangles.len(), 2 * scene.sites.len() - 4);
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let n = (b - a).cross(c - a).normalize();
        let above = scene.sites.iter().map(|p| (*p - a).dot(n)).fold(0.0, f64::max);
        // The sphere's own facets are flat.
        assert!(above < 2e-3 * radius, "a site stands {above} above triangle {t}");
    }
}

#[test]
fn lists_of_any_length_give_the_same_cells() {
    let scene = Scene::new("torus", 300);
    let want = scene.cells(&scene.near(299));
    for k in [0, 3, 8, 40] {
        assert_eq!(scene.cells(&scene.near(k)).fans, want.fans, "{k} near sites");
    }
}

#[test]
fn sites_on_one_circle_have_one_triangulation() {
    // A square lattice on a flat square: every four sites lie on a circle.
    let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
    let mut scene = Scene {
        mesh: TriMesh { vertices: corners.to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]] },
        normals: vec![DVec3::Z; 2],
        sites: Vec::new(),
        under: Vec::new(),
        spacing: 0.125,
    };
    for i in 0..64 {
        let (x, y) = (f64::from(i % 8) / 8.0 + 0.05, f64::from(i / 8) / 8.0 + 0.06);
        scene.put(DVec3::new(x, y, 0.0), u32::from(y > x));
    }
    let cells = scene.cells(&scene.near(24));
    assert!((cells.certificate.area - 1.0).abs() < 1e-9, "{:?}", cells.certificate);
    assert_eq!(cells.certificate.unshared_corners, 0);
    // Inner sites of a lattice whose squares are cut by one diagonal each have six neighbours on average.
    let inner = (0..64).filter(|i| (1..7).contains(&(i % 8)) && (1..7).contains(&(i / 8)));
    let degrees: Vec<usize> = inner.map(|i| cells.fans.of(i).len()).collect();
    assert!(degrees.iter().all(|d| (4..=8).contains(d)), "{degrees:?}");
}

#[test]
fn open_surfaces_are_covered() {
    let scene = Scene::new("open-hemisphere", 400);
    let cells = scene.cells(&scene.near(24));
    assert!((cells.certificate.area - 1.0).abs() < 1e-9 && cells.certificate.unshared_corners == 0);
    assert_eq!(cells.certificate.broken_cells, 0);
    let at_the_rim = (0..400).filter(|s| cells.fans.is_open(*s)).count();
    assert!((30..100).contains(&at_the_rim), "{at_the_rim} fans begin and end at the boundary");
}

#[test]
fn few_and_coincident_sites_do_not_panic() {
    for count in [0, 1, 2, 3, 5] {
        let mut scene = Scene::new("tetrahedron", count.max(1));
        scene.sites.truncate(count);
        scene.under.truncate(count);
        let cells = scene.cells(&scene.near(4));
        assert_eq!(cells.fans.len(), count);
        scene.connected(&cells);
    }
    let mut scene = Scene::new("torus", 200);
    for _ in 0..40 {
        scene.put(scene.sites[5], scene.under[5]);
    }
    let cells = scene.cells(&scene.near(24));
    // The heaviest of them takes the whole cell, the others stay without.
    assert!((cells.certificate.area - 1.0).abs() < 1e-9, "{:?}", cells.certificate);
    assert_eq!(cells.certificate.unshared_corners, 0);
}
