//! `hapterra info --formats`: what is read, by this program and by GDAL.

use std::ffi::OsStr;
use std::fmt::Write as _;

use clap::builder::TypedValueParser;
use heightfield_gdal::Error;

use crate::cli::report::put;
use heightfield::{gdal, own_formats};

/// The list is printed in place of what the command does, as `--help` is: no file is wanted for it.
#[derive(Clone, Copy, Debug)]
pub struct Printed;

impl TypedValueParser for Printed {
    type Value = Self;

    fn parse_ref(
        &self,
        _: &clap::Command,
        _: Option<&clap::Arg>,
        _: &OsStr,
    ) -> Result<Self, clap::Error> {
        // A list that is cut, as by `head`, is none that was asked for.
        let said = put(&text());
        std::process::exit(i32::from(said.is_err()))
    }
}

/// The formats, and the libgdal that was found or what to do about it.
fn text() -> String {
    let own: Vec<_> = own_formats().collect();
    let mut text = format!("read by hapterra:\n  {}\n", own.join(", "));
    match gdal() {
        Ok(library) => {
            let (version, path) = (library.version(), library.path().display());
            let _ = writeln!(text, "read by GDAL {version} ({path}):");
            for driver in library.drivers() {
                let _ = writeln!(text, "  {:<16} {}", driver.name, driver.title);
            }
        }
        Err(why) => {
            let _ = writeln!(text, "no GDAL: {why}\n  {}", Error::how_to_install());
        }
    }
    text
}
