//! MetaImage files, made here line by line.

use std::io::Write;

use crate::support::files::read_any_bytes;
use rtfmesh::glam::{DAffine3, DMat3, DVec3};
use rtfmesh::io::{Input, Reader, Volume};

use super::volume_of;
use crate::support::place::Place;

fn parsed(bytes: &[u8]) -> rtfmesh::Result<Volume> {
    match read_any_bytes(bytes, None, false)? {
        Input::Volume(volume) => Ok(volume),
        Input::Mesh(_) => panic!("a mesh was read"),
    }
}

/// 2 x 3 x 4 values, each with its indices in its digits.
fn small() -> Volume {
    volume_of([2, 3, 4], |p| 100.0 * p.x + 10.0 * p.y + p.z)
}

/// A file of 2 x 3 x 4 values with these further lines, of which the last names the values' file.
fn file(kind: &str, lines: &str, values: &[u8]) -> Vec<u8> {
    let header = format!("ObjectType = Image\nNDims = 3\nDimSize = 2 3 4\nElementType = {kind}\n{lines}\n");
    [header.as_bytes(), values].concat()
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

const LOCAL: &str = "ElementDataFile = LOCAL";

#[test]
fn metaimage_is_read_raw_packed_and_as_text() {
    let expected = small();
    let raw: &[u8] = bytemuck::cast_slice(&expected.values);
    let float = |lines: &str, values: &[u8]| parsed(&file("MET_FLOAT", &format!("{lines}{LOCAL}"), values));
    assert_eq!(float("", raw).unwrap(), expected);
    assert_eq!(float("BinaryData = True\nCompressedData = False\n", raw).unwrap(), expected);
    let swapped: Vec<u8> = raw.chunks(4).flat_map(|four| four.iter().rev().copied()).collect();
    for field in ["BinaryDataByteOrderMSB", "ElementByteOrderMSB"] {
        assert_eq!(float(&format!("{field} = True\n"), &swapped).unwrap(), expected);
    }
    let zlib = packed(raw);
    let lines = format!("CompressedData = True\nCompressedDataSize = {}\n", zlib.len());
    assert_eq!(float(&lines, &zlib).unwrap(), expected);
    let text: String = expected.values.iter().map(|v| format!("{v} ")).collect();
    assert_eq!(float("BinaryData = False\n", text.as_bytes()).unwrap(), expected);
    // Something in front of the values.
    let behind = [b"12345", raw].concat();
    assert_eq!(float("HeaderSize = 5\n", &behind).unwrap(), expected);
    assert_eq!(float("HeaderSize = -1\n", &behind).unwrap(), expected);
    // Other types, and numbers that the header scales.
    let shorts: Vec<u8> = expected.values.iter().flat_map(|v| (*v as i16 - 50).to_le_bytes()).collect();
    let lines = format!("ElementToIntensityFunctionOffset = 50\n{LOCAL}");
    assert_eq!(parsed(&file("MET_SHORT", &lines, &shorts)).unwrap(), expected);
    let bytes: Vec<u8> = expected.values.iter().map(|v| *v as u8 / 2).collect();
    let halves = parsed(&file("MET_UCHAR", &format!("ElementToIntensityFunctionSlope = 2\n{LOCAL}"), &bytes));
    let even: Vec<f32> = expected.values.iter().map(|v| 2.0 * (v / 2.0).floor()).collect();
    assert_eq!(halves.unwrap().values, even);
}

#[test]
fn metaimage_has_its_directions_spacing_and_origin() {
    let raw = small().values;
    let frame = |lines: &str| {
        let bytes = file("MET_FLOAT", &format!("{lines}\n{LOCAL}"), bytemuck::cast_slice(&raw));
        parsed(&bytes).unwrap().frame
    };
    assert_eq!(frame("ElementSpacing = 0.5 2 3"), DAffine3::from_scale(DVec3::new(0.5, 2.0, 3.0)));
    // The first axis along y, the second against x: each axis is a row.
    let turned = frame(
        "TransformMatrix = 0 1 0 -1 0 0 0 0 1\nOffset = 10 20 30\nElementSpacing = 2 3 4\n\
         CenterOfRotation = 1 2 3",
    );
    let axes = DMat3::from_cols(DVec3::Y * 2.0, DVec3::X * -3.0, DVec3::Z * 4.0);
    assert_eq!(turned, DAffine3 { matrix3: axes, translation: DVec3::new(10.0, 20.0, 30.0) });
    assert_eq!(frame("Position = 1 2 3").translation, DVec3::new(1.0, 2.0, 3.0));
}

#[test]
fn values_of_metaimage_may_be_in_a_file_beside_it() {
    let place = Place::new();
    let expected = small();
    let raw: &[u8] = bytemuck::cast_slice(&expected.values);
    let header = |name: &str| file("MET_FLOAT", &format!("ElementDataFile = {name}"), b"");
    std::fs::write(place.path("a.raw"), raw).unwrap();
    std::fs::write(place.path("a.mhd"), header("a.raw")).unwrap();
    let notes = vec!["files that it refers to were read: a.raw".to_owned()];
    let expected = Input::Volume(Volume { notes, ..expected });
    assert_eq!(Reader::new().read_any(place.path("a.mhd")).unwrap(), expected);
    for (other, said) in [
        ("../a.raw", "outside the folder"),
        ("LIST", "name one file"),
        ("slice%03d.raw 1 4 1", "name one file"),
        ("b.raw", "no such file"),
    ] {
        std::fs::write(place.path("b.mhd"), header(other)).unwrap();
        let error = Reader::new().read_any(place.path("b.mhd")).unwrap_err().to_string();
        assert!(error.contains(said), "{error:?} does not say {said:?}");
    }
}

#[test]
fn broken_metaimages_are_refused_in_words() {
    let raw = [0; 96];
    let lines = |lines: &str| file("MET_FLOAT", &format!("{lines}\n{LOCAL}"), &raw);
    let huge = |more: &str| {
        format!("NDims = 3\nDimSize = 99999 99999 99999\nElementType = MET_UCHAR\n{more}{LOCAL}\n12345678")
    };
    for (bytes, said) in [
        (file("MET_FLOAT", "BinaryData = True", b""), "no line 'ElementDataFile"),
        (file("MET_FLOAT_ARRAY", LOCAL, &raw), "'ElementType = MET_FLOAT_ARRAY'"),
        (file("MET_FLOAT", LOCAL, &raw[..95]), "do not fit into 95 bytes"),
        (lines("ElementNumberOfChannels = 3"), "'ElementNumberOfChannels = 3'"),
        (lines("ElementSpacing = 1 0 1"), "zero"),
        (lines("ElementSpacing = 1 1"), "'ElementSpacing = 1 1'"),
        (lines("Offset = 0 x 0"), "'Offset = 0 x 0'"),
        (lines("TransformMatrix = 1 0 0 1"), "'TransformMatrix = 1 0 0 1'"),
        (lines("HeaderSize = 0.5"), "'HeaderSize = 0.5'"),
        (lines("no field"), "line 5"),
        (lines("CompressedData = True"), "zlib data is cut off or damaged"),
        (format!("NDims = 3\nElementType = MET_FLOAT\n{LOCAL}\n").into(), "no field 'DimSize'"),
        (format!("NDims = 2\nDimSize = 9 9\nElementType = MET_FLOAT\n{LOCAL}\n").into(), "2 axes"),
        (format!("ObjectType = Tube\nNDims = 3\n{LOCAL}\n").into(), "'ObjectType = Tube'"),
        (huge("").into(), "do not fit"),
        (huge("CompressedData = True\n").into(), "8 bytes of zlib data cannot hold"),
        (huge("HeaderSize = 1e300\n").into(), "do not fit into 0 bytes"),
    ] {
        let found = parsed(&bytes).unwrap_err().to_string();
        assert!(found.contains(said), "{found:?} does not say {said:?}");
    }
    // Cut anywhere, a file is refused and not misread.
    let zlib = packed(bytemuck::cast_slice(&small().values));
    for whole in
        [lines("Comment = none"), file("MET_FLOAT", &format!("CompressedData = True\n{LOCAL}"), &zlib)]
    {
        for length in 0..whole.len() - 4 {
            assert!(read_any_bytes(&whole[..length], None, false).is_err(), "{length}");
        }
    }
}
