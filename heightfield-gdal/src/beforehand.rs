//! What is looked at before GDAL opens a file: GDAL would wait for a pipe without end, start a
//! device, and follow a VRT to whatever that names.

use std::collections::HashSet;
use std::fs::{self, File, FileType};
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::library::Library;
use crate::settings;

/// VRTs inside VRTs.
const MAX_NESTING: u32 = 16;
/// A VRT of 40,000 files has half as many bytes.
const MAX_VRT_BYTES: u64 = 32 << 20;
/// Files that a VRT names, directly or by another VRT.
const MAX_FILES: usize = 1 << 17;
/// A longer text is no name of a file.
const MAX_NAME: usize = 4096;
/// GDAL tells a VRT by its first bytes.
const HEAD_BYTES: u64 = 1024;
const VRT: &str = "<VRTDataset";
/// Signs that divide a name of a driver's or of a virtual file system's, as in
/// `NETCDF:"ocean.nc":depth`.
const DIVIDERS: [char; 7] = [':', '"', ',', '?', '&', '{', '}'];

/// Checks that a file, what lies beside it and what it names as a VRT are regular files.
///
/// # Errors
/// [`Error::NotOpened`].
pub(crate) fn check(library: &Library, path: &Path) -> Result<(), Error> {
    let names = Names {
        library,
        seen: HashSet::new(),
    };
    check_kind(path)?;
    check_siblings(path)?;
    names.follow(path)
}

/// A walk through the files that VRTs name.
struct Names<'l> {
    library: &'l Library,
    seen: HashSet<PathBuf>,
}

impl Names<'_> {
    fn follow(mut self, path: &Path) -> Result<(), Error> {
        let mut open = vec![(path.to_owned(), 0)];
        while let Some((path, depth)) = open.pop() {
            let Some(text) = vrt(&path)? else {
                continue;
            };
            if depth > MAX_NESTING {
                return refused(&path, &format!("VRTs lie in each other {depth} deep"));
            }
            let folder = path.parent().unwrap_or(Path::new("")).to_owned();
            let mut texts = vec![text];
            while let Some(text) = texts.pop() {
                for (node, value) in self.library.xml_texts(&text)? {
                    if value.trim_start().starts_with(VRT) {
                        texts.push(value);
                    } else if is_address(&node, &value) && !settings::is_fetching_allowed() {
                        return refused(
                            &path,
                            "it names what is elsewhere, and nothing is fetched",
                        );
                    } else if may_be_name(&node, &value) {
                        let found = self.named(&value, &folder)?;
                        open.extend(found.into_iter().map(|path| (path, depth + 1)));
                    }
                }
            }
        }
        Ok(())
    }

    /// The files that a text names, which were not looked at before.
    fn named(&mut self, text: &str, folder: &Path) -> Result<Vec<PathBuf>, Error> {
        let mut found = Vec::new();
        let parts = text.split(DIVIDERS).chain([text]);
        for part in parts.filter(|part| !part.is_empty()) {
            for name in [part, part.trim_start_matches('/')] {
                for path in [folder.join(name), PathBuf::from(name)] {
                    if self.seen.contains(&path) || fs::metadata(&path).is_err() {
                        continue;
                    }
                    check_kind(&path)?;
                    if self.seen.len() >= MAX_FILES {
                        return refused(&path, &format!("more than {MAX_FILES} files are named"));
                    }
                    self.seen.insert(path.clone());
                    found.push(path);
                }
            }
        }
        Ok(found)
    }
}

/// Whether a text of a VRT names what a driver of its own would ask a server for. GDAL itself looks
/// at addresses that begin with `/vsi`.
fn is_address(node: &str, value: &str) -> bool {
    let node = node.to_ascii_lowercase();
    let is_local = ["/vsi", "vrt://"]
        .iter()
        .any(|local| value.starts_with(local));
    (node.ends_with("filename") || node.ends_with("dataset")) && value.contains("://") && !is_local
}

/// Whether a text of a VRT may name a file. Most are numbers.
fn may_be_name(node: &str, value: &str) -> bool {
    let node = node.to_ascii_lowercase();
    let names_files = ["filename", "dataset", "dem"];
    value.len() <= MAX_NAME
        && (names_files.iter().any(|end| node.ends_with(end)) || value.parse::<f64>().is_err())
}

/// The text of a VRT; none where a file is something else.
fn vrt(path: &Path) -> Result<Option<String>, Error> {
    let Ok(mut file) = File::open(path) else {
        return Ok(None);
    };
    let mut bytes = Vec::new();
    let is_read = |result: std::io::Result<usize>| result.is_ok();
    if !is_read(file.by_ref().take(HEAD_BYTES).read_to_end(&mut bytes))
        || !bytes.windows(VRT.len()).any(|part| part == VRT.as_bytes())
    {
        return Ok(None);
    }
    let rest = MAX_VRT_BYTES + 1 - bytes.len() as u64;
    if !is_read(file.take(rest).read_to_end(&mut bytes)) {
        return Ok(None);
    }
    match bytes.len() as u64 > MAX_VRT_BYTES {
        true => refused(path, &format!("a VRT of more than {MAX_VRT_BYTES} bytes")),
        // GDAL stops at a zero byte, too.
        false => Ok(Some(String::from_utf8_lossy(&bytes).replace('\0', " "))),
    }
}

/// GDAL opens files beside this one whose names begin as its does.
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
        let behind = stem(&other).strip_prefix(&own).map(str::to_owned);
        let belongs =
            behind.is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '_', '-']));
        if !is_regular && belongs {
            check_kind(&other)?;
        }
    }
    Ok(())
}

/// Checks that what is at a path, if anything, is a file or a folder.
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
