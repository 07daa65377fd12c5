//! The library's errors in the words of the command line.

use crate::error::escaped;

/// What the library says, and what the command line has for it; other fields are options of their own name.
const PHRASES: [(&str, &str); 8] = [
    ("`shortage` add-vertices", "--vertices-at-least"),
    ("accept it with `shortage` best-effort", "leave out --strict"),
    ("`memory_bytes`", "--device-memory"),
    ("set its `format`", "set --input-format"),
    ("make a mesh of the points with `cloud::surface`", "make a mesh of the points by `rtfmesh remesh`"),
    (
        "make a mesh of the volume with `volume::iso_surface`",
        "make a mesh of it by `rtfmesh remesh --iso \
     VALUE`",
    ),
    ("read the file without materials", "leave out --keep-uv"),
    ("by `Follower`", "by `rtfmesh follow`"),
];

/// An error on one line; causes of the library's own errors are in their messages already.
pub fn line(error: &anyhow::Error) -> String {
    let text = match error.downcast_ref::<rtfmesh::Error>() {
        Some(error) => with_options(&error.to_string()),
        None => with_options(&format!("{error:#}")),
    };
    escaped(&text)
}

/// What the library warns of.
pub fn warnings(list: &mut [String]) {
    list.iter_mut().for_each(|text| *text = with_options(text));
}

/// The text with options in place of fields, which the library puts between backticks: `--k-clip` for
/// `k_clip`.
fn with_options(text: &str) -> String {
    let text = PHRASES.iter().fold(text.to_owned(), |text, (field, option)| text.replace(field, option));
    let last = text.matches('`').count();
    let parts = text.split('`').enumerate().map(|(k, part)| match k % 2 {
        // The last one has no other side.
        1 if k == last => format!("`{part}"),
        1 if is_field(part) => format!("--{}", part.replace('_', "-")),
        1 => format!("`{part}`"),
        _ => part.to_owned(),
    });
    parts.collect()
}

fn is_field(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'_')
}

#[cfg(test)]
mod tests {
    use super::with_options;

    #[test]
    fn fields_become_options_and_other_text_stays() {
        let text = "`k_clip` 49 is out of range; use 3 to 48";
        assert_eq!(with_options(text), "--k-clip 49 is out of range; use 3 to 48");
        let text = "let `shortage` add-vertices add them, or see `rtfmesh devices`";
        assert_eq!(with_options(text), "let --vertices-at-least add them, or see `rtfmesh devices`");
        assert_eq!(with_options("one ` alone"), "one ` alone");
    }
}
