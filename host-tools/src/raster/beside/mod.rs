//! What lies beside a file under the same name: a header (`.hdr`), a reference system
//! (`.prj`), a world file, a mask (`.msk`), overviews (`.ovr`). Only a file on disk has neighbours; what comes
//! out of an archive has none.

mod prj;
mod world_file;

use std::ffi::OsString;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::BadRaster;
use super::input::{Data, FileBytes};

pub(super) use prj::reference_system;
pub(super) use world_file::lay_out_by_world_file;

/// No neighbour that is text is longer; what is longer is something else.
const LONGEST_TEXT: u64 = 1 << 20;

/// Extensions of all neighbours that a format may ask for: [`find`] finds no others, so
/// that no output comes to lie over one that [`files_read_with`] does not know.
const NEIGHBOURS: [&str; 12] = [
    "hdr", "prj", "msk", "ovr", "wld", "tfw", "tifw", "tiffw", "tfwx", "pgw", "pngw", "pgwx",
];

/// A terrain file and the files beside it that are read with it.
#[must_use]
pub(super) fn files_read_with(path: &Path) -> Vec<PathBuf> {
    let beside = NEIGHBOURS
        .iter()
        .flat_map(|extension| candidates(path, extension));
    let there = beside.filter(|other| other != path && other.is_file());
    std::iter::once(path.to_owned()).chain(there).collect()
}

/// The file beside `input` whose extension is `extension`, in lower or upper case:
/// `hills.hdr` beside `hills.flt`, or `hills.flt.hdr`.
pub(super) fn find(input: &FileBytes, extension: &str) -> Option<PathBuf> {
    first(input, extension, candidates)
}

/// The file beside `input` whose name is that of `input` with `extension` behind it, as
/// `hills.tif.msk`: what GDAL writes for one file alone.
pub(super) fn find_appended(input: &FileBytes, extension: &str) -> Option<PathBuf> {
    first(input, extension, |path, extension| {
        [appended(path, extension)]
    })
}

/// The first of some names, made of the path of `input` and a known extension, that is a file.
fn first<const N: usize>(
    input: &FileBytes,
    extension: &str,
    names: impl Fn(&Path, &str) -> [PathBuf; N],
) -> Option<PathBuf> {
    let Data::File(_, path) = input.data() else {
        return None;
    };
    let known = NEIGHBOURS.iter().find(|known| **known == extension)?;
    let others = names(path, known);
    let mut others = others.into_iter().filter(|other| other != path);
    others.find(|other| other.is_file())
}

/// The names that a file beside `path` may have.
fn candidates(path: &Path, extension: &str) -> [PathBuf; 4] {
    let upper = extension.to_uppercase();
    [
        path.with_extension(extension),
        path.with_extension(&upper),
        appended(path, extension),
        appended(path, &upper),
    ]
}

/// A path with an extension behind its own.
fn appended(path: &Path, extension: &str) -> PathBuf {
    let mut name: OsString = path.as_os_str().to_owned();
    name.push(".");
    name.push(extension);
    PathBuf::from(name)
}

/// The text of the file beside `input` with an extension, and that file's name.
pub(super) fn text(
    input: &FileBytes,
    extension: &str,
) -> Result<Option<(String, String)>, BadRaster> {
    let Some(path) = find(input, extension) else {
        return Ok(None);
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let file = File::open(&path).map_err(BadRaster::Unreadable)?;
    let mut bytes = Vec::new();
    file.take(LONGEST_TEXT + 1)
        .read_to_end(&mut bytes)
        .map_err(BadRaster::Unreadable)?;
    if bytes.len() as u64 > LONGEST_TEXT {
        return Err(BadRaster::AbsurdSize(format!(
            "{name} beside it is larger than {LONGEST_TEXT} bytes: no such text is"
        )));
    }
    let text = String::from_utf8_lossy(&bytes).into_owned();
    Ok(Some((text, name.into_owned())))
}
