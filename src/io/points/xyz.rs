//! Points as lines of numbers: XYZ, TXT, CSV, ASC and PTS files. Coordinates come first; a line of names may
//! say what follows them, otherwise normals are known by their length and colours by their range.

use std::borrow::Cow;

use super::columns::{Column, load_columns, usual_name};
use crate::grammar::counted;
use crate::io::checks::{excerpt_of_bytes, refuse_binary};
use crate::io::loaded::Loaded;
use crate::io::text::{Lines, number, unsigned_integer, without_comment, words};
use crate::mesh::attributes::Kind;
use crate::{Error, Result};

/// Lines by which columns without names are told.
const TELLING: usize = 100;
/// Maximum number of columns.
const MOST_COLUMNS: usize = 64;
/// Lengths of normals in files differ from 1 by less.
const LENGTH: f64 = 0.02;

pub(crate) fn parse(bytes: &[u8]) -> Result<Loaded> {
    refuse_binary(bytes, "give lines of numbers")?;
    let bytes = with_blanks(bytes);
    let mut lines = Lines::with_comments(&bytes);
    let mut names: Option<Vec<String>> = None;
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut found = 0_u64;
    let mut row = Vec::new();
    let mut declared = None;
    while let Some(line) = lines.next() {
        let at = lines.number;
        if let Some(comment) = line.strip_prefix(b"//").or_else(|| line.strip_prefix(b"#")) {
            // CloudCompare and NumPy write the names of columns as a comment.
            let found = names_in(comment);
            let are_names = ["x", "y", "z"].iter().all(|axis| found.iter().any(|name| name == axis));
            names = names.or(are_names.then_some(found));
            continue;
        }
        let line = without_comment(line);
        row.clear();
        let mut wrong = None;
        for word in words(line) {
            match number(word) {
                Some(value) => row.push(value),
                None => wrong = wrong.or(Some(word)),
            }
        }
        if let Some(word) = wrong {
            if columns.is_empty() && names.is_none() && row.is_empty() {
                names = Some(names_in(line));
                continue;
            }
            let problem = format!("'{}' is not a number", excerpt_of_bytes(word));
            return Err(Error::input(Some(format!("line {at}")), problem, "write plain decimal numbers"));
        }
        if columns.is_empty() && row.len() == 1 && declared.is_none() {
            declared = words(line).next().and_then(unsigned_integer);
            continue;
        }
        if columns.is_empty() {
            columns = vec![Vec::new(); row.len().min(MOST_COLUMNS)];
        }
        if row.len() < 3 || row.len() < columns.len() {
            let problem = format!(
                "the line has {}, others have {}",
                counted(row.len(), ["number", "numbers"]),
                columns.len().max(3)
            );
            return Err(Error::input(Some(format!("line {at}")), problem, "give all points the same number"));
        }
        columns.iter_mut().zip(&row).for_each(|(column, value)| column.push(*value));
        found += 1;
    }
    if let Some(count) = declared.filter(|count| *count > found) {
        let problem = format!(
            "the file is cut off: it declares {} and has {found}",
            counted(count, ["point", "points"])
        );
        return Err(Error::input(None, problem, "get the complete file, or export it again"));
    }
    let mut notes = Vec::new();
    let names = match names {
        Some(names) if names.len() >= columns.len() => names,
        Some(_) => {
            let problem = "the line of names has fewer columns than the points";
            return Err(Error::input(None, problem, "name every column"));
        }
        None => told_names(&columns, declared.is_some(), &mut notes),
    };
    let columns =
        names.into_iter().zip(columns).map(|(name, values)| Column { name, kind: Kind::F64, values });
    load_columns(columns.collect(), notes)
}

fn names_in(line: &[u8]) -> Vec<String> {
    words(line).map(|word| usual_name(&String::from_utf8_lossy(word))).collect()
}

/// Commas and semicolons are blanks between numbers; commas are decimal points where other characters
/// separate the numbers.
fn with_blanks(bytes: &[u8]) -> Cow<'_, [u8]> {
    if !bytes.iter().any(|byte| matches!(byte, b',' | b';')) {
        return Cow::Borrowed(bytes);
    }
    let comma = if has_decimal_commas(bytes) { b'.' } else { b' ' };
    let plain = |byte: &u8| match byte {
        b',' => comma,
        b';' => b' ',
        other => *other,
    };
    Cow::Owned(bytes.iter().map(plain).collect())
}

/// Whether the first line of numbers has three words or more, each with at most one comma, between digits,
/// and no decimal point.
fn has_decimal_commas(bytes: &[u8]) -> bool {
    let numbers = |line: &&[u8]| {
        let is_of_number = |byte: &u8| byte.is_ascii_digit() || b"+-.,;eE \t".contains(byte);
        line.contains(&b',') && line.iter().all(is_of_number)
    };
    let Some(line) = Lines::new(bytes).find(numbers) else { return false };
    let words =
        || line.split(|byte| *byte == b';' || byte.is_ascii_whitespace()).filter(|word| !word.is_empty());
    let is_decimal = |word: &[u8]| {
        let is_between_digits = |at: usize| {
            let is_digit = |at: Option<usize>| at.and_then(|at| word.get(at)).is_some_and(u8::is_ascii_digit);
            is_digit(at.checked_sub(1)) && is_digit(Some(at + 1))
        };
        let mut commas = (0..word.len()).filter(|at| word[*at] == b',');
        commas.next().is_none_or(is_between_digits) && commas.next().is_none()
    };
    words().count() >= 3 && !line.contains(&b'.') && words().all(is_decimal)
}

/// Names for columns that have none. Files that begin with the number of points have the intensity before
/// colours.
fn told_names(columns: &[Vec<f64>], has_count: bool, notes: &mut Vec<String>) -> Vec<String> {
    let is_there = |i: &usize| columns.iter().take(3).all(|column| column[*i].is_finite());
    let lines: Vec<usize> = (0..columns.first().map_or(0, Vec::len)).filter(is_there).take(TELLING).collect();
    let row = |first: usize, i: usize| [0, 1, 2].map(|k| columns[first + k][i]);
    let are_normals = |first: usize| {
        let length = |i| row(first, i).iter().map(|x| x * x).sum::<f64>().sqrt();
        first + 3 <= columns.len() && lines.iter().all(|i| (length(*i) - 1.0).abs() < LENGTH)
    };
    let are_colours = |first: usize| {
        first + 3 <= columns.len()
            && (lines.iter().all(|i| row(first, *i).iter().all(|x| Kind::U8.holds(*x)))
                || lines.iter().all(|i| row(first, *i).iter().all(|x| (0.0..=1.0).contains(x))))
    };
    let mut names: Vec<String> = ["x", "y", "z"].map(str::to_owned).to_vec();
    let (mut normals, mut colours) = (false, false);
    while names.len() < columns.len() {
        let at = names.len();
        let found: &[&str] = if !normals && are_normals(at) {
            normals = true;
            &["nx", "ny", "nz"]
        } else if !colours && are_colours(at) && !(has_count && columns.len() == 7 && at == 3) {
            colours = true;
            &["red", "green", "blue"]
        } else {
            &["value"]
        };
        if found.len() == 1 {
            names.push(format!("value_{}", at + 1));
        } else {
            names.extend(found.iter().map(|name| (*name).to_owned()));
        }
    }
    if columns.len() > 3 {
        notes.push(format!("the columns were read as {}", names.join(", ")));
    }
    names
}
