//! Feature lines as `l` elements of OBJ files: reads a user's, and writes those found on a mesh.

use std::collections::HashMap;
use std::io;
use std::io::Write;
use std::path::Path;

use glam::DVec3;

use super::logical_lines::{at_line, logical_lines};
use super::write::write_vertex;
use crate::io::checks::excerpt;
use crate::io::file::write_atomically;
use crate::io::open::{Patience, read_file_bytes};
use crate::mesh::TriMesh;
use crate::mesh::features::{FeatureLine, Features};
use crate::{Error, Result};

/// Reads the `v` and `l` elements of an OBJ file, whatever its extension; all other elements are skipped.
///
/// # Errors
///
/// [`Error::Input`] with the path and the line: the file cannot be read, a coordinate or an index is invalid,
/// an element has fewer than two points, or there is none.
pub fn read_feature_lines(path: &Path) -> Result<Vec<FeatureLine>> {
    let read = read_file_bytes(path, &Patience::default()).and_then(|bytes| parse(&bytes));
    read.map_err(|error| error.in_file(path))
}

fn parse(bytes: &[u8]) -> Result<Vec<FeatureLine>> {
    let text = String::from_utf8_lossy(bytes);
    let mut vertices = Vec::new();
    // Vertex numbers from 1, since a later line may still define them.
    let mut elements: Vec<(u64, Vec<usize>)> = Vec::new();
    for (line, content) in logical_lines(&text) {
        let mut words = content.split_whitespace();
        match words.next() {
            Some("v") => vertices.push(vertex(line, words)?),
            Some("l") => {
                let numbers: Vec<usize> =
                    words.map(|word| vertex_number(line, word, vertices.len())).collect::<Result<_>>()?;
                if numbers.len() < 2 {
                    let problem = format!("the line element has {} of at least 2 points", numbers.len());
                    return Err(Error::input(at_line(line), problem, "remove it or add points"));
                }
                elements.push((line, numbers));
            }
            _ => {}
        }
    }
    if elements.is_empty() {
        let remedy = "give an OBJ file with elements like 'l 1 2 3'";
        return Err(Error::input(None, "the file has no line elements", remedy));
    }
    let point = |line: u64, number: usize| {
        vertices.get(number.wrapping_sub(1)).copied().ok_or_else(|| {
            let problem = format!("there is no vertex {number}, the file has {}", vertices.len());
            Error::input(at_line(line), problem, "repair the line element")
        })
    };
    let line_of = |(line, numbers): (u64, Vec<usize>)| {
        let points = numbers.into_iter().map(|number| point(line, number)).collect::<Result<_>>()?;
        Ok(FeatureLine { line, points })
    };
    elements.into_iter().map(line_of).collect()
}

fn vertex<'a>(line: u64, words: impl Iterator<Item = &'a str>) -> Result<DVec3> {
    let values: Vec<f64> = words.take(3).filter_map(|word| word.parse().ok()).collect();
    match values.as_slice() {
        &[x, y, z] if x.is_finite() && y.is_finite() && z.is_finite() => Ok(DVec3::new(x, y, z)),
        _ => {
            let problem = "the vertex does not have three finite coordinates";
            Err(Error::input(at_line(line), problem, "write plain decimal numbers"))
        }
    }
}

/// The vertex number from 1 that `word`, such as "7", "-2" or "7/1", stands for after `known` vertices.
fn vertex_number(line: u64, word: &str, known: usize) -> Result<usize> {
    let index = word.split('/').next().unwrap_or(word);
    let number = match index.parse::<i64>() {
        Ok(index) if index > 0 => usize::try_from(index).ok(),
        Ok(index) => usize::try_from(index.unsigned_abs())
            .ok()
            .filter(|back| (1..=known).contains(back))
            .map(|back| known - back + 1),
        Err(_) => None,
    };
    number.ok_or_else(|| {
        let problem = format!("'{}' is not a vertex index", excerpt(word));
        Error::input(at_line(line), problem, "indices count from 1, or back from -1")
    })
}

/// Writes the feature curves of `mesh` as `l` elements, in groups by kind, and its corners as `p` elements.
/// An existing file is replaced only when the new one is complete.
///
/// # Errors
///
/// [`Error::Output`]: see [`crate::io::check_target`]; also a full disk. Panics if the features are not
/// of `mesh`.
pub fn write_features(path: impl AsRef<Path>, mesh: &TriMesh, features: &Features) -> Result<()> {
    write_atomically(path.as_ref(), |file| write(file, mesh, features))
}

fn write(file: &mut impl Write, mesh: &TriMesh, features: &Features) -> io::Result<()> {
    let mut numbers: HashMap<u32, usize> = HashMap::new();
    for &vertex in features.curves.iter().flat_map(|curve| &curve.vertices).chain(&features.corners) {
        let next = numbers.len() + 1;
        if *numbers.entry(vertex).or_insert(next) == next {
            write_vertex(file, mesh.vertices[vertex as usize])?;
        }
    }
    for (group, curves) in features.curves_by_kind() {
        writeln!(file, "g {}", group.name())?;
        for curve in curves {
            write!(file, "l")?;
            let closing_vertex = curve.vertices.iter().take(usize::from(curve.closed));
            for vertex in curve.vertices.iter().chain(closing_vertex) {
                write!(file, " {}", numbers[vertex])?;
            }
            writeln!(file)?;
        }
    }
    if !features.corners.is_empty() {
        writeln!(file, "g corners")?;
    }
    for corner in &features.corners {
        writeln!(file, "p {}", numbers[corner])?;
    }
    Ok(())
}
