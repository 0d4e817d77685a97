//! The end of the program, reported to the host through semihosting.

use core::fmt;

/// Ends the program and reports why.
pub(crate) fn failed(why: fmt::Arguments<'_>) -> ! {
    semihosting::eprintln!("{why}");
    semihosting::process::exit(1)
}
