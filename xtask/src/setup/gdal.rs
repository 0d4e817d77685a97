//! The library of GDAL, which reads other formats of terrain files.

use std::path::Path;

use anyhow::{Context, Result};
use heightfield_gdal::{Error, Library, Settings};

use super::packages::{self, found_or_installed};
use crate::run::report;

/// Extensions of files that are read without GDAL.
const OWN_EXTENSIONS: [&str; 12] = [
    "tif", "tiff", "hgt", "npy", "asc", "png", "flt", "bil", "bip", "bsq", "hdr", "raw",
];

/// Ensures that there is a libgdal, or prints why not: without it, files of other formats are
/// refused with the package to install, and their tests are skipped.
pub(crate) fn ready_or_report() {
    if let Err(why) = found_or_installed(find, &packages::GDAL) {
        report(format!(
            "terrain files of other formats are not read: {why:#}"
        ));
    }
}

/// Returns true if GDAL is needed for a terrain, by its name.
pub(crate) fn is_needed_for(file: &Path) -> bool {
    let extension = file
        .extension()
        .map(|end| end.to_string_lossy().to_lowercase());
    extension.is_some_and(|end| !OWN_EXTENSIONS.contains(&end.as_str()))
}

fn find() -> Result<Library> {
    Library::load(Settings::default()).context(Error::how_to_install())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_read_without_gdal_need_no_gdal() {
        for name in [
            "dem.tif",
            "N34W119.HGT",
            "tiles",
            "a.b/dem",
            "https://host/dem.tiff",
        ] {
            assert!(!is_needed_for(Path::new(name)), "{name}");
        }
        for name in [
            "erdas.img",
            "dem.gpkg",
            "depth.JP2",
            "N34W119.hgt.zip",
            "all.vrt",
        ] {
            assert!(is_needed_for(Path::new(name)), "{name}");
        }
    }
}
