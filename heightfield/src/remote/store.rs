//! Requests to a server.

use std::io::{Error, ErrorKind, Result};
use std::ops::Range;
use std::sync::Arc;

use futures_util::StreamExt;
use object_store::path::Path;
use object_store::{GetOptions, GetRange, GetResult, ObjectMeta, ObjectStore};

use super::errors::{at_opening, is_without_ranges, reported};
use super::servers::at;
use super::{LOST, OUTAGE, pages};

/// A file on a server, in its state at opening.
#[derive(Debug)]
pub(super) struct Object {
    url: String,
    store: Arc<dyn ObjectStore>,
    path: Path,
    /// Its metadata at opening.
    metadata: ObjectMeta,
}

/// An opened file, and its first bytes.
pub(super) struct Opened {
    pub(super) object: Object,
    /// The first page, or the whole file if it is shorter or its server does not support ranges.
    pub(super) first: Vec<u8>,
    /// True if `first` is the whole file.
    pub(super) is_whole: bool,
}

/// Opens the file at a URL. One request returns its size and its first bytes.
pub(super) async fn open(url: &str) -> Result<Opened> {
    let (store, path) = at(url)?;
    let first = GetOptions {
        range: Some(GetRange::Bounded(0..pages::PAGE)),
        ..GetOptions::default()
    };
    match store.get_opts(&path, first).await {
        Ok(response) => {
            let (metadata, range) = (response.meta.clone(), response.range.clone());
            let first = body(response, &range).await?;
            let is_whole = first.len() as u64 == metadata.size;
            Ok(Opened {
                object: Object {
                    url: url.to_owned(),
                    store,
                    path,
                    metadata,
                },
                first,
                is_whole,
            })
        }
        Err(error) if is_without_ranges(&error) => whole(url, store, path).await,
        Err(error) => Err(at_opening(&error)),
    }
}

/// Reads a whole file into memory, from a server without ranges.
async fn whole(url: &str, store: Arc<dyn ObjectStore>, path: Path) -> Result<Opened> {
    const MAX: u64 = 256 << 20;
    let response = store.get_opts(&path, GetOptions::default()).await;
    let response = response.map_err(|error| reported(&error))?;
    let metadata = response.meta.clone();
    if metadata.size > MAX {
        let why = format!(
            "the server does not serve parts of files, and this one has {} MB",
            metadata.size >> 20
        );
        return Err(Error::new(ErrorKind::Unsupported, why));
    }
    let first = body(response, &(0..metadata.size)).await?;
    Ok(Opened {
        object: Object {
            url: url.to_owned(),
            store,
            path,
            metadata,
        },
        first,
        is_whole: true,
    })
}

impl Object {
    /// Returns the size of the file, bytes.
    pub(super) const fn len(&self) -> u64 {
        self.metadata.size
    }

    /// Returns the stamp of the file's state at opening; `None` if the server sends neither tag nor
    /// time.
    pub(super) fn stamp(&self) -> Option<String> {
        let metadata = &self.metadata;
        let is_identified = metadata.e_tag.is_some() || metadata.last_modified.timestamp() > 0;
        let time = metadata.last_modified.timestamp_micros();
        is_identified.then(|| {
            format!(
                "{:?} {} {:?} {time}",
                self.url, metadata.size, metadata.e_tag
            )
        })
    }

    /// Fetches a byte range inside the file.
    ///
    /// # Errors
    /// [`super::is_outage`] if a retry may succeed; otherwise the file cannot be read any more.
    pub(super) async fn get(&self, range: Range<u64>) -> Result<Vec<u8>> {
        let options = GetOptions {
            range: Some(GetRange::Bounded(range.clone())),
            ..GetOptions::default()
        };
        let response = self.store.get_opts(&self.path, options).await;
        let response = response.map_err(|error| reported(&error))?;
        let current = &response.meta;
        let same = current.size == self.metadata.size
            && current.e_tag == self.metadata.e_tag
            && (current.e_tag.is_some() || current.last_modified == self.metadata.last_modified);
        if !same {
            let why = "it was changed at its server since it was opened";
            return Err(Error::new(LOST, why));
        }
        body(response, &range).await
    }
}

/// Returns the bytes of a response, limited to the range.
async fn body(response: GetResult, range: &Range<u64>) -> Result<Vec<u8>> {
    let expected = range.end - range.start;
    let mut bytes = Vec::new();
    let mut parts = response.into_stream();
    while let Some(part) = parts.next().await {
        bytes.extend_from_slice(&part.map_err(|error| reported(&error))?);
        if bytes.len() as u64 > expected {
            let why = format!("more than {expected} bytes arrived");
            return Err(Error::new(OUTAGE, why));
        }
    }
    match bytes.len() as u64 == expected {
        true => Ok(bytes),
        false => {
            let why = format!("{} bytes of {expected} arrived", bytes.len());
            Err(Error::new(OUTAGE, why))
        }
    }
}
