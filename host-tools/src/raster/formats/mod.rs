//! The terrain formats, each in its own file or folder. To add one: write its
//! file with a `FORMAT`, and name it in [`FORMATS`].

mod asc;
mod height_name;
mod hgt;
mod netcdf;
pub(super) mod npy;
mod png;
pub(super) mod raw;
mod tiff;
mod usgs_dem;

use super::format::Format;

/// All formats that are told by their content or their extension; the first that
/// fits decides. Raw samples are not among them: only the user knows those.
pub(super) const FORMATS: [Format; 7] = [
    tiff::FORMAT,
    png::FORMAT,
    netcdf::FORMAT,
    npy::FORMAT,
    asc::FORMAT,
    usgs_dem::FORMAT,
    hgt::FORMAT,
];

/// Whether a file in an archive is a terrain, by its extension.
pub(super) fn has_terrain_extension(name: &str) -> bool {
    let extension = name.rsplit_once('.').map(|(_, end)| end.to_lowercase());
    extension.is_some_and(|end| FORMATS.iter().any(|format| format.claim(&end).is_some()))
}
