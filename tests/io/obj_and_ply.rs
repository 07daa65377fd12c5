//! OBJ and PLY files: every variant of both, and what writers guarantee.

use std::path::{Path, PathBuf};

use glam::DVec3;
use rtfmesh::io::{Loaded, check_target, check_text_target, read, write, write_text};
use rtfmesh::mesh::attributes::Kind;
use rtfmesh::mesh::samples::sample;
use rtfmesh::{Error, TriMesh};

/// A file of this name and content in a folder of its own.
pub(crate) fn file(name: &str, content: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    (folder, path)
}

fn load(name: &str, content: impl AsRef<[u8]>) -> Loaded {
    let (_folder, path) = file(name, content.as_ref());
    read(&path).unwrap()
}

fn positions(mesh: &TriMesh) -> Vec<[f64; 3]> {
    mesh.vertices.iter().map(DVec3::to_array).collect()
}

const SQUARE: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.5], [0.0, 1.0, 0.0]];

#[test]
fn formats_of_64_bits_round_trip_every_bit() {
    let mut mesh = sample("two-components").unwrap();
    mesh.vertices[0] = DVec3::new(0.1, 1.0 / 3.0, -1e300);
    mesh.vertices[1] = DVec3::new(5e-324, 1e-300, 123_456_789.123_456_78);
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.obj", "a.ply", "B.OBJ", "B.Ply", "a.off", "a.mesh", "a.ply.gz", "a.OFF.GZ"] {
        let path = folder.path().join(name);
        write(&path, &mesh).unwrap();
        let loaded = read(&path).unwrap();
        // An OBJ comes back in the order of first use.
        let corners = |mesh: &TriMesh| (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect::<Vec<_>>();
        assert_eq!(corners(&loaded.mesh), corners(&mesh), "{name}");
        assert_eq!(loaded.mesh.vertices.len(), mesh.vertices.len(), "{name}");
        assert_eq!(loaded.notes, Vec::<String>::new(), "{name}");
    }
    for name in ["a.ply", "a.off", "a.mesh", "a.ply.gz"] {
        assert_eq!(read(folder.path().join(name)).unwrap().mesh, mesh, "{name}");
    }
    let text = std::fs::read_to_string(folder.path().join("a.obj")).unwrap();
    assert_eq!(text.lines().next(), Some("v 0.1 0.3333333333333333 -1e300"));
}

#[test]
fn obj_polygons_groups_and_negative_indices() {
    let text = "\u{feff}# caf\u{e9}\nmtllib missing.mtl\no first\nv 0 0 0\nv 1 0 0 0.5 0.5 0.5 1\nv 1 1 .5\nv 0 1 0 1.0\n\
                vt 0 0\nvn 0 0 1\nusemtl none\ng a b\nf 1/1/-99 2//1 3/7 4 # quad\ng c\nv 0 0 1\n\
                f -1 \\\n -5 -4\nf 5 6 1\nl 1 2\np 3\nv 2 2 2\nvp 1 2\ns off\n";
    let Loaded { mesh, notes, attributes, .. } = load("a.obj", text);
    let mut expected = SQUARE.to_vec();
    expected.extend([[0.0, 0.0, 1.0], [2.0, 2.0, 2.0]]);
    assert_eq!(positions(&mesh), expected);
    // Vertices are shared across groups, and a face may come before its vertex.
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [4, 0, 1], [4, 5, 0]]);
    assert_eq!(
        notes,
        [
            "1 face with more than 3 vertices was split into triangles",
            "2 point and line elements were ignored",
            "lines with these keywords were ignored: vp",
            "colours were ignored: not all vertices have one",
            "normals were ignored: not all corners have one",
            "texture coordinates were ignored: not all corners have them",
        ]
    );
    let material = attributes.face_named("material").unwrap();
    assert_eq!((&material.names, &material.values), (&vec!["none".to_owned()], &vec![0.0; 4]));
    let group = attributes.face_named("group").unwrap();
    assert_eq!(
        (&group.names, &group.values),
        (&vec!["a b".to_owned(), "c".to_owned()], &vec![0., 0., 1., 1.])
    );
    assert_eq!(attributes.libraries, ["missing.mtl"]);
}

#[test]
fn obj_with_windows_line_ends_latin_names_and_unused_vertices() {
    let mut text = b"o caf\xe9\r\nv 9 9 9\r\nv 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\n".to_vec();
    text.extend(b"f 4 2 3\r\n");
    let Loaded { mesh, notes, .. } = load("a.obj", text);
    assert_eq!(positions(&mesh), [[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert_eq!(notes, ["1 vertex that no face uses was left out"]);
}

#[test]
fn ply_text_with_any_order_types_extras_and_polygons() {
    let text = "ply\nformat ascii 1.0\ncomment by hand\nobj_info x\nelement material 2\nproperty uchar red\n\
                element face 2\nproperty uchar flag\nproperty list ushort uint16 vertex_index\nproperty list uchar float uv\n\
                element vertex 4\nproperty float nx\nproperty double z\nproperty list uchar int ring\nproperty int x\n\
                property float y\nelement edge 1\nproperty int a\nend_header\n7\n8\n\n1 4 0 1 2 3 2 .5 1.\n\n0 3 2 1 0 0\n\
                nan 0 2 5 6 0 0\n-nan(ind) 0 0 1 0\n0 .5 0 1 1. 99 99\n0 0e0 0 +0 1\n";
    let Loaded { mesh, notes, attributes, .. } = load("a.ply", text);
    assert_eq!(positions(&mesh), SQUARE);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [2, 1, 0]]);
    assert_eq!(
        notes,
        [
            "2 elements 'material' were ignored",
            "1 face with more than 3 vertices was split into triangles",
            "these properties of each face were ignored: uv",
            "these properties of each vertex were ignored: ring",
            "values beyond those that the header declares were ignored (first on line 28)",
        ]
    );
    assert_eq!(attributes.face_named("flag").unwrap().values, [1.0, 1.0, 0.0]);
    let nx = &attributes.vertex[0];
    assert_eq!((nx.name.as_str(), nx.kind), ("nx", Kind::F32));
    assert_eq!((nx.values[0].is_nan(), nx.values[1].is_nan(), &nx.values[2..]), (true, true, &[0.0; 2][..]));
}

#[test]
fn ply_text_with_other_line_ends_and_comments_in_latin() {
    let text = b"ply\nformat ascii 1.0\ncomment caf\xe9\nelement vertex 3\nproperty float x\nproperty float y\n\
                 property float z\nelement face 1\nproperty list uchar int vertex_indices\nelement void 99999999999\n\
                 end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2";
    for end in [&b"\n"[..], b"\r\n", b"\r"] {
        let content = text.split(|byte| *byte == b'\n').collect::<Vec<_>>().join(end);
        let loaded = load("a.ply", content);
        assert_eq!(positions(&loaded.mesh), [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        assert_eq!(loaded.mesh.triangles, [[0, 1, 2]]);
    }
}

/// The square in binary: coordinates of this type and lists of these types, with extras in between.
fn binary_square(big: bool, coordinate: &str, count: &str, index: &str) -> Vec<u8> {
    fn append_number(bytes: &mut Vec<u8>, big: bool, kind: &str, value: f64) {
        let mut raw = match kind {
            "char" => (value as i8).to_le_bytes().to_vec(),
            "uchar" => (value as u8).to_le_bytes().to_vec(),
            "int16" => (value as i16).to_le_bytes().to_vec(),
            "ushort" => (value as u16).to_le_bytes().to_vec(),
            "int" => (value as i32).to_le_bytes().to_vec(),
            "uint32" => (value as u32).to_le_bytes().to_vec(),
            "float" => (value as f32).to_le_bytes().to_vec(),
            _ => value.to_le_bytes().to_vec(),
        };
        if big {
            raw.reverse();
        }
        bytes.extend(raw);
    }
    let order = if big { "big" } else { "little" };
    let mut bytes = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement camera 1\nproperty list uchar short v\nelement vertex 4\n\
         property {coordinate} y\nproperty short flag\nproperty {coordinate} x\nproperty list uint int l\n\
         property {coordinate} z\nelement face 2\nproperty list {count} {index} vertex_indices\nproperty double q\n\
         end_header\n"
    )
    .into_bytes();
    let out = &mut bytes;
    append_number(out, big, "uchar", 2.0);
    append_number(out, big, "int16", 1.0);
    append_number(out, big, "int16", 2.0);
    for [x, y, z] in SQUARE {
        append_number(out, big, coordinate, 2.0 * y);
        append_number(out, big, "int16", -1.0);
        append_number(out, big, coordinate, 2.0 * x);
        append_number(out, big, "uint32", 1.0);
        append_number(out, big, "int", 77.0);
        append_number(out, big, coordinate, 2.0 * z);
    }
    for face in [&[0.0, 1.0, 2.0, 3.0][..], &[3.0, 2.0, 1.0]] {
        append_number(out, big, count, face.len() as f64);
        face.iter().for_each(|vertex| append_number(out, big, index, *vertex));
        append_number(out, big, "double", 0.25);
    }
    bytes
}

#[test]
fn ply_binary_in_every_type_and_byte_order() {
    let doubled = SQUARE.map(|position| position.map(|value| 2.0 * value));
    for big in [false, true] {
        for kind in ["char", "uchar", "int16", "ushort", "int", "uint32"] {
            for coordinate in ["float", "double", kind] {
                let loaded = load("a.ply", binary_square(big, coordinate, kind, kind));
                let mesh = loaded.mesh;
                assert_eq!(positions(&mesh), doubled, "{big} {kind} {coordinate}");
                assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [3, 2, 1]], "{big} {kind} {coordinate}");
            }
        }
    }
}

#[test]
fn written_files_replace_old_ones_at_once_and_leave_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.ply");
    std::fs::write(&path, "old").unwrap();
    check_target(&path).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    write(&path, &sample("box").unwrap()).unwrap();
    assert_eq!(read(&path).unwrap().mesh, sample("box").unwrap());
    let report = folder.path().join("report.json");
    check_text_target(&report).unwrap();
    assert!(!report.exists());
    write_text(&report, "{}\n").unwrap();
    assert_eq!(std::fs::read_to_string(&report).unwrap(), "{}\n");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[cfg(unix)]
#[test]
fn written_files_have_ordinary_permissions_and_links_stay() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let [plain, ours, link] = ["plain.txt", "ours.obj", "link.obj"].map(|name| folder.path().join(name));
    std::fs::write(&plain, "").unwrap();
    write(&ours, &sample("tetrahedron").unwrap()).unwrap();
    let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&ours), mode(&plain));
    std::os::unix::fs::symlink(&ours, &link).unwrap();
    write(&link, &sample("box").unwrap()).unwrap();
    assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(read(&ours).unwrap().mesh.triangles.len(), 12);
}

fn output_problem(error: Error) -> String {
    match error {
        Error::Output { problem, remedy, .. } => {
            assert!(!remedy.is_empty());
            problem
        }
        other => panic!("not an output error: {other:?}"),
    }
}

#[test]
fn targets_that_cannot_be_written_are_refused_early() {
    let (folder, read_only) = file("fixed.obj", b"old");
    let mut permissions = std::fs::metadata(&read_only).unwrap().permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(&read_only, permissions).unwrap();
    let directory = folder.path().join("folder.ply");
    std::fs::create_dir(&directory).unwrap();
    let mesh = sample("tetrahedron").unwrap();
    for (path, expected) in [
        (folder.path().join("a.foo"), "unknown file type '.foo'"),
        (folder.path().join("a.xyz"), "this format has no faces"),
        (folder.path().join("a.foo.gz"), "unknown file type '.gz'"),
        (folder.path().join("a.gltf"), "glTF is written as .glb only"),
        (folder.path().join("a"), "the file name has no extension"),
        (folder.path().join("missing/a.obj"), "there is no folder"),
        (read_only.clone(), "the file is read-only"),
        (directory, "this is a directory"),
    ] {
        for result in [check_target(&path), write(&path, &mesh)] {
            let problem = output_problem(result.unwrap_err());
            assert!(problem.starts_with(expected), "{problem}");
        }
    }
    assert_eq!(std::fs::read(&read_only).unwrap(), b"old");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    assert_eq!(output_problem(check_text_target(Path::new("/")).unwrap_err()), "this is not a file name");
}

#[cfg(target_os = "linux")]
#[test]
fn devices_and_unwritable_folders_are_refused() {
    let problem = output_problem(write_text(Path::new("/dev/null"), "x").unwrap_err());
    assert_eq!(problem, "this is not a regular file");
    let problem = output_problem(check_target(Path::new("/proc/rtfmesh.obj")).unwrap_err());
    assert!(problem.starts_with("the file cannot be written"), "{problem}");
}
