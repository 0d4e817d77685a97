//! Texts that a device gives: they go to the terminal through here, and only through
//! here.
//!
//! Whoever made the device chose its name, its version, the file of its crash. A
//! terminal obeys control sequences, so a name could clear the screen, retitle the
//! window or write over what was said before.

use std::fmt::Write as _;

/// What a device calls itself, as a terminal may show it: every character that does not
/// print, or that changes how others print, becomes its escape as in a Rust string
/// (`\u{1b}`, `\n`, `\u{202e}`).
#[must_use]
pub fn shown(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\'' | '"' | '\\' => safe.push(c),
            // Writing to a String cannot fail.
            _ => _ = write!(safe, "{}", c.escape_debug()),
        }
    }
    safe
}

/// As [`shown`], for a text of several lines.
#[must_use]
pub fn shown_lines(text: &str) -> String {
    let lines: Vec<_> = text.lines().map(shown).collect();
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_obey_is_spelt_out() {
        for (told, seen) in [
            ("\x1b[2J\x1b]0;owned\x07", "\\u{1b}[2J\\u{1b}]0;owned\\u{7}"),
            ("board\r\nfault none", "board\\r\\nfault none"),
            ("\u{9b}31m", "\\u{9b}31m"),           // CSI in one character
            ("abc\u{202e}cba", "abc\\u{202e}cba"), // right to left from here
            ("a\u{200b}b\0\x7f", "a\\u{200b}b\\0\\u{7f}"),
        ] {
            assert_eq!(shown(told), seen);
        }
        for plain in ["nucleo-g474re 0.1.0", "Brett №3, 'é' \"ü\" \\"] {
            assert_eq!(shown(plain), plain);
        }
        assert_eq!(shown_lines("one\x1b\ntwo"), "one\\u{1b}\ntwo");
    }

    #[test]
    fn no_character_at_all_gets_through_that_controls() {
        for c in '\0'..=char::MAX {
            let text = shown(&c.to_string());
            assert!(!text.chars().any(char::is_control), "{:x}", u32::from(c));
        }
    }
}
