//! Files at URLs, which GDAL reads through this program's own client, with the same keys,
//! redirects, pages and time limits as files that are read here.

use std::fs::File;
use std::io::{self, copy};
use std::path::Path;
use std::sync::Arc;

use heightfield_gdal::{FileSystem, ReadAt};
use tempfile::TempDir;

use crate::RasterError;
use crate::beside;
use crate::input::FileBytes;
use crate::remote::{RemoteFetcher, RemoteFile, file_name, gdal_names, parts};

/// First bytes of formats that GDAL reads only from a disk (NetCDF, HDF5, HDF4), or only
/// sequentially (gzip): such files are downloaded whole.
const DOWNLOADED_FORMATS: [&[u8]; 4] = [
    b"CDF",
    b"\x89HDF\r\n\x1a\n",
    b"\x0e\x03\x13\x01",
    b"\x1f\x8b",
];
/// Max size of a file that is downloaded whole, bytes.
const MAX_DOWNLOAD_BYTES: u64 = 1 << 30;
/// It takes at most 1/`FREE_SHARE` of the free disk space.
const FREE_SHARE: u64 = 2;

/// The files at one host or in one bucket.
#[derive(Clone)]
pub(super) struct ServedFiles {
    fetcher: RemoteFetcher,
    /// As `https://host/`.
    root: String,
    /// Query of each URL, possibly with a key.
    query: String,
    roots: Arc<[String]>,
}

impl ServedFiles {
    /// Returns the server of a URL, and the file's name there.
    pub(super) fn of(url: &str, fetcher: &RemoteFetcher) -> (Self, String) {
        let [root, name, query] = parts(url);
        let served = Self {
            fetcher: fetcher.clone(),
            root: root.to_owned(),
            query: query.to_owned(),
            roots: gdal_names(root).into(),
        };
        (served, name.to_owned())
    }

    fn url(&self, name: &str) -> String {
        let query = if name.contains('?') { "" } else { &self.query };
        format!("{}{name}{query}", self.root)
    }
}

impl FileSystem for ServedFiles {
    fn open(&self, name: &str) -> io::Result<Box<dyn ReadAt>> {
        let file = self.fetcher.open(&self.url(name))?;
        Ok(Box::new(Remote(file)))
    }

    fn neighbours(&self, name: &str) -> io::Result<Vec<String>> {
        let url = self.url(name);
        let input = FileBytes::open(Path::new(&url), &self.fetcher).map_err(io_error)?;
        beside::names_at_url(&input, &url).map_err(io_error)
    }

    fn roots(&self) -> &[String] {
        &self.roots
    }
}

/// An open file at a URL.
struct Remote(Arc<RemoteFile>);

impl ReadAt for Remote {
    fn bytes(&self) -> u64 {
        self.0.len()
    }

    fn read_at(&self, at: u64, count: usize) -> io::Result<Vec<u8>> {
        self.0.read_at(at, count)
    }
}

fn io_error(fault: RasterError) -> io::Error {
    match fault {
        RasterError::Remote(error) | RasterError::Unreadable(error) => error,
        fault => io::Error::other(fault.to_string()),
    }
}

/// Converts an error of a read by GDAL through this program.
pub(super) fn fault(error: io::Error) -> RasterError {
    match error.kind() {
        // An error of the content, not of the server.
        io::ErrorKind::Other => RasterError::Unreadable(error),
        _ => RasterError::Remote(error),
    }
}

/// Returns true if a file with these first bytes is downloaded whole.
pub(super) fn needs_download(head: &[u8]) -> bool {
    DOWNLOADED_FORMATS
        .iter()
        .any(|bytes| head.starts_with(bytes))
}

/// Downloads a file and GDAL's notes beside it into a folder, which is deleted on drop.
///
/// # Errors
/// [`RasterError::AbsurdSize`] if it is too large for that.
pub(super) fn download(
    url: &str,
    fetcher: &RemoteFetcher,
) -> Result<(TempDir, String), RasterError> {
    let input = FileBytes::open(Path::new(url), fetcher)?;
    let folder = tempfile::tempdir().map_err(RasterError::Unreadable)?;
    let free = fs4::available_space(folder.path()).unwrap_or(u64::MAX);
    let max = MAX_DOWNLOAD_BYTES.min(free / FREE_SHARE);
    if input.len() > max {
        return Err(RasterError::AbsurdSize(format!(
            "{} MB, of which {} MB fit here: a file of this format at a URL is fetched as a whole",
            input.len() >> 20,
            max >> 20
        )));
    }
    let name = plain_name(url);
    let notes = beside::find_appended(&input, "aux.xml")?;
    let notes = notes.map(|notes| (notes, format!("{name}.aux.xml")));
    for (bytes, name) in [(input, name.clone())].into_iter().chain(notes) {
        let mut file = File::create(folder.path().join(name)).map_err(RasterError::Unreadable)?;
        copy(&mut bytes.reader()?, &mut file)
            .map_err(|error| RasterError::from_io(error, "the content of the URL"))?;
    }
    Ok((folder, name))
}

/// Returns a name that is valid on all systems, with the extension of the file at a URL.
fn plain_name(url: &str) -> String {
    let plain = |c: char| match c.is_ascii_alphanumeric() || ".-_".contains(c) {
        true => c,
        false => '_',
    };
    let name: String = file_name(url).chars().map(plain).collect();
    match name.trim_start_matches('.') {
        "" => "terrain".to_owned(),
        name => name.to_owned(),
    }
}
