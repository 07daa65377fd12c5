//! STL, OFF and MEDIT files, what all formats have in common, and how formats are told apart.

use std::io::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::support::files::{encode, read_bytes};
use glam::DVec3;
use rtfmesh::Error;
use rtfmesh::io::{Encoding, Loaded, Writer, lost_precision_note, read, write};
use rtfmesh::mesh::samples::{names, sample};

use super::obj_and_ply::file;
use super::refused::assert_refused;
use crate::support::files::{assert_same, corners, gltf_of, text_stl};

fn load(name: &str, content: impl AsRef<[u8]>) -> Loaded {
    let (_folder, path) = file(name, content.as_ref());
    read(&path).unwrap()
}

const WRITTEN: [&str; 6] = ["obj", "ply", "stl", "off", "glb", "mesh"];

#[test]
fn every_model_round_trips_through_every_format() {
    let folder = tempfile::tempdir().unwrap();
    for (name, _) in names() {
        let mesh = sample(name).unwrap();
        for extension in WRITTEN {
            let path = folder.path().join(format!("{name}.{extension}"));
            write(&path, &mesh).unwrap();
            let loaded = read(&path).unwrap();
            assert_same(&loaded.mesh, &mesh, 1e-6, &format!("{name}.{extension}"));
            assert_eq!(loaded.mesh.vertices.len(), mesh.vertices.len(), "{name}.{extension}");
            assert_eq!(loaded.notes, Vec::<String>::new(), "{name}.{extension}");
        }
        let text = load("a.stl", text_stl(&mesh)).mesh;
        assert_eq!(corners(&text), corners(&mesh), "all 64 bits of text STL are kept: {name}");
        assert_same(&load("a.gltf", gltf_of(&mesh)).mesh, &mesh, 1e-6, name);
    }
}

#[test]
fn compressed_files_are_smaller_and_always_the_same_bytes() {
    let mesh = sample("genus3").unwrap();
    for extension in WRITTEN {
        let encoding: Encoding = format!("{extension}.GZ").parse().unwrap();
        let name = Path::new("standard output");
        let packed = encode(name, &mesh, encoding).unwrap();
        let plain = encode(name, &mesh, Encoding { gzip: false, ..encoding }).unwrap();
        assert!(packed.len() < plain.len(), "{extension}: {} of {}", packed.len(), plain.len());
        assert_eq!(packed, encode(name, &mesh, encoding).unwrap());
        assert_same(&read_bytes(&packed, None).unwrap().mesh, &mesh, 1e-6, extension);
        // Concatenated gzip files are one file.
        let halves = plain.split_at(plain.len() / 2);
        let mut two = gz(halves.0);
        two.extend(gz(halves.1));
        assert_eq!(read_bytes(&two, None).unwrap(), read_bytes(&plain, None).unwrap(), "{extension}");
    }
}

fn gz(plain: &[u8]) -> Vec<u8> {
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packer.write_all(plain).unwrap();
    packer.finish().unwrap()
}

#[test]
fn damaged_and_huge_compressed_files_are_refused() {
    let whole = gz(text_stl(&sample("box").unwrap()).as_bytes());
    let cut = [2, 9, 20, whole.len() - 9, whole.len() - 1].map(|length| whole[..length].to_vec());
    for bytes in cut.into_iter().chain([[&whole, &b"more"[..]].concat()]) {
        let line = read_bytes(&bytes, None).unwrap_err().to_string();
        assert!(line.contains("of the decompressed file: the gzip data is cut off or damaged"), "{line}");
    }
    assert_refused("a.off.gz", gz(b""), "", "the file is empty");
    // A few kilobytes for 200 megabytes of blanks.
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    packer.write_all(&vec![b' '; 200 << 20]).unwrap();
    let bomb = packer.finish().unwrap();
    let start = Instant::now();
    assert_refused("a.off.gz", &bomb, "", "expand to more than");
    assert!(start.elapsed() < Duration::from_secs(20));
}

#[test]
fn content_decides_before_the_extension() {
    let mesh = sample("tetrahedron").unwrap();
    let folder = tempfile::tempdir().unwrap();
    for real in WRITTEN {
        for name in
            WRITTEN.iter().map(|lie| format!("a.{lie}")).chain(["a.foo".into(), "a".into(), "a.gz".into()])
        {
            let path = folder.path().join(&name);
            let encoding = Encoding { gzip: false, ..real.parse().unwrap() };
            Writer::new().encoding(encoding).write(&path, &mesh).unwrap();
            let loaded = read(&path).unwrap();
            assert_same(&loaded.mesh, &mesh, 1e-6, &name);
            let told = loaded.notes.iter().filter(|note| note.contains("read as")).count();
            assert_eq!(told, usize::from(!name.ends_with(real)), "{real} as {name}: {:?}", loaded.notes);
        }
    }
    // Without an extension there is no note; with a wrong declaration there is.
    let bytes = encode(Path::new("x"), &mesh, "off".parse().unwrap()).unwrap();
    assert_eq!(read_bytes(&bytes, None).unwrap().notes, Vec::<String>::new());
    assert_eq!(read_bytes(&bytes, Some("stl".parse().unwrap())).unwrap().notes.len(), 1);
    // Counts alone could be anything.
    let bare = bytes.strip_prefix(b"OFF\n").unwrap();
    assert_eq!(read_bytes(bare, Some("off".parse().unwrap())).unwrap().mesh, mesh);
    assert!(matches!(read_bytes(bare, None), Err(Error::Input { .. })));
}

#[test]
fn stl_is_text_or_binary_by_its_size() {
    let mesh = sample("box").unwrap();
    let mut binary = encode(Path::new("x"), &mesh, "stl".parse().unwrap()).unwrap();
    assert_eq!(binary.len(), 84 + 12 * 50);
    // Headers of many programs.
    binary[..16].copy_from_slice(b"solid made by me");
    assert_same(&load("a.stl", &binary).mesh, &mesh, 0.0, "solid");
    let more = load("a.stl", [&binary, &b"tail"[..]].concat());
    assert_eq!(more.notes, ["4 bytes after the last triangle were ignored"]);
    binary[84 + 48] = 1;
    let coloured = load("a.stl", &binary);
    assert_eq!(coloured.notes, ["attributes or colours of the triangles were ignored"]);
    assert_refused("a.stl", &binary[..200], "byte 200", "declares 12 triangles, but 2 are there");
    assert_refused("a.stl", &binary[..60], "byte 60", "at least 84 bytes");
    let mut billion = binary.clone();
    billion[80..84].copy_from_slice(&1_000_000_000_u32.to_le_bytes());
    assert_refused("a.stl", &billion, "byte 684", "declares 1000000000 triangles, but 12 are there");
    let mut none = binary[..84].to_vec();
    none[80..].fill(0);
    assert_refused("a.stl", &none, "", "no");
}

#[test]
fn stl_text_in_capitals_with_polygons_and_several_solids() {
    let text = "SOLID\r\nFACET NORMAL 0 0 1\r\nOUTER LOOP\r\nVERTEX 0 0 0\r\nVERTEX 1 0 0\r\nVERTEX 1 1 -0\r\n\
                VERTEX 0 1 0\r\nENDLOOP\r\nENDFACET\r\nENDSOLID\r\nsolid b\rfacet\router loop\rvertex 1 1 0\r\
                vertex 1 0 0\rvertex 0.1 -0 1e-300\rendloop\rendfacet\rendsolid";
    let Loaded { mesh, notes, .. } = load("a.stl", text);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [2, 1, 4]]);
    assert_eq!(mesh.vertices[4].to_array(), [0.1, 0.0, 1e-300]);
    assert_eq!(notes, ["1 face with more than 3 vertices was split into triangles"]);
    let facet = "facet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    for (content, place, problem) in [
        (format!("solid\n{facet}"), "line 8", "no 'endsolid'"),
        (format!("solid\n{facet}facet\nouter loop\n"), "line 10", "no 'endsolid'"),
        (format!("solid\n{facet}vertex 0 0 0\nendsolid"), "line 9", "'vertex' does not belong"),
        (format!("solid\n{facet}endso"), "line 9", "'endso' does not belong"),
        ("solid\nfacet\nouter loop\nvertex 0 0 0\nendloop\n".into(), "line 5", "has 1 of at least 3"),
        ("solid\nfacet\nouter loop\nvertex 0 0\n".into(), "line 4", "no z coordinate"),
        ("solid\nfacet\nouter loop\nvertex 0 0 1,5\n".into(), "line 4", "'1,5' is not a number"),
        ("solid\nendsolid\n".into(), "", "no facets"),
        (format!("solid\n{}\0{facet}", facet.repeat(20)), "line 142", "binary data"),
    ] {
        assert_refused("a.stl", content, place, problem);
    }
}

#[test]
fn stl_text_with_a_facet_on_a_line_or_in_one_line() {
    let usual = text_stl(&sample("box").unwrap());
    let by_lines = load("a.stl", &usual).mesh;
    let facets: Vec<&str> = usual.split("endfacet").collect();
    let one_line = |facet: &&str| facet.split_whitespace().collect::<Vec<_>>().join(" ");
    let flat: Vec<String> = facets.iter().map(one_line).collect();
    let flat = flat.join(" endfacet\n").replacen("facet", "\nfacet", 1);
    assert!(flat.contains("outer loop vertex"), "{flat}");
    assert_eq!(load("a.stl", &flat).mesh, by_lines);
    let whole = flat.replace('\n', " ").replacen("facet", "\nfacet", 1);
    assert_eq!(whole.lines().count(), 2, "{whole}");
    assert_eq!(load("a.stl", &whole).mesh, by_lines);
    let twice = format!("{} {}\n", usual.replace('\n', " "), usual.replace('\n', " "));
    assert_eq!(load("a.stl", &twice).mesh.triangles.len(), 2 * by_lines.triangles.len());
    let open = flat.replacen("endloop", "", 1);
    assert_refused("a.stl", open, "line 2", "'endfacet' does not belong here");
}

#[test]
fn stl_is_refused_or_noted_where_32_bits_do_not_suffice() {
    let mut mesh = sample("box").unwrap();
    let encoding = "stl".parse::<Encoding>().unwrap();
    assert_eq!(lost_precision_note(&mesh, encoding.format), None);
    mesh.vertices.iter_mut().for_each(|v| *v += DVec3::splat(1e6 + 0.1));
    assert!(lost_precision_note(&mesh, encoding.format).unwrap().contains("32-bit"));
    assert_eq!(lost_precision_note(&mesh, "glb".parse::<Encoding>().unwrap().format), None);
    mesh.vertices[0].x = 1e39;
    assert!(matches!(encode(Path::new("x"), &mesh, encoding), Err(Error::Output { .. })));
}

#[test]
fn off_with_colours_normals_comments_and_counts_anywhere() {
    let square = "0 0 0 9 9 9\n1 0 0 # corner\n\n1 1 .5 255 0 0 255\n0 1 0\n";
    let faces = "4 0 1 2 3 255 0 0\n3 2 1 0\n2 0 1\n";
    for head in [
        "OFF\n4 3 0\n",
        "# by hand\nCOFF 4 3 0\n",
        "\u{feff}NOFF\n# counts\n4 3\n",
        "STCNOFF 4 3 7\n",
        "4 3 0\n",
    ] {
        let Loaded { mesh, mut notes, .. } = load("a.off", format!("{head}{square}{faces}"));
        let lacking = "colours were ignored: not all vertices have one";
        assert_eq!(notes.pop_if(|note| note == lacking).is_some(), head.contains("COFF 4 3 0"), "{head}");
        assert_eq!(mesh.vertices[2].to_array(), [1.0, 1.0, 0.5], "{head}");
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [2, 1, 0]], "{head}");
        let all = notes.len();
        notes.retain(|note| !note.ends_with(" of the vertices were ignored"));
        let lost = [head.contains("NOFF"), head.contains("ST")].map(usize::from);
        assert_eq!(all - notes.len(), lost[0] + lost[1], "{head}");
        assert_eq!(
            notes,
            [
                "1 face with more than 3 vertices was split into triangles",
                "1 face with fewer than 3 vertices was ignored"
            ]
        );
    }
    let three = "0 0 0\n1 0 0\n0 1 0\n";
    for (content, place, problem) in [
        ("OFF BINARY\n\0\0".into(), "line 1", "binary OFF"),
        ("4OFF\n1 1\n".into(), "line 1", "not in three dimensions"),
        ("nOFF\n2\n1 1\n".into(), "line 1", "not in three dimensions"),
        ("OFF\n".into(), "line 1", "no line with the counts"),
        ("OFF\nx y\n".into(), "line 2", "'x y' is not a line of the counts"),
        ("OFF\n3 0 0\n".into(), "line 2", "cut off"),
        (
            "OFF\n1000000000 1 0\n0 0 0\n".into(),
            "line 2",
            "declares 1000000000 vertices of at least 6000000000 bytes",
        ),
        ("OFF\n3 1000000000 0\n0 0 0\n0 0 0\n0 0 0\n".into(), "line 2", "declares 1000000000 faces"),
        ("OFF\n99999999999 1 0\n".into(), "", "more than the 4294967294 possible"),
        // A face where a vertex should be is read as one; then there is no face left.
        (format!("OFF\n4 1 0\n{three}3 0 1 2     "), "line 6", "face 0 of 1 is missing"),
        (format!("OFF\n3 2 0\n{three}3 0 1 2    \n"), "line 6", "face 1 of 2 is missing"),
        (format!("OFF\n3 1 0\n{three}3 0 1 3\n"), "line 6, face 0", "no vertex 3, indices go from 0 to 2"),
        (format!("OFF\n3 1 0\n{three}3 0 1\n"), "line 6, face 0", "has 2 of 3 vertices"),
        (
            format!("OFF\n3 1 0\n{three}9999999999999 0 1 2\n"),
            "line 6, face 0",
            "has 3 of 9999999999999 vertices",
        ),
        (format!("OFF\n3 1 0\n{three}3 0 1 -1\n"), "line 6, face 0", "'-1' is not a whole number"),
    ] {
        assert_refused("a.off", content, place, problem);
    }
}

#[test]
fn medit_sections_in_any_order_and_layout() {
    let text = "MeshVersionFormatted 2\nDimension\n3\n# comment\nTriangles 1\n3 2 1 7\nCorners\n2\n1 2\n\
                Vertices\n4\n0 0 0 0 1 0 0 0\n1 1 .5\n0\n0 1 0 1\nQuadrilaterals\n1\n1 2 3 4 0\nTetrahedra\n0\nEnd\n9 z";
    let Loaded { mesh, notes, attributes, .. } = load("a.mesh", text);
    assert_eq!(attributes.face_named("reference").unwrap().values, [7.0, 0.0, 0.0]);
    assert_eq!(attributes.vertex[0].values, [0.0, 0.0, 0.0, 1.0]);
    assert_eq!(mesh.vertices[2].to_array(), [1.0, 1.0, 0.5]);
    assert_eq!(mesh.triangles, [[2, 1, 0], [0, 1, 2], [0, 2, 3]]);
    assert_eq!(
        notes,
        [
            "1 face with more than 3 vertices was split into triangles",
            "these sections were ignored: Corners, Tetrahedra"
        ]
    );
    let start = "MeshVersionFormatted 1\nDimension 3\n";
    let vertices = "Vertices\n3\n0 0 0 0\n1 0 0 0\n0 1 0 0\n";
    for (content, place, problem) in [
        ("MeshVersionFormatted 1\nDimension 2\n".to_owned(), "line 2", "not in three dimensions"),
        (format!("{start}{vertices}End"), "", "no faces"),
        (format!("{start}Vertices x\nEnd"), "line 3", "the count 'x'"),
        (
            format!("{start}{vertices}{vertices}Triangles\n1\n1 2 3 0\nEnd"),
            "line 8",
            "second section 'vertices'",
        ),
        (
            format!("{start}{vertices}Triangles\n1\n0 1 2 0\nEnd"),
            "line 10, triangle 1",
            "no vertex 0, indices go from 1 to 3",
        ),
        (format!("{start}{vertices}Triangles\n1\n1 2 4 0\nEnd"), "line 10, triangle 1", "no vertex 4"),
        (
            format!("{start}{vertices}Triangles\n1\n1 2 x 0\nEnd"),
            "line 10, triangle 1",
            "'x' is not a whole number",
        ),
        (format!("{start}{vertices}Triangles\n1\n1 2 3\nEnd"), "line 11, triangle 1", "no reference number"),
        (
            format!("{start}{vertices}Triangles\n1\n1 2"),
            "line 8",
            "declares 1 triangle of at least 8 bytes, but 4 bytes are left",
        ),
        (
            format!("{start}{vertices}Triangles\n900000000\n1 2 3 0\nEnd"),
            "line 8",
            "declares 900000000 triangles",
        ),
        (
            format!("{start}Vertices 900000000\n0 0 0 0\nTriangles 1\n1 1 1 0\nEnd"),
            "line 3",
            "declares 900000000 vertices",
        ),
    ] {
        assert_refused("a.mesh", content, place, problem);
    }
    let open = load("a.mesh", format!("{start}{vertices}Triangles\n1\n1 2 3 0\n"));
    assert_eq!(open.notes, ["the file does not end with 'End'; sections may be missing"]);
}

/// A cube of two prisms on a cube of six tetrahedra: five sides each, of two triangles.
#[test]
fn medit_volume_cells_alone_are_read_as_their_boundary() {
    let mut text = "MeshVersionFormatted 2\nDimension 3\nVertices\n14\n".to_owned();
    for k in 0..12 {
        text += &format!("{} {} {} {}\n", k % 2, k / 2 % 2, k / 4, k + 1);
    }
    // Neither is a corner of a cell.
    text += "5 5 5 0\n.5 .5 .5 0\nTetrahedra\n6\n";
    for [a, b, c, d] in [[1, 2, 4, 8], [1, 4, 3, 8], [1, 3, 7, 8], [1, 7, 5, 8], [1, 5, 6, 8], [1, 6, 2, 8]] {
        // Every second one is turned.
        let [a, b] = if (a + b + c) % 2 == 0 { [a, b] } else { [b, a] };
        text += &format!("{a} {b} {c} {d} 3\n");
    }
    text += "Prisms\n2\n5 6 8 9 10 12 4\n5 8 7 9 12 11 4\nEnd\n";
    let Loaded { mesh, notes, attributes, .. } = load("a.mesh", &text);
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (12, 20));
    let cone = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        a.dot(b.cross(c)) / 6.0
    };
    let volume: f64 = (0..mesh.triangles.len()).map(cone).sum();
    assert!((volume - 2.0).abs() < 1e-12 && (mesh.area() - 10.0).abs() < 1e-12);
    assert_eq!(
        notes,
        [
            "the surface is the boundary of 8 volume cells",
            "4 faces with more than 3 vertices were split into triangles"
        ]
    );
    let label = attributes.face_named("reference").unwrap();
    let of = |reference: f64| label.values.iter().filter(|value| **value == reference).count();
    assert_eq!([of(3.0), of(4.0)], [10, 10]);
    let references: Vec<f64> = (1..=12).map(f64::from).collect();
    assert_eq!(attributes.vertex[0].values, references);
    // Faces go before cells, which are told to be left out.
    let faces = text.replace("Prisms", "Triangles\n1\n1 2 4 9\nPrisms");
    let Loaded { mesh, notes, .. } = load("a.mesh", faces);
    assert_eq!(mesh.triangles, [[0, 1, 3]]);
    assert_eq!(notes, ["these sections were ignored: Prisms, Tetrahedra"]);
    let missing = text.replace("5 6 8 9 10 12 4", "5 6 8 9 10 15 4");
    assert_refused("a.mesh", missing, "line 29, prism 1", "no vertex 15, indices go from 1 to 14");
    let cut = text.replace("Tetrahedra\n6", "Tetrahedra\n60000");
    assert_refused("a.mesh", cut, "line 19", "declares 60000 tetrahedra");
}

#[test]
fn no_truncation_panics() {
    let mesh = sample("tetrahedron").unwrap();
    let mut files: Vec<(String, Vec<u8>)> = WRITTEN
        .iter()
        .flat_map(|name| [(*name).to_owned(), format!("{name}.gz")])
        .map(|name| (name.clone(), encode(Path::new("x"), &mesh, name.parse().unwrap()).unwrap()))
        .collect();
    files.push(("stl".into(), text_stl(&mesh).into_bytes()));
    files.push(("gltf".into(), gltf_of(&mesh).into_bytes()));
    for (name, content) in files {
        assert_eq!(read_bytes(&content, None).unwrap().mesh.triangles.len(), 4, "{name}");
        for length in 0..content.len() {
            let declared = Some(name.parse().unwrap());
            match read_bytes(&content[..length], declared) {
                Err(Error::Input { path: None, remedy, .. }) => assert!(!remedy.is_empty()),
                Err(other) => panic!("{name} of {length} bytes: {other:?}"),
                // The line end, the end mark and the last faces of formats that do not count them may be
                // missing.
                Ok(loaded) => assert!(
                    length + 16 >= content.len() || name == "obj",
                    "{name} of {length} of {} bytes: {:?}",
                    content.len(),
                    loaded.notes
                ),
            }
        }
    }
}
