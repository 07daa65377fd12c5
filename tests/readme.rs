//! The recipes of README.md and docs/guide.md, run as they stand there, but for smaller meshes.

use crate::cloud::terrain::tile;
use crate::support::painted::painted_globe;
use crate::support::place::Place;
use crate::volume::{nifti, nrrd, volume_of};
use rtfmesh::TriMesh;
use rtfmesh::glam::DVec3;
use rtfmesh::io::{read, write};
use rtfmesh::mesh::samples::sample;
use std::collections::HashSet;
use std::path::Path;

/// The commands of a document: lines of its shell blocks that call the program, and pipes within sentences.
fn commands(document: &str) -> Vec<String> {
    let mut found = Vec::new();
    // Between fences, every second part is a block.
    for (place, part) in document.split("```").enumerate() {
        if place % 2 == 1 {
            let lines = part.strip_prefix("sh\n").unwrap_or_default().lines();
            found.extend(lines.filter(|line| line.starts_with("rtfmesh ")).map(str::to_owned));
        } else {
            let spans = part.split('`').skip(1).step_by(2);
            found
                .extend(spans.filter(|span| span.contains("| rtfmesh ")).map(|span| span.replace('\n', " ")));
        }
    }
    found
}

/// The same command for a mesh that takes little time.
fn smaller(command: &str) -> String {
    let mut counts = false;
    let word = |word: &str| {
        let smaller = if counts { "200" } else { word };
        counts = word == "-n";
        match word {
            "0.1%" => "2%".to_owned(),
            "1%" => "10%".to_owned(),
            "5%" => "50%".to_owned(),
            _ => smaller.to_owned(),
        }
    };
    command.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// A folder with everything that the recipes name.
fn kitchen() -> Place {
    let place = Place::new();
    let (scan, part) = (sample("bumpy-sphere").unwrap(), sample("box").unwrap());
    std::fs::create_dir(place.path("scans")).unwrap();
    for name in ["scan.ply", "scan.ply.gz", "scans/one.ply", "scans/two.ply"] {
        write(place.path(name), &scan).unwrap();
    }
    std::fs::create_dir(place.path("frames")).unwrap();
    for name in ["rest.ply", "frames/one.ply", "frames/two.ply"] {
        write(place.path(name), &scan).unwrap();
    }
    write(place.path("part.ply"), &part).unwrap();
    write(place.path("soup.obj"), &part).unwrap();
    write(place.path("points.ply"), &TriMesh { triangles: Vec::new(), ..scan.clone() }).unwrap();
    std::fs::write(place.path("painted.ply"), painted(&scan)).unwrap();
    let bone = volume_of([16, 16, 16], |p| 600.0 - 50.0 * p.distance(DVec3::splat(7.4)));
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    std::io::Write::write_all(&mut packed, &nifti(&bone)).unwrap();
    std::fs::write(place.path("ct.nii.gz"), packed.finish().unwrap()).unwrap();
    let organs = volume_of([16, 16, 16], |p| match p.distance(DVec3::splat(7.4)) {
        far if far > 6.0 => 0.0,
        _ => {
            if p.x < 7.2 {
                1.0
            } else {
                2.0
            }
        }
    });
    std::fs::write(place.path("organs.nrrd"), nrrd(&organs)).unwrap();
    std::fs::write(place.path("globe.gltf"), painted_globe()).unwrap();
    std::fs::write(place.path("tile.laz"), tile()).unwrap();
    std::fs::write(place.path("sensors.xyz"), "0.5 0.5 1\n0.25 0 0.5\n").unwrap();
    std::fs::create_dir(place.path("tiles")).unwrap();
    let at = |k: u32| DVec3::new(f64::from(k % 9) / 8.0, f64::from(k / 9) / 8.0, 0.0);
    let cell = |k: u32| [[k, k + 1, k + 10], [k, k + 10, k + 9]];
    let square = TriMesh {
        vertices: (0..81).map(|k| at(k) + 0.1 * at(k).x * at(k).y * DVec3::Z).collect(),
        triangles: (0..72).filter(|k| k % 9 < 8).flat_map(cell).collect(),
    };
    write(place.path("tiles/one.ply"), &square).unwrap();
    let [a, b, _] = part.corners(0).map(|p| format!("v {} {} {}\n", p.x, p.y, p.z));
    std::fs::write(place.path("lines.obj"), format!("{a}{b}l 1 2\n")).unwrap();
    place
}

/// A PLY file with colours, and a number, and a label for each half of the mesh.
fn painted(mesh: &TriMesh) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float size\nelement face {}\n\
         property list uchar int vertex_indices\nproperty int material\nend_header\n",
        mesh.vertices.len(),
        mesh.triangles.len()
    );
    for p in &mesh.vertices {
        text += &format!("{} {} {} {} 100 50 1.5\n", p.x, p.y, p.z, if p.z > 0.0 { 200 } else { 20 });
    }
    for (t, [a, b, c]) in mesh.triangles.iter().enumerate() {
        let upper = mesh.corners(t).iter().map(|p| p.z).sum::<f64>() > 0.0;
        text += &format!("3 {a} {b} {c} {}\n", i32::from(upper));
    }
    text
}

#[test]
fn every_recipe_works() {
    let mut all = Vec::new();
    for (file, least) in [("README.md", 12), ("docs/guide.md", 30)] {
        let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap();
        let commands = commands(&text);
        assert!(commands.len() >= least, "recipes are missing in {file}: {commands:?}");
        all.extend(commands.iter().map(|command| smaller(command)));
    }
    let mut seen = HashSet::new();
    all.retain(|command| seen.insert(command.clone()));
    let place = kitchen();
    let program = assert_cmd::cargo::cargo_bin!("rtfmesh");
    let path = format!("{}:{}", program.parent().unwrap().display(), std::env::var("PATH").unwrap());
    for command in all {
        let mut shell = assert_cmd::Command::new("bash");
        shell.current_dir(place.path("")).env("PATH", &path).env("RTFMESH_CACHE_DIR", place.path("cache"));
        let done = shell.args(["-c", &format!("set -o pipefail; {command}")]).ok();
        assert!(done.is_ok(), "{command}: {done:?}");
    }
    for (name, fewest) in [
        ("scan-10k.ply", 200),
        ("even.ply", 200),
        ("out.glb", 50),
        ("painted-10k.glb", 200),
        ("globe.glb", 200),
    ] {
        assert!(read(place.path(name)).unwrap().mesh.vertices.len() >= fewest, "{name}");
    }
}
