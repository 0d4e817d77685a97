//! Files beside a file under the same name: a header (`.hdr`), a reference system (`.prj`), a world
//! file, a mask (`.msk`), overviews (`.ovr`), GDAL's notes (`.aux.xml`). Files on disk and at URLs
//! can have such neighbours.

mod pam;
mod prj;
mod unused_files;
mod world_file;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use super::RasterError;
use super::input::{Data, FileBytes};
use crate::remote::{is_missing, neighbour};

pub(super) use pam::Notes;
pub(super) use prj::reference_system;
pub(super) use unused_files::remark_unread;
pub(super) use world_file::{apply_world_file, remark_other_place};

/// Max size of a neighbour that is text; a longer file is something else.
const MAX_TEXT: u64 = 1 << 20;

/// First bytes of GDAL's metadata files.
const PAM_ROOT: &[u8] = b"<PAMDataset";

/// Extensions of all neighbours that a format reads: [`find`] accepts no others, so an output
/// cannot replace a file that [`files_read_with`] does not list.
const NEIGHBOUR_EXTENSIONS: [&str; 13] = [
    "hdr", "prj", "msk", "ovr", "aux.xml", "wld", "tfw", "tifw", "tiffw", "tfwx", "pgw", "pngw",
    "pgwx",
];

/// Returns a terrain file and the files beside it that are read with it.
#[must_use]
pub(super) fn files_read_with(path: &Path) -> Vec<PathBuf> {
    let neighbours = NEIGHBOUR_EXTENSIONS
        .iter()
        .flat_map(|extension| candidates(path, extension));
    let existing = neighbours.filter(|other| other != path && other.is_file());
    std::iter::once(path.to_owned()).chain(existing).collect()
}

/// Returns the names of the files beside a URL that belong to it. For a TIFF, only three are tried,
/// because a VRT may reference many TIFFs.
pub(super) fn names_at_url(input: &FileBytes, url: &str) -> Result<Vec<String>, RasterError> {
    let ends = match input.extension() {
        "tif" | "tiff" => &["msk", "ovr", "aux.xml"][..],
        _ => &NEIGHBOUR_EXTENSIONS[..],
    };
    prefetch_files(input, ends.iter().copied());
    let mut names = Vec::new();
    for name in ends.iter().flat_map(|end| neighbour(url, end)) {
        let found = find_at_url(url, &[name], input)?;
        names.extend(found.map(|found| found.name().to_owned()));
    }
    Ok(names)
}

/// Prefetches files with these extensions: on a server, all at once.
fn prefetch_files(input: &FileBytes, extensions: impl Iterator<Item = &'static str>) {
    if let Data::Remote(_, url) = input.data() {
        let urls: Vec<String> = extensions.flat_map(|end| neighbour(url, end)).collect();
        input.fetcher().prefetch_files(&urls);
    }
}

/// Finds the file beside `input` with an extension, in lower or upper case: `hills.hdr` beside
/// `hills.flt`, or `hills.flt.hdr`.
fn find(input: &FileBytes, extension: &str) -> Result<Option<FileBytes>, RasterError> {
    match (input.data(), known_extension(extension)) {
        (Data::File(_, path), Some(known)) => on_disk(path, &candidates(path, known), input),
        (Data::Remote(_, url), Some(known)) => find_at_url(url, &neighbour(url, known), input),
        _ => Ok(None),
    }
}

/// Finds the file beside `input` whose name is `input`'s with `extension` appended, as
/// `hills.tif.msk`: GDAL writes these for one file only.
pub(super) fn find_appended(
    input: &FileBytes,
    extension: &str,
) -> Result<Option<FileBytes>, RasterError> {
    match (input.data(), known_extension(extension)) {
        (Data::File(_, path), Some(known)) => on_disk(path, &[appended(path, known)], input),
        (Data::Remote(_, url), Some(known)) => find_at_url(url, &neighbour(url, known)[1..], input),
        _ => Ok(None),
    }
}

/// Returns the extension if it is in `NEIGHBOUR_EXTENSIONS`.
fn known_extension(extension: &str) -> Option<&'static str> {
    let known = NEIGHBOUR_EXTENSIONS
        .iter()
        .find(|known| **known == extension);
    known.copied()
}

/// Returns the first path that is a file other than `path`.
fn on_disk(
    path: &Path,
    others: &[PathBuf],
    input: &FileBytes,
) -> Result<Option<FileBytes>, RasterError> {
    let mut others = others.iter().filter(|other| *other != path);
    let found = others.find(|other| other.is_file());
    let open = |other: &PathBuf| FileBytes::open(other, input.fetcher());
    found.map(open).transpose()
}

/// Returns the first URL with a file. If that cannot be determined, the whole file cannot be read:
/// masked samples would be read as heights.
fn find_at_url(
    own: &str,
    urls: &[String],
    input: &FileBytes,
) -> Result<Option<FileBytes>, RasterError> {
    for url in urls.iter().filter(|url| *url != own) {
        match FileBytes::open(Path::new(url), input.fetcher()) {
            Err(RasterError::Remote(error)) if is_missing(&error) => {}
            Ok(found) if is_page(&found)? => {}
            other => return other.map(Some),
        }
    }
    Ok(None)
}

/// Returns true if a file is a web page, or empty: some servers return one for every name. Of the
/// neighbours, only GDAL's notes begin like one.
fn is_page(found: &FileBytes) -> Result<bool, RasterError> {
    let head = found.head(256)?;
    let first = head.iter().find(|byte| !byte.is_ascii_whitespace());
    let is_note = || head.windows(PAM_ROOT.len()).any(|part| part == PAM_ROOT);
    Ok(first.is_none_or(|first| *first == b'<' && !is_note()))
}

/// Returns the possible names of a file beside `path`.
fn candidates(path: &Path, extension: &str) -> [PathBuf; 4] {
    let upper = extension.to_uppercase();
    [
        path.with_extension(extension),
        path.with_extension(&upper),
        appended(path, extension),
        appended(path, &upper),
    ]
}

/// Returns a path with an extension appended to its own.
pub(super) fn appended(path: &Path, extension: &str) -> PathBuf {
    let mut name: OsString = path.as_os_str().to_owned();
    name.push(".");
    name.push(extension);
    PathBuf::from(name)
}

/// Returns the text and the name of the file beside `input` with an extension.
pub(super) fn text(
    input: &FileBytes,
    extension: &str,
) -> Result<Option<(String, String)>, RasterError> {
    find(input, extension)?.map(whole_text).transpose()
}

/// As `text`, for the file whose name is `input`'s with the extension appended.
fn text_appended(
    input: &FileBytes,
    extension: &str,
) -> Result<Option<(String, String)>, RasterError> {
    find_appended(input, extension)?.map(whole_text).transpose()
}

fn whole_text(file: FileBytes) -> Result<(String, String), RasterError> {
    let name = file.name().to_owned();
    let bytes = file.head(MAX_TEXT + 1)?;
    if bytes.len() as u64 > MAX_TEXT {
        return Err(RasterError::AbsurdSize(format!(
            "{name} beside it is larger than {MAX_TEXT} bytes, the limit of such texts"
        )));
    }
    Ok((String::from_utf8_lossy(&bytes).into_owned(), name))
}
