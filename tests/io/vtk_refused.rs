//! Files of VTK that are refused, with a remedy, and damaged ones, which must do no harm.

use crate::support::files::{read_any_bytes, read_bytes};

use super::refused::assert_refused;
use crate::support::vtk::{Array, Form, Mode, forms};

fn triangle(form: Form) -> Vec<u8> {
    let array = |section, kind, name, components, values: &[f64]| Array {
        section,
        kind,
        name,
        components,
        values: values.to_vec(),
    };
    let arrays = [
        array("PointData", "Float32", "heat", 1, &[0.5, 1.0, 1.5]),
        array("Points", "Float64", "Points", 3, &[0., 0., 0., 1., 0., 0., 0., 1., 0.]),
        array("Polys", "Int32", "connectivity", 1, &[0., 1., 2.]),
        array("Polys", "Int32", "offsets", 1, &[3.]),
    ];
    form.file("PolyData", ["", "NumberOfPoints=\"3\" NumberOfPolys=\"1\"", ""], &arrays)
}

const TEXT: Form = Form { mode: Mode::Ascii, is_big_endian: false, header: 4, block: None };
const PACKED: Form = Form { mode: Mode::Raw, is_big_endian: false, header: 8, block: Some(32) };

fn changed(from: &str, to: &str) -> String {
    let text = String::from_utf8(triangle(TEXT)).unwrap();
    assert!(text.contains(from), "{from}");
    text.replace(from, to)
}

#[test]
fn xml_that_is_refused_says_what_to_do() {
    for (from, to, place, problem) in [
        ("</Piece>", "</Peace>", "byte", "not valid XML"),
        ("PolyData", "vtkMultiBlockDataSet", "", "VTK files of vtkMultiBlockDataSet are not supported"),
        ("PolyData", "PPolyData", "", "VTK files of PPolyData are not supported"),
        ("PolyData", "vtkMultiBlockDataSet", "", "give one of the files that it names"),
        ("UInt32", "UInt16", "", "header_type 'UInt16' is not supported"),
        ("0 1 2\n", "0 1 3\n", "cell 0", "no vertex 3"),
        ("0 1 2\n", "0 1 -2\n", "cell 0", "the corner -2 is not the index"),
        ("0 1 2\n", "0 1 1.5\n", "cell 0", "the corner 1.5 is not the index"),
        ("0 1 2\n", "0 1 x\n", "the array 'connectivity'", "'x' is not a number"),
        ("  3\n", "  2\n", "", "no faces"),
        ("  3\n", "  4\n", "cell 0", "outside their list"),
        ("  3\n", "\n", "the array 'offsets'", "cut off"),
        ("  0 0 0 1", "  0 0 nan 1", "", "no face has finite coordinates"),
        ("  0 0 0 1", "  0 0 1", "the array 'Points'", "8 of 9 numbers"),
        ("NumberOfPoints=\"3\"", "NumberOfPoints=\"3000000000000\"", "the array 'Points'", "cut off"),
        ("NumberOfPoints=\"3\"", "NumberOfPoints=\"x\"", "", "\"x\" is not a number of elements"),
        ("NumberOfComponents=\"3\"", "NumberOfComponents=\"0\"", "the array 'Points'", "components"),
        ("Name=\"offsets\"", "Name=\"ends\"", "the cells", "no array 'offsets'"),
        ("type=\"Float64\"", "type=\"String\"", "the array 'Points'", "no known type"),
        ("format=\"ascii\"", "format=\"hex\"", "the array 'heat'", "no format 'hex'"),
        ("NumberOfPoints=\"3\"", "NumberOfPoints=\"0\"", "", "no vertices"),
    ] {
        let file = changed(from, to);
        let error = read_bytes(file.as_bytes(), None).unwrap_err().to_string();
        assert!(error.starts_with(place) && error.contains(problem), "{from} → {to}: {error}");
    }
    let packed = String::from_utf8_lossy(&triangle(PACKED)).replace("vtkZLib", "vtkLZ4");
    let error = read_bytes(packed.as_bytes(), None).unwrap_err().to_string();
    assert!(
        error.contains("vtkLZ4DataCompressor") && error.contains("with zlib or without compression"),
        "{error}"
    );
    assert_refused("a.vtp", "solid", "", "no element VTKFile");
}

#[test]
fn older_files_that_are_refused_name_the_line() {
    let file = |body: &str| format!("# vtk DataFile Version 3.0\nx\nASCII\n{body}");
    let points = "DATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\n";
    for (body, place, problem) in [
        ("POINTS 3 float\n".to_owned(), "line 3", "no line DATASET"),
        ("DATASET RECTILINEAR_GRID\n".to_owned(), "", "VTK files of RECTILINEAR_GRID are not supported"),
        (format!("{points}POLYGONS 1 4\n3 0 1 5\n"), "cell 0", "no vertex 5"),
        (format!("{points}POLYGONS 1 4\n4 0 1 2\n"), "cell 0", "outside their list"),
        (format!("{points}POLYGONS 1 4\n3 0 1\n"), "line 8", "3 of 4 numbers"),
        (format!("{points}POLYGONS 5 4\n3 0 1 2\n"), "line 7", "5 cells do not fit"),
        (format!("{points}POLYGON 1 4\n"), "line 7", "'POLYGON' is not a keyword"),
        (format!("{points}POLYGONS 1000000000 4000000000\n"), "line 7", "cut off"),
        (points.replace("float", "text"), "line 5", "'text' is not a type of numbers"),
        (points.replace("0 1 0\n", "0 one 0\n"), "line 6", "'one' is not a number"),
        (
            "DATASET UNSTRUCTURED_GRID\nPOINTS 1 float 0 0 0\nCELLS 1 2\n1 0\n".to_owned(),
            "line 7",
            "no types",
        ),
        (
            "DATASET UNSTRUCTURED_GRID\nPOINTS 1 float 0 0 0\nCELLS 1 2\n1 0\nCELL_TYPES 1\n42\n".to_owned(),
            "",
            "type 42 (polyhedra) are not supported",
        ),
    ] {
        assert_refused("a.vtk", file(&body), place, problem);
    }
}

/// Files cut off or changed anywhere are refused or read, without panics.
#[test]
fn damage_does_no_harm() {
    let mut files: Vec<Vec<u8>> = forms().into_iter().map(triangle).collect();
    files.push(b"# vtk DataFile Version 5.1\nx\nBINARY\nDATASET POLYDATA\nPOINTS 3 float\n".to_vec());
    for file in files {
        for length in (0..file.len()).step_by(2) {
            let _ = read_any_bytes(&file[..length], None, false);
        }
        for at in 0..file.len() {
            let mut copy = file.clone();
            copy[at] = [0xff, b'9', 0][at % 3];
            let _ = read_any_bytes(&copy, None, false);
        }
    }
}

/// Little that stands for much: packed zeros, and arrays that name the same bytes.
#[test]
fn files_that_repeat_themselves_are_refused() {
    let big = Form { mode: Mode::Raw, is_big_endian: false, header: 8, block: Some(1 << 20) };
    let zeros =
        Array { section: "PointData", kind: "UInt8", name: "a", components: 1, values: vec![0.0; 2 << 20] };
    let points =
        Array { section: "Points", kind: "UInt8", name: "Points", components: 3, values: vec![0.0; 6 << 20] };
    let file = big.file("PolyData", ["", "NumberOfPoints=\"2097152\"", ""], &[zeros, points]);
    let text = String::from_utf8_lossy(&file);
    let at = text.find("<DataArray").unwrap();
    let element = &text[at..text.find("</DataArray>").unwrap() + 12];
    let end = file.windows(12).position(|w| w == b"<Appended en" || w == b"</PointData>").unwrap();
    let repeated = [&file[..end], element.repeat(60).as_bytes(), &file[end..]].concat();
    let error = read_any_bytes(&repeated, None, false).unwrap_err().to_string();
    assert!(error.contains("expand to more than") || error.contains("far more numbers"), "{error}");
}

/// Work must not grow with the square of the number of sections and arrays.
#[test]
fn many_sections_take_linear_time() {
    let start = std::time::Instant::now();
    let head = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 1 float 0 0 0\n";
    for body in
        ["METADATA\n\n".repeat(200_000), format!("FIELD f 60000\n{}", "a 1 1 int\n7\n".repeat(60_000))]
    {
        let _ = read_any_bytes(format!("{head}POINT_DATA 1\n{body}").as_bytes(), None, false);
    }
    assert!(start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
}
