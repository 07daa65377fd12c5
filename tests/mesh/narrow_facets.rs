//! Edges of coarsely sampled round surfaces, and creases that look like them.

use crate::support::shapes::{prism, regular};
use glam::DVec3;
use rtfmesh::TriMesh;
use rtfmesh::mesh::features::{CurveKind, FeatureOptions, Features, find_features, spacing_of};
use std::f64::consts::TAU;

fn found(mesh: &TriMesh, vertices: usize) -> Features {
    let spacing = spacing_of(mesh, vertices).unwrap();
    find_features(mesh, &FeatureOptions { round_facets: true, ..FeatureOptions::new(spacing) }).unwrap()
}

/// How many edges of sharp curves run along z.
fn upright(mesh: &TriMesh, features: &Features) -> usize {
    let sharp = features.curves.iter().filter(|curve| curve.kind == CurveKind::Sharp);
    let is_upright = |[a, b]: &[u32; 2]| {
        let step = mesh.vertices[*a as usize] - mesh.vertices[*b as usize];
        step.z.abs() > 0.9 * step.length()
    };
    sharp.flat_map(|curve| curve.edge_ends().collect::<Vec<_>>()).filter(is_upright).count()
}

#[test]
fn edges_between_narrow_facets_of_a_cylinder_are_no_creases() {
    for sides in [7, 8] {
        let tube = prism(&regular(sides), 20.0);
        let narrow = found(&tube, 140);
        assert_eq!(upright(&tube, &narrow), 0, "{sides}");
        assert_eq!(narrow.discarded.facet_edges, sides as usize);
        assert!((narrow.discarded.facet_length - 20.0 * f64::from(sides)).abs() < 1e-9);
        // The rims stay.
        assert_eq!(narrow.patch_count, 3, "{sides}");
        // Wide facets are kept, in any unit.
        for unit in [1e-6, 1.0, 1e6] {
            let vertices = tube.vertices.iter().map(|p| unit * *p).collect();
            let tube = TriMesh { vertices, triangles: tube.triangles.clone() };
            let wide = found(&tube, 2000);
            assert_eq!((upright(&tube, &wide), wide.discarded.facet_edges), (sides as usize, 0), "{unit}");
        }
    }
}

#[test]
fn six_sides_and_fewer_are_creases_however_narrow() {
    for sides in [3, 4, 5, 6] {
        let nut = prism(&regular(sides), 20.0);
        for vertices in [140, 2000] {
            let features = found(&nut, vertices);
            assert_eq!(upright(&nut, &features), sides as usize, "{sides} {vertices}");
        }
    }
}

#[test]
fn chamfers_stairs_and_teeth_are_creases() {
    // A box with one chamfer of 45 degrees at each edge along z, 0.4 spacings wide at 300 vertices.
    let (side, cut) = (4.0, 0.4);
    let corners = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
    let chamfered: Vec<[f64; 2]> = corners
        .iter()
        .enumerate()
        .flat_map(|(k, [x, y])| {
            let [one, other] = [[x * side, y * (side - cut)], [x * (side - cut), y * side]];
            if k % 2 == 0 { [one, other] } else { [other, one] }
        })
        .collect();
    let part = prism(&chamfered, 20.0);
    assert_eq!(found(&part, 600).discarded.facet_edges, 0);
    // Waves of 45 degrees that turn back each time, as stairs and the teeth of a rack do.
    let wave = (0..20).map(|k| [f64::from(k), if k % 2 == 0 { 0.0 } else { 0.41 }]);
    let mut rack: Vec<[f64; 2]> = wave.collect();
    rack.extend([[19.0, 10.0], [0.0, 10.0]]);
    let rack = prism(&rack, 20.0);
    assert_eq!(found(&rack, 400).discarded.facet_edges, 0);
}

#[test]
fn a_low_poly_shape_of_many_vertices_stays_sharp() {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let mut vertices = Vec::new();
    for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        vertices.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
    }
    // Vertices of a face are at distance 2 from each other.
    let near = |i: usize, j: usize| (vertices[i].distance(vertices[j]) - 2.0).abs() < 1e-9;
    let mut triangles = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(i, k) {
                    let [a, b, c] = [i, j, k].map(|v| vertices[v]);
                    let outwards = (b - a).cross(c - a).dot(a + b + c) > 0.0;
                    let [j, k] = if outwards { [j, k] } else { [k, j] };
                    triangles.push([i as u32, j as u32, k as u32]);
                }
            }
        }
    }
    let icosahedron = TriMesh { vertices, triangles };
    let features = found(&icosahedron, 1000);
    let edges: usize = features.curves.iter().map(|curve| curve.edges()).sum();
    assert_eq!((edges, features.patch_count, features.discarded.facet_edges), (30, 20, 0));
}

#[test]
fn a_ruled_surface_cut_along_the_wrong_diagonals_has_no_creases() {
    // Between a segment at the top and an arc at the bottom; the other way of cutting it is smooth.
    let steps = 40;
    let vertices: Vec<DVec3> = (0..=steps)
        .flat_map(|k| {
            let t = f64::from(k) / f64::from(steps);
            let angle = 0.5 * TAU / 2.0 * t;
            let bottom = DVec3::new(10.0 * angle.sin(), 10.0 * (1.0 - angle.cos()), -10.0);
            [DVec3::new(0.0, 10.0 * t, 10.0), bottom]
        })
        .collect();
    let cut = |wrong: bool| {
        let quad = |k: u32| {
            let [a, b, c, d] = [2 * k, 2 * k + 1, 2 * k + 2, 2 * k + 3];
            if wrong { [[a, b, d], [a, d, c]] } else { [[a, b, c], [b, d, c]] }
        };
        TriMesh { vertices: vertices.clone(), triangles: (0..steps).flat_map(quad).collect() }
    };
    for mesh in [cut(true), cut(false)] {
        let narrow = found(&mesh, 200);
        // One edge at an end may remain.
        assert!(narrow.patch_count <= 2, "{:?}", narrow.discarded);
        assert_eq!(
            narrow.patch_count - 1,
            narrow.curves.iter().filter(|c| c.kind == CurveKind::Sharp).count()
        );
    }
}
