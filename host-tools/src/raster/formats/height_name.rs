//! Which of several variables or arrays in a file holds the heights.

use crate::raster::BadRaster;

/// The place in `names` of the first of the names that heights `usual`ly have (words,
/// the likeliest first), or of the only name. `kind` is what the file calls its
/// parts, for messages.
///
/// # Errors
/// When there are none, or several with other names.
pub(super) fn choose(kind: &str, names: &[&str], usual: &str) -> Result<usize, BadRaster> {
    let place = |wanted: &str| {
        let mut names = names.iter();
        names.position(|name| name.eq_ignore_ascii_case(wanted))
    };
    match (usual.split_whitespace().find_map(place), names) {
        (Some(place), _) => Ok(place),
        (None, [_]) => Ok(0),
        (None, []) => Err(BadRaster::NotAHeightField(format!(
            "it has no two-dimensional {kind} of numbers"
        ))),
        (None, several) => Err(BadRaster::NotAHeightField(format!(
            "of its two-dimensional {kind}s ({}) none is named as heights are",
            several.join(", ")
        ))),
    }
}
