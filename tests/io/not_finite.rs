//! Vertices without finite coordinates, as depth cameras write them, and the faces on them.

use glam::DVec3;
use rtfmesh::WarningCode;
use rtfmesh::io::{Loaded, Reader, Writer, target_encoding};
use rtfmesh::mesh::samples::sample;
use std::path::Path;

fn read(name: &str, content: &[u8]) -> rtfmesh::Result<Loaded> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    Reader::new().read_any(path)?.mesh_or_points()
}

fn load(name: &str, content: &[u8]) -> Loaded {
    read(name, content).unwrap()
}

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 5\nproperty double x\nproperty double y\n\
    property double z\nproperty int tag\nelement face 3\nproperty list int int vertex_indices\n\
    property list int double texcoord\nproperty int part\nend_header\n";

#[test]
fn vertices_without_a_place_are_left_out_with_their_faces() {
    let vertices = "0 0 0 5\n1 0 0 6\nnan 0 0 7\n1 1 0 8\n0 1 0 9\n";
    let faces = "3 0 1 3 6 0 0 1 0 1 1 30\n3 0 2 3 6 2 2 2 2 2 2 31\n3 0 3 4 6 0 0 1 1 0 1 32\n";
    let loaded = load("a.ply", format!("{PLY}{vertices}{faces}").as_bytes());
    let square = [[0., 0.], [1., 0.], [1., 1.], [0., 1.]].map(|[x, y]| DVec3::new(x, y, 0.0));
    assert_eq!(loaded.mesh.vertices, square);
    assert_eq!(loaded.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(loaded.attributes.vertex[0].values, [5.0, 6.0, 8.0, 9.0]);
    assert_eq!(loaded.attributes.face[0].values, [30.0, 32.0]);
    let uv = loaded.attributes.uv.unwrap().values;
    assert_eq!(uv, [[0., 0.], [1., 0.], [1., 1.], [0., 0.], [1., 1.], [0., 1.]]);
    let [(code, text)] = loaded.warnings.as_slice() else { panic!("{:?}", loaded.warnings) };
    assert_eq!(*code, WarningCode::LeftOut);
    assert!(text.starts_with("1 vertex without finite coordinates was left out, with 1 face: "), "{text}");
    // A vertex that no face uses is no loss, and neither is a point.
    let unused = faces.replace("3 0 2 3", "3 0 1 4");
    let loaded = load("a.ply", format!("{PLY}{vertices}{unused}").as_bytes());
    assert_eq!((loaded.mesh.triangles.len(), loaded.warnings.len()), (3, 0));
    assert_eq!(loaded.notes, ["1 vertex without finite coordinates was left out"]);
    let points = PLY.replace("element face 3", "element face 0");
    let loaded = load("a.ply", format!("{points}{vertices}").as_bytes());
    assert_eq!((loaded.mesh.vertices.len(), loaded.mesh.triangles.len()), (4, 0));
    assert_eq!(loaded.notes, ["1 vertex without finite coordinates was left out"]);
}

#[test]
fn every_format_that_can_hold_such_vertices_is_read() {
    let mut cube = sample("box").unwrap();
    cube.vertices[5].y = 77.25;
    let lost = cube.triangles.iter().filter(|face| face.contains(&5)).count();
    for name in ["a.obj", "a.ply", "a.off", "a.mesh", "a.vtk", "a.stl", "a.glb"] {
        let mut bytes =
            Writer::new().encoding(target_encoding(Path::new(name)).unwrap()).encode(name, &cube).unwrap();
        let number = match name {
            "a.ply" => (77.25_f64.to_le_bytes().to_vec(), f64::NAN.to_le_bytes().to_vec()),
            "a.vtk" => (77.25_f64.to_be_bytes().to_vec(), f64::NAN.to_be_bytes().to_vec()),
            "a.stl" | "a.glb" => (77.25_f32.to_le_bytes().to_vec(), f32::NAN.to_le_bytes().to_vec()),
            _ => (b"77.25".to_vec(), b" -nan".to_vec()),
        };
        let (from, to) = number;
        let places: Vec<usize> =
            (0..bytes.len() - from.len()).filter(|at| bytes[*at..].starts_with(&from)).collect();
        assert!(!places.is_empty(), "{name}");
        places.iter().for_each(|at| bytes[*at..at + to.len()].copy_from_slice(&to));
        let loaded = load(name, &bytes);
        assert_eq!(loaded.mesh.triangles.len(), cube.triangles.len() - lost, "{name}");
        assert!(loaded.mesh.vertices.iter().all(|p| p.is_finite() && p.y < 77.0), "{name}");
        assert_eq!(loaded.warnings.len(), 1, "{name}: {:?}", loaded.warnings);
    }
}

#[test]
fn words_of_all_compilers_for_no_number_are_read() {
    for word in ["nan", "NaN", "-nan(ind)", "inf", "-inf", "1e999", "1.#QNAN", "-1.#IND"] {
        let obj = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 {word} 1\nf 1 2 3\nf 1 2 4\n");
        let ply = format!(
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
             element face 2\nproperty list int int vertex_indices\nend_header\n\
             0 0 0\n1 0 0\n0 1 0\n0 {word} 1\n3 0 1 2\n3 0 1 3\n"
        );
        let facet = |last: &str| {
            format!("facet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n{last}\nendloop\nendfacet\n")
        };
        let stl =
            format!("solid #1\n{}{}endsolid\n", facet("vertex 0 1 0"), facet(&format!("vertex 0 {word} 1")));
        for (name, text) in [("a.obj", obj), ("a.ply", ply), ("a.stl", stl)] {
            let loaded = load(name, text.as_bytes());
            assert_eq!((loaded.mesh.vertices.len(), loaded.mesh.triangles.len()), (3, 1), "{name}, {word}");
        }
    }
    for word in ["1.", "nano", "n", "-", "infinite"] {
        let obj = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 {word} 1\nf 1 2 3\n");
        assert_eq!(read("a.obj", obj.as_bytes()).is_err(), word != "1.", "{word}");
    }
}
