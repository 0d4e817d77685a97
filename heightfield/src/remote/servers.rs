//! The servers of URLs: the protocol of each, and its key from the environment.

use std::io::{Error, ErrorKind, Result};
use std::num::NonZeroUsize;
use std::sync::{Arc, LazyLock, Mutex, Once, PoisonError};

use lru::LruCache;
use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey};
use object_store::azure::{AzureConfigKey, MicrosoftAzureBuilder};
use object_store::client::ClientConfigKey;
use object_store::gcp::{GoogleCloudStorageBuilder, GoogleConfigKey};
use object_store::http::HttpBuilder;
use object_store::path::Path;
use object_store::{ObjectStore, RetryConfig};

use super::errors::configuration_error;
use super::requests::Connector;
use super::url::without_query;

/// Time-outs of a request: in total, without data, and for the connection.
const REQUEST_TIMEOUT: &str = "60 seconds";
const READ_TIMEOUT: &str = "10 seconds";
const CONNECT_TIMEOUT: &str = "5 seconds";
/// Max retries of a request after a server error, and their max total time.
const MAX_RETRIES: usize = 3;
const RETRY_TIMEOUT_S: u64 = 15;

/// Max cached servers.
const MAX_SERVERS: NonZeroUsize = NonZeroUsize::new(64).unwrap();

/// A server, or a bucket on one.
type Server = Arc<dyn ObjectStore>;

/// Returns the server of a URL, and the path there. All files of a server share its open
/// connections and its access token, so that these are not requested for each file.
pub(super) fn at(url: &str) -> Result<(Server, Path)> {
    static SERVERS: LazyLock<Mutex<LruCache<String, Server>>> =
        LazyLock::new(|| Mutex::new(LruCache::new(MAX_SERVERS)));
    let (server, path) = parts(url)?;
    // A panic in the library does not change the cache.
    let mut servers = SERVERS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(server) = servers.get(&server) {
        return Ok((server.clone(), path));
    }
    let connection = connect(&server)?;
    servers.put(server, connection.clone());
    Ok((connection, path))
}

/// Splits a URL into the server, including any key after the path, and the path.
fn parts(url: &str) -> Result<(String, Path)> {
    let (scheme, rest) = url.split_once("://").unwrap_or_default();
    let scheme = scheme.to_ascii_lowercase();
    let named = without_query(rest);
    if named.to_ascii_lowercase().contains("%2f") || named.ends_with('/') {
        let why = "a file's name ends in no slash and has none in it (%2F)";
        return Err(Error::new(ErrorKind::InvalidInput, why));
    }
    let (host, path) = named.split_at(named.find('/').unwrap_or(named.len()));
    let path = Path::from_url_path(path).map_err(|error| configuration_error(&error))?;
    let query = rest[named.len()..].split('#').next().unwrap_or_default();
    // For a bucket, the key is in the environment.
    let query = if scheme.starts_with("http") {
        query
    } else {
        ""
    };
    Ok((format!("{scheme}://{host}/{query}"), path))
}

fn connect(url: &str) -> Result<Server> {
    use ClientConfigKey::{AllowHttp, ConnectTimeout, ReadTimeout, Timeout};
    static PROVIDER: Once = Once::new();
    PROVIDER.call_once(|| {
        // Another thread may have installed the same one.
        let _ = rustls::crypto::ring::default_provider().install_default();
    });
    let retry = RetryConfig {
        max_retries: MAX_RETRIES,
        retry_timeout: std::time::Duration::from_secs(RETRY_TIMEOUT_S),
        ..RetryConfig::default()
    };
    macro_rules! server {
        ($builder:expr, $key:path) => {
            Arc::new(
                $builder
                    .with_url(url)
                    .with_retry(retry)
                    .with_http_connector(Connector)
                    .with_config($key(Timeout), REQUEST_TIMEOUT)
                    .with_config($key(ReadTimeout), READ_TIMEOUT)
                    .with_config($key(ConnectTimeout), CONNECT_TIMEOUT)
                    .build()
                    .map_err(|error| configuration_error(&error))?,
            )
        };
    }
    let scheme = url.split("://").next().unwrap_or_default();
    Ok(match scheme {
        "s3" | "s3a" => server!(AmazonS3Builder::from_env(), AmazonS3ConfigKey::Client),
        "gs" => server!(
            GoogleCloudStorageBuilder::from_env(),
            GoogleConfigKey::Client
        ),
        "az" | "azure" | "abfs" | "abfss" | "adl" => {
            server!(azure_builder(), AzureConfigKey::Client)
        }
        "http" | "https" => server!(
            HttpBuilder::new().with_config(AllowHttp, "true"),
            std::convert::identity
        ),
        other => {
            let why = format!("{other}:// is not supported: use https, http, s3, gs or az");
            return Err(Error::new(ErrorKind::Unsupported, why));
        }
    })
}

/// Returns the settings of Microsoft's servers from the environment, including variables that only
/// Microsoft's own command uses.
fn azure_builder() -> MicrosoftAzureBuilder {
    let names = [
        ("AZURE_STORAGE_ACCOUNT", AzureConfigKey::AccountName),
        ("AZURE_STORAGE_KEY", AzureConfigKey::AccessKey),
    ];
    let builder = MicrosoftAzureBuilder::from_env();
    names.into_iter().fold(builder, |builder, (name, key)| {
        match (builder.get_config_value(&key), std::env::var(name)) {
            (None, Ok(value)) => builder.with_config(key, value),
            _ => builder,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn url_splits_into_path_and_base_with_its_signature() {
        let (_, path) = at("https://h:81/a%20b/c.tif?sig=x%2Fy#part").expect("a URL");
        assert_eq!(path.as_ref(), "a b/c.tif");
        let (_, path) = at("s3://bucket/a/b.tif").expect("a URL");
        assert_eq!(path.as_ref(), "a/b.tif");
        let parts = |url| parts(url).expect("a URL").0;
        assert_eq!(
            parts("HTTPS://h:81/a/b.tif?sig=x%2Fy#part"),
            "https://h:81/?sig=x%2Fy"
        );
        assert_eq!(parts("az://a@b/c.tif?sig=x"), "az://a@b/");
        assert!(at("ftp://h/a.tif").is_err());
        assert!(at("https:///a.tif").is_err());
    }
}
