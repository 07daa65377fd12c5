//! Invalid mesh files: what the error names, and that no damage leads to a panic or a hang.

use std::io::{Seek, Write};
use std::path::Path;
use std::time::{Duration, Instant};

use rtfmesh::Error;
use rtfmesh::io::{read, write};
use rtfmesh::mesh::samples::sample;

use super::obj_and_ply::file;
use crate::support::files::{gltf_of, text_stl};

/// Far longer than a small file takes on a busy machine, and far shorter than billions of elements.
const LIMIT: Duration = Duration::from_secs(30);

/// The place and problem of the error on reading this file; checks path and remedy.
fn refused(name: &str, content: &[u8]) -> (String, String) {
    let (_folder, path) = file(name, content);
    refused_path(&path)
}

fn refused_path(path: &Path) -> (String, String) {
    let error = read(path).expect_err("the file was accepted");
    let line = error.to_string();
    assert!(!line.contains('\n') && line.chars().count() < 400, "{line}");
    match error {
        Error::Input { path: named, place, problem, remedy, .. } => {
            assert_eq!(named.as_deref(), Some(path));
            assert!(!remedy.is_empty());
            (place.unwrap_or_default(), problem)
        }
        other => panic!("not an input error: {other:?}"),
    }
}

#[track_caller]
pub(crate) fn assert_refused(name: &str, content: impl AsRef<[u8]>, place: &str, problem: &str) {
    let (found_place, found_problem) = refused(name, content.as_ref());
    assert_eq!(found_place, place, "{found_problem}");
    assert!(found_problem.contains(problem), "'{found_problem}' does not say '{problem}'");
}

#[test]
fn paths_without_a_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    assert_eq!(refused_path(&at("none.obj")).1, "there is no such file");
    assert_eq!(refused_path(&at("none.xyz")).1, "there is no such file");
    std::fs::create_dir(at("dir.obj")).unwrap();
    assert_eq!(refused_path(&at("dir.obj")).1, "this is a directory");
    assert_refused("a.foo", "solid", "", "unknown file type '.foo'");
    assert_refused("a", "solid", "", "no extension");
    assert_refused("a.obj", "", "", "the file is empty");
    assert_refused("a.glb", "", "", "the file is empty");
    assert_refused("a.PLY", "", "", "the file is empty");
}

const THREE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

#[test]
fn obj_errors_name_the_line() {
    for (face, problem) in [
        ("f 1 2 4", "there is no vertex 4, the file has 3"),
        ("f 1 2 9223372036854775807", "there is no vertex 9223372036854775807"),
        ("f 0 1 2", "there is no vertex 0"),
        ("f -4 1 2", "there is no vertex -4"),
        ("f -9223372036854775808 1 2", "there is no vertex -9223372036854775808"),
        ("f 1 2 9223372036854775808", "'9223372036854775808' is not a whole number"),
        ("f 1 2 x", "'x' is not a whole number"),
        ("f 1.5 2 3", "'1.5' is not a whole number"),
        ("f /1 2 3", "'/1' is not a whole number"),
        ("v 1 2", "no z coordinate"),
        ("v 1 2,5 3", "y coordinate '2,5' is not a number"),
        ("o \0", "binary data"),
    ] {
        assert_refused("a.obj", format!("{THREE}f 1 2 3\n{face}\nf 3 2 1\n"), "line 5", problem);
    }
    // The error names the first face with a vertex that is never defined.
    assert_refused("a.obj", format!("{THREE}f 1 2 4\nf 1 2 6\nf 1 2 5\nv 5 5 5\n"), "line 5", "no vertex 6");
    assert_refused("a.obj", format!("f 1 2 \\\n3 4\n{THREE}"), "line 1", "no vertex 4");
}

#[test]
fn obj_without_a_surface() {
    assert_refused("a.obj", format!("{THREE}l 1 2\n"), "", "no faces");
    assert_refused("a.obj", format!("{THREE}f 1 2\n"), "", "no faces");
    assert_refused("a.obj", "f 1 2 3\n", "", "no vertices");
    assert_refused("a.obj", "# nothing\n", "", "no vertices");
    assert_refused("a.obj", "gibberish in words\n", "", "no vertices");
    assert_refused("a.obj", b"\x7fELF\x01\n\x00\x02\xff", "line 2", "binary data");
}

/// A text PLY of three vertices and one face; the vertices start on line 9, the face is on line 12.
fn ply(vertices: &str, face: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1\nproperty list char int vertex_indices\nend_header\n{vertices}{face}"
    )
}

const CORNERS: &str = "0 0 0\n1 0 0\n0 1 0\n";

#[test]
fn ply_data_errors_name_line_and_element() {
    for (face, problem) in [
        ("3 0 1 3\n", "no vertex 3, indices go from 0 to 2"),
        ("3 0 -1 2\n", "no vertex -1"),
        ("3 0 1 x\n", "'x' is not a number"),
        ("3 0 1 1.5\n", "'1.5' is not a number"),
        ("3 0 1 nan\n", "'NaN' is not a number"),
        ("-3 0 1 2\n", "'-3' is not a number"),
        ("3 0 1\n\n", "too few values"),
        ("3 0 1", "face 0 of 1 is incomplete"),
        ("1e300 0 1 2", "face 0 of 1 is incomplete"),
    ] {
        assert_refused("a.ply", ply(CORNERS, face), "line 13, face 0", problem);
    }
    for (vertex, problem) in [
        ("1 0\n", "too few values"),
        ("1 0 0,5\n", "'0,5' is not a number"),
        ("1 0 \u{1}\u{1b}[31m\n", r"'\u{1}\u{1b}[31m' is not a number"),
    ] {
        let content = ply(&format!("0 0 0\n{vertex}0 1 0\n"), "3 0 1 2\n");
        assert_refused("a.ply", content, "line 11, vertex 1", problem);
    }
    assert_refused("a.ply", ply("0 0 0\n1 0 0\n0 1 0\n\n\n\n\n", ""), "line 16, face 0", "incomplete");
}

#[test]
fn ply_header_errors_name_the_line() {
    let good = ply(CORNERS, "3 0 1 2\n");
    for (old, new, place, problem) in [
        ("format ascii 1.0", "format ascii 2.0", "line 2", "version '2.0'"),
        ("format ascii 1.0", "format utf8 1.0", "line 2", "unknown PLY format 'utf8'"),
        ("format ascii 1.0", "comment", "", "no 'format' line"),
        ("format ascii 1.0", "property int x", "line 2", "before any element"),
        ("element vertex 3", "elemnt vertex 3", "line 3", "'elemnt vertex 3' is not a PLY header line"),
        ("element vertex 3", "element vertex -3", "line 3", "'-3' is not a whole number"),
        ("element vertex 3", "element vertex", "line 3", "is not a PLY header line"),
        ("property float y", "property half y", "line 5", "unknown property type 'half'"),
        ("property float y", "property list y", "line 5", "unknown property type 'list'"),
        ("property float y", "property float", "line 5", "incomplete"),
        ("property float y", "property float x", "line 5", "'x' is declared twice"),
        ("property float y", "property float v", "", "no number 'y'"),
        ("property float y", "property list uchar float y", "", "no number 'y'"),
        ("element face 1", "element vertex 1", "line 7", "'vertex' is declared twice"),
        ("list char int", "list float int", "line 8", "list count type 'float'"),
        ("list char int", "list char float", "", "no integer list 'vertex_indices'"),
        ("vertex_indices", "vertices", "", "no integer list 'vertex_indices'"),
        ("end_header", "", "line 10", "is not a PLY header line"),
        ("element vertex 3", "element vertex 0", "", "no vertices"),
        ("element face 1", "element face 0", "", "no faces"),
        ("element face 1", "element face 4294967296", "line 12", "declares 4294967296 elements 'face'"),
        (
            "element vertex 3",
            "element vertex 4294967295",
            "",
            "4294967295 vertices, more than the 4294967294",
        ),
        ("ply\n", "plywood\n", "byte 0", "does not start with a 'ply' line"),
        ("ply\n", "ply\nply\n", "line 2", "'ply' is not a PLY header line"),
    ] {
        assert!(good.contains(old), "{old}");
        assert_refused("a.ply", good.replacen(old, new, 1), place, problem);
    }
    assert_refused("a.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", "", "no 'end_header'");
    assert_refused("a.ply", b"\x00\x01\x02\xff\xfe", "byte 0", "does not start");
}

#[test]
fn ply_that_declares_more_than_it_holds() {
    for (format, least) in [("ascii", 6), ("binary_little_endian", 12), ("binary_big_endian", 12)] {
        let content = ply(CORNERS, "3 0 1 2\n").replace("ascii", format);
        let content = content.replace("element vertex 3", "element vertex 1000000000");
        let start = Instant::now();
        let (_, problem) = refused("a.ply", content.as_bytes());
        let expected = format!("declares 1000000000 elements 'vertex' of at least {least}000000000 bytes");
        assert!(problem.contains(&expected), "{problem}");
        assert!(start.elapsed() < LIMIT);
    }
    // A list that claims 2^32 - 1 entries.
    let mut content = b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\nproperty uchar y\n\
                        property uchar z\nelement face 1\nproperty list uint uint vertex_indices\nend_header\n"
        .to_vec();
    content.extend([0, 0, 0, 255, 255, 255, 255, 0, 0, 0, 0]);
    let (place, problem) = refused("a.ply", &content);
    assert_eq!(place, format!("byte {}, face 0", content.len()));
    assert!(problem.contains("face 0 of 1 is incomplete"), "{problem}");
}

#[test]
fn binary_ply_cut_off_names_byte_and_element() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("box.ply");
    write(&path, &sample("box").unwrap()).unwrap();
    let whole = std::fs::read(&path).unwrap();
    let (place, problem) = refused("a.ply", &whole[..whole.len() - 20]);
    // Of face 10's 13 bytes 6 are left: its count, one index and a byte of the next.
    assert_eq!(place, format!("byte {}, face 10", whole.len() - 20 - 1));
    assert!(problem.contains("face 10 of 12 is incomplete"), "{problem}");
    let (place, problem) = refused("a.ply", &whole[..whole.len() - 12 * 13 - 1]);
    assert_eq!(place, format!("byte {}", whole.len() - 12 * 13 - 8 * 24));
    assert!(
        problem.contains("declares 8 elements 'vertex' of at least 192 bytes, but 191 bytes are left"),
        "{problem}"
    );
}

/// Cut, flipped, overwritten and doubled copies of `content`, always the same ones.
fn damaged(content: &[u8], round: u64) -> Vec<u8> {
    let mut state = round.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mut below = |limit: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % limit
    };
    let mut copy = content.to_vec();
    for _ in 0..=below(3) {
        let at = below(copy.len());
        match below(5) {
            0 => copy.truncate(at.max(1)),
            1 => copy[at] ^= 1 << below(8),
            2 => copy[at] = b"\0\n 9-.e\xff"[below(8)],
            3 => {
                let part = copy[at..(at + 1 + below(20)).min(copy.len())].to_vec();
                copy.splice(at..at, part);
            }
            _ => drop(copy.drain(at.min(copy.len() - 1)..(at + below(4)).min(copy.len() - 1).max(at))),
        }
    }
    copy
}

#[test]
fn no_damage_panics_or_hangs() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let written = ["binary.ply", "text.obj", "binary.stl", "a.off", "a.glb", "a.mesh"];
    for name in written.iter().chain(&["packed.off.gz"]) {
        write(at(name), &sample("box").unwrap()).unwrap();
    }
    std::fs::write(at("text.stl"), text_stl(&sample("box").unwrap())).unwrap();
    std::fs::write(at("a.gltf"), gltf_of(&sample("box").unwrap())).unwrap();
    std::fs::write(at("text.ply"), ply(CORNERS, "3 0 1 2\n")).unwrap();
    for name in written.iter().chain(&["text.ply", "text.stl", "a.gltf", "packed.off.gz"]) {
        let content = std::fs::read(at(name)).unwrap();
        let damaged_path = at(&format!("damaged-{name}"));
        let mut file = std::fs::File::create(&damaged_path).unwrap();
        let (mut accepted, mut refused) = (0, 0);
        for round in 0..2000 {
            // Emptying the file each time would make some file systems wait for the disk.
            let damaged = damaged(&content, round);
            file.rewind().unwrap();
            file.write_all(&damaged).unwrap();
            file.set_len(damaged.len() as u64).unwrap();
            let start = Instant::now();
            match read(&damaged_path) {
                Ok(loaded) => {
                    let mesh = loaded.mesh;
                    assert!(mesh.vertices.iter().all(|vertex| vertex.is_finite()));
                    let count = mesh.vertices.len();
                    assert!(mesh.triangles.as_flattened().iter().all(|vertex| (*vertex as usize) < count));
                    accepted += 1;
                }
                Err(Error::Input { .. }) => refused += 1,
                Err(other) => panic!("{name}, round {round}: {other:?}"),
            }
            assert!(start.elapsed() < LIMIT, "{name}, round {round}");
        }
        // Both outcomes must occur, or the damage tests nothing.
        // A compressed file has a checksum.
        let fewest = if name.ends_with(".gz") { 0 } else { 50 };
        assert!(accepted >= fewest && refused > 100, "{name}: {accepted} accepted, {refused} refused");
    }
}
