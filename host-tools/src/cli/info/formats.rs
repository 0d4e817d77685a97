//! `hapterra info --formats`: the formats that this program and GDAL read.

use std::fmt::Write as _;

use heightfield::{gdal, own_formats};
use heightfield_gdal::Error;

/// Returns the formats, and the libgdal found or how to install it.
pub(super) fn text() -> String {
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
