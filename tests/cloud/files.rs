//! Files of points, and the program on them.

use crate::support::files::read_any_bytes;
use glam::DVec3;
use predicates::prelude::*;
use rtfmesh::cloud::PointCloud;
use rtfmesh::io::{Encoding, Format, Loaded, Reader, read};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;

use super::sampled;
use crate::support::place::Place;

fn parsed(format: Format, bytes: impl AsRef<[u8]>) -> rtfmesh::Result<Loaded> {
    read_any_bytes(bytes.as_ref(), Some(Encoding { format, gzip: false }), false)?.mesh_or_points()
}

#[test]
fn lines_of_numbers_are_told_by_names_or_values() {
    let points = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, -6.0)];
    for (text, attributes) in [
        ("1 2 3\n4 5 -6\n", ""),
        ("# comment\n1,2,3\r\n4,5,-6", ""),
        ("2\n1 2 3 255 0 17\n4 5 -6 0 0 0\n", "colour"),
        ("1;2;3;0;0;1\n4;5;-6;0.6;0.8;0\n", "normal"),
        ("1 2 3 0 0 1 10 20 30\n4 5 -6 0 1 0 1 2 3\n", "colour normal"),
        ("1 2 3 -17.5 10 20 30\n4 5 -6 8.25 1 2 3\n", "colour value_4"),
        ("z,y,x,Heat\n3,2,1,8\n-6,5,4,9\n", "heat"),
        ("//X Y Z Nx Ny Nz\n1 2 3 0 0 1\n4 5 -6 0 0 2\n", "normal"),
        ("X [m];Y [m];Z [m];Soil moisture (%)\n1,0;2,0;3,0;7,5\n4,0;5,0;-6,0;8,5\n", "soil moisture"),
        ("X [m] Y [m] Z [m] Heat [K]\n1 2 3 7\n4 5 -6 8\n", "heat"),
        ("# X (m),Y (m),Z (m),Gas flow\n1,2,3,7\n4,5,-6,8\n", "gas flow"),
        (
            "X (US ft) Y (US ft) Z (US ft) Heat[0] Heat[1] # by A, B\n1 2 3 7 8\n4 5 -6 9 9\n",
            "heat[0] heat[1]",
        ),
        ("y x z, heat\n2 1 3 7\n5 4 -6 9\n", "heat"),
        ("1,0;2,0;3,0;tree\n4,0;5,0;-6,0;roof\n", ""),
        ("scan of a wall\n\"X\",\"Y\",\"Z\"\n1,2,3\n4,5,-6\n", ""),
        ("class,x,y,z,heat\ntree,1,2,3,7\nroof,4,5,-6,8\n", "heat"),
        ("1 2 3 tree 7\n4 5 -6 roof 8\n", "value_4"),
    ] {
        let loaded = parsed(Format::Xyz, text).unwrap();
        assert_eq!(loaded.mesh.vertices, points, "{text}");
        let names: Vec<&str> = loaded.attributes.vertex.iter().map(|a| a.name.as_str()).collect();
        assert_eq!(names.join(" "), attributes, "{text}");
        let left_out = |name: &str| format!("{name} was left out, since it begins with text");
        let is_told =
            [left_out("column 'class'"), left_out("column 4")].iter().any(|note| loaded.notes.contains(note));
        assert_eq!(is_told, text.contains("tree"), "{text}: {:?}", loaded.notes);
    }
}

const HEADER: &str = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z normal_x normal_y normal_z rgb\n\
    SIZE 4 4 4 4 4 4 4\nTYPE F F F F F F U\nCOUNT 1 1 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\n";

#[test]
fn pcd_is_read_as_text_and_binary() {
    let rows = [[1.0_f32, 2.0, 3.0, 0.0, 0.0, 1.0], [4.0, 5.0, -6.0, 1.0, 0.0, 0.0]];
    let colours = [0x00ff_8000_u32, 17];
    let mut text = format!("{HEADER}DATA ascii\n");
    let mut binary = format!("{HEADER}DATA binary\n").into_bytes();
    for (row, colour) in rows.iter().zip(colours) {
        text += &row.iter().map(|x| format!("{x} ")).collect::<String>();
        text += &format!("{colour}\n");
        row.iter().for_each(|x| binary.extend(x.to_le_bytes()));
        binary.extend(colour.to_le_bytes());
    }
    for bytes in [text.as_bytes(), &binary] {
        // The content says what it is, whatever the name.
        let loaded = parsed(Format::Pcd, bytes).unwrap();
        assert_eq!(loaded, read_any_bytes(bytes, None, false).unwrap().mesh_or_points().unwrap());
        let colour = &loaded.attributes.vertex[0].values;
        assert_eq!(colour, &[255.0, 128.0, 0.0, 0.0, 0.0, 17.0]);
        let cloud = PointCloud::from(loaded);
        assert_eq!(cloud.points, [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, -6.0)]);
        assert_eq!(cloud.normals, [DVec3::Z, DVec3::X]);
    }
    let holes = text.replace("4 5 -6", "nan nan nan");
    let loaded = parsed(Format::Pcd, holes).unwrap();
    assert!(loaded.mesh.vertices.len() == 1 && loaded.notes[0].contains("1 point without"));
    // Columns are told by the points that are there.
    let text = "1 2 3 0 0 1\nnan nan nan nan nan nan\n-nan(ind) 0 0 9 9 9\n4 5 6 0 1 0\n";
    let loaded = parsed(Format::Xyz, text).unwrap();
    let notes = ["the columns were read as x, y, z, nx, ny, nz", "2 points without a position were left out"];
    assert_eq!(loaded.notes, notes);
    assert_eq!(PointCloud::from(loaded).normals, [DVec3::Z, DVec3::Y]);
}

#[test]
fn pcd_is_read_as_packed_by_lzf() {
    // Fields one after another: x of both points, then y, z, normals, colours.
    let columns = [[1.0_f32, 4.0], [2.0, 5.0], [3.0, -6.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0]];
    let mut plain: Vec<u8> = columns.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    plain.extend([0x00ff_8000_u32, 17].iter().flat_map(|x| x.to_le_bytes()));
    // As bytes, but for the 12 zeros from byte 28 to 40: one zero and a long copy that overlaps itself.
    assert_eq!(plain[32..40], [0; 8]);
    let mut packed = vec![31];
    packed.extend(&plain[..32]);
    packed.extend([0, 0, 5 << 5, 0]);
    packed.push(15);
    packed.extend(&plain[40..]);
    let mut file = format!("{HEADER}DATA binary_compressed\n").into_bytes();
    file.extend((packed.len() as u32).to_le_bytes());
    file.extend((plain.len() as u32).to_le_bytes());
    file.extend(&packed);
    let cloud = PointCloud::from(parsed(Format::Pcd, &file).unwrap());
    assert_eq!(cloud.points, [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, -6.0)]);
    assert_eq!(cloud.normals, [DVec3::Z, DVec3::X]);
    // A whole file, or none.
    for length in 0..file.len() {
        assert!(parsed(Format::Pcd, &file[..length]).is_err(), "{length}");
    }
}

#[test]
fn hostile_files_are_refused_with_a_place() {
    let big = HEADER.replace("POINTS 2", "POINTS 1000000000");
    for (format, text, word) in [
        (Format::Xyz, "1 2\n".to_owned(), "line 1"),
        (Format::Xyz, "1 2 3\n1 2\n".to_owned(), "line 2"),
        (Format::Xyz, "nan 2 3\n".to_owned(), "no point has a finite position"),
        (Format::Xyz, "1 2 3\n1 b 3\n".to_owned(), "'b' is not a number"),
        (Format::Xyz, "x y z heat\n1 b 3 4\n4 5 6 7\n".to_owned(), "line 2: 'b' is not a number"),
        (Format::Xyz, "1 b 3\n4 5 6\n".to_owned(), "'b' is not a number"),
        (Format::Xyz, "1 2 3 b\n4 5 6 c d\n".to_owned(), "'d' is not a number"),
        (Format::Xyz, "1000000000\n1 2 3\n".to_owned(), "cut off"),
        (Format::Xyz, "a b c\n1 2 3\n".to_owned(), "no columns x, y and z"),
        (Format::Xyz, "# nothing\n".to_owned(), "no columns"),
        (Format::Pcd, HEADER.to_owned(), "no line DATA"),
        (Format::Pcd, format!("{big}DATA binary\n0000"), "cut off"),
        (Format::Pcd, format!("{big}DATA ascii\n1 2 3"), "cut off"),
        (Format::Pcd, format!("{HEADER}DATA binary_compressed\n"), "lengths of the compressed data"),
        (
            Format::Pcd,
            format!("{HEADER}DATA binary_compressed\n\x7f\0\0\0\x38\0\0\0"),
            "127 bytes are declared",
        ),
        // Four billion bytes in two; a copy from before the beginning; too few points.
        (Format::Pcd, format!("{HEADER}DATA binary_compressed\n\x02\0\0\0\x7f\x7f\x7f\x7f\0a"), "not unpack"),
        (Format::Pcd, format!("{HEADER}DATA binary_compressed\n\x02\0\0\0\x03\0\0\0\x20\0"), "not unpack"),
        (
            Format::Pcd,
            format!("{HEADER}DATA binary_compressed\n\x02\0\0\0\x01\0\0\0\0a"),
            "declares 2 points",
        ),
        (Format::Pcd, format!("{HEADER}DATA ascii\n1.00 2.00 3.00 0 0 1\n1 2 3 0 0 1 9\n"), "too few values"),
        (Format::Pcd, format!("{}DATA ascii\n1 2 3\n", HEADER.replace("SIZE 4", "SIZE")), "do not name"),
    ] {
        let error = parsed(format, &text).unwrap_err().to_string();
        assert!(error.contains(word), "{text:?}: {error}");
    }
}

#[test]
fn the_program_remeshes_points_and_writes_their_normals() {
    let place = Place::new();
    let cloud = sampled(&sample("torus").unwrap(), 5000, 9);
    let line = |p: &DVec3| format!("{} {} {}\n", p.x, p.y, p.z);
    std::fs::write(place.path("torus.xyz"), cloud.points.iter().map(line).collect::<String>()).unwrap();
    place.run("remesh torus.xyz out.ply -n 500 --iterations 3");
    let mesh = read(place.path("out.ply")).unwrap().mesh;
    let t = topology(&mesh);
    assert!(t.vertices == 500 && t.is_closed_manifold() && t.genus == Some(1), "{t:?}");
    // Ratios are of the points, and the report says what became of them.
    place.run("remesh torus.xyz out.ply --ratio 0.05 --iterations 3 --report report.json");
    assert_eq!(read(place.path("out.ply")).unwrap().mesh.vertices.len(), 250);
    let report = std::fs::read_to_string(place.path("report.json")).unwrap();
    assert!(report.contains("a point cloud (5000 points"), "{report}");
    place.run("remesh torus.xyz normals.ply --normals-only");
    let points = PointCloud::from(
        Reader::new().read_any(place.path("normals.ply")).unwrap().mesh_or_points().unwrap(),
    );
    assert_eq!(points.points, cloud.points);
    let right = points.normals.iter().zip(&cloud.normals).filter(|(n, m)| n.dot(**m) > 0.5).count();
    assert!(right > 4950, "{right}");
    let no_mesh = || predicate::str::contains("no faces").and(predicate::str::contains("rtfmesh remesh"));
    place.program("measure torus.xyz").assert().code(3).stderr(no_mesh());
    let wrong = place.program("remesh out.ply again.ply --closed").assert().code(2);
    wrong.stderr(predicate::str::contains("use --fill-holes 100%"));
}
