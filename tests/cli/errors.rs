//! Wrong arguments and unusable input: the exit code, a one-line error that names the remedy, and no file
//! written.

use crate::support::place::Place;
use rtfmesh::io::write;
use rtfmesh::mesh::samples::sample;

/// Runs and fails with `code` and one line on standard error that has all of `words`; no file comes or goes.
#[track_caller]
fn refused(place: &Place, arguments: &str, code: i32, words: &[&str]) {
    refused_in(place, arguments, &[], code, words);
}

#[track_caller]
fn refused_in(place: &Place, arguments: &str, environment: &[(&str, &str)], code: i32, words: &[&str]) {
    let before = place.files();
    let mut program = place.program(arguments);
    program.envs(environment.iter().copied());
    let done = program.assert().code(code).stdout("");
    let line = String::from_utf8(done.get_output().stderr.clone()).unwrap();
    assert!(line.starts_with("error: ") && line.lines().count() == 1 && line.ends_with('\n'), "{line}");
    assert!(line.contains("; "), "no remedy: {line}");
    for word in words {
        assert!(line.contains(word), "'{word}' is missing in: {line}");
    }
    assert_eq!(place.files(), before, "{arguments}");
}

/// Files that are no mesh, with what the error says about them.
#[track_caller]
fn refused_file(name: &str, content: &[u8], words: &[&str]) {
    let place = Place::new();
    std::fs::write(place.path(name), content).unwrap();
    let words: Vec<&str> = words.iter().copied().chain([name]).collect();
    refused(&place, &format!("remesh {name} out.ply -n 100 --report r.json"), 3, &words);
    refused(&place, &format!("measure {name}"), 3, &words);
    // Nothing else is measured against it either.
    write(place.path("good.ply"), &sample("box").unwrap()).unwrap();
    refused(&place, &format!("measure good.ply --against {name}"), 3, &words);
}

#[test]
fn files_that_are_no_mesh() {
    let place = Place::new();
    refused(&place, "remesh none.ply out.ply -n 100", 3, &["none.ply", "no such file"]);
    refused(&place, "measure none.ply", 3, &["none.ply", "no such file"]);
    std::fs::create_dir(place.path("folder.obj")).unwrap();
    refused(&place, "remesh folder.obj out.ply -n 100", 3, &["folder.obj", "directory"]);
    refused_file("empty.ply", b"", &["empty"]);
    refused_file("empty.obj", b"", &["empty"]);
    refused_file("mesh.foo", b"solid x\n", &[".foo", ".obj, .ply"]);
    refused_file("mesh.stl", b"solid x\n", &["endsolid"]);
    refused_file("mesh.obj", b"ply\nformat ascii 1.0\n", &["PLY header", "end_header"]);
    let garbage: Vec<u8> = (0..4096_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    refused_file("garbage.ply", &garbage, &[]);
    refused_file("garbage.obj", &garbage, &[]);
}

#[test]
fn truncated_files() {
    let place = Place::with("torus");
    let whole = std::fs::read(place.path("in.ply")).unwrap();
    for length in [3, 50, 400, whole.len() / 2, whole.len() - 1] {
        std::fs::write(place.path("cut.ply"), &whole[..length]).unwrap();
        refused(&place, "remesh cut.ply out.ply -n 100", 3, &["cut.ply"]);
    }
}

const POINTS: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";

#[test]
fn faces_and_numbers_that_make_no_sense() {
    let obj =
        |rest: &str, words: &[&str]| refused_file("bad.obj", format!("{POINTS}{rest}").as_bytes(), words);
    obj("f 1 2 5\n", &["line 5", "vertex 5"]);
    obj("f 1 2 3\nf 0 1 2\n", &["line 6", "vertex 0"]);
    obj("f 1 2\n", &["no faces"]);
    obj("l 1 2\n", &["no faces"]);
    obj("v nan 0 0\nf 1 2 5\n", &["no face has finite coordinates"]);
    let text = |count: usize, rest: &str| {
        let head =
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
        format!("{head}element face {count}\nproperty list uchar int vertex_indices\nend_header\n{rest}")
    };
    let ply = |rest: &str, words: &[&str]| refused_file("bad.ply", text(1, rest).as_bytes(), words);
    ply("0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", &["vertex 3"]);
    ply("0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n", &["no face has finite coordinates"]);
    // Points are no mesh, though a mesh is measured against them.
    let place = Place::new();
    std::fs::write(place.path("bad.ply"), text(0, "0 0 0\n1 0 0\n0 1 0\n")).unwrap();
    refused(&place, "remesh bad.ply out.ply -n 100", 3, &["bad.ply", "no faces"]);
    refused(&place, "measure bad.ply", 3, &["bad.ply", "no faces"]);
}

#[test]
fn meshes_without_area() {
    let place = Place::new();
    for (name, points) in [("point", ["2 3 4"; 3]), ("line", ["0 0 0", "1 1 1", "2 2 2"])] {
        let [a, b, c] = points;
        let faces = "f 1 2 3\nf 1 2 2\n";
        std::fs::write(place.path("flat.obj"), format!("v {a}\nv {b}\nv {c}\n{faces}")).unwrap();
        refused(&place, "remesh flat.obj out.ply -n 100 --report r.json", 3, &["flat.obj", "area"]);
        assert_eq!(place.files(), ["flat.obj"], "{name}");
    }
}

#[test]
fn counts_that_cannot_be() {
    let place = Place::with("torus");
    for (n, noun) in [(0, "vertices are"), (1, "vertex is"), (3, "vertices are")] {
        let line = format!("remesh in.ply out.ply -n {n} --report r.json");
        refused(&place, &line, 2, &[&format!("{n} {noun} too few"), "at least 4"]);
    }
    for n in [
        "-5",
        "many",
        "1.5",
        "1.2345k",
        "1,5k",
        "12,34",
        "1_0",
        "k",
        "1e4",
        "10kk",
        "99999999999999999999999",
    ] {
        refused(&place, &format!("remesh in.ply out.ply -n {n}"), 2, &[n]);
    }
    refused(&place, "remesh in.ply out.ply -n 5000000000", 2, &["5000000000"]);
    let line = "remesh in.ply out.ply -n 500000000 --report r.json";
    refused(&place, line, 4, &["bytes", "ask for at most"]);
    refused(&place, "remesh in.ply out.ply -n 100 --iterations 4294967295", 2, &["0 to 1000000"]);
    for (options, name) in [("--centroid area", "--centroid"), ("--k-clip 30", "--k-clip")] {
        let line = format!("remesh in.ply out.ply -n 100 {options}");
        refused(&place, &line, 2, &[name, "--preset rtf"]);
    }
    for (options, words) in [
        ("--face power", ["--face", "--preset rtf"]),
        ("--preset rtf --projection plane", ["--projection plane", "use --normals cloud"]),
        ("--preset rtf --normals surface", ["--normals surface", "--projection walk"]),
        ("--preset rtf --neighbours lists --k-clip 40", ["32 neighbours", "--neighbours brute"]),
        ("--preset rvd --normals fit", ["--normals", "--preset rtf"]),
        ("--preset rtf --face exact --k-clip 20", ["--k-clip", "tangent"]),
        ("--preset rvc --k-normal 12", ["--k-normal", "--normals fit"]),
        ("--preset rtf --offset 1", ["--offset", "--preset rpf"]),
        ("--preset rtf --lbfgs 7", ["--lbfgs", "use --preset rvd"]),
        ("--lbfgs 7", ["--lbfgs", "use --preset rvd"]),
        ("--preset cvd --lbfgs 7", ["--lbfgs", "use --momentum 0"]),
        ("--preset rvd --lbfgs 7 --momentum 0.5", ["momentum", "--momentum 0"]),
        ("--preset rvd --lbfgs 51", ["--lbfgs 51", "0 to 50"]),
        ("--preset mps --lbfgs 7", ["--lbfgs", "--iterations 160"]),
    ] {
        refused(&place, &format!("remesh in.ply out.ply -n 100 {options}"), 2, &words);
    }
    for (options, name) in [("--quality best", "--quality"), ("--no-fit", "--no-fit")] {
        let line = format!("remesh in.ply out.ply -n 100 --preset rtf {options}");
        refused(&place, &line, 2, &[name, "--preset default"]);
    }
}

#[test]
fn options_out_of_range_and_unknown_words() {
    let place = Place::with("torus");
    for (option, words) in [
        ("--preset rtf --k-normal 2", ["--k-normal 2", "3 to 49"]),
        ("--preset rtf --k-normal 50", ["--k-normal 50", "3 to 49"]),
        ("--preset rtf --k-clip 2", ["--k-clip 2", "3 to 48"]),
        ("--preset rtf --k-clip 49", ["--k-clip 49", "3 to 48"]),
        ("--preset rtf --k-project 0", ["--k-project 0", "1 to 48"]),
        ("--preset rtf --k-project 49", ["--k-project 49", "1 to 48"]),
        ("--tolerance=-1", ["--tolerance -1", "1e-4"]),
        ("--tolerance nan", ["--tolerance NaN", "1e-4"]),
        ("--iterations -1", ["-1", "--help"]),
        ("--seed x", ["--seed", "--help"]),
        ("--preset best", ["best", "rtf"]),
        ("--centroid middle", ["middle", "corners, weighted-corners, area"]),
        ("--colour", ["--colour", "--help"]),
    ] {
        refused(&place, &format!("remesh in.ply out.ply -n 100 --report r.json {option}"), 2, &words);
    }
    refused(&place, "remsh in.ply out.ply -n 100", 2, &["remsh", "remesh"]);
    for (sizes, words) in [
        ("-n 100 --ratio 0.5", ["--vertices", "--ratio"]),
        ("--edge-length 0.1 --ratio 0.5", ["--edge-length", "--ratio"]),
        ("--edge-length 0", ["edge length 0", "above 0"]),
        ("--edge-length=-1%", ["edge length -0.01", "above 0"]),
        ("--edge-length 1m", ["1m", "1% of the diagonal"]),
        ("--edge-length 1e-9", ["vertices", "longer edges"]),
        ("--ratio nan", ["ratio NaN", "above 0"]),
        ("--ratio 1e9", ["vertices", "smaller ratio"]),
        ("-n 100 --format foo", ["foo", "obj, ply"]),
        ("-n 100 --input-format foo", ["foo", "obj, ply"]),
    ] {
        refused(&place, &format!("remesh in.ply out.ply {sizes}"), 2, &words);
    }
    refused(&place, "remesh in.ply - -n 100", 2, &["standard output", "--format"]);
    refused(&place, "measure in.ply --against in.ply --accuracy 0", 2, &["accuracy", "use 1e-6 to 0.5"]);
    refused(&place, "remesh in.ply out.ply -n 9 --accuracy 0.1", 2, &["--report"]);
    refused(&place, "measure - --against -", 2, &["only one of the meshes"]);
    refused(&place, "remesh", 2, &["<INPUT>", "<OUTPUT>"]);
    refused(&place, "sample torus", 2, &["<OUTPUT>"]);
    refused(&place, "sample teapot out.ply", 2, &["teapot", "torus, genus3"]);
    // Without any word there are first steps, as an error.
    let told = place.program("").assert().code(2).stdout("").get_output().stderr.clone();
    let told = String::from_utf8(told).unwrap();
    assert!(told.starts_with("Usage: rtfmesh") && told.contains("rtfmesh demo "), "{told}");
    assert!(told.lines().count() <= 12 && told.lines().all(|line| line.chars().count() <= 100), "{told}");
}

#[test]
fn targets_that_cannot_be_written() {
    let place = Place::with("torus");
    std::fs::create_dir(place.path("folder.ply")).unwrap();
    for (target, words) in [
        ("missing/out.ply", ["missing", "create the folder"]),
        ("folder.ply", ["directory", "give the name"]),
        ("out.xyz", [".xyz", ".obj, .ply, .stl"]),
        ("out.gltf", ["glTF", ".glb"]),
        ("out", ["no extension", ".obj, .ply, .stl"]),
    ] {
        refused(&place, &format!("remesh in.ply {target} -n 100 --report r.json"), 1, &words);
        refused(&place, &format!("sample box {target}"), 1, &words);
    }
    refused(&place, "remesh in.ply out.ply -n 100 --report missing/r.json", 1, &["missing/r.json"]);
    refused(&place, "remesh in.ply out.ply -n 100 --report -", 1, &["standard output", "name a file"]);
    refused(&place, "inspect in.ply --curves -", 1, &["standard output"]);
    refused(&place, "remesh in.ply out.ply -n 100 --report folder.ply", 1, &["folder.ply", "directory"]);
    // The report must not end up in a mesh.
    let before = std::fs::read(place.path("in.ply")).unwrap();
    refused(&place, "remesh in.ply out.ply -n 100 --report out.ply", 2, &["out.ply", "another file"]);
    refused(&place, "remesh in.ply out.ply -n 100 --report ./in.ply", 2, &["in.ply", "another file"]);
    assert_eq!(std::fs::read(place.path("in.ply")).unwrap(), before);
}

#[cfg(unix)]
#[test]
fn read_only_files_and_folders_stay_as_they_are() {
    use std::os::unix::fs::PermissionsExt;
    let place = Place::with("torus");
    let allow = |path: &std::path::Path, mode| {
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    };
    std::fs::write(place.path("kept.ply"), "kept").unwrap();
    allow(&place.path("kept.ply"), 0o444);
    refused(&place, "remesh in.ply kept.ply -n 100", 1, &["kept.ply", "read-only"]);
    assert_eq!(std::fs::read(place.path("kept.ply")).unwrap(), b"kept");
    let folder = place.path("fixed");
    std::fs::create_dir(&folder).unwrap();
    allow(&folder, 0o555);
    // The superuser writes anyway, so there is nothing to see then.
    if std::fs::write(folder.join("try"), "").is_err() {
        refused(&place, "remesh in.ply fixed/out.ply -n 100", 1, &["fixed/out.ply", "permissions"]);
    }
    allow(&folder, 0o755);
}

#[test]
fn devices_that_are_not_there() {
    let place = Place::with("torus");
    let line = "remesh in.ply out.ply -n 100 --report r.json";
    refused(&place, &format!("{line} --device teapot"), 4, &["teapot", "there are: 0 "]);
    refused(&place, &format!("{line} --device 99"), 4, &["'99'"]);
    refused_in(&place, line, &[("RTFMESH_DEVICE", "teapot")], 4, &["teapot"]);
}

#[test]
fn a_machine_without_vulkan() {
    let place = Place::with("torus");
    let none = [
        ("VK_ICD_FILENAMES", "/nonexistent"),
        ("VK_DRIVER_FILES", "/nonexistent"),
        ("VK_ADD_DRIVER_FILES", ""),
    ];
    refused_in(
        &place,
        "remesh in.ply out.ply -n 100 --report r.json",
        &none,
        4,
        &["Vulkan", "driver", "install"],
    );
    refused_in(&place, "devices", &none, 4, &["Vulkan", "driver", "install"]);
    // What needs no device works.
    place.program("measure in.ply --json").envs(none).assert().success();
    place.program("sample box box.ply").envs(none).assert().success();
}

#[test]
fn sharp_edges_that_cannot_be_kept() {
    let place = Place::with("box");
    refused(&place, "remesh in.ply out.ply -n 100 --feature-angle 0", 2, &["--feature-angle 0", "180"]);
    refused(&place, "remesh in.ply out.ply -n 100 --feature-angle 181", 2, &["--feature-angle 181"]);
    refused(&place, "remesh in.ply out.ply -n 100 --features none.obj", 3, &["none.obj", "no such file"]);
    let rtf = "remesh in.ply out.ply -n 100 --preset rtf --feature-angle 30";
    refused(&place, rtf, 2, &["--feature-angle", "preset default"]);
    refused(&place, "remesh in.ply out.ply -n 99 --strict --vertices-at-least", 2, &["cannot be used with"]);
    for option in ["--weld 1", "--weld=-1", "--min-component nan", "--min-component 1", "--smooth-boundary 1"]
    {
        let line = format!("remesh in.ply out.ply -n 100 {option}");
        refused(&place, &line, 2, &[option.split([' ', '=']).next().unwrap()]);
    }
    std::fs::write(place.path("f.obj"), "v 0 0 0\nv 1 1 1\nv 0 0 0.5\nl 1 3\n").unwrap();
    refused(&place, "remesh in.ply out.ply -n 100 --features f.obj", 3, &["f.obj", "line 4"]);
    refused(&place, "remesh in.ply f.obj -n 100 --features f.obj", 2, &["f.obj", "overwritten"]);
}

#[test]
fn presets_refuse_a_faulty_mesh_if_asked_to() {
    let place = Place::with("genus3");
    let line = "remesh in.ply out.ply -n 20 --iterations 5 --preset";
    for preset in ["rtf", "rvd"] {
        let words = ["could not build a valid mesh with 20 vertices", "leave out --strict"];
        refused(&place, &format!("{line} {preset} --strict"), 3, &words);
        place.program(&format!("{line} {preset}")).assert().success();
        std::fs::remove_file(place.path("out.ply")).unwrap();
    }
    refused(
        &place,
        &format!("{line} rtf --vertices-at-least"),
        2,
        &["--vertices-at-least", "preset default"],
    );
}
