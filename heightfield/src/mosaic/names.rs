//! The files of a folder or of a pattern of names.

use std::path::{Path, PathBuf};

use super::super::RasterError;
use super::super::format::Claim;
use super::super::formats::claim_of;
use crate::remote::is_url;

/// Max number of files of a terrain: the 30 m tiles of all land on Earth are 26,450.
const MAX_FILES: usize = 1 << 20;

/// Returns the terrain files of a folder or a pattern, in the order of their names; `None` for
/// another path.
///
/// # Errors
/// [`RasterError::NoTiles`]; a folder that cannot be read.
pub(crate) fn named(path: &Path) -> Result<Option<Vec<PathBuf>>, RasterError> {
    if path.to_str().is_some_and(is_url) {
        return Ok(None);
    }
    let files = if path.is_dir() {
        in_folder(path)?
    } else if let Some(pattern) = pattern(path) {
        matching(pattern)?
    } else {
        return Ok(None);
    };
    match files.len() {
        0 => Err(RasterError::NoTiles(match path.is_dir() {
            true => "no file in this folder is a terrain file that states its place".into(),
            false => "no terrain file matches this pattern".into(),
        })),
        count if count > MAX_FILES => Err(RasterError::NoTiles(format!(
            "more than {MAX_FILES} files are not read as one terrain"
        ))),
        _ => Ok(Some(files)),
    }
}

/// Returns the path as a pattern: it has a special character, and no file has this name.
fn pattern(path: &Path) -> Option<&str> {
    let text = path.to_str()?;
    (text.contains(['*', '?', '[']) && !path.exists()).then_some(text)
}

/// Returns the files of a folder in formats that include the place; subfolders are ignored.
fn in_folder(folder: &Path) -> Result<Vec<PathBuf>, RasterError> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(RasterError::Unreadable)? {
        let path = entry.map_err(RasterError::Unreadable)?.path();
        if is_tile(&path) && path.is_file() && files.len() <= MAX_FILES {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// Returns the files that match a pattern, including pictures and archives of any name.
fn matching(pattern: &str) -> Result<Vec<PathBuf>, RasterError> {
    let wrong = |error| RasterError::NoTiles(format!("this pattern cannot be read: {error}"));
    let found = glob::glob(pattern).map_err(wrong)?;
    // Files in folders without permission cannot be read.
    let found = found.filter_map(Result::ok);
    let requested = |path: &PathBuf| {
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        let others = ["png", "zip", "gz"];
        is_tile(path) || others.iter().any(|other| extension == *other)
    };
    let tiles = found.filter(|path| requested(path) && path.is_file());
    let mut files: Vec<_> = tiles.take(MAX_FILES + 1).collect();
    files.sort();
    Ok(files)
}

/// Returns true for names of files that contain a terrain with its place, possibly compressed.
/// Pictures seldom do: beside tiles, they are previews.
pub(super) fn is_tile(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let lower = name.to_lowercase();
    let unpacked = lower.strip_suffix(".zip").or(lower.strip_suffix(".gz"));
    let unpacked = unpacked.unwrap_or(&lower);
    let is_hidden = lower.starts_with('.');
    let is_placed = !unpacked.ends_with(".png");
    let claims = claim_of(unpacked).is_some_and(|claim| claim != Claim::Possible);
    claims && is_placed && !is_hidden
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_recognised_by_file_name() {
        for name in [
            "a.tif",
            "A.TIFF",
            "N44W072.hgt",
            "N44W072.hgt.zip",
            "n44w072.HGT.gz",
            "x.asc",
            "w012n34.dt2",
            "x.flt",
            "x.nc",
        ] {
            assert!(is_tile(Path::new(name)), "{name}");
        }
        for name in [
            "README.txt",
            "a.tif.aux.xml",
            "a.prj",
            "a.tfw",
            "a.hdr",
            "a.tif.ovr",
            "a.tif.msk",
            "index.vrt",
            "preview.png",
            "tiles.zip",
            ".a.tif",
            "a.npy",
            "tif",
        ] {
            assert!(!is_tile(Path::new(name)), "{name}");
        }
    }
}
