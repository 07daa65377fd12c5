//! `rtfmesh follow`: other poses of an input get its result's triangles.

use crate::support::place::Place;
use crate::support::shapes::moved;
use rtfmesh::glam::DVec3;
use rtfmesh::io::{read, write};
use rtfmesh::mesh::samples::sample;

/// A mesh with a result, and three poses of it.
fn with_poses() -> Place {
    let place = Place::with("torus");
    let input = read(place.path("in.ply")).unwrap().mesh;
    std::fs::create_dir(place.path("poses")).unwrap();
    for k in 0..3 {
        let pose = moved(&input, |p| p + DVec3::X * f64::from(k) * p.y);
        write(place.path(&format!("poses/{k}.off")), &pose).unwrap();
    }
    place.run("remesh in.ply out.ply -n 200 --quality draft");
    place
}

#[test]
fn every_pose_gets_the_triangles_of_the_result() {
    let place = with_poses();
    let (_, told) = place.run("follow in.ply out.ply poses --out made --distances");
    assert_eq!(told.lines().count(), 3);
    assert!(told.starts_with("1/3 poses/0.off -> made/0.ply, RMS 0."), "{told}");
    let result = read(place.path("out.ply")).unwrap().mesh;
    for k in 0..3 {
        let made = read(place.path(&format!("made/{k}.ply"))).unwrap().mesh;
        assert_eq!(made.triangles, result.triangles);
        let wanted = result.vertices.iter().map(|p| *p + DVec3::X * f64::from(k) * p.y);
        let far = made.vertices.iter().zip(wanted).map(|(p, q)| p.distance(q)).fold(0.0, f64::max);
        assert!(far < if k == 0 { 1e-6 } else { 0.1 }, "{k}: {far}");
    }
}

#[test]
fn poses_without_faces_may_be_points_of_any_format() {
    let place = with_poses();
    let pose = read(place.path("poses/1.off")).unwrap().mesh;
    let lines: Vec<String> = pose.vertices.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z)).collect();
    std::fs::write(place.path("pose.obj"), lines.concat()).unwrap();
    place.run("follow in.ply out.ply poses pose.obj --out made");
    assert_eq!(place.bytes("made/pose.ply"), place.bytes("made/1.ply"));
}

#[test]
fn the_time_limit_ends_the_run() {
    let place = with_poses();
    let done = place.program("follow in.ply out.ply poses --out made --time-limit 1e-9").assert().code(1);
    let told = String::from_utf8(done.get_output().stderr.clone()).unwrap();
    assert!(told.contains("the time limit ended the run: 0 done, 3 left"), "{told}");
    let done = place.program("follow in.ply out.ply - --out made").assert().code(2);
    let told = String::from_utf8(done.get_output().stderr.clone()).unwrap();
    assert!(told.contains("standard input cannot be one of several inputs"), "{told}");
}

#[test]
fn a_pose_that_does_not_fit_is_named() {
    let place = with_poses();
    write(place.path("poses/1.off"), &sample("box").unwrap()).unwrap();
    let done = place.program("follow in.ply out.ply poses --out made").assert().code(3);
    let told = String::from_utf8(done.get_output().stderr.clone()).unwrap();
    let last = told.lines().last().unwrap();
    assert!(last.starts_with("error: poses/1.off: the pose has 8 vertices, and the input has"), "{told}");
    assert!(place.path("made/0.ply").exists() && !place.path("made/1.ply").exists());
}

#[test]
fn nothing_that_is_read_is_replaced() {
    let place = with_poses();
    std::fs::rename(place.path("poses/1.off"), place.path("poses/out.off")).unwrap();
    for arguments in
        ["follow in.ply out.ply poses --out .", "follow in.ply out.ply poses --out poses --format off"]
    {
        let done = place.program(arguments).assert().code(2);
        let told = String::from_utf8(done.get_output().stderr.clone()).unwrap();
        assert!(told.contains(" would overwrite "), "{told}");
    }
}
