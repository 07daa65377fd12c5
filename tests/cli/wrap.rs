//! `rtfmesh wrap`, and `--wrap` of other commands.

use crate::support::place::Place;
use rtfmesh::io::{Writer, read};
use rtfmesh::mesh::attributes::{Attribute, Attributes, Kind, Role};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;

/// A box of triangles that are not connected, with the height of each vertex as a value.
fn with_soup() -> Place {
    let place = Place::new();
    let cube = sample("box").unwrap();
    let vertices: Vec<glam::DVec3> = (0..cube.triangles.len()).flat_map(|t| cube.corners(t)).collect();
    let triangles = (0..cube.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let height = vertices.iter().map(|p| p.z).collect();
    let attributes = Attributes {
        vertex: vec![Attribute::new("height", Role::Other, Kind::F64, 1, height)],
        ..Attributes::default()
    };
    let soup = rtfmesh::TriMesh { vertices: vertices.iter().map(|p| 1.001 * *p).collect(), triangles };
    Writer::new().attributes(&attributes).write(place.path("soup.ply"), &soup).unwrap();
    place
}

#[test]
fn a_soup_becomes_a_closed_mesh_with_its_values() {
    let place = with_soup();
    let (_, told) = place.run("wrap soup.ply closed.ply -n 600 --detail 6%");
    assert!(
        told.contains("wrapped at a detail of 6.000 % of the diagonal") && told.contains("lie on the input"),
        "{told}"
    );
    let closed = read(place.path("closed.ply")).unwrap();
    assert_eq!(closed.mesh.vertices.len(), 600);
    assert!(topology(&closed.mesh).is_closed_manifold());
    let height = closed.attributes.vertex.iter().find(|values| values.name == "height").unwrap();
    for (v, p) in closed.mesh.vertices.iter().enumerate() {
        // Within half of the detail.
        assert!((height.values[v] - p.z / 1.001).abs() < 0.052, "{p}");
    }
    let (_, same) = place.run("remesh soup.ply same.ply -n 600 --wrap 6%");
    assert!(same.contains("wrapped at a detail"), "{same}");
    assert!(read(place.path("same.ply")).unwrap().mesh == closed.mesh);
    // Edges as long as the detail, where nothing else is asked for.
    place.run("wrap soup.ply even.ply --detail 10% --quiet");
    let even = read(place.path("even.ply")).unwrap().mesh;
    let edge = (2.0 * even.area() / 3f64.sqrt() / even.vertices.len() as f64).sqrt();
    assert!((edge / (0.1 * 3f64.sqrt() * 1.001) - 1.0).abs() < 0.1, "{edge}");
}

#[test]
fn the_help_shows_what_wrapping_has() {
    let place = with_soup();
    let help = place.run("wrap --help").0;
    for hidden in ["--ratio", "--symmetric", "--keep-boundary", "--iso", "--points-as"] {
        assert!(!help.contains(hidden), "{hidden}: {help}");
    }
    for shown in ["Mesh to wrap", "--detail", "[default: by the detail]", "180 disables [default: 180]"] {
        assert!(help.contains(shown), "{shown}: {help}");
    }
}

#[test]
fn what_makes_no_sense_with_wrapping_is_refused() {
    let place = with_soup();
    std::fs::write(place.path("points.xyz"), "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n").unwrap();
    for (arguments, words) in [
        ("wrap soup.ply out.ply --detail 0", "--detail 0 is out of range"),
        ("remesh soup.ply out.ply --wrap 0", "--wrap 0 is out of range"),
        ("wrap soup.ply out.ply --keep-boundary", "--keep-boundary does not work with wrapped surfaces"),
        ("wrap soup.ply out.ply --ratio 0.5", "--ratio does not work with wrapped surfaces"),
        (
            "remesh soup.ply out.ply --wrap 6% --symmetric x",
            "--symmetric does not work with wrapped surfaces",
        ),
        ("wrap soup.ply out.ply --wrap 6%", "use --detail"),
        ("wrap soup.ply out.ply --detail 0.01%", "too large a grid"),
        ("wrap points.xyz out.ply", "works only with meshes"),
    ] {
        let wrong = place.program(arguments).assert().code(2);
        let told = String::from_utf8(wrong.get_output().stderr.clone()).unwrap();
        assert!(told.contains(words) && !place.path("out.ply").exists(), "{arguments}: {told}");
    }
}
