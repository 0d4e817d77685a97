//! Terrain files at URLs, of which only the touched parts are fetched.
//!
//! ```text
//! fetcher (open files by URL) ─▶ file, pages (64 KiB each) ─▶ store (HTTP requests)
//! ```
//!
//! A file is cut into pages. Pages that are wanted are fetched in the background, several
//! that follow each other with one request, and those touched last are kept. Every read
//! waits for them; where a caller must not wait, a thread of the blocks reads ([`crate::Wait`]).
//!
//! Pages are kept on disk for another run (`pages_on_disk`), where the server says by a tag or a time
//! which state of the file they are of.
//!
//! A file that was changed at its server is not read on: what was fetched of it and what
//! would come do not belong together.
//!
//! `object_store` makes the requests; it is named in `store`, `servers`, `requests` and `errors` only.
//! Without the feature `remote` there is no such file (`disabled`).

#[cfg(not(feature = "remote"))]
mod disabled;
#[cfg(feature = "remote")]
mod errors;
#[cfg(feature = "remote")]
mod fetcher;
#[cfg(feature = "remote")]
mod file;
#[cfg(feature = "remote")]
mod pages;
#[cfg(feature = "remote")]
mod pages_on_disk;
mod reader;
#[cfg(feature = "remote")]
mod redirects;
#[cfg(feature = "remote")]
mod requests;
#[cfg(feature = "remote")]
mod servers;
#[cfg(feature = "remote")]
mod shared_pages;
#[cfg(feature = "remote")]
mod store;
mod url;

use std::io::{Error, ErrorKind};

#[cfg(not(feature = "remote"))]
pub use disabled::RemoteFetcher;
#[cfg(not(feature = "remote"))]
pub(crate) use disabled::RemoteFile;
#[cfg(feature = "remote")]
pub use fetcher::RemoteFetcher;
#[cfg(feature = "remote")]
pub(crate) use file::RemoteFile;
pub(crate) use reader::RemoteReader;
pub use url::{file_name, is_url, without_key};
pub(crate) use url::{gdal_names, neighbour, parts, without_rest};

/// A failure of the line or the server: another try may go well.
const OUTAGE: ErrorKind = ErrorKind::ConnectionAborted;

/// A file that cannot be read on: it was changed, or may not be read any more.
const LOST: ErrorKind = ErrorKind::StaleNetworkFileHandle;

/// Returns true if an error says that nothing more comes of a file that was opened.
pub(crate) fn is_lost(error: &Error) -> bool {
    error.kind() == LOST
}

/// Bytes that were not received, if the reason is not known any more.
pub(crate) fn outage() -> Error {
    Error::new(OUTAGE, "it was not received: try again")
}

/// Returns true if an error is one of the line or the server.
pub(crate) fn is_outage(error: &Error) -> bool {
    error.kind() == OUTAGE
}

/// Returns true if an error says that there is no such file. To a user without list permission, a
/// server answers that a missing file is forbidden.
pub(crate) fn is_missing(error: &Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::NotFound | ErrorKind::PermissionDenied
    )
}
