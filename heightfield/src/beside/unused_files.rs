//! Files beside a terrain that describe it but are not read.

use super::candidates;
use crate::decoded::Decoded;
use crate::input::{Data, FileBytes};

/// Extensions of such files, and their content.
const UNREAD: [(&str, &str); 6] = [
    ("aux", "no-data value, reference system and statistics"),
    ("rrd", "overviews"),
    ("tab", "its place"),
    ("lbl", "a label with type, unit and place of the samples"),
    ("points", "control points"),
    ("rpb", "a camera model"),
];

/// Adds remarks on files beside a file on disk that describe it but are not read.
pub(crate) fn remark_unread(input: &FileBytes, decoded: &mut Decoded) {
    let Data::File(_, path) = input.data() else {
        return;
    };
    let mut unread = UNREAD.to_vec();
    if decoded.system.is_none() {
        unread.push(("prj", "the reference system"));
    }
    for (extension, what) in unread {
        let mut there = candidates(path, extension).into_iter();
        let Some(found) = there.find(|other| other != path && other.is_file()) else {
            continue;
        };
        let name = found.file_name().unwrap_or_default().to_string_lossy();
        // A file that was opened has its own remark.
        if !decoded.remarks.iter().any(|remark| remark.contains(&*name)) {
            decoded.remarks.push(format!(
                "{name} beside it may contain {what}: it is not read"
            ));
        }
    }
}
