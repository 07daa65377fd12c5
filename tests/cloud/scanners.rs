//! LAS, LAZ and E57 files, written by the crates that read them.

use std::f64::consts::FRAC_1_SQRT_2;
use std::io::Cursor;

use crate::support::files::read_any_bytes;
use e57::{E57Writer, Quaternion, Record, RecordValue, Transform, Translation};
use glam::DVec3;
use las::point::{Classification, Format};
use las::{Builder, Color, Vector, Writer};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rtfmesh::Error;
use rtfmesh::io::Loaded;
use rtfmesh::mesh::attributes::{Kind, Role};

use crate::io::hostile::refused;
use crate::support::place::Place;

/// A place in a map's coordinates, UTM, in metres.
const FAR: DVec3 = DVec3::new(412_345.0, 5_654_321.0, 123.0);

fn parsed(bytes: &[u8]) -> rtfmesh::Result<Loaded> {
    read_any_bytes(bytes, None, false)?.mesh_or_points()
}

/// Point `k` in millimetres.
fn place(k: u16) -> DVec3 {
    FAR + DVec3::new(1.0, 2.0, -1.0) * f64::from(k) / 1000.0
}

/// A file of version 1.`minor` with points of this format, of which every fourth is withheld.
fn las_file(minor: u8, format: u8, packed: bool, colour: impl Fn(u16) -> Color) -> Vec<u8> {
    let mut builder = Builder::from((1, minor));
    builder.point_format = Format::new(format).unwrap();
    builder.point_format.is_compressed = packed;
    let axis = |offset: f64| las::Transform { scale: 0.001, offset };
    builder.transforms = Vector { x: axis(412_000.0), y: axis(5_654_000.0), z: axis(0.0) };
    let mut writer = Writer::new(Cursor::new(Vec::new()), builder.into_header().unwrap()).unwrap();
    for k in 0..200 {
        let at = place(k);
        let point = las::Point {
            x: at.x,
            y: at.y,
            z: at.z,
            intensity: 3 * k,
            classification: Classification::new((k % 7) as u8).unwrap(),
            // In formats before 6 that is class 12, and not a flag.
            is_overlap: k == 1,
            is_withheld: k % 4 == 3,
            color: Some(colour(k)),
            gps_time: builder_has_time(format).then_some(1.5),
            ..las::Point::default()
        };
        writer.write_point(point).unwrap();
    }
    writer.into_inner().unwrap().into_inner()
}

fn builder_has_time(format: u8) -> bool {
    format != 2
}

/// All kinds of files of LAS.
fn las_files(colour: impl Fn(u16) -> Color + Copy) -> Vec<Vec<u8>> {
    let kinds = [(2, 2, false), (2, 2, true), (4, 7, false), (4, 7, true)];
    kinds.into_iter().map(|(minor, format, packed)| las_file(minor, format, packed, colour)).collect()
}

/// Two scans of which the second stands elsewhere and is turned by 90 degrees around z.
fn e57_file(second_has_colour: bool) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut file, "{file}").unwrap();
    let position = [Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];
    let other = [Record::CARTESIAN_INVALID_STATE, Record::INTENSITY_U16];
    let colour = [Record::COLOR_RED_U8, Record::COLOR_GREEN_U8, Record::COLOR_BLUE_U8];
    for scan in 0..2 {
        let has_colour = scan == 0 || second_has_colour;
        let colour = colour.iter().filter(|_| has_colour).cloned();
        let prototype = position.iter().chain(&other).cloned().chain(colour).collect();
        let mut points = writer.add_pointcloud("{scan}", prototype).unwrap();
        if scan == 1 {
            let rotation = Quaternion { w: FRAC_1_SQRT_2, x: 0.0, y: 0.0, z: FRAC_1_SQRT_2 };
            let translation = Translation { x: FAR.x, y: FAR.y, z: FAR.z };
            points.set_transform(Some(Transform { rotation, translation }));
        }
        for k in 0..100_i64 {
            let at = [k as f64, 2.0, 3.0].map(RecordValue::Double);
            // The last one is no point.
            let other = [2 * i64::from(k == 99), 7 * k].map(RecordValue::Integer);
            let colour = [k, 0, 255].map(RecordValue::Integer).into_iter().filter(|_| has_colour);
            points.add_point(at.into_iter().chain(other).chain(colour).collect()).unwrap();
        }
        points.finalize().unwrap();
    }
    writer.finalize().unwrap();
    drop(writer);
    file.into_inner()
}

#[test]
fn las_keeps_places_to_the_millimetre_and_what_points_carry() {
    let kept: Vec<u16> = (0..200).filter(|k| k % 4 != 3).collect();
    for bytes in las_files(|k| Color::new(300 * k, 65535, 0)) {
        let loaded = parsed(&bytes).unwrap();
        assert_eq!(loaded.mesh.vertices.len(), 150);
        for (found, k) in loaded.mesh.vertices.iter().zip(&kept) {
            assert!(found.distance(place(*k)) < 1e-8, "{found} is not {}", place(*k));
        }
        let [colour, intensity, classes] = &loaded.attributes.vertex[..] else {
            panic!("{:?}", loaded.attributes.listed())
        };
        assert_eq!((colour.role, colour.kind, colour.components), (Role::Colour, Kind::U16, 3));
        assert_eq!(colour.at(149), [f64::from(300 * kept[149]), 65535.0, 0.0]);
        assert_eq!(
            (intensity.name.as_str(), intensity.kind, intensity.at(149)),
            ("intensity", Kind::U16, &[594.0][..])
        );
        let class = if bytes[25] == 2 { 12.0 } else { 1.0 };
        assert_eq!(
            (classes.name.as_str(), classes.kind, classes.at(1), classes.at(2)),
            ("classification", Kind::U8, &[class][..], &[2.0][..])
        );
        assert_eq!(loaded.notes, ["50 points marked as withheld were left out"]);
    }
    // Colours that need 8 bits only, and none.
    let bytes = las_file(2, 2, true, |k| Color::new(k, 255, 0));
    assert_eq!(parsed(&bytes).unwrap().attributes.vertex[0].kind, Kind::U8);
    let bytes = las_file(2, 2, true, |_| Color::default());
    assert_eq!(parsed(&bytes).unwrap().attributes.vertex[0].name, "intensity");
}

#[test]
fn scans_of_e57_are_joined_by_their_poses() {
    let loaded = parsed(&e57_file(true)).unwrap();
    let points = &loaded.mesh.vertices;
    assert_eq!(points.len(), 198);
    assert_eq!(points[98], DVec3::new(98.0, 2.0, 3.0));
    // Turned from x to y.
    let last = FAR + DVec3::new(-2.0, 98.0, 3.0);
    assert!(points[197].distance(last) < 1e-8, "{} is not {last}", points[197]);
    let [colour, intensity] = &loaded.attributes.vertex[..] else {
        panic!("{:?}", loaded.attributes.listed())
    };
    assert_eq!((colour.role, colour.kind, colour.at(197)), (Role::Colour, Kind::U8, &[98.0, 0.0, 255.0][..]));
    assert_eq!((intensity.kind, intensity.at(197)), (Kind::F32, &[686.0][..]));
    let notes = ["2 scans were joined, each placed by its pose", "2 points without a position were left out"];
    assert_eq!(loaded.notes, notes);
    let loaded = parsed(&e57_file(false)).unwrap();
    assert_eq!(loaded.attributes.vertex.len(), 1);
    assert!(loaded.notes[2].contains("colours were left out: 99 points"), "{:?}", loaded.notes);
}

#[test]
fn the_program_takes_them_by_name_or_content() {
    let folder = Place::new();
    let files = las_files(|_| Color::default());
    for (name, bytes) in
        [("a.las", &files[0]), ("a.laz", &files[1]), ("a.txt", &files[3]), ("a.e57", &e57_file(true))]
    {
        std::fs::write(folder.path(name), bytes).unwrap();
        let (text, _) = folder.run(&format!("inspect {name} --json"));
        assert!(text.contains("\"points\": 150") || text.contains("\"points\": 198"), "{name}: {text}");
    }
    std::fs::write(folder.path("b.las"), b"LASF of another kind").unwrap();
    folder.program("inspect b.las").assert().code(3);
}

#[test]
fn broken_files_of_scanners_are_refused_or_read() {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    let files = las_files(|k| Color::new(k, k, k)).into_iter().chain([e57_file(true)]);
    for (which, bytes) in files.enumerate() {
        let check = |bytes: &[u8], what: &str| match parsed(bytes) {
            Ok(loaded) => assert!(loaded.mesh.vertices.iter().all(|p| p.is_finite())),
            Err(error @ Error::Input { .. }) => {
                assert!(!error.to_string().contains('\n'), "{which} {what}: {error}");
            }
            Err(other) => panic!("{which} {what}: {other:?}"),
        };
        for part in 1..40 {
            let cut = &bytes[..bytes.len() * part / 40];
            assert!(
                cut.len() < 8 || parsed(cut).is_err(),
                "file {which} is read though cut off at {part}/40"
            );
            check(cut, "cut off");
        }
        for _ in 0..100 {
            let mut changed = bytes.clone();
            let end = if rng.random() { bytes.len().min(400) } else { bytes.len() };
            let at = rng.random_range(0..end);
            changed[at] = rng.random();
            check(&changed, &format!("changed at {at}"));
        }
    }
}

#[test]
fn counts_of_scanners_decide_no_memory() {
    let [las, laz, las14, laz14] = <[Vec<u8>; 4]>::try_from(las_files(|_| Color::default())).unwrap();
    let changed = |bytes: &[u8], at: usize, value: &[u8]| {
        let mut bytes = bytes.to_vec();
        bytes[at..at + value.len()].copy_from_slice(value);
        bytes
    };
    refused("a.las", &changed(&las, 107, &[255; 4]), "4294967295");
    refused("a.las", &changed(&las, 107, &[255, 255, 255, 15]), "cut off");
    refused("a.laz", &changed(&laz, 107, &[255, 255, 255, 15]), "more than fit into it");
    refused("a.las", &changed(&las14, 247, &[255; 8]), "18446744073709551615");
    // Points are still there where extended records are not.
    let extended = changed(&las14, 235, &[1, 0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255]);
    assert_eq!(parsed(&extended).unwrap(), parsed(&las14).unwrap());
    for bytes in [&laz, &laz14] {
        let offset = u32::from_le_bytes(bytes[96..100].try_into().unwrap()) as usize;
        let table = i64::from_le_bytes(bytes[offset..offset + 8].try_into().unwrap()) as usize;
        refused("a.laz", &changed(bytes, table + 4, &[255; 4]), "4294967295 chunks");
    }
    // The size of a layer of points: behind the first point, which has 36 bytes, and their number.
    let offset = u32::from_le_bytes(laz14[96..100].try_into().unwrap()) as usize;
    refused("a.laz", &changed(&laz14, offset + 8 + 36 + 4, &[255; 4]), "longer than the file");
    // The same of a second chunk, of which the number of points in the first says nothing.
    // The size of chunks is behind the record's header of 52 bytes, in its data.
    let chunk_size = laz14.windows(14).position(|w| w == b"laszip encoded").unwrap() + 52 + 12;
    let table = i64::from_le_bytes(laz14[offset..offset + 8].try_into().unwrap()) as usize;
    let mut two = changed(&laz14, chunk_size, &10_u32.to_le_bytes());
    two.splice(table..table, [0; 40].into_iter().chain([255; 36]));
    refused("a.laz", &two, "longer than the file");
    let text = e57_file(true);
    let at = text.windows(16).position(|w| w.starts_with(b"recordCount=\"100")).unwrap();
    assert!(parsed(&changed(&text, at + 13, b"999")).is_err());
}
