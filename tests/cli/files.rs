//! The program with files of every format, standard input and output, and every way to ask for a size.

use crate::support::files::assert_same;
use crate::support::files::read_bytes;
use crate::support::place::Place;
use predicates::prelude::*;
use rtfmesh::io::{read, write};
use rtfmesh::mesh::repair::{RepairOptions, repair_with};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;

#[test]
fn meshes_flow_through_pipes() {
    let place = Place::with("sphere");
    let input = std::fs::read(place.path("in.ply")).unwrap();
    for format in ["ply", "obj", "stl", "off", "glb", "mesh", "ply.gz", "off.gz"] {
        let line = format!("remesh - - -n 100 --iterations 2 --format {format}");
        let done = place.program(&line).write_stdin(input.clone()).assert().success();
        let mesh = read_bytes(&done.get_output().stdout, None).unwrap().mesh;
        assert_eq!(mesh.vertices.len(), 100, "{format}");
        assert!(topology(&mesh).is_closed_manifold(), "{format}");
        let errors = String::from_utf8(done.get_output().stderr.clone()).unwrap();
        assert!(errors.contains("smallest angle"), "the table is on standard error: {errors}");
        if format.ends_with(".gz") {
            assert!(done.get_output().stdout.starts_with(&[0x1f, 0x8b]));
        }
        // What comes out goes in, without a word about its format.
        let again = place.program("measure - --json").write_stdin(done.get_output().stdout.clone()).assert();
        again.success().stdout(predicate::str::contains("\"vertices\": 100")).stderr("");
        let inspect = place.program("inspect -").write_stdin(done.get_output().stdout.clone()).assert();
        inspect.success().stdout(predicate::str::contains("100, 196"));
    }
    assert_eq!(place.files(), ["in.ply"]);
}

#[test]
fn standard_input_that_is_no_mesh_writes_nothing() {
    let place = Place::with("sphere");
    let whole = std::fs::read(place.path("in.ply")).unwrap();
    for (input, words) in [
        (&whole[..whole.len() / 2], ["standard input: byte", "cut off"]),
        (&b""[..], ["standard input: ", "empty"]),
        (&b"4 4 0\n"[..], ["standard input: ", "--input-format"]),
    ] {
        let done =
            place.program("remesh - - -n 100 --format ply").write_stdin(input).assert().code(3).stdout("");
        let line = String::from_utf8(done.get_output().stderr.clone()).unwrap();
        assert!(line.lines().count() == 1 && words.iter().all(|word| line.contains(word)), "{line}");
    }
    let bare = "4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
    let done = place.program("measure - --input-format off").write_stdin(bare).assert().success();
    done.stdout(predicate::str::contains("4, 4"));
    let reference = place.program("measure in.ply --against -").write_stdin(whole).assert().success();
    reference.stdout(predicate::str::contains("Hausdorff")).stderr("");
}

#[test]
fn models_are_written_in_every_format_and_lying_names_are_noted() {
    let place = Place::new();
    for name in ["a.stl", "a.off", "a.glb", "a.mesh", "a.vtp", "a.vtu", "a.vtk", "a.ply.gz", "a.stl.gz"] {
        place.run(&format!("sample torus {name}"));
        assert_same(&read(place.path(name)).unwrap().mesh, &sample("torus").unwrap(), 1e-6, name);
        assert_eq!(place.run(&format!("measure {name}")).1, "", "{name}");
    }
    place.run("sample torus lie.obj --format off");
    let (_, notes) = place.run("measure lie.obj");
    assert_eq!(notes, "note: lie.obj: the content is OFF, not OBJ, and was read as such\n");
    let (_, notes) = place.run("remesh lie.obj out --format glb -n 200 --iterations 2");
    assert!(notes.starts_with("note: lie.obj: the content is OFF"), "{notes}");
    let (_, notes) = place.run("measure out");
    assert_eq!(notes, "note: out: the file name has no extension; read as GLB\n");
    assert!(place.run("inspect lie.obj").0.contains("the content is OFF"));
    let done = place.program("sample torus - --format stl").assert().success();
    assert_eq!(done.get_output().stdout, std::fs::read(place.path("a.stl")).unwrap());
}

/// Mean length of the edges of all triangles.
fn mean_edge(name: &str, place: &Place) -> f64 {
    let mesh = read(place.path(name)).unwrap().mesh;
    let edges = (0..mesh.triangles.len()).flat_map(|t| {
        let [a, b, c] = mesh.corners(t);
        [a.distance(b), b.distance(c), c.distance(a)]
    });
    edges.sum::<f64>() / (3 * mesh.triangles.len()) as f64
}

#[test]
fn edges_get_the_length_that_was_asked_for() {
    let place = Place::with("sphere");
    place.run("remesh in.ply out.ply --edge-length 0.2 -q");
    let mean = mean_edge("out.ply", &place);
    assert!((mean / 0.2 - 1.0).abs() < 0.05, "{mean}");
    // The sphere's box has a diagonal of twice the root of three.
    place.run("remesh in.ply out.ply --edge-length 5% -q");
    let mean = mean_edge("out.ply", &place);
    assert!((mean / (0.1 * 3f64.sqrt()) - 1.0).abs() < 0.05, "{mean}");
}

#[test]
fn counts_may_be_in_thousands_and_millions() {
    let place = Place::with("box");
    for (text, count) in
        [("2k", 2000), ("1.5K", 1500), ("0.02M", 20_000), ("10_000", 10_000), ("12,345", 12_345)]
    {
        let (plan, _) = place.run(&format!("remesh in.ply --dry-run -n {text}"));
        assert!(plan.contains(&format!("{count}, ")), "{text}: {plan}");
    }
    place.program("remesh in.ply --dry-run -n 1,5k").assert().code(2).stderr(predicate::str::contains("10k"));
    assert_eq!(place.run("inspect in.ply -n 2k"), place.run("inspect in.ply -n 2000"));
}

#[test]
fn ratios_and_no_size_at_all_count_the_inputs_vertices() {
    let place = Place::new();
    let mut mesh = sample("two-components").unwrap();
    let count = mesh.vertices.len();
    // What repair takes out does not count.
    mesh.vertices.push(glam::DVec3::splat(9.0));
    write(place.path("in.ply"), &mesh).unwrap();
    let quiet = place.run("remesh in.ply half.ply --ratio 0.5 --iterations 2 --quality draft -q");
    assert_eq!(quiet.0, "");
    let half = (0.5 * count as f64).round() as usize;
    assert_eq!(read(place.path("half.ply")).unwrap().mesh.vertices.len(), half);
    // Repaired for the count, but no other mesh for that.
    place.run(&format!("remesh in.ply counted.ply -n {half} --iterations 2 --quality draft -q"));
    place.run("batch in.ply --out many --ratio 0.5 --iterations 2 --quality draft -q");
    let [one, counted, many] =
        ["half.ply", "counted.ply", "many/in.ply"].map(|name| std::fs::read(place.path(name)).unwrap());
    assert!(one == counted && one == many);
    let plans = ["--ratio 0.5".to_owned(), format!("-n {half}")]
        .map(|size| place.run(&format!("remesh in.ply --dry-run {size}")).0);
    assert_eq!(plans[0], plans[1]);
    // Nor do components that the run leaves out.
    let options = RepairOptions::default().min_component(0.4);
    let left = repair_with(&mesh, &options).unwrap().mesh.vertices.len();
    assert!((4..count).contains(&left));
    let plans = ["--ratio 1".to_owned(), format!("-n {left}")]
        .map(|size| place.run(&format!("remesh in.ply --dry-run --min-component 0.4 {size}")).0);
    assert_eq!(plans[0], plans[1]);
    let (_, notes) = place.run("remesh in.ply same.ply --iterations 2 --quality draft");
    assert!(
        notes.starts_with(&format!(
            "note: in.ply: no size given: keeping the input's vertex count, {count}\n"
        )),
        "{notes}"
    );
    assert_eq!(read(place.path("same.ply")).unwrap().mesh.vertices.len(), count);
}

#[test]
fn a_dry_run_tells_the_plan_and_writes_nothing() {
    let place = Place::with("box");
    let (text, errors) = place.run("remesh in.ply out.ply -n 2000 --report r.json --dry-run");
    assert_eq!(errors, "");
    for row in ["2000", "12, 8, 6", "on curves", "inside each patch", "device memory, about"] {
        assert!(text.contains(row), "'{row}' is missing: {text}");
    }
    assert_eq!(place.files(), ["in.ply"]);
    // The plan is that of the run.
    let last = text.lines().rfind(|line| line.trim_start().starts_with("level")).unwrap();
    let on_curves: usize = last.split(", ").nth(2).unwrap().split(' ').next().unwrap().parse().unwrap();
    place.run("remesh in.ply out.ply -n 2000 --report r.json -q --iterations 2");
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(place.path("r.json")).unwrap()).unwrap();
    assert_eq!(report["features"]["curve_sites"], on_curves, "{text}");
    let row = text.lines().find(|line| line.trim_start().starts_with("on curves")).unwrap();
    let (totals, each) = row.split_once(": ").unwrap();
    let each: Vec<usize> = each.split_whitespace().map(|count| count.parse().unwrap()).collect();
    let sum: usize = each.iter().sum();
    assert_eq!((each.len(), sum + 8), (12, on_curves), "{text}");
    assert!(totals.ends_with(&format!("{sum} and 8 corners")), "{text}");
    // No target is needed, no device, and standard output is for meshes.
    let (text, _) = place.run("remesh in.ply --dry-run --edge-length 2% -q");
    assert!(text.contains("vertices, spacing"), "{text}");
    let mut rtf = place.program("remesh in.ply --dry-run --preset rtf -n 500");
    rtf.env("VK_ICD_FILENAMES", "/nonexistent").env("VK_DRIVER_FILES", "/nonexistent").assert().success();
    let (text, errors) = place.run("remesh in.ply - --format ply --dry-run -n 500");
    assert!(text.is_empty() && errors.contains("vertices, spacing"), "{text}{errors}");
    let (text, _) = place.run("remesh in.ply --dry-run -n 20");
    assert!(text.contains("local operations"), "{text}");
    let (text, _) = place.run("remesh in.ply --dry-run -n 20 --vertices-at-least");
    assert!(text.contains("      34 vertices"), "{text}");
    std::fs::write(place.path("l.obj"), "v 0 0 0\nv 1 0 0\nl 1 2\n").unwrap();
    let refused = place.program("remesh in.ply --dry-run -n 7 --features l.obj").assert().code(2);
    refused.stderr(predicate::str::contains("ask for 34"));
}
