//! `rtfmesh repair`, and holes filled before a run.

use crate::support::place::Place;
use rtfmesh::io::{Writer, read, write};
use rtfmesh::mesh::attributes::{Attribute, Attributes, Kind, Role};
use rtfmesh::mesh::repair::repair;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;

/// A torus with one wide hole and one narrow one.
fn with_torus() -> Place {
    let place = Place::new();
    let mut torus = sample("torus").unwrap();
    let centre = |t: [u32; 3]| t.into_iter().map(|v| torus.vertices[v as usize]).sum::<glam::DVec3>() / 3.0;
    let wide = torus.vertices[0];
    let cut = |t: &[u32; 3]| centre(*t).distance(wide) < 0.3;
    let mut kept: Vec<[u32; 3]> = torus.triangles.iter().copied().filter(|t| !cut(t)).collect();
    let far = kept.iter().position(|t| centre(*t).distance(wide) > 1.0).unwrap();
    kept.remove(far);
    torus.triangles = kept;
    // Without vertices that are no longer used.
    write(place.path("open.ply"), &repair(&torus).unwrap().mesh).unwrap();
    place
}

#[test]
fn holes_are_filled_and_nothing_else_changes() {
    let place = with_torus();
    let open = read(place.path("open.ply")).unwrap().mesh;
    assert_eq!(topology(&open).boundary_loops, 2);
    let (_, told) = place.run("repair open.ply closed.ply --fill-holes 100%");
    assert!(told.contains("note: open.ply: 2 holes were filled"), "{told}");
    assert!(told.contains("boundary loops") && told.contains("intersecting triangles"), "{told}");
    let closed = read(place.path("closed.ply")).unwrap().mesh;
    assert!(topology(&closed).is_closed_manifold());
    assert!(closed.vertices[..open.vertices.len()] == open.vertices);
    assert!(closed.triangles[..open.triangles.len()] == open.triangles);
    let (_, told) = place.run("repair open.ply half.ply --fill-holes 12%");
    assert!(told.contains("1 hole was filled") && told.contains("1 hole was left open"), "{told}");
    assert_eq!(topology(&read(place.path("half.ply")).unwrap().mesh).boundary_loops, 1);
    let (_, told) = place.run("repair open.ply same.ply --quiet");
    assert!(told.is_empty() && read(place.path("same.ply")).unwrap().mesh == open, "{told}");
    let wrong = place.program("repair open.ply out.ply --fill-holes 0").assert().code(2);
    let told = String::from_utf8(wrong.get_output().stderr.clone()).unwrap();
    assert!(told.contains("--fill-holes 0 is out of range") && !place.path("out.ply").exists(), "{told}");
}

#[test]
fn values_come_along_and_go_on_over_patches() {
    let place = with_torus();
    let open = read(place.path("open.ply")).unwrap().mesh;
    let height = open.vertices.iter().map(|p| p.z).collect();
    let region = (0..open.triangles.len()).map(|t| f64::from(open.corners(t)[0].x > 0.0)).collect();
    let attributes = Attributes {
        vertex: vec![Attribute::new("height", Role::Other, Kind::F64, 1, height)],
        face: vec![Attribute::new("region", Role::Label, Kind::U8, 1, region)],
        ..Attributes::default()
    };
    Writer::new().attributes(&attributes).write(place.path("open.ply"), &open).unwrap();
    place.run("repair open.ply closed.ply --fill-holes 100%");
    let loaded = read(place.path("closed.ply")).unwrap();
    let [was, now] =
        [&attributes, &loaded.attributes].map(|all| (&all.vertex[0].values, &all.face[0].values));
    assert!(now.0[..was.0.len()] == was.0[..] && now.1[..was.1.len()] == was.1[..]);
    assert_eq!(now.1.len(), loaded.mesh.triangles.len());
    for (p, height) in loaded.mesh.vertices.iter().zip(now.0) {
        assert!((p.z - height).abs() < 0.3, "{height} at {p}");
    }
}

#[test]
fn runs_fill_holes_first_and_measure_to_the_filled_surface() {
    let place = with_torus();
    let (_, told) = place.run("remesh open.ply closed.ply -n 900 --fill-holes 100%");
    assert!(told.contains("2 holes were filled") && !told.contains("warning"), "{told}");
    let found = topology(&read(place.path("closed.ply")).unwrap().mesh);
    assert!(found.is_closed_manifold() && found.vertices == 900 && found.genus == Some(1), "{found:?}");
    place.program("remesh open.ply x.ply -n 900 --fill-holes 12% --keep-boundary").assert().code(2);
}

#[test]
fn spikes_and_inner_shells_go_where_that_is_asked_for() {
    let place = Place::new();
    let mut mesh = sample("sphere").unwrap();
    let count = mesh.vertices.len();
    let offset = count as u32;
    mesh.vertices.extend_from_within(..);
    mesh.vertices[count..].iter_mut().for_each(|v| *v *= 0.4);
    mesh.triangles.extend(mesh.triangles.clone().iter().map(|t| t.map(|v| v + offset)));
    mesh.vertices[9] *= 3.0;
    write(place.path("in.ply"), &mesh).unwrap();
    let (_, told) = place.run("repair in.ply same.ply");
    assert!(!told.contains("spike") && !told.contains("inside"), "{told}");
    assert_eq!(read(place.path("same.ply")).unwrap().mesh, mesh);
    let (_, told) = place.run("repair in.ply out.ply --smooth-spikes --outer");
    assert!(told.contains("note: in.ply: 1 spike was smoothed"), "{told}");
    assert!(told.contains("note: in.ply: 1 component was removed: inside closed ones"), "{told}");
    let out = read(place.path("out.ply")).unwrap().mesh;
    assert_eq!(out.vertices.len(), count);
    assert!(out.vertices[9].length() < 1.01 && out.vertices[..9] == mesh.vertices[..9]);
    place.run("remesh in.ply fine.ply -n 300 --smooth-spikes --outer --report r.json");
    let report = place.json("r.json");
    assert_eq!(report.pointer("/repaired/hidden_components_removed"), Some(&1.into()), "{report:#}");
    assert_eq!(report.pointer("/output/topology/components"), Some(&1.into()), "{report:#}");
    place.program("remesh in.ply x.ply -n 300 --outer --keep-boundary").assert().code(2);
}
