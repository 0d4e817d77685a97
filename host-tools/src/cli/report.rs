//! Reports that a command exists to print: losing one is a failure of the command.
//!
//! For commands that hold no device at that moment: the writing waits for a terminal that
//! was stopped.

use std::io::{ErrorKind, Write, stdout};

use super::failure::Failure;
use heightfield::printable_text::printable_lines;

/// Prints the report. A reader who goes away wants no more of it; a disk without room has
/// lost it.
///
/// # Errors
/// Standard output cannot be written.
pub fn put(report: &str) -> Result<(), Failure> {
    let mut output = stdout().lock();
    let written = output.write_all(printable_lines(report).as_bytes());
    match written.and_then(|()| output.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::new(format!("cannot write the report: {error}"))
                .hint("free disk space for standard output"))
        }
        _ => Ok(()),
    }
}
