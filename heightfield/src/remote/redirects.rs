//! The choice of redirects to follow: none from https to http, and none with a key to another host.

use reqwest::Url;
use reqwest::header::{HeaderMap, HeaderName};

/// Headers that are not keys; any other may be one.
const KEYLESS_HEADERS: [&str; 9] = [
    "accept",
    "content-length",
    "host",
    "if-match",
    "if-modified-since",
    "if-none-match",
    "if-unmodified-since",
    "range",
    "user-agent",
];

/// Reason why a redirect is not followed.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum RedirectError {
    #[error(
        "its server redirects from https to http at {0}, an unencrypted connection: name the http URL itself to allow it"
    )]
    LeavesHttps(String),
    #[error(
        "its server redirects to {0}, and the key of the request is for another host: name its URL there if that is intended"
    )]
    SendsKey(String),
    #[error("its server redirects to a target that is no URL of a web server")]
    NotAUrl,
    #[error("its server redirects again and again")]
    TooMany,
}

/// Returns true if a request may contain a key: in a header, a password, or the URL's query.
pub(super) fn has_key(url: &Url, headers: &HeaderMap) -> bool {
    let may_be_key = |name: &HeaderName| !KEYLESS_HEADERS.contains(&name.as_str());
    let in_url = url.query().is_some() || url.password().is_some() || !url.username().is_empty();
    in_url || headers.keys().any(may_be_key)
}

/// Returns the target of a redirect.
///
/// # Errors
/// The reason why it is not followed.
pub(super) fn target(from: &Url, location: &str, has_key: bool) -> Result<Url, RedirectError> {
    let to = from.join(location).map_err(|_| RedirectError::NotAUrl)?;
    let host = match (to.scheme(), to.host_str()) {
        ("http" | "https", Some(host)) => host.to_owned(),
        _ => return Err(RedirectError::NotAUrl),
    };
    if from.scheme() == "https" && to.scheme() == "http" {
        return Err(RedirectError::LeavesHttps(host));
    }
    if has_key && !is_same_host(from, &to) {
        return Err(RedirectError::SendsKey(host));
    }
    Ok(to)
}

/// Returns true if both are on one server, even if the redirect is from http to https.
fn is_same_host(from: &Url, to: &Url) -> bool {
    let port = |url: &Url| url.port_or_known_default();
    let is_upgrade = (port(from), port(to)) == (Some(80), Some(443));
    from.host_str() == to.host_str() && (port(from) == port(to) || is_upgrade)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn url(text: &str) -> Url {
        text.parse().expect("a URL")
    }

    #[test]
    fn redirect_is_followed_if_it_discloses_no_key() {
        for (from, location, has_key, to) in [
            ("https://h/a", "/b", true, "https://h/b"),
            ("https://h/a", "c/d?e", true, "https://h/c/d?e"),
            ("https://h/a", "https://h:443/b", true, "https://h/b"),
            ("http://h/a", "https://h/a", true, "https://h/a"),
            ("https://h/a", "https://other/b", false, "https://other/b"),
            ("http://h/a", "//other/b", false, "http://other/b"),
        ] {
            let found = target(&url(from), location, has_key);
            assert_eq!(found, Ok(url(to)), "{from} {location}");
        }
    }

    #[test]
    fn redirect_that_would_disclose_a_key_is_refused() {
        use RedirectError::{LeavesHttps, NotAUrl, SendsKey};
        let other = || "other".to_owned();
        for (from, location, has_key, why) in [
            ("https://h/a", "http://h/a", false, LeavesHttps("h".into())),
            ("https://h/a", "http://other/a", true, LeavesHttps(other())),
            ("https://h/a", "//other/a", true, SendsKey(other())),
            ("https://h/a", "https://h:444/", true, SendsKey("h".into())),
            ("http://h:81/a", "https://h/", true, SendsKey("h".into())),
            ("http://h/a", "https://other/", true, SendsKey(other())),
            ("https://h/a", "file:///etc/passwd", false, NotAUrl),
            ("https://h/a", "http://", false, NotAUrl),
        ] {
            let refused = target(&url(from), location, has_key);
            assert_eq!(refused, Err(why), "{from} {location}");
        }
    }

    #[test]
    fn unknown_headers_and_url_credentials_count_as_keys() {
        let with = |name: &'static str| {
            let mut headers = HeaderMap::new();
            headers.insert("range", "bytes=0-1".parse().expect("a value"));
            headers.insert(name, "x".parse().expect("a value"));
            headers
        };
        assert!(!has_key(&url("https://h/a.tif"), &with("user-agent")));
        for name in ["authorization", "x-amz-security-token", "cookie", "api-key"] {
            assert!(has_key(&url("https://h/a.tif"), &with(name)), "{name}");
        }
        for keyed in ["https://h/a?sig=x", "https://me@h/a", "https://me:p@h/a"] {
            assert!(has_key(&url(keyed), &HeaderMap::new()), "{keyed}");
        }
    }
}
