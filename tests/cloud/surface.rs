//! Surfaces through points, against the meshes that the points are of.

use glam::{DAffine3, DQuat, DVec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rtfmesh::Error;
use rtfmesh::cloud::{PointCloud, SurfaceOptions, oriented_normals, surface, surface_with_progress};
use rtfmesh::io::Volume;
use rtfmesh::measure::measure;
use rtfmesh::mesh::attributes::{Attribute, Kind, Role};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::volume::{IsoOptions, iso_surface};
use rtfmesh::{Flow, Phase};

use super::{sampled, shaken, without_normals};

fn default() -> SurfaceOptions {
    SurfaceOptions::default()
}

#[test]
fn normals_agree_with_those_of_the_mesh() {
    for (name, count) in [("torus", 8000), ("genus3", 12000), ("two-components", 8000)] {
        let cloud = sampled(&sample(name).unwrap(), count, 1);
        let found = oriented_normals(&without_normals(&cloud)).unwrap();
        let wrong = found.iter().zip(&cloud.normals).filter(|(n, m)| n.dot(**m) < 0.5).count();
        assert!(wrong * 200 < count, "{name}: {wrong} of {count}");
        assert!(found.iter().all(|n| (n.length() - 1.0).abs() < 1e-9));
    }
}

#[test]
fn normals_of_random_signs_are_found_anew_and_right_ones_stay() {
    for name in ["genus3", "box"] {
        let right = sampled(&sample(name).unwrap(), 4000, 1);
        let found = surface(&right, &default()).unwrap();
        assert!(!found.normals_disagree, "{name}");
        let mut wrong = right.clone();
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        wrong.normals.iter_mut().for_each(|n| *n = if rng.random::<bool>() { *n } else { -*n });
        let turned = surface(&wrong, &default()).unwrap();
        let bare = surface(&without_normals(&right), &default()).unwrap();
        assert!(turned.normals_disagree && !bare.normals_disagree, "{name}");
        assert_eq!(turned.mesh, bare.mesh, "{name}");
        let bare = oriented_normals(&without_normals(&right)).unwrap();
        assert_eq!(oriented_normals(&wrong).unwrap(), bare, "{name}");
        let agree = oriented_normals(&right).unwrap().into_iter().zip(&right.normals);
        assert!(agree.filter(|(n, m)| n.dot(**m) < 0.99).count() < 40, "{name}");
    }
}

#[test]
fn closed_surfaces_have_the_topology_of_the_mesh_and_lie_on_it() {
    for (name, count, genus, components) in
        [("torus", 10_000, 1, 1), ("genus3", 15_000, 3, 1), ("two-components", 10_000, 1, 2)]
    {
        let mesh = sample(name).unwrap();
        let cloud = without_normals(&sampled(&mesh, count, 2));
        let found = surface(&cloud, &default()).unwrap();
        let t = topology(&found.mesh);
        assert!(t.is_closed_manifold() && t.components == components, "{name}: {t:?}");
        assert_eq!(t.genus, Some(genus), "{name}");
        let distances = measure(&found.mesh, Some(&mesh)).unwrap().distances.unwrap();
        assert!(distances.rms < 0.15, "{name}: {} % of the diagonal", distances.rms);
        // The side of the square that one point has for itself.
        let want = (mesh.area() / count as f64).sqrt();
        assert!((found.spacing / want - 1.0).abs() < 0.2, "{name}: {} for {want}", found.spacing);
    }
}

#[test]
fn noise_outliers_and_duplicates_change_nothing_of_the_topology() {
    let mesh = sample("torus").unwrap();
    let clean = sampled(&mesh, 12_000, 3);
    let spacing = (mesh.area() / 12_000.0).sqrt();
    let mut cloud = without_normals(&shaken(&clean, 0.7 * spacing, 4));
    cloud.points.extend([DVec3::splat(3.0), DVec3::new(-4.0, 0.0, 1.0), DVec3::new(0.0, 0.0, 2.5)]);
    cloud.points.extend_from_within(..500);
    let found = surface(&cloud, &default()).unwrap();
    assert_eq!((found.outliers, found.duplicates), (3, 500));
    let t = topology(&found.mesh);
    assert!(t.is_closed_manifold() && t.components == 1 && t.genus == Some(1), "{t:?}");
    assert!(found.noise > 0.2 * spacing);
}

#[test]
fn holes_stay_open_unless_they_are_to_be_filled() {
    let mesh = sample("open-hemisphere").unwrap();
    let cloud = without_normals(&sampled(&mesh, 6000, 5));
    let open = surface(&cloud, &default()).unwrap();
    let t = topology(&open.mesh);
    assert!(t.boundary_loops == 1 && t.components == 1 && t.nonmanifold_vertices == 0, "{t:?}");
    // Its boundary is that of the points, give or take two spacings.
    let lowest = mesh.vertices.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    let found = open.mesh.vertices.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    assert!((found - lowest).abs() < 2.0 * open.spacing, "{found} for {lowest}, {}", open.spacing);
    let small = surface(&cloud, &default().fill_holes(0.5)).unwrap();
    assert_eq!(topology(&small.mesh).boundary_loops, 1);
    let closed = surface(&cloud, &default().fill_holes(f64::INFINITY)).unwrap();
    let t = topology(&closed.mesh);
    assert!(t.is_closed_manifold() && t.genus == Some(0) && closed.filled == 1, "{t:?}");
}

#[test]
fn two_sides_of_a_thin_plate_stay_apart_with_normals() {
    // The plate is 1 x 1 x 0.01; at this density, points are half of its thickness apart.
    let cloud = sampled(&sample("thin-plate").unwrap(), 80_000, 6);
    let t = topology(&surface(&cloud, &default()).unwrap().mesh);
    assert!(t.is_closed_manifold() && t.components == 1 && t.genus == Some(0), "{t:?}");
}

#[test]
fn sheets_little_more_than_a_spacing_apart_stay_apart_with_normals() {
    // The plate is 1 x 1 x 0.01, points are 0.008 apart. Inside out, it is a slit.
    let plate = sampled(&sample("thin-plate").unwrap(), 30_000, 6);
    let slit = PointCloud { normals: plate.normals.iter().map(|n| -*n).collect(), ..plate.clone() };
    for (name, cloud) in [("plate", plate), ("slit", slit)] {
        let t = topology(&surface(&cloud, &default()).unwrap().mesh);
        assert!(t.is_closed_manifold() && t.components == 1 && t.genus == Some(0), "{name}: {t:?}");
    }
}

#[test]
fn a_plane_gives_a_flat_mesh_and_a_line_none() {
    let points = |at: &dyn Fn(f64, f64) -> DVec3| PointCloud {
        points: (0..2500).map(|i| at(f64::from(i % 50), f64::from(i / 50))).collect(),
        ..PointCloud::default()
    };
    let flat = surface(&points(&|x, y| DVec3::new(x, y, 7.0)), &default()).unwrap().mesh;
    assert!(flat.vertices.iter().all(|p| (p.z - 7.0).abs() < 1e-4));
    assert!((flat.area() - 49.0 * 49.0).abs() < 0.1 * 49.0 * 49.0, "{}", flat.area());
    let line = points(&|x, y| DVec3::new(1.0, 2.0, 3.0) * (x + 50.0 * y));
    assert!(matches!(surface(&line, &default()), Err(Error::Input { .. })));
}

#[test]
fn points_of_very_different_density_take_bounded_memory() {
    let sphere = sample("sphere").unwrap();
    // With cells as narrow as the dense points ask for, the others would reach billions of nodes.
    let mut cloud = sampled(&sphere, 3000, 4);
    cloud.points.iter_mut().for_each(|p| *p = *p * 1e-4 + DVec3::new(3.0, 0.0, 0.0));
    let wide = sampled(&sphere, 1000, 5);
    cloud.points.extend(wide.points);
    cloud.normals.extend(wide.normals);
    let found = surface(&cloud, &default()).unwrap();
    assert!(found.cell > 10.0 * found.spacing, "{} {}", found.cell, found.spacing);
    assert!(found.mesh.triangles.len() < 3_000_000, "{}", found.mesh.triangles.len());
    let t = topology(&found.mesh);
    assert!(t.is_closed_manifold() && t.components == 1 && t.genus == Some(0), "{t:?}");
}

#[test]
fn what_makes_no_surface_is_refused() {
    let of = |points: Vec<DVec3>| PointCloud { points, ..PointCloud::default() };
    let some: Vec<DVec3> = (0..50).map(|i| DVec3::new(f64::from(i), f64::from(i * i % 7), 0.0)).collect();
    let with = |p: DVec3| of(some.iter().copied().chain([p]).collect());
    let few_normals = PointCloud { points: some.clone(), normals: vec![DVec3::Z], ..PointCloud::default() };
    for (cloud, word) in [
        (of(Vec::new()), "0 different points"),
        (of(vec![DVec3::ONE]), "1 different points"),
        (of(vec![DVec3::ONE; 1000]), "one point"),
        (with(DVec3::new(f64::NAN, 0.0, 0.0)), "not finite"),
        (with(DVec3::new(0.0, f64::INFINITY, 0.0)), "not finite"),
        (few_normals, "1 normal for 50 points"),
    ] {
        let error = surface(&cloud, &default()).unwrap_err();
        assert!(matches!(&error, Error::Input { .. }), "{error}");
        assert!(error.to_string().contains(word), "{error}");
    }
    let error = surface(&of(some), &default().fill_holes(f64::NAN)).unwrap_err();
    assert!(matches!(error, Error::Usage { .. }), "{error}");
}

#[test]
fn points_that_fill_a_volume_are_refused_and_noise_is_not() {
    let mut rng = Pcg64Mcg::seed_from_u64(9);
    let points = (0..5000).map(|_| DVec3::from_array(rng.random())).collect();
    let error = surface(&PointCloud { points, ..PointCloud::default() }, &default()).unwrap_err();
    assert!(matches!(&error, Error::Input { .. }) && error.to_string().contains("fill a volume"), "{error}");
    // Noise of a spacing, and tubes few spacings wide.
    let sphere = sample("sphere").unwrap();
    let spacing = (sphere.area() / 3000.0).sqrt();
    let noisy = without_normals(&shaken(&sampled(&sphere, 3000, 3), spacing, 4));
    let tubes = without_normals(&sampled(&sample("genus3").unwrap(), 3000, 5));
    assert!(surface(&noisy, &default()).is_ok() && surface(&tubes, &default()).is_ok());
}

#[test]
fn the_same_points_give_the_same_surface_and_values_are_carried() {
    let mut cloud = without_normals(&sampled(&sample("torus").unwrap(), 4000, 7));
    let heights = cloud.points.iter().map(|p| p.z).collect();
    cloud.attributes.vertex.push(Attribute::new("height", Role::Other, Kind::F64, 1, heights));
    let one = surface(&cloud, &default()).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    assert_eq!(pool.install(|| surface(&cloud, &default())).unwrap(), one);
    let carried = &one.attributes.vertex[0];
    let far = one.mesh.vertices.iter().zip(&carried.values).map(|(p, z)| (p.z - z).abs());
    assert!(far.fold(0.0, f64::max) < 3.0 * one.spacing);
}

#[test]
fn progress_is_told_and_cancels() {
    let cloud = without_normals(&sampled(&sample("torus").unwrap(), 4000, 8));
    let cancelled = surface_with_progress(&cloud, &default(), |now| {
        assert_eq!(now.phase, Phase::Surface);
        Flow::Cancel
    });
    assert_eq!(cancelled.unwrap_err(), Error::Cancelled);
}

#[test]
fn a_surface_that_must_finish_early_goes_through_an_even_choice_of_points() {
    let of = sample("torus").unwrap();
    let mut cloud = sampled(&of, 90_000, 8);
    let values = cloud.points.iter().map(|p| p.x).collect();
    cloud.attributes.vertex.push(Attribute::new("x", Role::Other, Kind::F64, 1, values));
    let found = surface_with_progress(&cloud, &default(), |_| Flow::Finish).unwrap();
    assert_eq!(found.unused, 45_000);
    let topology = topology(&found.mesh);
    assert!(topology.is_closed_manifold() && topology.genus == Some(1), "{topology:?}");
    let x = &found.attributes.vertex[0];
    let off = (0..).zip(&found.mesh.vertices).map(|(v, p)| (x.at(v)[0] - p.x).abs());
    assert!(off.fold(0.0, f64::max) < 3.0 * found.spacing);
    // Fewer points take so little time that all are used.
    let few = sampled(&of, 10_000, 8);
    let found = surface_with_progress(&few, &default(), |_| Flow::Finish).unwrap();
    assert_eq!(found.unused, 0);
}

#[test]
fn a_tunnel_of_few_spacings_is_kept_through_a_thick_plate() {
    // Of two spacings' radius, and fifteen long.
    let plate = |p: DVec3| (p.abs() - DVec3::new(0.8, 0.8, 0.12)).max_element();
    let field = |p: DVec3| plate(p).max(0.04 - p.truncate().length());
    let size = [81, 81, 15];
    let frame = DAffine3::from_scale_rotation_translation(
        DVec3::splat(0.025),
        DQuat::IDENTITY,
        DVec3::new(-1.0, -1.0, -0.175),
    );
    let place = |i: usize| {
        frame.transform_point3(DVec3::new((i % 81) as f64, (i / 81 % 81) as f64, (i / 6561) as f64))
    };
    let values = (0..size.iter().product()).map(|i| field(place(i)) as f32).collect();
    let volume = Volume { size, values, frame, notes: Vec::new() };
    let of = iso_surface(&volume, &IsoOptions::new(0.0)).unwrap().mesh;
    let found = surface(&sampled(&of, 20_000, 4), &default()).unwrap();
    assert_eq!((topology(&found.mesh).genus, found.handles), (Some(1), 0));
}
