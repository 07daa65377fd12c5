//! Surfaces at a value.

use rtfmesh::glam::{DAffine3, DMat3, DVec3};
use rtfmesh::io::Volume;
use rtfmesh::mesh::topology::topology;
use rtfmesh::volume::{Inside, IsoOptions, IsoSurface, iso_surface, iso_surface_with_progress};
use rtfmesh::{Error, Flow, TriMesh};

use super::volume_of;

const CENTRE: DVec3 = DVec3::new(9.3, 10.1, 9.7);
const RADIUS: f64 = 6.2;

/// Signed distances of a ball.
fn ball() -> Volume {
    volume_of([20, 21, 19], |p| p.distance(CENTRE) - RADIUS)
}

fn at(volume: &Volume, options: IsoOptions) -> IsoSurface {
    iso_surface(volume, &options).unwrap()
}

/// The volume that a mesh encloses; negative if it is inside out.
fn enclosed(mesh: &TriMesh) -> f64 {
    let corners = (0..mesh.triangles.len()).map(|t| mesh.corners(t));
    corners.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}

/// The tri-linear field at a place in units of nodes.
fn interpolated(volume: &Volume, p: DVec3) -> f64 {
    let low = p.floor();
    let share = p - low;
    let corner = |bits: usize| {
        let up = DVec3::new((bits & 1) as f64, (bits >> 1 & 1) as f64, (bits >> 2) as f64);
        let node = (low + up).to_array();
        let weight: f64 = (0..3).map(|a| if up[a] > 0.0 { share[a] } else { 1.0 - share[a] }).product();
        if weight == 0.0 { 0.0 } else { weight * f64::from(volume.at(node.map(|c| c as usize))) }
    };
    (0..8).map(corner).sum()
}

#[test]
fn vertices_are_where_the_field_has_the_value() {
    let volume = ball();
    for iso in [0.0, -1.7, 1.25] {
        let found = at(&volume, IsoOptions::new(iso));
        assert_eq!(found.inside, Inside::Below);
        assert!(found.rim.is_empty());
        let summary = topology(&found.mesh);
        assert_eq!((summary.components, summary.boundary_loops, summary.genus), (1, 0, Some(0)));
        for vertex in &found.mesh.vertices {
            let off = interpolated(&volume, *vertex) - iso;
            // Vertices keep clear of nodes.
            assert!(off.abs() < 0.021, "{vertex} is off by {off}");
        }
        let exact = 4.0 / 3.0 * std::f64::consts::PI * (RADIUS + iso).powi(3);
        let volume = enclosed(&found.mesh);
        assert!((volume / exact - 1.0).abs() < 0.03, "{volume} in place of {exact}");
    }
}

#[test]
fn the_side_is_that_of_less_of_the_border_or_as_asked() {
    let mut volume = ball();
    let below = at(&volume, IsoOptions::new(0.0));
    let above = at(&volume, IsoOptions::new(0.0).inside(Inside::Above));
    assert!((enclosed(&below.mesh) + enclosed(&above.mesh)).abs() < 1e-9);
    volume.values.iter_mut().for_each(|value| *value = -*value);
    let density = at(&volume, IsoOptions::new(0.0));
    assert_eq!(density.inside, Inside::Above);
    assert_eq!(density.mesh, below.mesh);
}

#[test]
fn space_is_the_volumes_own_and_the_surface_faces_outward_in_it() {
    let turned = DMat3::from_cols(DVec3::new(0.0, 0.5, 0.0), DVec3::new(2.0, 0.0, 0.0), 3.0 * DVec3::Z);
    assert!(turned.determinant() < 0.0);
    let plain = at(&ball(), IsoOptions::new(0.0).closed(true));
    let frame = DAffine3 { matrix3: turned, translation: DVec3::new(100.0, -7.0, 3.0) };
    let placed = at(&Volume { frame, ..ball() }, IsoOptions::new(0.0).closed(true));
    assert!((enclosed(&placed.mesh) / enclosed(&plain.mesh) - 3.0).abs() < 1e-9);
    let back = frame.inverse();
    for (a, b) in plain.mesh.vertices.iter().zip(&placed.mesh.vertices) {
        assert!(a.distance(back.transform_point3(*b)) < 1e-9);
    }
}

#[test]
fn the_border_stays_open_or_is_closed_with_a_sharp_rim() {
    for (mirror, axis) in [(1.0, 0), (-1.0, 0), (1.0, 1), (1.0, 2)] {
        let mut centre = DVec3::splat(9.5);
        centre[axis] = 1.0;
        let mut volume = volume_of([20, 20, 20], |p| p.distance(centre) - RADIUS);
        volume.frame = DAffine3::from_scale(DVec3::new(mirror, 1.0, 1.0));
        let open = at(&volume, IsoOptions::new(0.0));
        assert_eq!((topology(&open.mesh).boundary_loops, open.rim.len()), (1, 0));
        let closed = at(&volume, IsoOptions::new(0.0).closed(true));
        let summary = topology(&closed.mesh);
        assert_eq!((summary.boundary_loops, summary.genus), (0, Some(0)));
        assert!(enclosed(&closed.mesh) > 0.0);
        // The rim is one circle in the border.
        let corners = closed.mesh.triangles.as_flattened();
        let ends = |half: &u32| {
            let next = if half % 3 == 2 { half - 2 } else { half + 1 };
            [*half, next].map(|corner| corners[corner as usize])
        };
        let edges: Vec<[u32; 2]> = closed.rim.iter().map(ends).collect();
        let length = |[a, b]: &[u32; 2]| {
            let [a, b] = [a, b].map(|v| closed.mesh.vertices[*v as usize]);
            assert!(a[axis].abs() < 0.021 && b[axis].abs() < 0.021, "{a} {b}");
            a.distance(b)
        };
        let total: f64 = edges.iter().map(length).sum();
        let around = 2.0 * std::f64::consts::PI * (RADIUS.powi(2) - 1.0).sqrt();
        assert!((total / around - 1.0).abs() < 0.02, "{total} in place of {around}");
        for [a, _] in &edges {
            assert_eq!(edges.iter().flatten().filter(|v| *v == a).count(), 2);
        }
    }
}

#[test]
fn undefined_values_leave_holes_and_infinite_ones_do_not() {
    let mut volume = ball();
    volume.values.iter_mut().filter(|value| **value > 3.0).for_each(|value| *value = f32::INFINITY);
    let whole = at(&volume, IsoOptions::new(0.0));
    assert_eq!(whole.mesh, at(&ball(), IsoOptions::new(0.0)).mesh);
    let near = at(&volume, IsoOptions::new(2.8));
    assert!(near.mesh.vertices.iter().all(|vertex| vertex.is_finite()));
    let [nx, ny, _] = volume.size;
    for (i, value) in volume.values.iter_mut().enumerate() {
        if i / nx / ny >= 10 {
            *value = f32::NAN;
        }
    }
    let half = topology(&at(&volume, IsoOptions::new(0.0)).mesh);
    assert_eq!((half.components, half.boundary_loops), (1, 1));
}

#[test]
fn values_on_the_surface_itself_make_a_surface() {
    // Whole distances in the grid's own metric: most nodes of the surface have exactly its value.
    let volume = volume_of([12, 12, 12], |p| (p - DVec3::splat(5.0)).abs().element_sum() - 4.0);
    let found = topology(&at(&volume, IsoOptions::new(0.0)).mesh);
    assert_eq!((found.components, found.boundary_loops, found.nonmanifold_edges), (1, 0, 0));
    // Two nodes are enough.
    let least = volume_of([2, 2, 2], |p| p.x - 0.25);
    assert_eq!(at(&least, IsoOptions::new(0.0).inside(Inside::Above)).mesh.triangles.len(), 2);
}

#[test]
fn a_value_that_is_nowhere_is_an_error_with_the_range() {
    let refused = |volume: &Volume, iso: f64| iso_surface(volume, &IsoOptions::new(iso)).unwrap_err();
    let error = refused(&volume_of([4, 4, 4], |p| p.x), 7.5).to_string();
    assert!(error.contains("no surface at 7.5: all values go from 0 to 3"), "{error}");
    let error = refused(&volume_of([4, 4, 4], |_| f64::NAN), 0.0).to_string();
    assert!(error.contains("no value is finite"), "{error}");
    assert!(matches!(refused(&ball(), f64::NAN), Error::Usage { .. }));
}

#[test]
fn a_surface_that_must_finish_early_uses_fewer_nodes() {
    let size = [180, 170, 190];
    let centre = DVec3::new(90.0, 85.0, 95.0);
    let volume = volume_of(size, |p| p.distance(centre) - 60.0);
    let found = iso_surface_with_progress(&volume, &IsoOptions::new(0.0), |_| Flow::Finish).unwrap();
    assert_eq!(found.step, 1, "so few values are done at once");
    let volume = volume_of([260, 260, 260], |p| p.distance(DVec3::splat(129.0)) - 100.0);
    let found = iso_surface_with_progress(&volume, &IsoOptions::new(0.0), |_| Flow::Finish).unwrap();
    assert_eq!(found.step, 2);
    let exact = 4.0 / 3.0 * std::f64::consts::PI * 1e6;
    assert!((enclosed(&found.mesh) / exact - 1.0).abs() < 0.005);
}

/// Three balls: one of radius 6.2, a fifth as large, and one of a voxel; and a cavity of a voxel.
fn balls() -> Volume {
    let balls = [(CENTRE, RADIUS), (DVec3::new(24.3, 9.1, 9.2), 3.6), (DVec3::new(24.1, 17.0, 15.1), 1.2)];
    volume_of([30, 21, 19], |p| {
        let outside = balls.iter().map(|(centre, radius)| p.distance(*centre) - radius);
        let solid = outside.fold(f64::INFINITY, f64::min);
        solid.max(0.9 - p.distance(CENTRE + 0.2))
    })
}

#[test]
fn specks_and_pinholes_are_left_out_and_counted_and_kept_when_asked_for() {
    let found = at(&balls(), IsoOptions::new(0.0));
    assert_eq!((found.specks, topology(&found.mesh).components), (2, 2));
    let exact = 4.0 / 3.0 * std::f64::consts::PI * (RADIUS.powi(3) + 3.6_f64.powi(3));
    assert!((enclosed(&found.mesh) / exact - 1.0).abs() < 0.03);
    let all = at(&balls(), IsoOptions::new(0.0).keep_specks(true));
    assert_eq!((all.specks, topology(&all.mesh).components), (0, 4));
}

#[test]
fn a_small_handle_is_removed_unless_specks_are_kept_and_a_lattice_stays() {
    // A ball with an ear of two voxels' radius, which is half a voxel thick.
    let ear = |p: DVec3| {
        let p = p - CENTRE - DVec3::new(RADIUS + 1.0, 0.0, 0.0);
        DVec3::new(p.truncate().length() - 1.6, p.z, 0.0).length() - 0.9
    };
    let volume = volume_of([24, 21, 19], |p| (p.distance(CENTRE) - RADIUS).min(ear(p)));
    let all = at(&volume, IsoOptions::new(0.0).keep_specks(true));
    assert_eq!((all.handles, topology(&all.mesh).genus), (0, Some(1)));
    let found = at(&volume, IsoOptions::new(0.0));
    assert_eq!((found.handles, topology(&found.mesh).genus), (1, Some(0)));
    assert!((enclosed(&found.mesh) / enclosed(&all.mesh) - 1.0).abs() < 0.02);
    // A gyroid has handles all over, of eight voxels.
    let gyroid = |p: DVec3| {
        let p = p * (std::f64::consts::TAU / 8.0);
        p.x.sin() * p.y.cos() + p.y.sin() * p.z.cos() + p.z.sin() * p.x.cos()
    };
    let volume = volume_of([33; 3], gyroid);
    let found = at(&volume, IsoOptions::new(0.0).closed(true));
    assert_eq!(found.handles, 0);
    assert!(topology(&found.mesh).genus.is_some_and(|genus| genus > 50));
}

#[test]
fn many_small_parts_of_one_size_are_no_specks() {
    let places = |p: DVec3| (p / 5.0).round() * 5.0;
    let volume =
        volume_of([21; 3], |p| p.distance(places(p).clamp(DVec3::splat(5.0), DVec3::splat(15.0))) - 1.1);
    let found = at(&volume, IsoOptions::new(0.0));
    assert_eq!((found.specks, topology(&found.mesh).components), (0, 27));
}

/// A number from -1 to 1 that depends on the node alone.
fn noise(p: DVec3) -> f64 {
    let node = (p.x + 64.0 * (p.y + 64.0 * p.z)) as u64;
    let mixed = (node + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    ((mixed ^ mixed >> 32) & 0xffff_ffff) as f64 / f64::from(1_u32 << 31) - 1.0
}

/// A ball of radius 14 in so much noise that its surface has a hundred handles and more.
pub fn noisy_ball() -> Volume {
    volume_of([41; 3], |p| p.distance(DVec3::splat(20.0)) - 14.0 + 7.0 * noise(p))
}

#[test]
fn noise_with_many_handles_is_smoothed_unless_it_is_to_stay() {
    let all = at(&noisy_ball(), IsoOptions::new(0.0).keep_specks(true));
    assert_eq!(all.smoothings, 0);
    assert!(topology(&all.mesh).genus.is_some_and(|genus| genus > 100));
    let found = at(&noisy_ball(), IsoOptions::new(0.0));
    assert!(found.smoothings > 0);
    let of_found = topology(&found.mesh);
    assert_eq!((of_found.components, of_found.genus), (1, Some(0)));
    let exact = 4.0 / 3.0 * std::f64::consts::PI * 14_f64.powi(3);
    assert!((enclosed(&found.mesh) / exact - 1.0).abs() < 0.04, "{} of {exact}", enclosed(&found.mesh));
    let rough = at(&noisy_ball(), IsoOptions::new(0.0).smooth_noise(false));
    assert!(rough.smoothings == 0 && rough.specks > 0);
    assert!(topology(&rough.mesh).genus.is_some_and(|genus| genus > 100));
}

#[test]
fn a_lattice_keeps_its_handles_with_noise_and_without() {
    let gyroid = |p: DVec3| {
        let p = p * (std::f64::consts::TAU / 12.0);
        p.x.sin() * p.y.cos() + p.y.sin() * p.z.cos() + p.z.sin() * p.x.cos()
    };
    let handles = |noisy: f64| {
        let volume = volume_of([61; 3], |p| gyroid(p) + noisy * noise(p));
        let found = at(&volume, IsoOptions::new(0.0).closed(true));
        (found.smoothings, topology(&found.mesh).genus.unwrap())
    };
    let (clean, noisy) = (handles(0.0), handles(1.5));
    assert_eq!(clean.0, 0);
    assert!(noisy.0 > 0);
    assert!((0.8..1.25).contains(&(noisy.1 as f64 / clean.1 as f64)), "{clean:?} {noisy:?}");
    // Struts of two nodes, in zeros and ones: smooth ones would be gone.
    let is_strut = |p: DVec3| p.to_array().into_iter().filter(|c| c.rem_euclid(6.0) < 2.0).count() > 1;
    for (share, has_specks) in [(0.0, false), (0.6, true)] {
        let volume = volume_of([50; 3], |p| f64::from(is_strut(p)) + share * noise(p));
        let found = at(&volume, IsoOptions::new(0.5));
        let genus = topology(&found.mesh).genus.unwrap() as usize;
        assert!(found.smoothings == 0 && genus > 500, "{genus}");
        assert_eq!(10 * found.specks > genus, has_specks, "{} specks, {genus} handles", found.specks);
    }
}
