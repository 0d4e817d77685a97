//! Requests to a server: `object_store` is named here and in `errors` only.

use std::io::{Error, ErrorKind, Result};
use std::ops::Range;
use std::sync::Once;

use futures_util::StreamExt;
use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey};
use object_store::azure::{AzureConfigKey, MicrosoftAzureBuilder};
use object_store::client::ClientConfigKey;
use object_store::gcp::{GoogleCloudStorageBuilder, GoogleConfigKey};
use object_store::http::HttpBuilder;
use object_store::path::Path;
use object_store::{GetOptions, GetRange, GetResult, ObjectMeta, ObjectStore, RetryConfig};

use super::errors::{at_opening, is_without_ranges, told, wrong};
use super::url::shown;
use super::{LOST, OUTAGE, pages};

/// A request is given up after so long, and when nothing comes for so long.
const REQUEST: &str = "60 seconds";
const SILENCE: &str = "10 seconds";
const CONNECT: &str = "5 seconds";
/// So often, and in all for so long, a request is made again that the server could not
/// answer.
const RETRIES: usize = 3;
const RETRIES_SECONDS: u64 = 15;

/// A file at a server, in the state in which it was opened.
#[derive(Debug)]
pub(super) struct Object {
    url: String,
    store: Box<dyn ObjectStore>,
    path: Path,
    /// As it was when it was opened.
    was: ObjectMeta,
}

/// A file that was opened, and its first bytes.
pub(super) struct Opened {
    pub(super) object: Object,
    /// The first page, or all of the file where it is shorter or cannot be read in ranges.
    pub(super) first: Vec<u8>,
    /// Whether that is all of it.
    pub(super) is_all: bool,
}

/// Opens the file at a URL. One request tells how long it is and how it begins.
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

/// A server that knows no ranges hands over all of a file, which then is held in memory.
async fn whole(url: &str, store: Box<dyn ObjectStore>, path: Path) -> Result<Opened> {
    const LARGEST: u64 = 256 << 20;
    let got = store.get_opts(&path, GetOptions::default()).await;
    let got = got.map_err(|error| told(&error))?;
    let was = got.meta.clone();
    if was.size > LARGEST {
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
    /// Bytes of the file.
    pub(super) const fn len(&self) -> u64 {
        self.was.size
    }

    /// What tells the file in the state in which it was opened from others; `None` where the
    /// server tells neither tag nor time.
    pub(super) fn stamp(&self) -> Option<String> {
        let was = &self.was;
        let tells = was.e_tag.is_some() || was.last_modified.timestamp() > 0;
        let time = was.last_modified.timestamp_micros();
        tells.then(|| format!("{:?} {} {:?} {time}", self.url, was.size, was.e_tag))
    }

    /// Some of its bytes, all of them inside the file.
    ///
    /// # Errors
    /// [`super::is_outage`] where another try may go well; else nothing more comes of it.
    pub(super) async fn get(&self, range: Range<u64>) -> Result<Vec<u8>> {
        let options = GetOptions {
            range: Some(GetRange::Bounded(range.clone())),
            ..GetOptions::default()
        };
        let got = self.store.get_opts(&self.path, options).await;
        let got = got.map_err(|error| told(&error))?;
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

/// The bytes of an answer: those of the range, however many the server sends.
async fn body(got: GetResult, range: &Range<u64>) -> Result<Vec<u8>> {
    let wanted = range.end - range.start;
    let mut bytes = Vec::new();
    let mut parts = got.into_stream();
    while let Some(part) = parts.next().await {
        bytes.extend_from_slice(&part.map_err(|error| told(&error))?);
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

/// The server of a URL, and the path there.
fn at(url: &str) -> Result<(Box<dyn ObjectStore>, Path)> {
    use ClientConfigKey::{AllowHttp, ConnectTimeout, ReadTimeout, Timeout};
    static CHOSEN: Once = Once::new();
    CHOSEN.call_once(|| {
        // Somebody else's choice is as good.
        let _ = rustls::crypto::ring::default_provider().install_default();
    });
    let retry = RetryConfig {
        max_retries: RETRIES,
        retry_timeout: std::time::Duration::from_secs(RETRIES_SECONDS),
        ..RetryConfig::default()
    };
    let (scheme, rest) = url.split_once("://").unwrap_or_default();
    let scheme = &*scheme.to_ascii_lowercase();
    let url = &*format!("{scheme}://{rest}");
    if shown(url).to_ascii_lowercase().contains("%2f") || shown(url).ends_with('/') {
        let why = "a file's name ends in no slash and has none in it (%2F)";
        return Err(Error::new(ErrorKind::InvalidInput, why));
    }
    // Of a URL without what follows its path.
    let in_bucket = || {
        let (_, key) = shown(rest).split_once('/').unwrap_or_default();
        Path::from_url_path(key).map_err(|error| wrong(&error))
    };
    macro_rules! store {
        ($builder:expr, $key:path) => {
            $builder
                .with_retry(retry)
                .with_config($key(Timeout), REQUEST)
                .with_config($key(ReadTimeout), SILENCE)
                .with_config($key(ConnectTimeout), CONNECT)
                .build()
                .map_err(|error| wrong(&error))?
        };
    }
    Ok(match scheme {
        "s3" | "s3a" => {
            let builder = AmazonS3Builder::from_env().with_url(shown(url));
            (
                Box::new(store!(builder, AmazonS3ConfigKey::Client)),
                in_bucket()?,
            )
        }
        "gs" => {
            let builder = GoogleCloudStorageBuilder::from_env().with_url(shown(url));
            (
                Box::new(store!(builder, GoogleConfigKey::Client)),
                in_bucket()?,
            )
        }
        "az" | "azure" | "abfs" | "abfss" | "adl" => {
            let builder = microsofts().with_url(shown(url));
            (
                Box::new(store!(builder, AzureConfigKey::Client)),
                in_bucket()?,
            )
        }
        "http" | "https" => {
            let path = shown(rest).find('/').map_or("", |at| &shown(rest)[at..]);
            let (host, query) = (
                &rest[..shown(rest).len() - path.len()],
                &rest[shown(rest).len()..],
            );
            let query = query.split('#').next().unwrap_or_default();
            let store = HttpBuilder::new()
                .with_url(format!("{scheme}://{host}/{query}"))
                .with_retry(retry)
                .with_config(AllowHttp, "true")
                .with_config(Timeout, REQUEST)
                .with_config(ReadTimeout, SILENCE)
                .with_config(ConnectTimeout, CONNECT)
                .build()
                .map_err(|error| wrong(&error))?;
            let path = Path::from_url_path(path).map_err(|error| wrong(&error))?;
            (Box::new(store), path)
        }
        other => {
            let why =
                format!("no files are read by {other}://: https, http, s3, gs and az are known");
            return Err(Error::new(ErrorKind::Unsupported, why));
        }
    })
}

/// What the environment says of Microsoft's servers, also by the names that only
/// Microsoft's own command knows.
fn microsofts() -> MicrosoftAzureBuilder {
    let names = [
        ("AZURE_STORAGE_ACCOUNT", AzureConfigKey::AccountName),
        ("AZURE_STORAGE_KEY", AzureConfigKey::AccessKey),
    ];
    let known = MicrosoftAzureBuilder::from_env();
    names.into_iter().fold(known, |known, (name, key)| {
        match (known.get_config_value(&key), std::env::var(name)) {
            (None, Ok(value)) => known.with_config(key, value),
            _ => known,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_and_its_key_go_to_the_server_as_they_are() {
        let (_, path) = at("https://h:81/a%20b/c.tif?sig=x%2Fy#part").expect("a URL");
        assert_eq!(path.as_ref(), "a b/c.tif");
        let (_, path) = at("s3://bucket/a/b.tif").expect("a URL");
        assert_eq!(path.as_ref(), "a/b.tif");
        assert!(at("ftp://h/a.tif").is_err());
        assert!(at("https:///a.tif").is_err());
    }
}
