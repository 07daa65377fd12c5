//! The lines of an OBJ file: without comments, continued lines joined.

use std::borrow::Cow;

/// Keywords before a name, which may have any characters.
const NAMED: [&str; 9] = ["g", "o", "usemtl", "mtllib", "newmtl", "bump", "disp", "refl", "norm"];

/// The lines without comments, joined where they end in a backslash, each with the number of its first line
/// from 1.
pub(crate) fn logical_lines(text: &str) -> impl Iterator<Item = (u64, Cow<'_, str>)> {
    // Old programs end lines by CR alone.
    let end = if text.contains('\n') { '\n' } else { '\r' };
    let mut lines = (1..).zip(text.split(end));
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

/// A comment begins with `#` at the start of a word. Names of groups, materials and files may have words that
/// begin so, as in "Material #25"; a comment after them begins with `#` and a blank.
fn without_comment(line: &str) -> &str {
    let keyword = line.split_whitespace().next().unwrap_or_default().to_ascii_lowercase();
    let is_named = NAMED.contains(&keyword.as_str()) || keyword.starts_with("map_");
    let begins = |(at, _): &(usize, &str)| {
        let (before, after) = (&line[..*at], &line[at + 1..]);
        let is_word = before.is_empty() || before.ends_with(char::is_whitespace);
        let is_alone = after.is_empty() || after.starts_with(char::is_whitespace);
        is_word && (!is_named || is_alone)
    };
    let comment = line.match_indices('#').find(begins);
    comment.map_or(line, |(at, _)| &line[..at]).trim_end()
}

/// The place of an error.
pub(crate) fn at_line(line: u64) -> Option<String> {
    Some(format!("line {line}"))
}
