//! Borders of labels that are boxes: flat faces, sharp edges.

use rtfmesh::glam::{DVec3, Vec3Swizzles};
use rtfmesh::io::{Volume, read};
use rtfmesh::volume::{LabelOptions, LabelSurface, label_surface};

use super::labels::enclosed;
use super::{npy, volume_of};
use crate::support::place::Place;

fn borders(volume: &Volume) -> LabelSurface {
    label_surface(volume, &LabelOptions::default()).unwrap()
}

/// Whether a node is one of `low..high`.
fn is_in(p: DVec3, low: [f64; 3], high: [f64; 3]) -> bool {
    p.cmpge(DVec3::from_array(low)).all() && p.cmplt(DVec3::from_array(high)).all()
}

/// The length of the half-edges that are to be kept.
fn kept(found: &LabelSurface) -> f64 {
    let corners = found.mesh.triangles.as_flattened();
    let length = |half: &u32| {
        let next = if half % 3 == 2 { half - 2 } else { half + 1 };
        let [a, b] = [*half, next].map(|c| found.mesh.vertices[corners[c as usize] as usize]);
        a.distance(b)
    };
    found.rim.iter().map(length).sum()
}

#[test]
fn boxes_have_flat_faces_and_sharp_edges() {
    let shapes: [(&[[[f64; 3]; 2]], f64); 4] = [
        (&[[[4.0, 5.0, 6.0], [14.0, 15.0, 16.0]]], 120.0),
        // A plate, and an L.
        (&[[[3.0, 3.0, 8.0], [21.0, 20.0, 14.0]]], 4.0 * (18.0 + 17.0 + 6.0)),
        (&[[[3.0, 3.0, 3.0], [9.0, 20.0, 12.0]], [[3.0, 3.0, 3.0], [21.0, 9.0, 12.0]]], 2.0 * 70.0 + 54.0),
        // A smaller box on a larger one.
        (&[[[3.0, 3.0, 3.0], [21.0, 20.0, 9.0]], [[8.0, 8.0, 9.0], [15.0, 15.0, 16.0]]], 164.0 + 28.0 * 3.0),
    ];
    for (boxes, edges) in shapes {
        let inside = |p: DVec3| boxes.iter().any(|[low, high]| is_in(p, *low, *high));
        let volume = volume_of([24; 3], |p| f64::from(u8::from(inside(p))));
        let found = borders(&volume);
        let nodes = volume.values.iter().sum::<f32>();
        let (own, expected) = (enclosed(&found, 1), f64::from(nodes));
        assert!((own / expected - 1.0).abs() < 1e-9, "{boxes:?}: {own} and {expected}");
        assert!((kept(&found) - edges).abs() < 1e-9, "{boxes:?}: {} and {edges}", kept(&found));
        // All vertices are on planes half way between nodes.
        let is_flat = |p: &DVec3| p.to_array().iter().any(|x| (x.fract() - 0.5).abs() < 1e-5);
        assert!(found.mesh.vertices.iter().all(is_flat));
    }
}

#[test]
fn boxes_side_by_side_have_a_flat_wall() {
    let volume = volume_of([26; 3], |p| match p {
        _ if is_in(p, [3.0; 3], [12.0, 20.0, 20.0]) => 1.0,
        _ if is_in(p, [12.0, 3.0, 3.0], [20.0; 3]) => 2.0,
        _ => 0.0,
    });
    let found = borders(&volume);
    for (label, length) in [(1, 9.0), (2, 8.0)] {
        let expected = length * 17.0 * 17.0;
        assert!((enclosed(&found, label) / expected - 1.0).abs() < 1e-9, "{}", enclosed(&found, label));
    }
}

#[test]
fn slopes_of_stairs_and_curved_rims_have_no_kept_edges() {
    let slope = |p: DVec3| is_in(p, [4.0; 3], [28.0, 28.0, 6.0 + ((p.x - 4.0) / 3.0).floor()]);
    let can = |p: DVec3| (p - DVec3::splat(15.3)).xy().length() < 9.4 && (4.0..26.0).contains(&p.z);
    let stairs = borders(&volume_of([32; 3], |p| f64::from(u8::from(slope(p)))));
    let top = stairs.mesh.vertices.iter().filter(|p| is_in(**p, [12.0, 12.0, 7.0], [22.0, 20.0, 30.0]));
    for p in top {
        // In the middle of each step the slope is half a step above the nodes.
        let exact = 6.0 - 0.5 + (p.x - 5.0) / 3.0;
        assert!((p.z - exact).abs() < 0.2, "{p}: {exact}");
    }
    let can = borders(&volume_of([32; 3], |p| f64::from(u8::from(can(p)))));
    assert_eq!(can.rim.len(), 0);
    let side = can.mesh.vertices.iter().filter(|p| (p.z - 14.5).abs() < 7.0);
    let off = side.map(|p| ((*p - DVec3::splat(15.3)).xy().length() - 9.4).abs()).fold(0.0, f64::max);
    assert!(off < 0.4, "{off}");
}

#[test]
fn the_program_keeps_edges_of_boxes_as_far_as_there_are_vertices() {
    let place = Place::new();
    let volume = volume_of([20; 3], |p| f64::from(u8::from(is_in(p, [4.0; 3], [16.0; 3]))));
    std::fs::write(place.path("box.npy"), npy(&volume)).unwrap();
    place.run("remesh box.npy out.ply -n 200 --labels");
    let mesh = read(place.path("out.ply")).unwrap().mesh;
    assert_eq!(mesh.vertices.len(), 200);
    let on_faces = |p: &DVec3| ((*p - DVec3::splat(9.5)).abs().max_element() - 6.0).abs() < 1e-5;
    assert!(mesh.vertices.iter().all(on_faces));
    let warning = "sharp edges were given up: sharp edges and boundaries need 8 vertices";
    for count in [20, 8, 7] {
        let (_, told) = place.run(&format!("remesh box.npy out.ply -n {count} --labels"));
        assert_eq!(told.contains(warning), count < 8, "{told}");
        let mesh = read(place.path("out.ply")).unwrap().mesh;
        assert_eq!((mesh.vertices.len(), mesh.vertices.iter().all(on_faces)), (count, count >= 8));
    }
}
