//! Reports that are a command's result: if one cannot be written, the command fails.
//!
//! Only for commands without an open device, because the write waits for a stopped terminal.

use std::io::{ErrorKind, Write, stdout};

use super::failure::Failure;
use heightfield::printable_text::printable_lines;

/// Prints the report. A closed pipe is no error, a full disk is one.
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
