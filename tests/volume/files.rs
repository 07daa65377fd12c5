//! Files of volumes, made here byte by byte, and the program on them.

use crate::support::files::read_any_bytes;
use predicates::prelude::*;
use rtfmesh::glam::{DAffine3, DVec3};
use rtfmesh::io::{Input, Reader, Volume, read};
use rtfmesh::mesh::topology::topology;

use super::{npy, npy_of, volume_of};
use crate::support::place::Place;

fn parsed(bytes: &[u8]) -> rtfmesh::Result<Volume> {
    match read_any_bytes(bytes, None, false)? {
        Input::Volume(volume) => Ok(volume),
        Input::Mesh(_) => panic!("a mesh was read"),
    }
}

/// What is wrong with a file.
fn problem(bytes: &[u8]) -> String {
    parsed(bytes).unwrap_err().to_string()
}

/// 2 x 3 x 4 values, each telling its indices: 100 x + 10 y + z.
fn small() -> Volume {
    volume_of([2, 3, 4], |p| 100.0 * p.x + 10.0 * p.y + p.z)
}

/// The values of [`small`] with the last index fastest.
fn last_fastest() -> Vec<f64> {
    let indices = (0..24).map(|i| [i / 12, i / 4 % 3, i % 4]);
    indices.map(|[x, y, z]| f64::from(100 * x + 10 * y + z)).collect()
}

#[test]
fn arrays_of_numpy_have_any_order_and_type() {
    let expected = small();
    assert_eq!(parsed(&npy(&expected)).unwrap(), expected);
    let values = last_fastest();
    let array = |kind: &str, values: Vec<u8>| {
        npy_of(&format!("'{kind}', 'fortran_order': False, 'shape': (2, 3, 4)"), &values)
    };
    let each = |bytes: &dyn Fn(f64) -> Vec<u8>| values.iter().flat_map(|v| bytes(*v)).collect::<Vec<u8>>();
    for (kind, bytes) in [
        ("|u1", each(&|v| vec![v as u8])),
        ("<u2", each(&|v| (v as u16).to_le_bytes().into())),
        (">i2", each(&|v| (v as i16).to_be_bytes().into())),
        ("<i4", each(&|v| (v as i32).to_le_bytes().into())),
        (">u4", each(&|v| (v as u32).to_be_bytes().into())),
        ("<i8", each(&|v| (v as i64).to_le_bytes().into())),
        (">u8", each(&|v| (v as u64).to_be_bytes().into())),
        ("<f2", each(&|v| half::f16::from_f64(v).to_le_bytes().into())),
        (">f4", each(&|v| (v as f32).to_be_bytes().into())),
        ("<f8", each(&|v| v.to_le_bytes().into())),
    ] {
        assert_eq!(parsed(&array(kind, bytes)).unwrap(), expected, "{kind}");
    }
    let signs: Vec<u8> = (0..8).map(|i| (i % 2) * 255).collect();
    let signed = parsed(&npy_of("'|i1', 'fortran_order': True, 'shape': (2, 2, 2)", &signs)).unwrap();
    assert_eq!(signed.values, [0.0, -1.0, 0.0, -1.0, 0.0, -1.0, 0.0, -1.0]);
    let truths = npy_of("'|b1', 'fortran_order': True, 'shape': (2, 2, 2)", &[0, 1, 0, 1, 0, 1, 0, 1]);
    assert_eq!(parsed(&truths).unwrap().range(), Some([0.0, 1.0]));
}

#[test]
fn nrrd_is_read_raw_packed_and_as_text() {
    let expected = small();
    let raw: &[u8] = bytemuck::cast_slice(&expected.values);
    let header = |extra: &str| {
        format!("NRRD0004\n# a comment\ntype: float\ndimension: 3\nsizes: 2 3 4\n{extra}\n\n").into_bytes()
    };
    let with = |extra: &str, values: &[u8]| [header(extra), values.to_vec()].concat();
    assert_eq!(parsed(&with("encoding: raw\nendian: little", raw)).unwrap(), expected);
    let swapped: Vec<u8> = raw.chunks(4).flat_map(|four| four.iter().rev().copied()).collect();
    assert_eq!(parsed(&with("encoding: raw\nendian: big\nmy key:=value", &swapped)).unwrap(), expected);
    assert_eq!(parsed(&with("encoding: gzip\nendian: little", &packed(raw))).unwrap(), expected);
    let text: String = expected.values.iter().map(|v| format!("{v} ")).collect();
    assert_eq!(parsed(&with("encoding: ascii", text.as_bytes())).unwrap(), expected);
    // Something in front of the values.
    let behind = [b"one\ntwo\n123".to_vec(), raw.to_vec()].concat();
    let skipping = with("encoding: raw\nline skip: 2\nbyte skip: 3", &behind);
    assert_eq!(parsed(&skipping).unwrap(), expected);
    assert_eq!(parsed(&with("encoding: raw\nbyte skip: -1", &behind)).unwrap(), expected);
    // Places.
    let spaced = parsed(&with("encoding: raw\nspacings: 0.5 2 3", raw)).unwrap();
    assert_eq!(spaced.spacing(), DVec3::new(0.5, 2.0, 3.0));
    let directions = "encoding: raw\nspace: left-posterior-superior\n\
        space directions: (0, 2, 0) (-1,0,0) (0,0,4)\nspace origin: (10, 20,30)";
    let turned = parsed(&with(directions, raw)).unwrap().frame;
    assert_eq!(turned.transform_point3(DVec3::new(1.0, 1.0, 1.0)), DVec3::new(9.0, 22.0, 34.0));
    // Values in a file of their own.
    let place = Place::new();
    std::fs::write(place.path("a.nhdr"), header("encoding: raw\ndata file: a.raw")).unwrap();
    std::fs::write(place.path("a.raw"), raw).unwrap();
    let notes = vec!["files that it refers to were read: a.raw".to_owned()];
    let expected = Input::Volume(Volume { notes, ..expected });
    assert_eq!(Reader::new().read_any(place.path("a.nhdr")).unwrap(), expected);
    for (name, extra) in [("up.nhdr", "../a.raw"), ("all.nhdr", "LIST"), ("none.nhdr", "b.raw")] {
        std::fs::write(place.path(name), header(&format!("encoding: raw\ndata file: {extra}"))).unwrap();
        assert!(Reader::new().read_any(place.path(name)).is_err(), "{extra}");
    }
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// A NIfTI-1 file of 2 x 2 x 2 16-bit values 0 to 7, with these bytes of the header at these places.
fn nifti(changes: &[(usize, &[u8])]) -> Vec<u8> {
    let mut bytes = vec![0; 352];
    let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
    put(0, &348_i32.to_le_bytes());
    put(40, bytemuck::cast_slice(&[3_u16, 2, 2, 2, 1, 1, 1, 1]));
    put(70, &4_i16.to_le_bytes());
    put(76, bytemuck::cast_slice(&[1.0_f32, 0.5, 2.0, 3.0]));
    put(108, &352_f32.to_le_bytes());
    put(344, b"n+1\0");
    changes.iter().for_each(|(at, value)| put(*at, value));
    bytes.extend((0..8_i16).flat_map(i16::to_le_bytes));
    bytes
}

#[test]
fn nifti_has_scaled_values_in_its_own_space() {
    let plain = parsed(&nifti(&[])).unwrap();
    assert_eq!(plain.values, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    assert_eq!(plain.frame, DAffine3::from_scale(DVec3::new(0.5, 2.0, 3.0)));
    assert_eq!(parsed(&packed(&nifti(&[]))).unwrap(), plain);
    let scale: &[u8] = bytemuck::cast_slice(&[0.5_f32, -1.0]);
    assert_eq!(parsed(&nifti(&[(112, scale)])).unwrap().values[..3], [-1.0, -0.5, 0.0]);
    // A matrix goes before a rotation.
    let codes: &[u8] = bytemuck::cast_slice(&[1_i16, 1]);
    let rows: &[u8] =
        bytemuck::cast_slice(&[0.0_f32, -2.0, 0.0, 7.0, 1.0, 0.0, 0.0, 8.0, 0.0, 0.0, 3.0, 9.0]);
    let placed = parsed(&nifti(&[(252, codes), (280, rows)])).unwrap();
    assert_eq!(placed.frame.transform_point3(DVec3::ONE), DVec3::new(5.0, 9.0, 12.0));
    // A quarter turn about z, with the third axis turned over.
    let half = 0.5_f32.sqrt();
    let turn = [0.0_f32, 0.0, half, 1.0, 2.0, 3.0];
    let turn: &[u8] = bytemuck::cast_slice(&turn);
    let code = 1_i16.to_le_bytes();
    let changes: [(usize, &[u8]); 3] = [(252, &code), (256, turn), (76, &(-1.0_f32).to_le_bytes())];
    let turned = parsed(&nifti(&changes)).unwrap();
    let at = turned.frame.transform_point3(DVec3::ONE);
    assert!(at.distance(DVec3::new(1.0 - 2.0, 2.0 + 0.5, 3.0 - 3.0)) < 1e-6, "{at}");
    // A series: the first is read, with a note.
    let four: &[u8] = bytemuck::cast_slice(&[4_u16, 2, 2, 2, 3]);
    assert!(parsed(&nifti(&[(40, four)])).unwrap().notes[0].contains("3 volumes"));
}

#[test]
fn nifti_of_the_other_byte_order_is_read() {
    let mut bytes = nifti(&[]);
    let (header, values) = bytes.split_at_mut(352);
    header[..4].reverse();
    for (first, size, count) in [(40, 2, 8), (70, 2, 1), (76, 4, 8), (108, 4, 3)] {
        header[first..first + size * count].chunks_exact_mut(size).for_each(<[u8]>::reverse);
    }
    values.chunks_exact_mut(2).for_each(<[u8]>::reverse);
    assert_eq!(parsed(&bytes).unwrap(), parsed(&nifti(&[])).unwrap());
}

#[test]
fn broken_volumes_are_refused_in_words() {
    let array = |shape: &str| npy_of(&format!("'<f4', 'fortran_order': False, 'shape': {shape}"), &[0; 96]);
    for (bytes, said) in [
        (array("(24,)"), "1 axis (24)"),
        (array("(2, 3, 4, 1, 2)"), "5 axes"),
        (array("(1, 6, 4)"), "two along each axis"),
        (array("(3, 3, 4)"), "do not fit into 96 bytes"),
        (array("(1000000000, 1000000000, 1000000000)"), "do not fit"),
        (npy_of("'<c8', 'fortran_order': False, 'shape': (2, 2, 3)", &[0; 96]), "not supported"),
        (npy_of("[('a', '<f4')], 'fortran_order': False, 'shape': (2, 3, 4)", &[0; 96]), "not supported"),
        (npy_of(&"(".repeat(3000), &[]), "not supported"),
        (b"\x93NUMPY\x01\x00\xff\xff".to_vec(), "cut off"),
        (b"\x93NUMPY\x02\x00\xff\xff\xff\xff".to_vec(), "cut off"),
        (b"NRRD0004\ntype: float\n".to_vec(), "no empty line"),
        (b"NRRD0004\ntype: float\n\n".to_vec(), "no field 'sizes'"),
        (b"NRRD0004\ntype: block\nsizes: 2 2 2\nencoding: raw\n\n".to_vec(), "'type: block'"),
        (b"NRRD0004\ntype: float\nsizes: 2 2 2\nencoding: bzip2\n\n".to_vec(), "'encoding: bzip2'"),
        (b"NRRD0004\ntype: float\nsizes: 2 x 2\nencoding: raw\n\n".to_vec(), "'sizes: 2 x 2'"),
        (b"NRRD0004\ntype: uint8\nsizes: 2 2 2\nencoding: txt\n\n1 2 3 4 5 six 7 8".to_vec(), "'six'"),
        (b"NRRD0004\ntype: uint8\nsizes: 2 2 2\nspacings: 1 0 1\nencoding: raw\n\n12345678".to_vec(), "zero"),
        (nifti(&[(70, &128_i16.to_le_bytes())]), "type 128 (RGB24, colours)"),
        (nifti(&[(344, b"ni1\0")]), "another file"),
        (nifti(&[(4, b"n+2\0")]), "NIfTI-2"),
        (nifti(&[(40, bytemuck::cast_slice(&[3_u16, 9, 9, 9]))]), "do not fit"),
        (nifti(&[(108, &1e9_f32.to_le_bytes())]), "no values"),
        (nifti(&[(76, bytemuck::cast_slice(&[1.0_f32, f32::NAN, 1.0, 1.0]))]), "not finite"),
    ] {
        let found = problem(&bytes);
        assert!(found.contains(said), "{found:?} does not say {said:?}");
    }
    // Cut anywhere, a file is refused and not misread.
    for whole in [npy(&small()), nifti(&[])] {
        for length in (0..whole.len()).step_by(7) {
            assert!(read_any_bytes(&whole[..length], None, false).is_err(), "{length}");
        }
    }
}

#[test]
fn the_program_makes_a_mesh_of_a_volume() {
    let place = Place::new();
    let ball = volume_of([20, 20, 20], |p| p.distance(DVec3::splat(9.3)) - 6.0);
    std::fs::write(place.path("ball.npy"), npy(&ball)).unwrap();
    let (_, told) = place.run("remesh ball.npy out.ply -n 300 --iso 0 --report r.json --spacing 1,1,2");
    assert!(told.contains("20 x 20 x 20 values"), "{told}");
    let mesh = read(place.path("out.ply")).unwrap().mesh;
    assert_eq!((mesh.vertices.len(), topology(&mesh).genus), (300, Some(0)));
    let [low, high] = mesh.bounds().unwrap();
    assert!(((high - low) - DVec3::new(12.0, 12.0, 24.0)).abs().max_element() < 0.5, "{low} {high}");
    let report = std::fs::read_to_string(place.path("r.json")).unwrap();
    assert!(report.contains("the isosurface at 0 has"), "{report}");
    let (plan, _) = place.run("remesh ball.npy --dry-run -n 300 --iso 0");
    assert!(plan.contains("300"), "{plan}");
    let (shown, _) = place.run("inspect ball.npy");
    assert!(shown.contains("20 x 20 x 20") && shown.contains("not all are whole"), "{shown}");
    let (json, _) = place.run("inspect ball.npy --json");
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((json["size"][2].as_u64(), json["not_finite"].as_u64()), (Some(20), Some(0)));
    // Without a choice, the range helps to make one.
    for (arguments, code, said) in [
        ("remesh ball.npy out.ply -n 300", 2, "add --iso VALUE"),
        ("remesh ball.npy out.ply -n 300 --iso 77", 3, "no surface at 77"),
        (
            "remesh ball.npy out.ply -n 300 --iso 0 --fill-holes 1",
            2,
            "does not work with volumes; use --closed",
        ),
        ("remesh ball.npy out.ply -n 300 --normals-only", 3, "not a mesh"),
        ("remesh out.ply o.ply -n 300 --iso 0", 2, "works only with volumes"),
        ("remesh ball.npy out.npy -n 300 --iso 0", 1, "no faces"),
        ("measure ball.npy", 3, "values on a grid"),
        ("inspect ball.npy -n 30", 2, "works only with meshes"),
        ("remesh ball.npy o.ply -n 9 --iso 0 --spacing 1,2", 2, "three lengths above 0"),
    ] {
        place.program(arguments).assert().code(code).stderr(predicate::str::contains(said));
    }
}
