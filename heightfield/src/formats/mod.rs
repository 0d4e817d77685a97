//! The terrain formats, each in its own file or folder. To add one: write its file with a `FORMAT`,
//! and add it to [`FORMATS`].

mod asc;
pub(super) mod flt_bil;
pub(super) mod gdal;
mod height_name;
mod hgt;
mod npy;
mod png;
pub(super) mod raw;
mod tiff;

use super::format::{Claim, Format};

/// All formats that are recognised by content or extension; the first match is used. Raw samples
/// are not included: only the user can state their layout.
pub(super) const FORMATS: [Format; 6] = [
    tiff::FORMAT,
    png::FORMAT,
    npy::FORMAT,
    asc::FORMAT,
    hgt::FORMAT,
    flt_bil::FORMAT,
];

/// Returns true if a file with these first bytes is read here, not by GDAL.
fn is_read_here(head: &[u8]) -> bool {
    FORMATS.iter().any(|format| (format.begins)(head))
}

/// Extensions of formats that GDAL reads, and whose files usually contain heights.
const BY_GDAL: [&str; 9] = ["bag", "dem", "dt0", "dt1", "dt2", "grd", "img", "jp2", "nc"];

/// Returns the strongest claim of any format on the extension of a file in a folder or archive.
pub(super) fn claim_of(name: &str) -> Option<Claim> {
    let extension = name.rsplit_once('.')?.1.to_lowercase();
    let claims = FORMATS.iter().filter_map(|format| format.claim(&extension));
    let by_gdal = BY_GDAL.contains(&extension.as_str());
    let claims = claims.chain(by_gdal.then_some(Claim::Expected));
    claims.min_by_key(|claim| *claim == Claim::Possible)
}
