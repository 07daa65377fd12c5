//! Text files as odd programs end them, and the solids of STL text.

use std::path::Path;

use crate::support::files::{encode_with, read_bytes};
use rtfmesh::io::{Encoding, Format, lost_attributes_note};
use rtfmesh::mesh::attributes::{Attributes, Role};
use rtfmesh::mesh::samples::sample;

use super::refused::assert_refused;
use crate::support::files::{corners, gltf_of, text_stl};

fn encoding(format: Format) -> Encoding {
    Encoding { format, gzip: false }
}

#[test]
fn text_files_may_end_in_nul_and_control_z() {
    let mesh = sample("box").unwrap();
    let as_text =
        |format| encode_with(Path::new("x"), &mesh, &Attributes::default(), encoding(format)).unwrap();
    let list = |rows: Vec<String>| rows.join("\n");
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n{}\n{}\n",
        mesh.vertices.len(),
        mesh.triangles.len(),
        list(mesh.vertices.iter().map(|p| format!("{} {} {}", p.x, p.y, p.z)).collect()),
        list(mesh.triangles.iter().map(|[a, b, c]| format!("3 {a} {b} {c}")).collect()),
    );
    let files = [
        (Format::Obj, as_text(Format::Obj)),
        (Format::Off, as_text(Format::Off)),
        (Format::Medit, as_text(Format::Medit)),
        (Format::Stl, text_stl(&mesh).into_bytes()),
        (Format::Ply, ply.into_bytes()),
        (Format::Gltf, gltf_of(&mesh).into_bytes()),
    ];
    for (format, text) in files {
        let plain = read_bytes(&text, Some(encoding(format))).unwrap();
        for end in [&b"\0"[..], b"\x1a", b"\r\n\x1a\0\0\n", &[0; 700]] {
            let padded = [&text, end].concat();
            assert_eq!(read_bytes(&padded, Some(encoding(format))).unwrap(), plain, "{format:?} {end:?}");
        }
    }
    assert_refused("a.obj", "v 0 0 0\nv 1 0 0\0\nv 0 1 0\nf 1 2 3\n", "line 2", "binary data");
    assert_refused("a.obj", [0; 9], "", "no vertices");
}

/// A text STL file of solids with a triangle each, one above another.
fn solids(names: &[&str]) -> String {
    let facet = |z: usize| {
        format!(
            "facet normal 0 0 1\nouter loop\nvertex 0 0 {z}\nvertex 1 0 {z}\nvertex 0 1 {z}\nendloop\nendfacet\n"
        )
    };
    let solid = |(z, name): (usize, &&str)| format!("solid {name}\n{}endsolid {name}\n", facet(z));
    names.iter().enumerate().map(solid).collect()
}

#[test]
fn stl_keywords_of_the_end_may_be_two_words() {
    let text = solids(&["part"]);
    let whole = read_bytes(text.as_bytes(), None).unwrap();
    for word in ["solid", "facet", "loop"] {
        for spaced in [format!("end {word}"), format!("END  {}", word.to_uppercase())] {
            let text = text.replace(&format!("end{word}"), &spaced);
            assert_eq!(read_bytes(text.as_bytes(), None).unwrap(), whole, "{spaced}");
        }
    }
    assert_refused("a.stl", text.replace("endloop", "end"), "line 7", "'end' does not belong");
}

#[test]
fn names_of_stl_solids_are_labels_and_come_back_as_solids() {
    let text = solids(&["inlet pipe", "", "wall", "inlet pipe"]);
    let loaded = read_bytes(text.as_bytes(), None).unwrap();
    let label = loaded.attributes.face_named("group").unwrap();
    assert_eq!((label.role, label.values.as_slice()), (Role::Label, &[0.0, 1.0, 2.0, 0.0][..]));
    assert_eq!(label.names, ["inlet pipe", "solid_2", "wall"]);
    // A file of one solid has no labels, whatever its name.
    assert!(read_bytes(solids(&["part"]).as_bytes(), None).unwrap().attributes.is_empty());

    assert_eq!(lost_attributes_note(&loaded.attributes, Format::Stl), None);
    let written =
        encode_with(Path::new("x"), &loaded.mesh, &loaded.attributes, encoding(Format::Stl)).unwrap();
    let again = read_bytes(&written, None).unwrap();
    let by_solid = again.attributes.face_named("group").unwrap();
    assert_eq!((&by_solid.names, by_solid.values.as_slice()), (&label.names, &[0.0, 0.0, 1.0, 2.0][..]));
    let [first, second, third, fourth] = corners(&loaded.mesh).try_into().unwrap();
    assert_eq!(corners(&again.mesh), [first, fourth, second, third], "solids stand together");
    // In OBJ they are groups.
    let obj = encode_with(Path::new("x"), &loaded.mesh, &loaded.attributes, encoding(Format::Obj)).unwrap();
    let obj = read_bytes(&obj, None).unwrap();
    assert_eq!(obj.attributes.face_named("group").unwrap().names, label.names);
}

#[test]
fn unknown_formats_are_told_the_known_ones_by_group() {
    let error = "foo".parse::<Encoding>().unwrap_err().to_string();
    for group in ["meshes (obj, ply", "points (xyz, pcd", "volumes (npy, nrrd, nii, mha or vti)"] {
        assert!(error.contains(group), "{error}");
    }
    let error = read_bytes(b"gibberish", None).unwrap_err().to_string();
    assert!(error.contains("volumes (npy"), "{error}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.foo");
    std::fs::write(&path, "gibberish").unwrap();
    let error = rtfmesh::io::read(&path).unwrap_err().to_string();
    assert!(
        error.contains("meshes (.obj, .ply") && error.contains("volumes (.npy, .nrrd, .nii, .mha or .vti)"),
        "{error}"
    );
}
