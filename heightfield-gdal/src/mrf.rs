//! File names in an MRF's header: its samples and their index.

use crate::error::Error;
use crate::libgdal::Libgdal;
use crate::xml;

/// GDAL recognises an MRF by its first bytes.
const SIGN: &[u8] = b"<MRF_META";
/// Max size of a header, bytes.
pub(crate) const MAX_BYTES: u64 = 1 << 20;
/// Elements with names of files beside the header.
const NEIGHBOUR_KEYS: [&str; 2] = ["DataFile", "IndexFile"];
/// The element with another raster, which GDAL copies.
const COPIED_KEY: &str = "Source";

/// Returns true if a file's first bytes are an MRF's.
pub(crate) fn begins(head: &[u8]) -> bool {
    head.windows(SIGN.len()).any(|part| part == SIGN)
}

pub(crate) fn too_large() -> String {
    format!("an MRF whose header has more than {MAX_BYTES} bytes")
}

/// Checks that the header of an MRF on a server references only files beside it: GDAL opens other
/// names on this computer, some of them in the program's current folder.
///
/// # Errors
/// [`Error::Refused`], [`Error::ZeroByte`]; as a text, the referenced file and a remedy.
pub(crate) fn check(library: &Libgdal, header: &str) -> Result<Result<(), String>, Error> {
    // GDAL also stops at a zero byte.
    let header = header.replace('\0', " ");
    for named in xml::texts(library, &header)? {
        let is_any_of = |names: &[&str]| {
            let mut names = names.iter();
            names.any(|name| named.node.eq_ignore_ascii_case(name))
        };
        let name = named.value.trim();
        let leaves_folder = is_any_of(&NEIGHBOUR_KEYS) && !is_neighbour(name);
        if leaves_folder || is_any_of(&[COPIED_KEY]) {
            return Ok(Err(format!(
                "it names {name}, which may not be beside it: get both files, and open the MRF here"
            )));
        }
    }
    Ok(Ok(()))
}

/// Returns true if a name is neither absolute nor outside the MRF's folder.
fn is_neighbour(name: &str) -> bool {
    let mut parts = name.split(['/', '\\']);
    !name.contains(':') && parts.all(|part| !part.is_empty() && !part.starts_with('.'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbour_names_are_plain() {
        for (name, is_it) in [
            ("hills.dat", true),
            ("data/hills.v2.dat", true),
            ("/etc/hostname", false),
            ("\\\\host\\share", false),
            ("C:\\hills.dat", false),
            ("C:hills.dat", false),
            ("./hills.dat", false),
            ("a/../../hills.dat", false),
            ("/vsizip/hills.zip", false),
            ("http://h/hills.dat", false),
            ("", false),
        ] {
            assert_eq!(is_neighbour(name), is_it, "{name}");
        }
    }
}
