//! The files of VTK and ParaView: every form that its writers have, cells of all kinds, and what is refused.

use std::path::Path;

use crate::support::files::{encode_with, read_bytes};
use glam::DVec3;
use rtfmesh::io::{Encoding, Format, Loaded, lost_attributes_note};
use rtfmesh::mesh::attributes::{Attribute, Attributes, CornerUv, Kind, Role};
use rtfmesh::mesh::topology::topology;

use crate::support::place::Place;
use crate::support::shapes::mesh;
use crate::support::vtk::{Array, Form, Mode, forms, legacy_numbers};

const PLAIN: Form = Form { mode: Mode::Ascii, is_big_endian: false, header: 4, block: None };

fn array<'t>(section: &'t str, kind: &'t str, name: &'t str, components: usize, values: &[f64]) -> Array<'t> {
    Array { section, kind, name, components, values: values.to_vec() }
}

/// A vertex, a line, a square and a triangle, a strip; points with normals, texture, colours and more.
fn poly_data(form: Form) -> Vec<u8> {
    const POINTS: [f64; 24] =
        [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., 2., 0., 0., 2., 1., 0.5, 3., 0., 0., 3., 1., 0.];
    let eight = |f: &dyn Fn(f64) -> f64| (0..8).map(|v| f(f64::from(v))).collect::<Vec<f64>>();
    let many = |count: i32| (0..8 * count).map(f64::from).collect::<Vec<f64>>();
    let arrays = [
        array("PointData", "Float32", "Up", 3, &[0.0, 0.0, 1.0].repeat(8)),
        array("PointData", "Float64", "where", 2, &many(2)),
        array("PointData", "UInt8", "RGB", 3, &many(3)),
        array("PointData", "Int16", "a &lt; b", 1, &eight(&|v| -v)),
        array("PointData", "Int64", "large", 1, &eight(&|v| v * 1e10)),
        array("PointData", "Float32", "stress", 6, &many(6)),
        array("CellData", "Int64", "part", 1, &[9.0, 8.0, 0.0, -1.0, 2.0]),
        array("CellData", "Float32", "heat", 1, &[9.0, 8.0, 0.5, 1.5, 2.5]),
        array("CellData", "Int64", "vtkOriginalCellIds", 1, &[0.0, 1.0, 2.0, 3.0, 4.0]),
        array("Points", "Float32", "Points", 3, &POINTS),
        array("Verts", "Int64", "connectivity", 1, &[0.0]),
        array("Verts", "Int64", "offsets", 1, &[1.0]),
        array("Lines", "Int64", "connectivity", 1, &[0.0, 1.0, 2.0]),
        array("Lines", "Int64", "offsets", 1, &[3.0]),
        array("Strips", "Int32", "connectivity", 1, &[4.0, 5.0, 6.0, 7.0]),
        array("Strips", "Int32", "offsets", 1, &[4.0]),
        array("Polys", "Int64", "connectivity", 1, &[0.0, 1.0, 2.0, 3.0, 1.0, 4.0, 2.0]),
        array("Polys", "Int64", "offsets", 1, &[4.0, 7.0]),
    ];
    let piece = "NumberOfPoints=\"8\" NumberOfVerts=\"1\" NumberOfLines=\"1\" NumberOfStrips=\"1\" \
                 NumberOfPolys=\"2\"";
    form.file("PolyData", ["", piece, " Normals=\"Up\" TCoords=\"where\""], &arrays)
}

#[track_caller]
fn check_poly_data(loaded: &Loaded, what: &str) {
    let Loaded { mesh, attributes, notes, .. } = loaded;
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [1, 4, 2], [4, 5, 6], [6, 5, 7]], "{what}");
    assert_eq!(mesh.vertices[5], DVec3::new(2.0, 1.0, 0.5), "{what}");
    assert_eq!(
        notes,
        &["1 face with more than 3 vertices was split into triangles", "2 points and lines were ignored"],
        "{what}"
    );
    let found: Vec<_> =
        attributes.vertex.iter().map(|a| (a.name.as_str(), a.role, a.kind, a.components)).collect();
    let stress = ["stress_0", "stress_1", "stress_2", "stress_3", "stress_4", "stress_5"];
    let mut wanted = vec![
        ("Up", Role::Normal, Kind::F32, 3),
        ("RGB", Role::Colour, Kind::U8, 3),
        ("a < b", Role::Other, Kind::I16, 1),
        ("large", Role::Other, Kind::F64, 1),
    ];
    wanted.extend(stress.map(|name| (name, Role::Other, Kind::F32, 1)));
    assert_eq!(found, wanted, "{what}");
    assert_eq!(attributes.vertex[2].at(3), [-3.0], "{what}");
    assert_eq!(attributes.vertex[3].at(7), [7e10], "{what}");
    assert_eq!(attributes.vertex[9].at(7), [47.0], "{what}");
    let uv = attributes.uv.as_ref().unwrap();
    assert_eq!((uv.kind, uv.values[7]), (Kind::F64, [8.0, 9.0]), "{what}: the second corner of triangle 2");
    let [part, heat, original] = attributes.face.as_slice() else { panic!("{what}") };
    assert_eq!((part.role, part.kind), (Role::Label, Kind::I32), "{what}");
    assert_eq!(part.values, [0.0, 0.0, -1.0, 2.0, 2.0], "{what}");
    assert_eq!((heat.role, heat.values[4]), (Role::Other, 2.5), "{what}");
    assert_eq!(original.role, Role::Other, "{what}: borders around each cell are no help");
}

#[test]
fn xml_files_of_every_form_are_the_same_mesh() {
    let forms = forms();
    assert_eq!(forms.len(), 37);
    for form in forms {
        let bytes = poly_data(form);
        let loaded = read_bytes(&bytes, None).unwrap_or_else(|error| panic!("{form:?}: {error}"));
        check_poly_data(&loaded, &format!("{form:?}"));
    }
}

/// The same mesh in the older format; of version 5 with arrays of offsets.
fn legacy(is_binary: bool, has_offsets: bool) -> Vec<u8> {
    let mut file = b"# vtk DataFile Version 5.1\na title\n".to_vec();
    file.extend(if is_binary { &b"BINARY\n"[..] } else { b"ASCII\n" });
    let mut add = |line: &str, kind: &str, values: &[f64]| {
        file.extend(line.as_bytes());
        file.push(b'\n');
        file.extend(legacy_numbers(kind, values, is_binary));
    };
    let points =
        [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., 2., 0., 0., 2., 1., 0.5, 3., 0., 0., 3., 1., 0.];
    add("DATASET POLYDATA\nFIELD FieldData 1\nTIME 1 1 double", "double", &[0.5]);
    add(
        "METADATA\nINFORMATION 1\nNAME L2 LOCATION vtkDataArray\nDATA 2 0 1\n\nPOINTS 8 float",
        "float",
        &points,
    );
    let lists: [(&str, &[f64], &[f64]); 4] = [
        ("VERTICES", &[0., 1.], &[0.]),
        ("LINES", &[0., 3.], &[0., 1., 2.]),
        ("POLYGONS", &[0., 4., 7.], &[0., 1., 2., 3., 1., 4., 2.]),
        ("TRIANGLE_STRIPS", &[0., 4.], &[4., 5., 6., 7.]),
    ];
    for (keyword, offsets, corners) in lists {
        if has_offsets {
            let head = format!("{keyword} {} {}\nOFFSETS vtktypeint64", offsets.len(), corners.len());
            add(&head, "vtktypeint64", offsets);
            add("CONNECTIVITY vtktypeint64", "vtktypeint64", corners);
            continue;
        }
        let cells = offsets
            .windows(2)
            .map(|pair| [&[pair[1] - pair[0]][..], &corners[pair[0] as usize..pair[1] as usize]].concat());
        let list = cells.collect::<Vec<_>>().concat();
        add(&format!("{keyword} {} {}", offsets.len() - 1, list.len()), "int", &list);
    }
    let many = |count: u32| (0..8 * count).map(f64::from).collect::<Vec<f64>>();
    add("\nPOINT_DATA 8\nNORMALS Up float", "float", &[0.0, 0.0, 1.0].repeat(8));
    add("TEXTURE_COORDINATES where 2 double", "double", &many(2));
    add("FIELD FieldData 4\nRGB 3 8 unsigned_char", "unsigned_char", &many(3));
    add(
        "METADATA\nCOMPONENT_NAMES\nr g b\n\na%20<%20b 1 8 int",
        "int",
        &[0., -1., -2., -3., -4., -5., -6., -7.],
    );
    add("large 1 8 vtktypeint64", "vtktypeint64", &many(1).iter().map(|v| v * 1e10).collect::<Vec<_>>());
    add("stress 6 8 float", "float", &many(6));
    add("CELL_DATA 5\nSCALARS part int\nLOOKUP_TABLE own", "int", &[9.0, 8.0, 0.0, -1.0, 2.0]);
    let opaque = [255.0; 8];
    let table = if is_binary { ("unsigned_char", &opaque) } else { ("float", &[1.0; 8]) };
    add("LOOKUP_TABLE own 2", table.0, table.1);
    add("SCALARS heat float 1\nLOOKUP_TABLE default", "float", &[9.0, 8.0, 0.5, 1.5, 2.5]);
    add("GLOBAL_IDS vtkOriginalCellIds vtktypeint64", "vtktypeint64", &[0.0, 1.0, 2.0, 3.0, 4.0]);
    file
}

#[test]
fn older_files_are_read_as_text_and_binary() {
    for (is_binary, has_offsets) in [(false, false), (false, true), (true, false), (true, true)] {
        let mut loaded = read_bytes(&legacy(is_binary, has_offsets), None).unwrap();
        // This one has 32 bits here.
        let of_16_bits = &mut loaded.attributes.vertex[2];
        assert_eq!(of_16_bits.kind, Kind::I32);
        of_16_bits.kind = Kind::I16;
        check_poly_data(&loaded, &format!("binary: {is_binary}, offsets: {has_offsets}"));
    }
    // Colours as text are fractions, and texts are passed.
    let text = "# vtk DataFile Version 2.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 3 float 0 0 0 1 0 0 0 1 0\n\
                POLYGONS 1 4 3 0 1 2\nPOINT_DATA 3\nFIELD f 2\nnames 1 3 string\na\n\nb\nbits 1 3 bit 1 0 1\n\
                COLOR_SCALARS tint 3\n0 0.5 1 0 0 0 1 1 1\n";
    let Loaded { attributes, notes, .. } = read_bytes(text.as_bytes(), None).unwrap();
    assert_eq!(attributes.vertex[0].values, [1.0, 0.0, 1.0]);
    assert_eq!(attributes.vertex_role(Role::Colour).unwrap().at(0), [0.0, 0.5, 1.0]);
    assert_eq!(notes, ["1 array without numbers was left out: names"]);
    let binary = [
        &b"# vtk DataFile Version 4.2\nx\nBINARY\nDATASET POLYDATA\nPOINTS 3 float\n"[..],
        &legacy_numbers("float", &[0., 0., 0., 1., 0., 0., 0., 1., 0.], true),
        b"POLYGONS 1 4\n",
        &legacy_numbers("int", &[3., 0., 1., 2.], true),
        b"POINT_DATA 3\nFIELD f 2\nnames 1 3 string\n\xc1a\xc0\x80\x02bc\nbits 1 3 bit\n\xa0\n",
    ]
    .concat();
    assert_eq!(read_bytes(&binary, None).unwrap().attributes.vertex[0].values, [1.0, 0.0, 1.0]);
}

/// An unstructured grid of these cells, each its type and corners, with a number for each.
fn grid(points: &[f64], cells: &[(u8, &[u32])], labels: &[f64]) -> Vec<u8> {
    let corners: Vec<f64> =
        cells.iter().flat_map(|(_, corners)| corners.iter().copied().map(f64::from)).collect();
    let ends = cells.iter().scan(0, |end, (_, corners)| {
        *end += corners.len();
        Some(*end as f64)
    });
    let ends: Vec<f64> = ends.collect();
    let kinds: Vec<f64> = cells.iter().map(|(kind, _)| f64::from(*kind)).collect();
    let heights: Vec<f64> = points.chunks(3).map(|point| point[2]).collect();
    let piece = format!("NumberOfPoints=\"{}\" NumberOfCells=\"{}\"", points.len() / 3, cells.len());
    PLAIN.file(
        "UnstructuredGrid",
        ["", &piece, ""],
        &[
            array("PointData", "Float64", "height", 1, &heights),
            array("CellData", "Int32", "mat", 1, labels),
            array("Points", "Float64", "Points", 3, points),
            array("Cells", "Int64", "connectivity", 1, &corners),
            array("Cells", "Int64", "offsets", 1, &ends),
            array("Cells", "UInt8", "types", 1, &kinds),
        ],
    )
}

/// Two unit cubes one above the other, and a point inside that belongs to no cell.
fn cubes() -> Vec<f64> {
    let mut points: Vec<f64> =
        (0..12).flat_map(|i| [f64::from(i % 2), f64::from(i / 2 % 2), f64::from(i / 4)]).collect();
    points.extend([0.5, 0.5, 0.5]);
    points
}

fn volume_within(loaded: &Loaded) -> f64 {
    (0..loaded.mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = loaded.mesh.corners(t);
            a.dot(b.cross(c)) / 6.0
        })
        .sum()
}

#[test]
fn volume_cells_have_their_boundary_as_the_surface() {
    let lower: &[u32] = &[0, 1, 3, 2, 4, 5, 7, 6];
    let upper: &[u32] = &[4, 5, 7, 6, 8, 9, 11, 10];
    let voxel: &[u32] = &[0, 1, 2, 3, 4, 5, 6, 7];
    // Corners in the order of a mirrored cell.
    let mirrored: &[u32] = &[8, 9, 11, 10, 4, 5, 7, 6];
    for cells in [[(12, lower), (12, upper)], [(11, voxel), (12, upper)], [(12, lower), (12, mirrored)]] {
        let loaded = read_bytes(&grid(&cubes(), &cells, &[3.0, 4.0]), None).unwrap();
        assert_eq!((loaded.mesh.vertices.len(), loaded.mesh.triangles.len()), (12, 20));
        assert!((volume_within(&loaded) - 2.0).abs() < 1e-12, "{cells:?}: it faces outward");
        assert_eq!(topology(&loaded.mesh).boundary_edges, 0);
        assert_eq!(loaded.attributes.vertex[0].values.iter().sum::<f64>(), 12.0, "heights of 0, 1 and 2");
        assert_eq!(loaded.attributes.face[0].values, [[3.0; 10], [4.0; 10]].concat());
        assert_eq!(loaded.notes[0], "the surface is the boundary of 2 volume cells");
    }
    // A tetrahedron, a pyramid and a wedge, in either order of their corners, and of a higher order.
    let six = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., 0.5, 0.5, 1., 0.5, 1.5, 1.];
    for (kind, corners, volume, count) in [
        (10, &[0, 1, 2, 4][..], 1.0 / 6.0, 4),
        (10, &[1, 0, 2, 4], 1.0 / 6.0, 4),
        (24, &[0, 1, 2, 4, 5, 5, 5, 5, 5, 5], 1.0 / 6.0, 4),
        (14, &[0, 1, 2, 3, 4], 1.0 / 3.0, 6),
        (14, &[3, 2, 1, 0, 4], 1.0 / 3.0, 6),
        // A hexahedron squeezed to the pyramid.
        (12, &[0, 1, 2, 3, 4, 4, 4, 4], 1.0 / 3.0, 6),
    ] {
        let loaded = read_bytes(&grid(&six, &[(kind, corners)], &[1.0]), None).unwrap();
        assert_eq!(loaded.mesh.triangles.len(), count, "{kind}");
        assert!((volume_within(&loaded) - volume).abs() < 1e-12, "{kind}: {}", volume_within(&loaded));
    }
    let prism = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1., 1., 0., 1., 0., 1., 1.];
    for corners in [[0, 1, 2, 3, 4, 5], [0, 2, 1, 3, 5, 4]] {
        let loaded = read_bytes(&grid(&prism, &[(13, &corners)], &[1.0]), None).unwrap();
        assert!((volume_within(&loaded) - 0.5).abs() < 1e-12);
    }
}

#[test]
fn surface_cells_on_a_boundary_give_it_their_labels() {
    let lower: &[u32] = &[0, 1, 3, 2, 4, 5, 7, 6];
    let upper: &[u32] = &[4, 5, 7, 6, 8, 9, 11, 10];
    // The bottom, and a square between the two cubes.
    let cells = [(12, lower), (12, upper), (9, &[0, 1, 3, 2][..]), (9, &[4, 5, 7, 6]), (3, &[0, 1])];
    let loaded = read_bytes(&grid(&cubes(), &cells, &[3.0, 4.0, 7.0, 8.0, 9.0]), None).unwrap();
    let labels = &loaded.attributes.face[0].values;
    assert_eq!(labels.iter().filter(|label| **label == 7.0).count(), 2);
    assert_eq!(labels.iter().filter(|label| **label == 8.0).count(), 0);
    assert!((volume_within(&loaded) - 2.0).abs() < 1e-12);
    assert!(loaded.notes.contains(&"1 surface cell that is not on it was left out".to_owned()));
    assert!(loaded.notes.contains(&"1 point or line was ignored".to_owned()));
}

/// All kinds of numbers, texture with and without a seam.
fn attributes(has_seam: bool) -> Attributes {
    let vertex = vec![
        Attribute::new("normal", Role::Normal, Kind::F32, 3, [0.0, 0.0, 1.0].repeat(4)),
        Attribute::new("colour", Role::Colour, Kind::U8, 4, (0..16).map(f64::from).collect()),
        Attribute::new(
            "a \"b\" <&> 50%",
            Role::Other,
            Kind::F64,
            2,
            (0..8).map(|v| f64::from(v) / 3.0).collect(),
        ),
        Attribute::new("i", Role::Other, Kind::I8, 1, vec![-128.0, 127.0, 0.0, 1.0]),
        Attribute::new("u", Role::Other, Kind::U16, 1, vec![65535.0, 0.0, 0.0, 1.0]),
        Attribute::new("same", Role::Other, Kind::U32, 1, vec![4294967295.0, 0.0, 0.0, 1.0]),
    ];
    let face = vec![
        Attribute::new("part", Role::Label, Kind::I32, 1, vec![-7.0, 9.0]),
        Attribute::new("tint", Role::Colour, Kind::U8, 3, vec![1., 2., 3., 4., 5., 6.]),
        Attribute::new("heat", Role::Other, Kind::F32, 1, vec![0.5, 0.25]),
    ];
    let mut values = vec![[0.25, 0.5], [1.0, 0.0], [1.0, 1.0], [0.25, 0.5], [1.0, 1.0], [-3.0, 1.5]];
    if has_seam {
        values[3] = [0.125, 0.75];
    }
    Attributes { vertex, face, uv: Some(CornerUv { kind: Kind::F64, values }), ..Attributes::default() }
}

#[test]
fn all_attributes_come_back_in_their_types() {
    let square = mesh(&[[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.1]], &[[0, 1, 2], [0, 2, 3]]);
    for format in [Format::Vtp, Format::Vtu, Format::Vtk] {
        for has_seam in [false, true] {
            let attributes = attributes(has_seam);
            assert_eq!(lost_attributes_note(&attributes, format), None);
            for gzip in [false, true] {
                let encoding = Encoding { format, gzip };
                let bytes = encode_with(Path::new("x"), &square, &attributes, encoding).unwrap();
                let loaded = read_bytes(&bytes, None).unwrap();
                assert_eq!(loaded.mesh, square, "{format:?}");
                assert_eq!(loaded.attributes, attributes, "{format:?}, seam: {has_seam}");
                assert_eq!(loaded.notes, Vec::<String>::new());
            }
        }
        // Two of one name, and colours of a text format.
        let twice = Attributes {
            vertex: vec![
                Attribute::new("a", Role::Other, Kind::F32, 1, vec![1.0; 4]),
                Attribute::new("a", Role::Other, Kind::F32, 1, vec![2.0; 4]),
                Attribute::new("colour", Role::Colour, Kind::F64, 3, vec![0.5; 12]),
            ],
            ..Attributes::default()
        };
        let encoding = Encoding { format, gzip: false };
        let bytes = encode_with(Path::new("x"), &square, &twice, encoding).unwrap();
        let found = read_bytes(&bytes, None).unwrap().attributes.vertex;
        assert_ne!(found[0].name, found[1].name);
        assert_eq!((found[0].values[0], found[1].values[0]), (1.0, 2.0));
        assert_eq!((found[2].kind, found[2].values[0]), (Kind::U8, 128.0));
    }
}

#[test]
fn pieces_are_joined() {
    let one = poly_data(PLAIN);
    let text = String::from_utf8(one).unwrap();
    let begin = text.find("<Piece").unwrap();
    let end = text.find("</Piece>").unwrap() + "</Piece>".len();
    let piece = &text[begin..end];
    let other = piece.replace("Name=\"stress\"", "Name=\"strain\"");
    let both = format!("{}{piece}\n{other}{}", &text[..begin], &text[end..]);
    let loaded = read_bytes(both.as_bytes(), None).unwrap();
    assert_eq!((loaded.mesh.vertices.len(), loaded.mesh.triangles.len()), (16, 10));
    assert_eq!(loaded.mesh.triangles[9], [14, 13, 15]);
    assert_eq!(loaded.attributes.face[0].values, [[0.0, 0.0, -1.0, 2.0, 2.0]; 2].concat());
    assert!(loaded.notes.iter().any(|note| note.ends_with("left out: stress")), "{:?}", loaded.notes);
}

#[test]
fn cell_data_are_labels_whose_borders_can_be_kept() {
    let place = Place::new();
    let cubes = cubes();
    let cells = [(12, &[0, 1, 3, 2, 4, 5, 7, 6][..]), (12, &[4, 5, 7, 6, 8, 9, 11, 10])];
    std::fs::write(place.path("in.vtu"), grid(&cubes, &cells, &[3.0, 4.0])).unwrap();
    place.run("remesh in.vtu out.vtp -n 300 --iterations 2 --quality draft --keep-labels -q");
    let result = rtfmesh::io::read(place.path("out.vtp")).unwrap();
    let label = result.attributes.face_named("mat").unwrap();
    for (t, value) in label.values.iter().enumerate() {
        let side = if *value == 3.0 { -0.01..1.01 } else { 0.99..2.01 };
        assert!(
            result.mesh.corners(t).iter().all(|corner| side.contains(&corner.z)),
            "{t}: {:?}",
            result.mesh.corners(t)
        );
    }
}
