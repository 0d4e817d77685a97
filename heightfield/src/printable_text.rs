//! Makes texts from files, servers, devices and users safe for terminals, logs and pages.
//!
//! Names in a file are chosen by its author. A terminal obeys control sequences, and characters
//! that change the writing direction hide a line's content, so a name could clear the screen or
//! overwrite earlier lines. All output passes through this module: the terminal (`print_macros`,
//! `cli::terminal::writer`, `cli::report`, errors), the log (`cli::log`), readers of events and the
//! viewer.

use std::fmt::Write as _;

/// Returns a text on one line: every character that does not print, or that changes how others
/// print, becomes its escape as in a Rust string (`\u{1b}`, `\n`, `\u{202e}`).
#[must_use]
pub fn printable(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    let mut rest = text;
    // Rust also escapes these, though they print as they are.
    while let Some(at) = rest.find(['\'', '"', '\\']) {
        safe.extend(rest[..at].escape_debug());
        safe.push_str(&rest[at..=at]);
        rest = &rest[at + 1..];
    }
    safe.extend(rest.escape_debug());
    safe
}

/// As [`printable`], for a text of several lines.
#[must_use]
pub fn printable_lines(text: &str) -> String {
    let lines: Vec<_> = text.split('\n').map(printable).collect();
    lines.join("\n")
}

/// As [`printable_lines`], for JSON: the characters become JSON escapes, so the values stay the
/// same.
#[must_use]
pub fn printable_json(json: &str) -> String {
    let mut safe = String::with_capacity(json.len());
    for c in json.chars() {
        if c == '\n' || printable(c.encode_utf8(&mut [0; 4])).chars().eq([c]) {
            safe.push(c);
        } else {
            for unit in c.encode_utf16(&mut [0; 2]) {
                // Writing to a String cannot fail.
                let _ = write!(safe, "\\u{unit:04x}");
            }
        }
    }
    safe
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_that_a_terminal_obeys_is_escaped() {
        for (reported, expected) in [
            ("\x1b[2J\x1b]0;owned\x07", "\\u{1b}[2J\\u{1b}]0;owned\\u{7}"),
            ("board\r\nfault none", "board\\r\\nfault none"),
            ("\u{9b}31m", "\\u{9b}31m"),           // CSI in one character
            ("abc\u{202e}cba", "abc\\u{202e}cba"), // right to left from here
            ("a\u{200b}b\0\x7f", "a\\u{200b}b\\0\\u{7f}"),
        ] {
            assert_eq!(printable(reported), expected);
        }
        // The last one as macOS file systems store it, in two characters.
        for plain in [
            "nucleo-g474re 0.1.0",
            "Brett №3, 'é' \"ü\" \\",
            "Zu\u{308}rich",
        ] {
            assert_eq!(printable(plain), plain);
        }
        assert_eq!(printable_lines("one\x1b\ntwo\r\n"), "one\\u{1b}\ntwo\\r\n");
    }

    #[test]
    fn printable_text_has_no_control_or_bidi_characters() {
        const TURN: [char; 12] = [
            '\u{61c}', '\u{200e}', '\u{200f}', '\u{202a}', '\u{202b}', '\u{202c}', '\u{202d}',
            '\u{202e}', '\u{2066}', '\u{2067}', '\u{2068}', '\u{2069}',
        ];
        for c in '\0'..=char::MAX {
            let text = printable(&c.to_string());
            let controls = |c: char| c.is_control() || TURN.contains(&c);
            assert!(!text.contains(controls), "{:x}", u32::from(c));
        }
    }

    #[test]
    fn json_keeps_its_values() {
        let value = "a\u{1b}\u{9b}\u{202e}\u{e0001}\"\\ü\n";
        let json = serde_json::to_string(&[value]).expect("JSON");
        let shown = printable_json(&(json + "\n"));
        assert!(
            !shown
                .trim_end()
                .contains(|c: char| c.is_control() || c == '\u{202e}')
        );
        let back: [String; 1] = serde_json::from_str(&shown).expect("JSON");
        assert_eq!(back, [value]);
    }
}
