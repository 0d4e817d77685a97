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
    was: ObjectMeta,
}

/// An opened file, and its first bytes.
pub(super) struct Opened {
    pub(super) object: Object,
    /// The first page, or the whole file if it is shorter or its server does not support ranges.
    pub(super) first: Vec<u8>,
    /// True if `first` is the whole file.
    pub(super) is_all: bool,
}

/// Opens the file at a URL. One request returns its size and its first bytes.
pub(super) async fn open(url: &str) -> Result<Opened> {
    let (store, path) = at(url)?;
    let first = GetOptions {
        range: Some(GetRange::Bounded(0..pages::PAGE)),
        ..GetOptions::default()
    };
    match store.get_opts(&path, first).await {
        Ok(got) => {
            let (was, range) = (got.meta.clone(), got.range.clone());
            let first = body(got, &range).await?;
            let is_all = first.len() as u64 == was.size;
            Ok(Opened {
                object: Object {
                    url: url.to_owned(),
                    store,
                    path,
                    was,
                },
                first,
                is_all,
            })
        }
        Err(error) if is_without_ranges(&error) => whole(url, store, path).await,
        Err(error) => Err(at_opening(&error)),
    }
}

/// Reads a whole file into memory, from a server without ranges.
async fn whole(url: &str, store: Arc<dyn ObjectStore>, path: Path) -> Result<Opened> {
    const MAX: u64 = 256 << 20;
    let got = store.get_opts(&path, GetOptions::default()).await;
    let got = got.map_err(|error| reported(&error))?;
    let was = got.meta.clone();
    if was.size > MAX {
        let why = format!(
            "the server hands out no parts of files, and this one has {} MB",
            was.size >> 20
        );
        return Err(Error::new(ErrorKind::Unsupported, why));
    }
    let first = body(got, &(0..was.size)).await?;
    Ok(Opened {
        object: Object {
            url: url.to_owned(),
            store,
            path,
            was,
        },
        first,
        is_all: true,
    })
}

impl Object {
    /// Returns the size of the file, bytes.
    pub(super) const fn len(&self) -> u64 {
        self.was.size
    }

    /// Returns the stamp of the file's state at opening; `None` if the server sends neither tag nor
    /// time.
    pub(super) fn stamp(&self) -> Option<String> {
        let was = &self.was;
        let tells = was.e_tag.is_some() || was.last_modified.timestamp() > 0;
        let time = was.last_modified.timestamp_micros();
        tells.then(|| format!("{:?} {} {:?} {time}", self.url, was.size, was.e_tag))
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
        let got = self.store.get_opts(&self.path, options).await;
        let got = got.map_err(|error| reported(&error))?;
        let is = &got.meta;
        let same = is.size == self.was.size
            && is.e_tag == self.was.e_tag
            && (is.e_tag.is_some() || is.last_modified == self.was.last_modified);
        if !same {
            let why = "it was changed at its server since it was opened";
            return Err(Error::new(LOST, why));
        }
        body(got, &range).await
    }
}

/// Returns the bytes of a response, limited to the range.
async fn body(got: GetResult, range: &Range<u64>) -> Result<Vec<u8>> {
    let wanted = range.end - range.start;
    let mut bytes = Vec::new();
    let mut parts = got.into_stream();
    while let Some(part) = parts.next().await {
        bytes.extend_from_slice(&part.map_err(|error| reported(&error))?);
        if bytes.len() as u64 > wanted {
            let why = format!("more than {wanted} bytes came");
            return Err(Error::new(OUTAGE, why));
        }
    }
    match bytes.len() as u64 == wanted {
        true => Ok(bytes),
        false => {
            let why = format!("{} bytes of {wanted} came", bytes.len());
            Err(Error::new(OUTAGE, why))
        }
    }
}
