//! Numbers with their nouns, for messages.

use std::fmt::Display;

/// `count` with the singular or the plural of a noun, which a verb may follow: "1 edge has", "2 edges have".
pub(crate) fn counted(count: impl Display + PartialEq + From<u8>, [one, many]: [&str; 2]) -> String {
    let noun = if count == 1_u8.into() { one } else { many };
    format!("{count} {noun}")
}

/// A number in digits, with `separator` between groups of three of its whole part.
pub(crate) fn in_groups(number: &str, separator: char) -> String {
    let whole = number.find('.').unwrap_or(number.len());
    let mut text = String::new();
    for (k, digit) in number.chars().enumerate() {
        if k > 0 && k < whole && (whole - k).is_multiple_of(3) {
            text.push(separator);
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::in_groups;

    #[test]
    fn digits_of_the_whole_part_are_in_groups_of_three() {
        assert_eq!(in_groups("1234567.25", ','), "1,234,567.25");
        assert_eq!((in_groups("123", ','), in_groups("1900", ' ')), ("123".into(), "1 900".into()));
    }
}
