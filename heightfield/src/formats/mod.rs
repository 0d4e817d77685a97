//! The terrain formats, each in its own file or folder. To add one: write its
//! file with a `FORMAT`, and name it in [`FORMATS`].

mod asc;
mod dted;
pub(super) mod gdal;
mod grass;
pub(super) mod headered;
mod height_name;
mod hgt;
mod netcdf;
pub(super) mod npy;
mod png;
pub(super) mod raw;
mod tiff;
mod usgs_dem;

use super::format::{Claim, Format};

/// All formats that are told by their content or their extension; the first that
/// fits decides. Raw samples are not among them: only the user knows those.
pub(super) const FORMATS: [Format; 10] = [
    tiff::FORMAT,
    png::FORMAT,
    netcdf::FORMAT,
    npy::FORMAT,
    asc::FORMAT,
    grass::FORMAT,
    dted::FORMAT,
    usgs_dem::FORMAT,
    hgt::FORMAT,
    headered::FORMAT,
];

/// What the extension of a file in an archive says, the strongest claim of any format.
pub(super) fn claim_of(name: &str) -> Option<Claim> {
    let extension = name.rsplit_once('.')?.1.to_lowercase();
    let claims = FORMATS.iter().filter_map(|format| format.claim(&extension));
    claims.min_by_key(|claim| *claim == Claim::Suggests)
}
