//! The lines of an OBJ file: without comments, continued lines joined.

use std::borrow::Cow;

/// The lines without comments, joined where they end in a backslash, each with the number of its first line
/// from 1.
pub(crate) fn logical_lines(text: &str) -> impl Iterator<Item = (u64, Cow<'_, str>)> {
    let mut lines = (1..).zip(text.lines());
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let mut joined = Cow::Borrowed(without_comment(first));
        while joined.ends_with('\\') {
            // Extended in place: a line may be continued a million times.
            let longer = joined.to_mut();
            longer.pop();
            longer.push(' ');
            longer.push_str(lines.next().map_or("", |(_, next)| without_comment(next)));
        }
        Some((number, joined))
    })
}

fn without_comment(line: &str) -> &str {
    line.split('#').next().unwrap_or(line).trim_end()
}

/// The place of an error.
pub(crate) fn at_line(line: u64) -> Option<String> {
    Some(format!("line {line}"))
}
