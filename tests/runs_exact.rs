//! Whole runs with exact cells.

use crate::reference::exact;
use crate::support::{assert_valid, device};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::mesh::voronoi::energy;
use rtfmesh::{Error, MeasureDepth, Options, Remeshed, TriMesh, remesh};

fn run(mesh: &TriMesh, options: &Options) -> Remeshed {
    let result = remesh(device(), mesh, options, &mut |_| {}).unwrap();
    assert_valid(device());
    result
}

#[test]
fn both_presets_keep_the_topology_and_lower_the_energy() {
    for (name, n) in [("torus", 600), ("bumpy-sphere", 500), ("two-components", 400)] {
        let input = sample(name).unwrap();
        let short = |iterations| Options { iterations, ..Options::rvd(n) };
        let began = run(&input, &short(1)).summary.energy.unwrap();
        let lloyd = run(&input, &short(30));
        let momentum = run(&input, &Options { momentum: 0.9, ..short(30) });
        for result in [&lloyd, &momentum] {
            assert_eq!(result.summary.warnings, Vec::<String>::new(), "{name}");
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
fn reruns_give_the_same_bytes() {
    let input = sample("torus").unwrap();
    let options = Options { iterations: 5, ..Options::cvd(300) };
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
        let wrong = remesh(device(), &input, &Options { momentum, ..Options::cvd(100) }, &mut |_| {});
        assert!(matches!(wrong, Err(Error::Usage { .. })), "{momentum}");
    }
    let options = Options { iterations: 3, measures: MeasureDepth::Basic, ..Options::rvd(100) };
    assert_eq!(run(&input, &options).summary.energy, None);
}
