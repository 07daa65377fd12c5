//! OFF: text, one vertex or face a line, with whatever colours, normals and textures behind the positions.

use std::io::{self, Write};

use glam::DVec3;

use super::text::{Faces, Lines, check_promise, cut_off, refuse_binary, shown, vertex, whole, words};
use super::write::write_number;
use super::{Loaded, check_counts};
use crate::{Error, Result, TriMesh};

/// Whether `word` opens an OFF file: `OFF` after any of `ST`, `C`, `N`, `4` and `n`.
pub(super) fn is_keyword(word: &str) -> bool {
    let Some(prefix) = word.strip_suffix("OFF") else { return false };
    let prefix = prefix.strip_prefix("ST").unwrap_or(prefix);
    let prefix = prefix.strip_prefix('C').unwrap_or(prefix);
    let prefix = prefix.strip_prefix('N').unwrap_or(prefix);
    let prefix = prefix.strip_prefix('4').unwrap_or(prefix);
    matches!(prefix, "" | "n")
}

pub(super) fn parse(bytes: &[u8]) -> Result<Loaded> {
    let mut lines = Lines::new(bytes);
    let ended = |lines: &Lines, what: &str| cut_off(lines.place(), what);
    let mut line = lines.next().ok_or_else(|| ended(&lines, "there is nothing but comments"))?;
    let first = words(line).next().unwrap_or_default();
    if let Some(keyword) = str::from_utf8(first).ok().filter(|word| is_keyword(word)) {
        check_kind(keyword, line, &lines.place())?;
        line = line.get(first.len()..).unwrap_or_default().trim_ascii();
        if line.is_empty() {
            line = lines.next().ok_or_else(|| ended(&lines, "there is no line with the counts"))?;
        }
    }
    refuse_binary(bytes, "give a text file")?;
    let mut counts = words(line).map_while(whole);
    let (Some(vertices), Some(faces)) = (counts.next(), counts.next()) else {
        let problem = format!("'{}' are no counts of vertices and faces", shown(line));
        return Err(Error::input(Some(lines.place()), problem, "write them as two or three whole numbers"));
    };
    check_counts(vertices, faces)?;
    // Three numbers of one digit; a count and one index.
    check_promise((vertices, "vertices"), 6, lines.left(), lines.place())?;
    check_promise((faces, "faces"), 4, lines.left(), lines.place())?;
    let positions = read_vertices(vertices, &mut lines)?;
    let (faces, lesser) = read_faces(faces, vertices, &mut lines)?;
    let mut notes: Vec<String> = faces.notes().into_iter().collect();
    if lesser > 0 {
        notes.push(format!("{lesser} faces with fewer than 3 vertices were ignored"));
    }
    check_counts(vertices, faces.triangles.len() as u64)?;
    Ok(Loaded { mesh: TriMesh { vertices: positions, triangles: faces.triangles }, notes })
}

fn check_kind(keyword: &str, line: &[u8], place: &str) -> Result<()> {
    let refuse = |problem: &str, remedy: &str| Err(Error::input(Some(place.to_owned()), problem, remedy));
    if words(line).nth(1).is_some_and(|word| word.eq_ignore_ascii_case(b"BINARY")) {
        return refuse("binary OFF files are not supported", "write the mesh again as text");
    }
    if keyword.contains(['4', 'n']) {
        return refuse("this OFF file is not in three dimensions", "write the mesh again as plain OFF");
    }
    Ok(())
}

fn read_vertices(count: u64, lines: &mut Lines) -> Result<Vec<DVec3>> {
    // `check_promise` has shown that the file is long enough for this many.
    let mut vertices = Vec::with_capacity(usize::try_from(count).unwrap_or(0));
    for index in 0..count {
        let line = lines.next();
        let line =
            line.ok_or_else(|| cut_off(lines.place(), &format!("vertex {index} of {count} is missing")))?;
        vertices.push(vertex(&mut words(line), &|| format!("{}, vertex {index}", lines.place()))?);
    }
    Ok(vertices)
}

/// The faces, and how many were points or lines.
fn read_faces(count: u64, vertices: u64, lines: &mut Lines) -> Result<(Faces, u64)> {
    let mut faces = Faces::new(0, vertices);
    let (mut corners, mut lesser) = (Vec::new(), 0);
    for index in 0..count {
        let line = lines.next();
        let line =
            line.ok_or_else(|| cut_off(lines.place(), &format!("face {index} of {count} is missing")))?;
        let place = || format!("{}, face {index}", lines.place());
        let refuse = |problem: String| {
            Err(Error::input(Some(place()), problem, "mend the face or write the mesh again"))
        };
        let mut words = words(line);
        let first = words.next().unwrap_or_default();
        let Some(size) = whole(first) else {
            return refuse(format!("the number of vertices '{}' is not a whole number", shown(first)));
        };
        corners.clear();
        for _ in 0..size {
            let Some(word) = words.next() else {
                return refuse(format!("the face has {} of {size} vertices", corners.len()));
            };
            let Some(corner) = whole(word) else {
                return refuse(format!("the vertex index '{}' is not a whole number", shown(word)));
            };
            corners.push(corner);
        }
        if size < 3 {
            lesser += 1;
        } else {
            faces.push(&corners, &place)?;
        }
    }
    Ok((faces, lesser))
}

pub(super) fn write(file: &mut dyn Write, mesh: &TriMesh) -> io::Result<()> {
    writeln!(file, "OFF\n{} {} 0", mesh.vertices.len(), mesh.triangles.len())?;
    for vertex in &mesh.vertices {
        for (value, end) in vertex.to_array().into_iter().zip([" ", " ", "\n"]) {
            write_number(file, value)?;
            file.write_all(end.as_bytes())?;
        }
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(file, "3 {a} {b} {c}")?;
    }
    Ok(())
}
