//! Whole runs with exact restricted Voronoi cells.

use crate::reference::exact;
use crate::support::{assert_valid, device, faults};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::sites::restricted_voronoi::{RestrictedVoronoi, energy};
use rtfmesh::{Error, MeasureDepth, Options, Remeshed, TriMesh, remesh};

fn run(mesh: &TriMesh, options: &Options) -> Remeshed {
    let result = remesh(device(), mesh, options).unwrap();
    assert_valid(device());
    result
}

#[test]
fn both_presets_keep_the_topology_and_lower_the_energy() {
    for (name, n) in [("torus", 600), ("bumpy-sphere", 500), ("two-components", 400)] {
        let input = sample(name).unwrap();
        let short = |iterations| Options::rvd(n).iterations(iterations);
        let began = run(&input, &short(1)).summary.energy.unwrap();
        let lloyd = run(&input, &short(30));
        let momentum = run(&input, &short(30).momentum(0.9));
        for result in [&lloyd, &momentum] {
            assert_eq!(faults(&result.summary), Vec::<String>::new(), "{name}");
            let (got, want) = (topology(&result.mesh), topology(&input));
            assert!(got.is_closed_manifold(), "{name}: {got:?}");
            assert_eq!((got.vertices, got.components, got.euler), (n, want.components, want.euler), "{name}");
            let cells = result.summary.exact.unwrap();
            assert!((cells.area - 1.0).abs() < 1e-5 && cells.empty_cells == 0, "{name}: {cells:?}");
        }
        let of = |result: &Remeshed| result.summary.energy.unwrap().energy;
        assert!(of(&lloyd) < 0.8 * began.energy, "{name}: {} from {}", of(&lloyd), began.energy);
        assert!(of(&momentum) < of(&lloyd), "{name}: {} with momentum, {}", of(&momentum), of(&lloyd));
    }
}

#[test]
fn lbfgs_ends_lower_than_lloyd_after_as_many_iterations() {
    for (name, n) in [("torus", 600), ("two-components", 400)] {
        let input = sample(name).unwrap();
        let short = Options::rvd(n).iterations(40).tolerance(0.0);
        let momentum = run(&input, &short.clone().momentum(0.9)).summary;
        let lloyd = run(&input, &short).summary;
        let options = short.lbfgs(7);
        let result = run(&input, &options);
        let summary = &result.summary;
        assert_eq!(faults(summary), Vec::<String>::new(), "{name}");
        let (got, want) = (topology(&result.mesh), topology(&input));
        assert!(got.is_closed_manifold(), "{name}: {got:?}");
        assert_eq!((got.vertices, got.components, got.euler), (n, want.components, want.euler), "{name}");
        let cells = summary.exact.unwrap();
        assert!((cells.area - 1.0).abs() < 1e-5 && cells.empty_cells == 0, "{name}: {cells:?}");
        let [lbfgs, lloyds, momentum] =
            [summary, &lloyd, &momentum].map(|summary| summary.energy.unwrap().energy);
        assert!(lbfgs < 0.995 * lloyds && lbfgs < momentum, "{name}: {lbfgs}, {lloyds}, {momentum}");
        // The first step is Lloyd's, but for rounding.
        assert!((summary.steps[0] / lloyd.steps[0] - 1.0).abs() < 1e-5, "{name}: {:?}", summary.steps);
        assert_eq!(summary.steps.len(), 40, "{name}");
        assert!(summary.steps[39] < 0.03 * summary.steps[0], "{name}: {:?}", summary.steps);
        assert!(summary.steps[39] < lloyd.steps[39], "{name}: {} by Lloyd", lloyd.steps[39]);
        assert_eq!(run(&input, &options).mesh, result.mesh, "{name}: once more");
    }
}

#[test]
fn lbfgs_of_one_iteration_is_lloyd_and_rest_ends_it() {
    let input = sample("torus").unwrap();
    let once = Options::rvd(300).iterations(1);
    let lbfgs = run(&input, &once.clone().lbfgs(7));
    let lloyd = run(&input, &once);
    let apart = lbfgs.mesh.vertices.iter().zip(&lloyd.mesh.vertices).map(|(p, q)| p.distance(*q));
    assert!(apart.fold(0.0, f64::max) < 1e-5 * lloyd.summary.spacing);
    let early = run(&input, &Options::rvd(300).lbfgs(7).tolerance(0.02)).summary;
    assert!(early.converged && early.iterations < 40, "{}", early.iterations);
    assert!(early.steps.last().is_some_and(|step| *step < 0.02), "{:?}", early.steps);
}

#[test]
fn the_gradient_of_the_energy_is_twice_the_area_times_the_way_from_the_centroid() {
    let input = sample("bumpy-sphere").unwrap();
    // Off the surface, too: the formula holds anywhere in space.
    let sites: Vec<_> = input.vertices.iter().step_by(25).map(|p| *p * 1.02).collect();
    let cells = RestrictedVoronoi::new(&sites).cells(&input);
    let energy_at = |site: usize, by: glam::DVec3| {
        let mut sites = sites.clone();
        sites[site] += by;
        energy(&input, &sites).unwrap().energy
    };
    for site in [0, sites.len() / 2, sites.len() - 1] {
        for axis in [glam::DVec3::X, glam::DVec3::Y, glam::DVec3::Z] {
            let by = 1e-4 * axis;
            let slope = (energy_at(site, by) - energy_at(site, -by)) / 2e-4;
            let want = -2.0 * cells[site].first.dot(axis);
            let most = 2.0 * cells[site].first.length();
            assert!((slope - want).abs() < 1e-3 * most, "site {site}: {slope} instead of {want}");
        }
    }
}

#[test]
fn what_lbfgs_cannot_be_is_refused() {
    let input = sample("tetrahedron").unwrap();
    let wrong = [
        Options::rvd(100).lbfgs(51),
        Options::cvd(100).lbfgs(7),
        Options::rtf(100).lbfgs(7),
        Options::new(100).lbfgs(7),
        Options::mps(100).lbfgs(7),
    ];
    for options in wrong {
        let refused = remesh(device(), &input, &options);
        assert!(matches!(refused, Err(Error::Usage { .. })), "{options:?}");
    }
}

#[test]
fn reruns_give_the_same_bytes() {
    let input = sample("torus").unwrap();
    let options = Options::cvd(300).iterations(5);
    assert_eq!(run(&input, &options).mesh, run(&input, &options).mesh);
}

#[test]
fn energies_are_those_of_the_maths_in_the_units_of_the_file() {
    let input = sample("torus").unwrap();
    let sites: Vec<_> = input.vertices.iter().copied().step_by(40).collect();
    let triangles: Vec<_> = (0..input.triangles.len()).map(|t| input.corners(t)).collect();
    let cells = exact::cells(&triangles, &sites);
    let (area, want) = cells.iter().fold((0.0, 0.0), |(a, e), c| (a + c.area, e + c.energy));
    let got = energy(&input, &sites).unwrap();
    assert!((got.energy / want - 1.0).abs() < 1e-9, "{got:?} instead of {want}");
    let hexagons = 5.0 / (18.0 * 3f64.sqrt()) * area * area / sites.len() as f64;
    assert!((got.excess - (want / hexagons - 1.0)).abs() < 1e-9, "{got:?}");
    let large = |points: &[glam::DVec3]| points.iter().map(|p| *p * 1e20).collect::<Vec<_>>();
    let scaled = TriMesh { vertices: large(&input.vertices), triangles: input.triangles.clone() };
    let got = energy(&scaled, &large(&sites)).unwrap();
    assert!((got.energy / (want * 1e80) - 1.0).abs() < 1e-9, "{got:?}");
}

#[test]
fn momentum_has_a_range_and_energy_a_price() {
    let input = sample("tetrahedron").unwrap();
    for momentum in [-0.1, 1.0, f64::NAN] {
        let wrong = remesh(device(), &input, &Options::cvd(100).momentum(momentum));
        assert!(matches!(wrong, Err(Error::Usage { .. })), "{momentum}");
    }
    let options = Options::rvd(100).iterations(3).measures(MeasureDepth::Basic);
    assert_eq!(run(&input, &options).summary.energy, None);
}
