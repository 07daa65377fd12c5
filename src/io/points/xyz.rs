//! Points as lines of numbers: XYZ, TXT, CSV, ASC and PTS files. Coordinates come first; a line of names may
//! say what follows them, otherwise normals are known by their length and colours by their range.

use std::borrow::Cow;

use super::columns::{Column, load_columns, usual_name};
use crate::grammar::counted;
use crate::io::checks::{excerpt, excerpt_of_bytes, refuse_binary};
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
    let plain = with_blanks(bytes);
    // For names: commas and semicolons are between columns.
    let mut original = Lines::with_comments(bytes);
    let mut lines = Lines::with_comments(&plain);
    let mut names: Option<Vec<String>> = None;
    let mut rows = Rows::default();
    let mut declared = None;
    while let Some(line) = lines.next() {
        let at = lines.number;
        if let Some(comment) = after_sign(line) {
            // CloudCompare and NumPy write the names of columns as a comment.
            if names.is_none() && rows.count == 0 {
                let written = line_at(&mut original, at);
                let found = names_in(written.and_then(after_sign).unwrap_or(comment));
                names = has_axes(&found).then_some(found);
            }
            continue;
        }
        let line = without_comment(line);
        let is_number = |word: &[u8]| number(word).is_some();
        if rows.count == 0 && !words(line).any(is_number) {
            names = Some(names_in(line_at(&mut original, at).unwrap_or(line)));
            continue;
        }
        if rows.count == 0 && declared.is_none() && words(line).count() == 1 {
            declared = words(line).next().and_then(unsigned_integer);
            continue;
        }
        rows.push(line, names.as_deref(), at)?;
    }
    let Rows { columns, text, count: found, .. } = rows;
    if let Some(count) = declared.filter(|count| *count > found) {
        let problem = format!(
            "the file is cut off: it declares {} and has {found}",
            counted(count, ["point", "points"])
        );
        return Err(Error::input(None, problem, "get the complete file, or export it again"));
    }
    let mut notes = Vec::new();
    for place in &text {
        let name = names.as_ref().and_then(|names| names.get(*place));
        let column = name
            .map_or_else(|| format!("column {}", place + 1), |name| format!("column '{}'", excerpt(name)));
        notes.push(format!("{column} was left out, since it begins with text"));
    }
    let names = names.map(|names| {
        (0..).zip(names).filter(|(place, _)| !text.contains(place)).map(|(_, name)| name).collect()
    });
    let names: Vec<String> = match names {
        Some(names) if Vec::len(&names) >= columns.len() => names,
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

/// The numbers of the lines, column by column.
#[derive(Default)]
struct Rows {
    columns: Vec<Vec<f64>>,
    /// Which words of a line are text, by the first line.
    text: Vec<usize>,
    count: u64,
    row: Vec<f64>,
}

impl Rows {
    /// Adds a line. Of the first one, words may be text, but not coordinates.
    fn push(&mut self, line: &[u8], names: Option<&[String]>, at: u64) -> Result<()> {
        let refuse =
            |problem: String, remedy: &str| Err(Error::input(Some(format!("line {at}")), problem, remedy));
        self.row.clear();
        let is_axis = |place: usize| match names {
            Some(names) => names.get(place).is_none_or(|name| ["x", "y", "z"].contains(&name.as_str())),
            None => place < 3,
        };
        for (place, word) in words(line).enumerate() {
            match number(word) {
                _ if self.text.contains(&place) => {}
                Some(value) => self.row.push(value),
                None if self.count == 0 && !is_axis(place) && self.text.len() < MOST_COLUMNS => {
                    self.text.push(place);
                }
                None => {
                    let problem = format!("'{}' is not a number", excerpt_of_bytes(word));
                    return refuse(problem, "write plain decimal numbers");
                }
            }
        }
        let row = &self.row;
        if self.count == 0 {
            self.columns = vec![Vec::new(); row.len().min(MOST_COLUMNS)];
        }
        if row.len() < 3 || row.len() < self.columns.len() {
            let count = counted(row.len(), ["number", "numbers"]);
            let problem = format!("the line has {count}, others have {}", self.columns.len().max(3));
            return refuse(problem, "give all points the same number");
        }
        self.columns.iter_mut().zip(row).for_each(|(column, value)| column.push(*value));
        self.count += 1;
        Ok(())
    }
}

/// The line of this number, which is not before those read already.
fn line_at<'a>(lines: &mut Lines<'a>, number: u64) -> Option<&'a [u8]> {
    while lines.number < number {
        let line = lines.next()?;
        if lines.number == number {
            return Some(line);
        }
    }
    None
}

/// What follows the sign of a comment.
fn after_sign(line: &[u8]) -> Option<&[u8]> {
    line.strip_prefix(b"//").or_else(|| line.strip_prefix(b"#"))
}

/// The names of columns without units in brackets: between commas, semicolons or tabs if x, y and z are among
/// them then, otherwise between all of these and blanks.
fn names_in(line: &[u8]) -> Vec<String> {
    let line = without_units(&String::from_utf8_lossy(without_comment(line)));
    let by_separator = [',', ';', '\t'].into_iter().find_map(|separator| {
        let names: Vec<String> = line.split(separator).map(usual_name).collect();
        has_axes(&names).then_some(names)
    });
    let by_all = || {
        let words = line.split(|c: char| c.is_whitespace() || c == ',' || c == ';');
        words.filter(|word| !word.is_empty()).map(usual_name).collect()
    };
    by_separator.unwrap_or_else(by_all)
}

fn has_axes(names: &[String]) -> bool {
    ["x", "y", "z"].iter().all(|axis| names.iter().any(|name| name == axis))
}

/// The line without what is in brackets, unless that is a number, as of `heat[0]`.
fn without_units(line: &str) -> String {
    let (mut kept, mut rest) = (String::new(), line);
    while let Some(begin) = rest.find(['[', '(']) {
        let close = if rest[begin..].starts_with('[') { ']' } else { ')' };
        let Some(length) = rest[begin..].find(close) else { break };
        let inside = &rest[begin + 1..begin + length];
        let is_number = !inside.is_empty() && inside.bytes().all(|byte| byte.is_ascii_digit());
        kept.push_str(&rest[..if is_number { begin + length + 1 } else { begin }]);
        rest = &rest[begin + length + 1..];
    }
    kept + rest
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

/// Whether the first line with three numbers or more has commas, each number at most one and between digits,
/// and no decimal point.
fn has_decimal_commas(bytes: &[u8]) -> bool {
    let numbers = |line: &[u8]| -> Vec<Vec<u8>> {
        let is_of_number = |byte: &u8| byte.is_ascii_digit() || b"+-.,eE".contains(byte);
        let words = line.split(|byte| *byte == b';' || byte.is_ascii_whitespace());
        words
            .filter(|word| word.iter().all(is_of_number) && word.iter().any(u8::is_ascii_digit))
            .map(<[u8]>::to_vec)
            .collect()
    };
    let first = Lines::new(bytes).map(numbers).find(|numbers| numbers.len() >= 3);
    let is_decimal = |word: &Vec<u8>| {
        let is_between_digits = |at: usize| {
            let is_digit = |at: Option<usize>| at.and_then(|at| word.get(at)).is_some_and(u8::is_ascii_digit);
            is_digit(at.checked_sub(1)) && is_digit(Some(at + 1))
        };
        let mut commas = (0..word.len()).filter(|at| word[*at] == b',');
        commas.next().is_none_or(is_between_digits) && commas.next().is_none()
    };
    let has = |numbers: &[Vec<u8>], byte: u8| numbers.iter().any(|word| word.contains(&byte));
    first.is_some_and(|numbers| has(&numbers, b',') && !has(&numbers, b'.') && numbers.iter().all(is_decimal))
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
