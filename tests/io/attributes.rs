//! Colors, normals, texture coordinates, labels and other attributes in files of every format.

use crate::support::files::{encode_with, read_bytes};
use crate::support::shapes::{mesh, plane};
use crate::support::store_glb;
use rtfmesh::TriMesh;
use rtfmesh::io::{Format, Loaded, lost_attributes_note};
use rtfmesh::mesh::attributes::{Attribute, Attributes, CornerUv, Kind, Role};
use std::path::Path;

/// Two triangles, vertices in the order of first use.
fn square() -> TriMesh {
    mesh(&[[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]], &[[0, 1, 2], [0, 2, 3]])
}

fn colour(kind: Kind, components: usize) -> Attribute {
    let largest = kind.range().map_or(1.0, |[_, high]| high);
    let value = |k: usize| kind.rounded((k % 7) as f64 / 6.0 * largest);
    let value = |k: usize| if kind == Kind::F32 { f64::from(value(k) as f32) } else { value(k) };
    Attribute::new("colour", Role::Colour, kind, components, (0..4 * components).map(value).collect())
}

fn normal(kind: Kind) -> Attribute {
    Attribute::new(
        "normal",
        Role::Normal,
        kind,
        3,
        [[0.6, 0.0, 0.8]; 4].map(|n| n.map(|x| f64::from(x as f32))).concat(),
    )
}

fn labels(name: &str, kind: Kind, values: [f64; 2], names: &[&str]) -> Attribute {
    let names = names.iter().map(|name| (*name).to_owned()).collect();
    Attribute { names, ..Attribute::new(name, Role::Label, kind, 1, values.to_vec()) }
}

fn uv_without_seam(kind: Kind) -> CornerUv {
    CornerUv { kind, values: vec![[0.25, 0.5], [1.0, 0.0], [1.0, 1.0], [0.25, 0.5], [1.0, 1.0], [-3.0, 1.5]] }
}

/// With a seam along one half of the diagonal.
fn uv_with_seam(kind: Kind) -> CornerUv {
    let mut uv = uv_without_seam(kind);
    uv.values[3] = [0.125, 0.75];
    uv
}

fn through(format: &str, mesh: &TriMesh, attributes: &Attributes) -> Loaded {
    let bytes = encode_with(Path::new("x"), mesh, attributes, format.parse().unwrap()).unwrap();
    if format == "glb" {
        store_glb(&bytes);
    }
    read_bytes(&bytes, None).unwrap()
}

#[track_caller]
fn assert_kept(format: &str, attributes: &Attributes) {
    let loaded = through(format, &square(), attributes);
    assert_eq!(loaded.mesh, square(), "{format}");
    assert_eq!(&loaded.attributes, attributes, "{format}");
    assert_eq!(loaded.notes, Vec::<String>::new(), "{format}");
    assert_eq!(
        lost_attributes_note(attributes, format.parse::<rtfmesh::io::Encoding>().unwrap().format),
        None
    );
}

#[test]
fn ply_keeps_every_number_in_its_type() {
    let mut vertex = vec![colour(Kind::U8, 4), normal(Kind::F32)];
    for (name, kind, values) in [
        ("quality", Kind::F64, [0.1, -1e300, 5e-324, 0.0]),
        ("a", Kind::I8, [-128.0, 127.0, 0.0, 1.0]),
        ("b", Kind::I16, [-32768.0, 32767.0, 0.0, 1.0]),
        ("c", Kind::U16, [65535.0, 0.0, 0.0, 1.0]),
        ("d", Kind::I32, [-2147483648.0, 2147483647.0, 0.0, 1.0]),
        ("e", Kind::U32, [4294967295.0, 0.0, 0.0, 1.0]),
    ] {
        vertex.push(Attribute::new(name, Role::Other, kind, 1, values.to_vec()));
    }
    let mut face = vec![Attribute::new("colour", Role::Colour, Kind::U8, 3, vec![1., 2., 3., 4., 5., 6.])];
    face.push(labels("label", Kind::I32, [-7.0, 9.0], &[]));
    face.push(Attribute::new("heat", Role::Other, Kind::F32, 1, vec![0.5, 0.25]));
    for uv in [None, Some(uv_without_seam(Kind::F32)), Some(uv_with_seam(Kind::F64))] {
        assert_kept(
            "ply",
            &Attributes { vertex: vertex.clone(), face: face.clone(), uv, ..Default::default() },
        );
    }
    assert_kept("ply.gz", &Attributes { vertex: vec![colour(Kind::F32, 3)], ..Default::default() });
}

#[test]
fn obj_keeps_colours_normals_texture_materials_and_groups() {
    let face = vec![
        labels("material", Kind::U32, [0.0, 1.0], &["wood dark", "steel"]),
        labels("group", Kind::U32, [0.0, 1.0], &["", "lid"]),
        labels("object", Kind::U32, [0.0, 1.0], &["one", "two"]),
    ];
    let libraries = vec!["a b.mtl".to_owned(), "c.mtl".to_owned()];
    for uv in [uv_without_seam(Kind::F64), uv_with_seam(Kind::F64)] {
        let vertex = vec![colour(Kind::F64, 3), normal(Kind::F64)];
        let attributes = Attributes {
            vertex,
            face: face.clone(),
            uv: Some(uv),
            libraries: libraries.clone(),
            ..Attributes::default()
        };
        assert_kept("obj", &attributes);
    }
    let text = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1 0\n\
                vn 0 0 2\nvn 0 1 0\nf 1/1/1 2/-3/1 3/3/1 4/4/1\nf 4/4/2 3/3/2 2/2/2\n";
    let Loaded { attributes, notes, .. } = read_bytes(text.as_bytes(), None).unwrap();
    assert_eq!(attributes.vertex_role(Role::Colour).unwrap().at(3), [1.0, 1.0, 1.0]);
    let normals = attributes.vertex_role(Role::Normal).unwrap();
    assert_eq!(normals.at(0), [0.0, 0.0, 2.0]);
    assert!(
        (normals.at(3)[1] - 1.0 / 17f64.sqrt()).abs() < 1e-9 || normals.at(3)[2] > 0.8,
        "{:?}",
        normals.at(3)
    );
    let square = [[0., 0.], [1., 0.], [1., 1.], [0., 0.], [1., 1.], [0., 1.]];
    assert_eq!(attributes.uv.unwrap().values[..6], square);
    assert!(notes.iter().any(|note| note.starts_with("3 vertices have several normals")), "{notes:?}");
}

#[test]
fn glb_keeps_colours_normals_texture_and_materials() {
    let face = vec![labels("material", Kind::U32, [0.0, 1.0], &["wood", "steel"])];
    for kind in [Kind::U8, Kind::U16, Kind::F32] {
        for components in [3, 4] {
            let vertex = vec![colour(kind, components), normal(Kind::F32)];
            let uv = Some(uv_without_seam(Kind::F32));
            assert_kept("glb", &Attributes { vertex, face: face.clone(), uv, ..Default::default() });
        }
    }
    let bare = vec![labels("material", Kind::U32, [0.0, 1.0], &["wood", ""])];
    assert_kept("glb", &Attributes { face: bare, ..Default::default() });
    // One vertex has both sides of the seam, and becomes two.
    let attributes = Attributes {
        vertex: vec![colour(Kind::U8, 3)],
        uv: Some(uv_with_seam(Kind::F32)),
        ..Default::default()
    };
    let loaded = through("glb", &square(), &attributes);
    assert_eq!(loaded.mesh.vertices.len(), 5);
    assert_eq!(loaded.mesh.vertices[4], square().vertices[0]);
    assert_eq!(loaded.attributes.uv, attributes.uv);
    assert_eq!(loaded.attributes.vertex[0].at(4), attributes.vertex[0].at(0));
}

#[test]
fn medit_keeps_references_and_off_keeps_colours() {
    let reference = Attribute::new("reference", Role::Label, Kind::I32, 1, vec![0.0, -1.0, 2.0, 3.0]);
    let face = vec![labels("reference", Kind::I32, [5.0, -6.0], &[])];
    assert_kept("mesh", &Attributes { vertex: vec![reference], face, ..Default::default() });
    for kind in [Kind::U8, Kind::F64] {
        for components in [3, 4] {
            assert_kept("off", &Attributes { vertex: vec![colour(kind, components)], ..Default::default() });
        }
    }
}

#[test]
fn attributes_that_a_format_cannot_hold_are_named() {
    let attributes = Attributes {
        vertex: vec![colour(Kind::U8, 3), Attribute::new("heat", Role::Other, Kind::F32, 1, vec![0.0; 4])],
        face: vec![labels("material", Kind::U32, [0.0, 1.0], &["a", "b"])],
        uv: Some(uv_without_seam(Kind::F32)),
        ..Default::default()
    };
    for (format, words) in [
        (Format::Ply, "without their names"),
        (Format::Obj, "heat of each vertex (1 x f32)"),
        (Format::Glb, "heat of each vertex"),
        (Format::Off, "material of each face (1 x u32), texture coordinates"),
        (Format::Medit, "colour of each vertex (3 x u8), heat"),
        (Format::Stl, "STL cannot hold these: colour"),
    ] {
        let said = lost_attributes_note(&attributes, format).unwrap();
        assert!(said.contains(words), "{said}");
        if format != Format::Gltf {
            // What is dropped leaves a mesh that can be read.
            let back = through(format.extension(), &square(), &attributes);
            assert_eq!(back.mesh.triangles.len(), 2, "{format:?}");
        }
    }
    assert_eq!(lost_attributes_note(&Attributes::default(), Format::Stl), None);
}

#[test]
fn invalid_numbers_lose_the_attribute_but_not_the_mesh() {
    let head =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    let text = format!(
        "{head}property uchar red\nproperty float heat\nelement face 1\nproperty list uchar int vertex_indices\n\
         property list uchar float texcoord\nend_header\n0 0 0 300 1\n1 0 0 4 hot\n0 1 0 5 2\n3 0 1 2 2 0 0\n"
    );
    let Loaded { attributes, notes, mesh, .. } = read_bytes(text.as_bytes(), None).unwrap();
    assert!(attributes.is_empty() && mesh.triangles.len() == 1);
    assert_eq!(
        notes,
        [
            "the property 'red' of each vertex was ignored: '300' is not of type uchar",
            "the property 'heat' of each vertex was ignored: 'hot' is not of type float",
            "texture coordinates were ignored: 1 face lacks some",
        ]
    );
    // Attributes whose names are in use get another name.
    let twice = ["s", "x", "x"].map(|name| Attribute::new(name, Role::Other, Kind::F32, 1, vec![1.0; 4]));
    let uv = Some(uv_without_seam(Kind::F32));
    let loaded = through("ply", &square(), &Attributes { vertex: twice.to_vec(), uv, ..Default::default() });
    let names: Vec<&str> = loaded.attributes.vertex.iter().map(|a| a.name.as_str()).collect();
    assert_eq!(
        (names, loaded.attributes.uv.is_some(), loaded.mesh),
        (vec!["s_", "x_", "x__"], true, square())
    );
    let grid = plane(1, 0.0);
    let loaded =
        through("glb", &grid, &Attributes { uv: Some(uv_without_seam(Kind::F32)), ..Default::default() });
    assert_eq!(loaded.attributes.uv.unwrap().values.len(), 3 * grid.triangles.len());
}
