//! Choice of the variable or array in a file that contains the heights.

use crate::RasterError;

/// Returns the index in `names` of `requested`; by default, of the first name in `usual` (words,
/// the likeliest first), or of the only name. `kind` is the file's word for its parts, for
/// messages.
///
/// # Errors
/// If there are no names, several unusual ones, or not the requested one.
pub(super) fn choose(
    kind: &'static str,
    names: &[&str],
    usual: &str,
    requested: Option<&str>,
) -> Result<usize, RasterError> {
    if let Some(requested) = requested {
        let exact = names.iter().position(|name| *name == requested);
        let available = match names {
            [] => format!("it has no {kind} of numbers"),
            names => format!("its {kind}s are {}", names.join(", ")),
        };
        return exact.ok_or_else(|| RasterError::NoSuchPart {
            requested: format!("{kind} {requested}"),
            available,
        });
    }
    let place = |word: &str| {
        let mut names = names.iter();
        names.position(|name| name.eq_ignore_ascii_case(word))
    };
    match (usual.split_whitespace().find_map(place), names) {
        (Some(place), _) => Ok(place),
        (None, [_]) => Ok(0),
        (None, []) => Err(RasterError::NotAHeightField(format!(
            "it has no {kind} of numbers"
        ))),
        (None, several) => Err(RasterError::SeveralHeights {
            kind,
            names: several.iter().map(|name| (*name).to_owned()).collect(),
        }),
    }
}
