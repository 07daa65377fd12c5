//! Points seen from above: ground and roofs, without trees, cars and noise.

use std::io::Cursor;

use las::point::{Classification, Format};
use las::{Builder, Vector, Writer};
use rand::RngExt;
use rtfmesh::Error;
use rtfmesh::cloud::{CloudSurface, PointCloud, SurfaceKind, SurfaceOptions, surface};
use rtfmesh::glam::DVec3;
use rtfmesh::mesh::attributes::{Attribute, Attributes, Kind, Role};
use rtfmesh::mesh::topology::topology;

use crate::support::rng;

/// Easting, northing and height of a map, in metres.
const FAR: DVec3 = DVec3::new(412_000.0, 5_654_000.0, 230.0);
/// Width of the land, in metres.
const WIDTH: f64 = 60.0;
const ROOF: f64 = 12.0;

/// The ground's height.
fn ground(x: f64, y: f64) -> f64 {
    2.0 * (x / 9.0).sin() + 0.05 * y
}

/// Whether there is a building.
fn is_built(x: f64, y: f64) -> bool {
    (20.0..32.0).contains(&x) && (24.0..40.0).contains(&y)
}

/// Points with their classes: ground with a building, trees that hide much of it, and noise far below and
/// above.
fn land() -> (Vec<DVec3>, Vec<f64>) {
    let mut rng = rng(7);
    let mut all = Vec::new();
    let trees = [[10.0, 10.0], [45.0, 15.0], [48.0, 48.0], [12.0, 50.0]];
    for _ in 0..12_000 {
        let [x, y]: [f64; 2] = std::array::from_fn(|_| rng.random_range(0.0..WIDTH));
        let noise = rng.random_range(-0.03..0.03);
        if is_built(x, y) {
            all.push((DVec3::new(x, y, ROOF + noise), 6.0));
            continue;
        }
        let is_near = |[a, b]: &[f64; 2]| (x - a).hypot(y - b) < 2.5;
        let has_tree = trees.iter().any(is_near);
        if has_tree && rng.random_range(0.0..1.0) < 0.8 {
            all.push((DVec3::new(x, y, ground(x, y) + rng.random_range(3.0..9.0)), 5.0));
        } else {
            all.push((DVec3::new(x, y, ground(x, y) + noise), 2.0));
        }
        if has_tree {
            all.push((DVec3::new(x, y, ground(x, y) + rng.random_range(3.0..9.0)), 5.0));
        }
    }
    for k in 0..12 {
        let [x, y]: [f64; 2] = std::array::from_fn(|_| rng.random_range(0.0..WIDTH));
        all.push((
            DVec3::new(x, y, if k % 2 == 0 { -40.0 } else { 70.0 }),
            if k % 2 == 0 { 7.0 } else { 18.0 },
        ));
    }
    all.into_iter().map(|(p, class)| (p + FAR, class)).unzip()
}

/// The land as a LAZ file.
pub fn tile() -> Vec<u8> {
    let mut builder = Builder::from((1, 2));
    builder.point_format = Format::new(1).unwrap();
    builder.point_format.is_compressed = true;
    let axis = |offset: f64| las::Transform { scale: 0.001, offset };
    builder.transforms = Vector { x: axis(FAR.x), y: axis(FAR.y), z: axis(0.0) };
    let mut writer = Writer::new(Cursor::new(Vec::new()), builder.into_header().unwrap()).unwrap();
    let (points, classes) = land();
    for (p, class) in points.iter().zip(classes) {
        let classification = Classification::new(class as u8).unwrap();
        let [x, y, z] = p.to_array();
        let point = las::Point { x, y, z, classification, gps_time: Some(0.0), ..las::Point::default() };
        writer.write_point(point).unwrap();
    }
    writer.into_inner().unwrap().into_inner()
}

fn cloud(points: &[DVec3], classes: Option<&[f64]>) -> PointCloud {
    let of = |values: &[f64]| Attribute::new("classification", Role::Other, Kind::U8, 1, values.to_vec());
    let vertex = classes.map(of).into_iter().collect();
    let attributes = Attributes { vertex, ..Attributes::default() };
    PointCloud { points: points.to_vec(), attributes, ..PointCloud::default() }
}

fn through(cloud: &PointCloud) -> CloudSurface {
    surface(cloud, &SurfaceOptions::default()).unwrap()
}

/// The share of vertices that are off the ground and the roof by more than half a metre, of those that are
/// not near a wall.
fn share_off(found: &CloudSurface) -> f64 {
    let relative: Vec<DVec3> = found.mesh.vertices.iter().map(|p| *p - FAR).collect();
    let is_at_wall = |p: &&DVec3| {
        let near = [[-2.0, 0.0], [2.0, 0.0], [0.0, -2.0], [0.0, 2.0]];
        near.iter().any(|[dx, dy]| is_built(p.x + dx, p.y + dy) != is_built(p.x, p.y))
    };
    let free: Vec<&DVec3> = relative.iter().filter(|p| !is_at_wall(p)).collect();
    let exact = |p: &DVec3| if is_built(p.x, p.y) { ROOF } else { ground(p.x, p.y) };
    let off = free.iter().filter(|p| (p.z - exact(p)).abs() > 0.5).count();
    off as f64 / free.len() as f64
}

#[test]
fn classified_points_become_ground_and_roofs() {
    let (points, classes) = land();
    let found = through(&cloud(&points, Some(&classes)));
    let others = classes.iter().filter(|class| ![2.0, 6.0].contains(class)).count();
    assert!(found.is_terrain);
    assert_eq!(found.other_classes, others);
    let summary = topology(&found.mesh);
    assert_eq!((summary.components, summary.boundary_loops, summary.genus), (1, 1, Some(0)));
    assert!(share_off(&found) == 0.0, "{} are off", share_off(&found));
    // Classes come along from the nearest points.
    let named = found.attributes.vertex.iter().find(|a| a.name == "classification").unwrap();
    assert_eq!(named.values.len(), found.mesh.vertices.len());
    assert!(named.values.iter().all(|class| [2.0, 6.0].contains(class)));
}

#[test]
fn trees_and_noise_without_classes_are_left_out_and_roofs_stay() {
    let (points, classes) = land();
    for given in [None, Some(vec![1.0; points.len()])] {
        let found = through(&cloud(&points, given.as_deref()));
        assert!(found.is_terrain);
        let standing = classes.iter().filter(|class| ![2.0, 6.0].contains(class)).count();
        assert!(found.off_terrain >= standing * 9 / 10, "{} of {standing}", found.off_terrain);
        assert!(found.off_terrain < standing + points.len() / 10);
        let summary = topology(&found.mesh);
        assert_eq!((summary.components, summary.boundary_loops, summary.genus), (1, 1, Some(0)));
        assert!(share_off(&found) < 0.01, "{} are off", share_off(&found));
    }
}

#[test]
fn an_attribute_of_three_numbers_is_no_classification() {
    let (points, _) = land();
    let mut named = cloud(&points, Some(&[2.0].repeat(3 * points.len())));
    named.attributes.vertex[0].components = 3;
    assert_eq!(through(&named).mesh, through(&cloud(&points, None)).mesh);
}

#[test]
fn the_kind_can_be_chosen() {
    let (points, classes) = land();
    let land: Vec<DVec3> =
        points.iter().zip(&classes).filter(|(_, class)| **class == 2.0).map(|(p, _)| *p).collect();
    let plain = cloud(&land, None);
    let as_kind = |kind| surface(&plain, &SurfaceOptions::default().kind(kind)).unwrap();
    // Ground alone is a surface that needs nothing left out.
    assert_eq!(as_kind(SurfaceKind::Automatic), as_kind(SurfaceKind::Object));
    assert!(!as_kind(SurfaceKind::Object).is_terrain);
    let terrain = as_kind(SurfaceKind::Terrain);
    assert!(terrain.is_terrain && share_off(&terrain) == 0.0);
}

#[test]
fn holes_up_to_the_asked_size_are_filled() {
    let (points, classes) = land();
    let is_lake = |p: &DVec3| (p.x - FAR.x - 45.0).abs() < 6.0 && (p.y - FAR.y - 32.0).abs() < 6.0;
    let (points, classes): (Vec<DVec3>, Vec<f64>) =
        points.into_iter().zip(classes).filter(|(p, _)| !is_lake(p)).unzip();
    let cloud = cloud(&points, Some(&classes));
    let loops = |fill: f64| {
        let found = surface(&cloud, &SurfaceOptions::default().fill_holes(fill)).unwrap();
        topology(&found.mesh).boundary_loops
    };
    assert_eq!([loops(0.0), loops(8.0), loops(20.0), loops(f64::INFINITY)], [2, 2, 1, 1]);
}

#[test]
fn points_without_an_area_are_refused_as_terrain() {
    let line: Vec<DVec3> = (0..2000).map(|k| FAR + DVec3::X * f64::from(k)).collect();
    let options = SurfaceOptions::default().kind(SurfaceKind::Terrain);
    let refused = surface(&cloud(&line, None), &options).unwrap_err();
    assert!(matches!(refused, Error::Input { .. }), "{refused}");
}
