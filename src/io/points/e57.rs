//! Points of E57 files, the format of terrestrial laser scanning, by the `e57` crate.

use std::io::Cursor;

use e57::{CartesianCoordinate, E57Reader, Point, PointCloud, RecordDataType};

use super::columns::{Column, load_columns, without_position};
use super::{broken_file, without_panics};
use crate::grammar::counted;
use crate::io::checks::{check_vertex_count, excerpt, expands_too_far};
use crate::io::loaded::Loaded;
use crate::mesh::attributes::Kind;
use crate::{Error, Result};

/// Minimum number of bytes that a point takes in memory.
const POINT_BYTES: u64 = 24;

/// Whether a file begins as E57 files do.
pub(crate) fn starts(bytes: &[u8]) -> bool {
    bytes.starts_with(b"ASTM-E57")
}

pub(crate) fn parse(bytes: &[u8]) -> Result<Loaded> {
    without_panics(|| read(bytes))
}

fn read(bytes: &[u8]) -> Result<Loaded> {
    let mut reader = E57Reader::new(Cursor::new(bytes)).map_err(e57_error)?;
    let scans = reader.pointclouds();
    let count = scans.iter().fold(0_u64, |sum, scan| sum.saturating_add(scan.records));
    check_vertex_count(count.max(1))?;
    if expands_too_far(count.saturating_mul(POINT_BYTES), bytes.len() as u64) {
        return Err(broken_file(format!("it declares {count} points, more than fit into it")));
    }
    let mut columns = Columns::default();
    for scan in &scans {
        check_takes_room(scan)?;
        let mut points = reader.pointcloud_simple(scan).map_err(e57_error)?;
        points.intensity_to_color(false);
        points.normalize_intensity(false);
        for point in points {
            columns.add(&point.map_err(e57_error)?);
        }
    }
    columns.finish(scans.len())
}

fn e57_error(error: e57::Error) -> Error {
    broken_file(excerpt(&error.to_string()))
}

/// Refuses scans whose points have the same numbers all, which take no bytes: nothing bounds them.
fn check_takes_room(scan: &PointCloud) -> Result<()> {
    let takes_room = |data: &RecordDataType| match data {
        RecordDataType::Integer { min, max } | RecordDataType::ScaledInteger { min, max, .. } => min < max,
        _ => true,
    };
    if scan.records <= 1 || scan.prototype.iter().any(|record| takes_room(&record.data_type)) {
        return Ok(());
    }
    Err(broken_file("all points of a scan are at one place"))
}

/// The numbers of the points so far.
#[derive(Default)]
struct Columns {
    position: [Vec<f64>; 3],
    /// Only of points that have one, as is the colour.
    intensity: Vec<f64>,
    colour: [Vec<f64>; 3],
    /// Points of which only the direction is known, or nothing.
    missing: usize,
}

impl Columns {
    fn add(&mut self, point: &Point) {
        let CartesianCoordinate::Valid { x, y, z } = point.cartesian else {
            self.missing += 1;
            return;
        };
        self.position.iter_mut().zip([x, y, z]).for_each(|(to, value)| to.push(value));
        self.intensity.extend(point.intensity.map(f64::from));
        if let Some(colour) = &point.color {
            // From 0 to 1, whatever numbers the file has.
            let shares = [colour.red, colour.green, colour.blue].map(f64::from);
            let largest = f64::from(u8::MAX);
            let bytes = shares.map(|share| Kind::U8.rounded(largest * share));
            self.colour.iter_mut().zip(bytes).for_each(|(to, value)| to.push(value));
        }
    }

    fn finish(self, scans: usize) -> Result<Loaded> {
        let mut notes = Vec::new();
        if scans > 1 {
            notes.push(format!("{scans} scans were joined, each placed by its pose"));
        }
        if self.missing > 0 {
            notes.push(without_position(self.missing));
        }
        let column = |name: &str, kind, values| Column { name: name.to_owned(), kind, values };
        let [x, y, z] = self.position;
        let count = x.len();
        let mut columns =
            vec![column("x", Kind::F64, x), column("y", Kind::F64, y), column("z", Kind::F64, z)];
        let [red, green, blue] = self.colour;
        let others = [
            ("colours", vec![("red", Kind::U8, red), ("green", Kind::U8, green), ("blue", Kind::U8, blue)]),
            ("intensities", vec![("intensity", Kind::F32, self.intensity)]),
        ];
        for (what, values) in others {
            let known = values[0].2.len();
            if known == count {
                columns.extend(values.into_iter().map(|(name, kind, values)| column(name, kind, values)));
            } else if known > 0 {
                let points = counted(count - known, ["point has", "points have"]);
                notes.push(format!("{what} were left out: {points} none"));
            }
        }
        load_columns(columns, notes)
    }
}
