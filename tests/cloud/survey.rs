//! What is said of points before a surface is made, and how they are drawn.

use glam::DVec3;
use rtfmesh::ProgressToken;
use rtfmesh::cloud::{CloudSurvey, PointCloud, surface, survey};
use rtfmesh::io::read;
use rtfmesh::mesh::samples::sample;
use serde_json::Value;
use tiny_skia::Pixmap;

use super::{sampled, shaken};
use crate::support::place::Place;

fn surveyed(points: Vec<DVec3>) -> CloudSurvey {
    survey(&PointCloud { points, ..PointCloud::default() }, &ProgressToken::default()).unwrap()
}

/// Lines of coordinates, each with the numbers that `other` adds.
fn lines(points: &[DVec3], other: impl Fn(usize) -> String) -> String {
    points.iter().enumerate().map(|(i, p)| format!("{} {} {}{}\n", p.x, p.y, p.z, other(i))).collect()
}

#[test]
fn a_grid_has_its_spacing_and_nothing_else() {
    let mut points: Vec<DVec3> =
        (0..900).map(|k| 0.5 * DVec3::new(f64::from(k % 30), f64::from(k / 30), 0.0)).collect();
    let flat = surveyed(points.clone());
    assert!((flat.spacing - 0.5).abs() < 0.05, "{flat:?}");
    assert_eq!((flat.duplicates, flat.outliers), (0, 0));
    assert_eq!(flat.bounds, [DVec3::ZERO, DVec3::new(14.5, 14.5, 0.0)]);
    assert!(flat.noise.unwrap() < 1e-9, "{flat:?}");
    let [least, greatest] = flat.spacing_range;
    assert!(least <= flat.spacing && flat.spacing <= greatest && greatest < 1.0, "{flat:?}");
    points.extend([points[17], points[400], DVec3::new(7.0, 7.0, 6.0)]);
    let found = surveyed(points);
    assert_eq!((found.duplicates, found.outliers), (2, 1));
    assert!((found.spacing - 0.5).abs() < 0.05 && found.bounds[1].z == 6.0, "{found:?}");
}

#[test]
fn noise_shows_and_lines_have_none() {
    let even = sampled(&sample("torus").unwrap(), 4000, 3);
    let smooth = surveyed(even.points.clone());
    assert!(smooth.noise.unwrap() < CloudSurvey::CURVATURE * smooth.spacing, "{smooth:?}");
    let rough = surveyed(shaken(&even, smooth.spacing, 4).points);
    // Even between -1 and 1 spacing.
    let expected = smooth.spacing / 3_f64.sqrt();
    assert!((rough.noise.unwrap() / expected - 1.0).abs() < 0.3, "{rough:?}, not {expected}");
    assert_eq!(surveyed((0..50).map(|k| DVec3::splat(k.into())).collect()).noise, None);
    // What the surface is made with.
    let made = surface(&even, &Default::default()).unwrap();
    assert_eq!((made.spacing, Some(made.noise)), (smooth.spacing, smooth.noise));
}

#[test]
fn the_program_inspects_points() {
    let place = Place::new();
    let points = sampled(&sample("genus3").unwrap(), 3000, 5).points;
    std::fs::write(place.path("in.xyz"), lines(&points, |i| format!(" {} 0 0 {i}", i % 256))).unwrap();
    let (table, errors) = place.run("inspect in.xyz");
    assert_eq!(errors, "");
    for row in
        ["points                  3000", "minimum coordinates", "0.17 spacings", "none: remesh", "colour"]
    {
        assert!(table.contains(row), "'{row}' is missing: {table}");
    }
    let json: Value = serde_json::from_str(&place.run("inspect in.xyz --json").0).unwrap();
    assert_eq!(
        (&json["points"], &json["normals"], &json["duplicates"]),
        (&3000.into(), &0.into(), &0.into())
    );
    let spacing = json["spacing"].as_f64().unwrap();
    assert_eq!(spacing, surveyed(points).spacing);
    assert!(json["notes"][0].as_str().unwrap().contains("read as"), "{json}");
    place.run("remesh in.xyz normals.ply --normals-only");
    assert!(place.run("inspect normals.ply").0.contains("all points"));
    for (arguments, code) in [("inspect in.xyz -n 10", 2), ("inspect in.xyz --curves s.obj", 2)] {
        place.program(arguments).assert().code(code);
    }
}

#[test]
fn points_are_drawn_in_their_colours_and_lit_by_normals() {
    let place = Place::new();
    let cloud = sampled(&sample("genus3").unwrap(), 4000, 5);
    std::fs::write(place.path("plain.xyz"), lines(&cloud.points, |_| String::new())).unwrap();
    std::fs::write(place.path("red.xyz"), lines(&cloud.points, |_| " 255 0 0".to_owned())).unwrap();
    let normal = |i: usize, sign: f64| (sign * cloud.normals[i]).to_array().map(|x| format!(" {x}")).concat();
    std::fs::write(place.path("lit.xyz"), lines(&cloud.points, |i| normal(i, 1.0))).unwrap();
    std::fs::write(place.path("inward.xyz"), lines(&cloud.points, |i| normal(i, -1.0))).unwrap();
    let share = |name: &str, is_meant: &dyn Fn([u8; 3]) -> bool| {
        place.run(&format!("render {name}.xyz {name}.png --size 200x150"));
        let picture = Pixmap::load_png(place.path(&format!("{name}.png"))).unwrap();
        let colours = picture.pixels().iter().map(|p| [p.red(), p.green(), p.blue()]);
        let drawn: Vec<[u8; 3]> = colours.filter(|colour| *colour != [255; 3]).collect();
        assert!(drawn.len() > 3000, "{name}: {}", drawn.len());
        drawn.iter().filter(|colour| is_meant(**colour)).count() as f64 / drawn.len() as f64
    };
    let is_blue = |[red, _, blue]: [u8; 3]| blue > red;
    assert!(share("plain", &is_blue) > 0.95);
    assert!(share("red", &|[red, green, _]| red > green) > 0.99);
    assert!(share("lit", &is_blue) > 0.85);
    assert!(share("inward", &is_blue) < 0.15, "insides are brown");
    place.run("sample genus3 mesh.ply");
    let (_, errors) = place.run("render plain.xyz mesh.ply both.png --color distance --against mesh.ply");
    assert!(errors.contains("plain.xyz: largest distance"), "{errors}");
    for option in ["--color quality", "--curves"] {
        place.program(&format!("render plain.xyz x.png {option}")).assert().code(2);
    }
}

#[test]
fn a_batch_remeshes_points_as_it_does_meshes() {
    let place = Place::new();
    std::fs::create_dir(place.path("scans")).unwrap();
    let points = sampled(&sample("torus").unwrap(), 3000, 9).points;
    std::fs::write(place.path("scans/points.xyz"), lines(&points, |_| String::new())).unwrap();
    std::fs::write(place.path("scans/notes.txt"), "not points").unwrap();
    place.run("sample box scans/box.ply");
    place.run("batch scans --out out --ratio 0.1 --iterations 3 --quiet");
    assert_eq!(read(place.path("out/points.ply")).unwrap().mesh.vertices.len(), 300);
    assert!(place.path("out/box.ply").exists() && !place.path("out/notes.ply").exists());
    let log = std::fs::read_to_string(place.path("out/batch.jsonl")).unwrap();
    assert!(log.contains("a point cloud (3000 points"), "{log}");
}
