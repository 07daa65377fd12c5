//! Results for formats with 32-bit numbers: figures are those of the file.

use crate::support::files::{encode, read_bytes};
use crate::support::{assert_valid, device};
use glam::DVec3;
use rtfmesh::io::{Encoding, Format};
use rtfmesh::measure::measure;
use rtfmesh::mesh::samples::sample;
use rtfmesh::{MeasureDepth, Options, Remeshed, TriMesh, remesh};
use std::path::Path;

fn options() -> Options {
    Options::new(300).first_iterations(20).iterations(2).polish_rounds(2)
}

fn run(mesh: &TriMesh, options: &Options) -> Remeshed {
    let result = remesh(device(), mesh, options).unwrap();
    assert_valid(device());
    result
}

fn file_of(result: &Remeshed, format: Format) -> TriMesh {
    let encoding = Encoding { format, gzip: false };
    read_bytes(&encode(Path::new("x"), &result.mesh, encoding).unwrap(), None).unwrap().mesh
}

/// A sphere so far from the origin that numbers of 32 bits hardly tell its vertices apart.
fn far_sphere(distance: f64) -> TriMesh {
    let mut mesh = sample("sphere").unwrap();
    mesh.vertices.iter_mut().for_each(|v| *v += distance * DVec3::new(1.0, -0.7, 0.3));
    mesh
}

#[test]
fn what_32_bits_cannot_hold_is_said_and_measured() {
    let far = far_sphere(4e6);
    let ply = run(&far, &options().format(Format::Ply));
    assert_eq!(ply.mesh, run(&far, &options()).mesh);
    assert_eq!((ply.summary.warnings.len(), ply.summary.output.self_intersecting_faces), (0, Some(0)));
    for depth in [MeasureDepth::Basic, MeasureDepth::Full] {
        let stl = run(&far, &options().format(Format::Stl).measures(depth));
        let [warning, ..] = stl.summary.warnings.as_slice() else { panic!("no warning") };
        let measured = measure(&file_of(&stl, Format::Stl), None).unwrap();
        let output = &stl.summary.output;
        assert_eq!(output.self_intersecting_faces, measured.self_intersecting_faces);
        assert_eq!(output.topology, measured.topology);
        assert_eq!(output.quality, measured.quality);
        let crossing = measured.self_intersecting_faces.unwrap();
        assert!(crossing > 0 && warning.contains(&format!("{crossing} faces intersect others")), "{warning}");
        assert!(warning.starts_with("STL stores 32-bit numbers") && warning.contains(".ply"), "{warning}");
        assert!(!stl.summary.warnings.iter().any(|other| other.contains("ask for more vertices")));
    }
    // Relative to the mesh's own place, they are fine enough.
    let glb = run(&far, &options().format(Format::Glb));
    assert_eq!(glb.summary.warnings, Vec::<String>::new());
    assert_eq!(file_of(&glb, Format::Glb), glb.mesh);
}

#[test]
fn vertices_that_fall_together_are_counted() {
    let stl = run(&far_sphere(1e7), &options().format(Format::Stl));
    let left = file_of(&stl, Format::Stl).vertices.len();
    assert!(left < 300 && stl.summary.output.vertices == left);
    let warning = &stl.summary.warnings[0];
    assert!(warning.contains(&format!("{} vertices fall on others", 300 - left)), "{warning}");
}

#[test]
fn rounding_that_moves_but_changes_nothing_is_a_remark() {
    let stl = run(&far_sphere(1e2), &options().format(Format::Stl));
    assert_eq!(stl.summary.warnings, Vec::<String>::new());
    let last = stl.summary.remarks.last().unwrap();
    assert!(last.starts_with("STL stores 32-bit numbers, which moves vertices by up to"), "{last}");
    let near = run(&sample("sphere").unwrap(), &options().format(Format::Stl));
    assert_eq!((near.summary.warnings, near.summary.remarks), (vec![], vec![]));
}
