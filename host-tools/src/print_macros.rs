//! `print!`, `println!`, `eprint!` and `eprintln!` of this crate, under the names of the standard
//! library's macros. Those panic if the reader is gone: `hapterra list | head -1` would crash, and
//! `hapterra run FILE | head -1` would crash without disarming the arm. These ignore the error.
//!
//! They are for commands that control no device. If an arm may be armed, `cli::terminal::writer`
//! writes, and callers do not wait for it.
//!
//! They are not for output that is a command's result (files, `replay -o -`, `cli::report`): there,
//! a write error ends the command. `list` prints each line as soon as it is known, because a silent
//! board takes more than a second, and succeeds even if the reader is gone.

/// Writes text to standard output.
macro_rules! print {
    ($($what:tt)*) => {{
        use std::io::Write as _;
        // Fails if the reader has closed it.
        let _ = std::io::stdout().lock().write_all(heightfield::printable_text::printable_lines(&format!($($what)*)).as_bytes());
    }};
}

/// Writes a line to standard output.
macro_rules! println {
    ($($what:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stdout().lock(), "{}", heightfield::printable_text::printable_lines(&format!($($what)*)));
    }};
}

/// Writes a line to standard error.
macro_rules! eprintln {
    ($($what:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr().lock(), "{}", heightfield::printable_text::printable_lines(&format!($($what)*)));
    }};
}
