//! VTK's images: XML in every form and the older format, values of nodes and of voxels.

use crate::support::files::read_any_bytes;
use rtfmesh::glam::{DAffine3, DMat3, DVec3};
use rtfmesh::io::{Input, Volume};

use super::volume_of;
use crate::support::place::Place;
use crate::support::vtk::{Array, Form, Mode, forms, legacy_numbers};

const TEXT: Form = Form { mode: Mode::Ascii, is_big_endian: false, header: 4, block: None };

fn parsed(bytes: &[u8]) -> rtfmesh::Result<Volume> {
    match read_any_bytes(bytes, None, false)? {
        Input::Volume(volume) => Ok(volume),
        Input::Mesh(_) => panic!("a mesh was read"),
    }
}

/// The values of nodes or voxels as an image.
fn image(
    form: Form,
    dataset: &str,
    piece: &str,
    section: &str,
    arrays: &[(&str, &str, Vec<f64>)],
) -> Vec<u8> {
    let arrays: Vec<Array> = arrays
        .iter()
        .map(|(kind, name, values)| Array { section, kind, name, components: 1, values: values.clone() })
        .collect();
    form.file("ImageData", [dataset, piece, " Scalars=\"shown\""], &arrays)
}

/// Values that tell their indices.
fn small() -> Volume {
    volume_of([2, 3, 4], |p| 100.0 * p.x + 10.0 * p.y + p.z)
}

fn values(volume: &Volume) -> Vec<f64> {
    volume.values.iter().map(|value| f64::from(*value)).collect()
}

const GRID: &str =
    " WholeExtent=\"1 2 -1 1 0 3\" Origin=\"5 6 7\" Spacing=\"1 2 0.5\" Direction=\"0 -1 0 1 0 0 0 0 1\"";

#[test]
fn images_of_every_form_are_the_same_volume() {
    let axes = DMat3::from_cols(DVec3::Y, -2.0 * DVec3::X, 0.5 * DVec3::Z);
    let frame = DAffine3 {
        matrix3: axes,
        translation: DVec3::new(5.0, 6.0, 7.0) + axes * DVec3::new(1.0, -1.0, 0.0),
    };
    for form in forms() {
        for kind in ["UInt8", "Int16", "UInt32", "Int64", "Float32", "Float64"] {
            let arrays = [("Float32", "other", vec![0.0; 24]), (kind, "shown", values(&small()))];
            let read = parsed(&image(form, GRID, "Extent=\"1 2 -1 1 0 3\"", "PointData", &arrays)).unwrap();
            assert_eq!(read.frame, frame, "{form:?}");
            if kind != "UInt8" {
                assert_eq!(read.values, small().values, "{form:?} {kind}");
            }
            assert_eq!(read.notes, ["the array 'shown' was read; other arrays of the file were not"]);
        }
    }
}

#[test]
fn values_of_voxels_are_in_their_middle() {
    let grid = " WholeExtent=\"0 2 0 3 0 4\" Origin=\"0 0 0\" Spacing=\"2 2 2\"";
    let arrays = [("Int32", "label", values(&small()))];
    let read = parsed(&image(TEXT, grid, "Extent=\"0 2 0 3 0 4\"", "CellData", &arrays)).unwrap();
    assert_eq!((read.size, read.values), ([2, 3, 4], small().values));
    assert_eq!(read.frame.transform_point3(DVec3::ZERO), DVec3::ONE);
    assert_eq!(read.notes, Vec::<String>::new());
}

#[test]
fn older_images_are_volumes_too() {
    for is_binary in [false, true] {
        let form = if is_binary { "BINARY" } else { "ASCII" };
        let head = format!(
            "# vtk DataFile Version 3.0\nx\n{form}\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 3 4\n\
             ASPECT_RATIO 1 2 3\nORIGIN 5 6 7\nPOINT_DATA 24\nSCALARS a float\nLOOKUP_TABLE default\n"
        );
        let file = [head.into_bytes(), legacy_numbers("float", &values(&small()), is_binary)].concat();
        let read = parsed(&file).unwrap();
        assert_eq!((read.size, read.values), ([2, 3, 4], small().values));
        assert_eq!(read.frame.transform_point3(DVec3::ONE), DVec3::new(6.0, 8.0, 10.0));
    }
}

#[test]
fn images_that_are_refused() {
    let refused = |grid: &str, arrays: &[(&str, &str, Vec<f64>)]| {
        parsed(&image(TEXT, grid, "", "PointData", arrays)).unwrap_err().to_string()
    };
    let grid = " WholeExtent=\"0 1 0 1 0 1\"";
    let eight = vec![0.0; 8];
    for (grid, values, problem) in [
        (" WholeExtent=\"0 1 0 1 0 0\"", vec![0.0; 4], "needs at least two along each axis"),
        (" WholeExtent=\"0 1 0 1\"", eight.clone(), "does not have 6 numbers"),
        (grid, vec![0.0; 7], "7 of 8 numbers"),
        (" WholeExtent=\"0 1 0 1 0 1\" Spacing=\"1 0 1\"", eight.clone(), "zero or not finite"),
        (" WholeExtent=\"0 2000000000 0 2000000000 0 2000000000\"", eight.clone(), "cut off"),
    ] {
        let error = refused(grid, &[("Float32", "shown", values)]);
        assert!(error.contains(problem), "{error}");
    }
    assert!(refused(grid, &[]).contains("no array of one number"), "{}", refused(grid, &[]));
}

#[test]
fn the_program_makes_a_surface_of_an_image() {
    let place = Place::new();
    let ball = volume_of([12, 12, 12], |p| 4.0 - p.distance(DVec3::splat(5.5)));
    let grid = " WholeExtent=\"0 11 0 11 0 11\"";
    let form = Form { mode: Mode::Base64, is_big_endian: false, header: 8, block: Some(1 << 12) };
    let file = image(form, grid, "", "PointData", &[("Float32", "shown", values(&ball))]);
    std::fs::write(place.path("in.vti"), file).unwrap();
    place.run("remesh in.vti out.vtk -n 200 --iso 0 --iterations 2 --quality draft -q");
    let mesh = rtfmesh::io::read(place.path("out.vtk")).unwrap().mesh;
    assert!(mesh.vertices.iter().all(|v| (v.distance(DVec3::splat(5.5)) - 4.0).abs() < 0.2));
}
