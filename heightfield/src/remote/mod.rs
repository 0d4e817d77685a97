//! Terrain files at URLs, of which only the needed parts are fetched.
//!
//! ```text
//! fetcher (open files by URL) ─▶ file, pages (64 KiB each) ─▶ store (HTTP requests)
//! ```
//!
//! A file is divided into pages. Requested pages are fetched in the background, adjacent ones in
//! one request, and the last used are cached. Every read waits for its pages; for callers that must
//! not wait, a background thread of the blocks reads ([`crate::Wait`]).
//!
//! Pages are stored on disk for later runs (`pages_on_disk`), if the server identifies the file's
//! state by a tag or a time.
//!
//! Reading stops if a file changes on its server, because old and new pages do not match.
//!
//! `object_store` makes the requests; only `store`, `servers`, `requests` and `errors` use it.
//! `servers` has the connections, their time-outs and the retries; `redirects` the permitted
//! redirects.
//! Without the feature `remote`, files at URLs cannot be opened (`disabled`).

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
pub(crate) use url::{gdal_names, neighbour, parts, without_query};

/// A failure of the connection or the server: a retry may succeed.
const OUTAGE: ErrorKind = ErrorKind::ConnectionAborted;

/// A file that cannot be read any more: it has changed, or access is denied.
const LOST: ErrorKind = ErrorKind::StaleNetworkFileHandle;

/// Returns true if an open file cannot be read any more.
pub(crate) fn is_lost(error: &Error) -> bool {
    error.kind() == LOST
}

/// Returns the error for missing bytes whose reason is no longer stored.
pub(crate) fn outage() -> Error {
    Error::new(OUTAGE, "it was not received: try again")
}

/// Returns true for an error of the connection or the server.
pub(crate) fn is_outage(error: &Error) -> bool {
    error.kind() == OUTAGE
}

/// Returns true if the file does not exist. For a user without list permission, a server reports a
/// missing file as forbidden.
pub(crate) fn is_missing(error: &Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::NotFound | ErrorKind::PermissionDenied
    )
}
