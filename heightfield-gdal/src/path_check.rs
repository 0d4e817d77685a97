//! Checks before GDAL opens a file: GDAL would wait for a pipe indefinitely, start a device, and
//! open all files that a VRT references.

use std::collections::HashSet;
use std::fs::{self, File, FileType};
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::libgdal::Libgdal;
use crate::vrt;
use crate::xml::Text;

/// Checks that a file, its neighbours and the files that a VRT references are regular files.
///
/// # Errors
/// [`Error::NotOpened`].
pub(crate) fn check(library: &Libgdal, path: &Path) -> Result<(), Error> {
    let names = Names {
        library,
        visited: HashSet::new(),
    };
    check_kind(path)?;
    check_siblings(path)?;
    names.follow(path)
}

/// A traversal of the files that VRTs reference.
struct Names<'l> {
    library: &'l Libgdal,
    visited: HashSet<PathBuf>,
}

impl Names<'_> {
    fn follow(mut self, path: &Path) -> Result<(), Error> {
        let mut open = vec![(path.to_owned(), 0)];
        while let Some((path, depth)) = open.pop() {
            let Some(text) = text_of_vrt(&path)? else {
                continue;
            };
            if depth > vrt::MAX_NESTING {
                return refused(&path, &vrt::too_deep(depth));
            }
            let folder = path.parent().unwrap_or(Path::new("")).to_owned();
            for named in vrt::names(self.library, &text)? {
                if let Err(why) = named.check_here() {
                    return refused(&path, &why);
                }
                let found = self.files_of(&named, &folder)?;
                open.extend(found.into_iter().map(|path| (path, depth + 1)));
            }
        }
        Ok(())
    }

    /// Returns the new files in a text.
    fn files_of(&mut self, named: &Text, folder: &Path) -> Result<Vec<PathBuf>, Error> {
        let mut found = Vec::new();
        for part in named.parts() {
            for name in [part, part.trim_start_matches('/')] {
                for path in [folder.join(name), PathBuf::from(name)] {
                    if self.visited.contains(&path) || fs::metadata(&path).is_err() {
                        continue;
                    }
                    check_kind(&path)?;
                    if self.visited.len() >= vrt::MAX_FILES {
                        let why = format!("more than {} files are named", vrt::MAX_FILES);
                        return refused(&path, &why);
                    }
                    self.visited.insert(path.clone());
                    found.push(path);
                }
            }
        }
        Ok(found)
    }
}

/// Returns the text of a VRT; `None` for another file.
fn text_of_vrt(path: &Path) -> Result<Option<String>, Error> {
    let Ok(mut file) = File::open(path) else {
        return Ok(None);
    };
    let mut bytes = Vec::new();
    let is_read = |result: std::io::Result<usize>| result.is_ok();
    if !is_read(file.by_ref().take(vrt::HEAD_BYTES).read_to_end(&mut bytes)) || !vrt::begins(&bytes)
    {
        return Ok(None);
    }
    let limit = vrt::MAX_BYTES + 1 - bytes.len() as u64;
    if !is_read(file.take(limit).read_to_end(&mut bytes)) {
        return Ok(None);
    }
    match bytes.len() as u64 > vrt::MAX_BYTES {
        true => refused(path, &vrt::too_large()),
        false => Ok(Some(String::from_utf8_lossy(&bytes).into_owned())),
    }
}

/// Checks files beside this one whose names begin like its own, because GDAL opens them.
fn check_siblings(path: &Path) -> Result<(), Error> {
    let stem = |path: &Path| {
        let stem = path.file_stem().unwrap_or_default();
        stem.to_string_lossy().to_lowercase()
    };
    let own = stem(path);
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let (Ok(entries), false) = (fs::read_dir(folder), own.is_empty()) else {
        return Ok(());
    };
    for entry in entries.flatten() {
        let other = entry.path();
        let is_regular = entry.file_type().is_ok_and(|kind| kind.is_file());
        let suffix = stem(&other).strip_prefix(&own).map(str::to_owned);
        let belongs =
            suffix.is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '_', '-']));
        if !is_regular && belongs {
            check_kind(&other)?;
        }
    }
    Ok(())
}

/// Checks that a path, if it exists, is a regular file or a folder.
fn check_kind(path: &Path) -> Result<(), Error> {
    match fs::metadata(path).map(|metadata| metadata.file_type()) {
        Ok(kind) if !kind.is_file() && !kind.is_dir() => refused(
            path,
            &format!("it is {}, not a regular file", name_of(kind)),
        ),
        _ => Ok(()),
    }
}

fn refused<T>(path: &Path, why: &str) -> Result<T, Error> {
    Err(Error::NotOpened {
        path: path.to_owned(),
        why: why.to_owned(),
    })
}

#[cfg(unix)]
fn name_of(kind: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    match kind {
        kind if kind.is_fifo() => "a pipe (FIFO)",
        kind if kind.is_socket() => "a socket",
        _ => "a device",
    }
}

#[cfg(not(unix))]
fn name_of(_: FileType) -> &'static str {
    "something else"
}
