//! Numbers with their nouns, for messages.

use std::fmt::Display;

/// `count` with the singular or the plural of a noun, which a verb may follow: "1 edge has", "2 edges have".
pub(crate) fn counted(count: impl Display + PartialEq + From<u8>, [one, many]: [&str; 2]) -> String {
    let noun = if count == 1_u8.into() { one } else { many };
    format!("{count} {noun}")
}
