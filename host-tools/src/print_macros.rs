//! `print!`, `println!`, `eprint!` and `eprintln!` of this crate, under the names of the
//! standard library's. Those panic if the reader is gone: `hapterra list | head
//! -1` would end in a crash, and `hapterra run FILE | head -1` without letting go of the
//! arm. These continue in silence.
//!
//! For commands that hold no device. Where an arm may be armed, `cli::terminal::writer`
//! writes, and callers do not wait for it.
//!
//! Output that a command was asked to write (files, `replay -o -`), and the report that is a command's
//! result (`cli::report`), do not use them: there, a write error ends the command. `list` prints each
//! line as soon as it is known, because a silent board takes more than a second, and succeeds even if
//! the reader is gone.

/// Says something on standard output.
macro_rules! print {
    ($($what:tt)*) => {{
        use std::io::Write as _;
        // The reader has closed it.
        let _ = std::io::stdout().lock().write_all(heightfield::printable_text::printable_lines(&format!($($what)*)).as_bytes());
    }};
}

/// Says a line on standard output.
macro_rules! println {
    ($($what:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stdout().lock(), "{}", heightfield::printable_text::printable_lines(&format!($($what)*)));
    }};
}

/// Says a line on standard error.
macro_rules! eprintln {
    ($($what:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr().lock(), "{}", heightfield::printable_text::printable_lines(&format!($($what)*)));
    }};
}
