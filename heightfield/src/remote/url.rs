//! The parts of a URL that matter for file names.

use std::path::Path;

/// Returns true if a name is a URL.
pub fn is_url(name: &str) -> bool {
    let Some((scheme, address)) = name.split_once("://") else {
        return false;
    };
    let is_word = |c: char| c.is_ascii_alphanumeric() || "+-.".contains(c);
    scheme.len() > 1 && scheme.chars().all(is_word) && !address.is_empty()
}

/// Returns a path or URL for display, without a key.
pub fn without_key(path: &Path) -> String {
    let text = path.display().to_string();
    match is_url(&text) {
        true => without_credentials(&text),
        false => text,
    }
}

/// Returns a URL without its query and without name and password.
pub(super) fn without_credentials(url: &str) -> String {
    let (scheme, address) = without_query(url).split_once("://").unwrap_or(("", url));
    let (host, path) = address.split_at(address.find('/').unwrap_or(address.len()));
    let host = host.rsplit('@').next().unwrap_or_default();
    format!("{scheme}://{host}{path}")
}

/// Returns a URL without its query or fragment, which may be a key.
pub(crate) fn without_query(url: &str) -> &str {
    split(url).0
}

/// Returns the last part of a URL's path.
pub fn file_name(url: &str) -> &str {
    without_query(url).rsplit('/').next().unwrap_or_default()
}

/// Returns the URLs of a file beside another: with its extension replaced, and with one appended.
pub(crate) fn neighbour(url: &str, extension: &str) -> [String; 2] {
    let (path, query) = split(url);
    let name = file_name(url);
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let folder = &path[..path.len() - name.len()];
    [
        format!("{folder}{stem}.{extension}{query}"),
        format!("{path}.{extension}{query}"),
    ]
}

/// Splits a URL: up to the slash after its host or bucket, the path, and the rest, which may be a
/// key.
pub(crate) fn parts(url: &str) -> [&str; 3] {
    let (named, query) = split(url);
    let host = named.find("://").map_or(0, |at| at + 3);
    let path = named[host..]
        .find('/')
        .map_or(named.len(), |at| host + at + 1);
    [&named[..path], &named[path..], query]
}

/// Returns the prefixes of GDAL's names for files at the same host or in the same bucket; a prefix
/// that contains another comes before it.
pub(crate) fn gdal_names(root: &str) -> Vec<String> {
    let (scheme, host) = root.split_once("://").unwrap_or_default();
    let of_gdal = match scheme {
        "s3" | "s3a" => format!("/vsis3/{host}"),
        "gs" => format!("/vsigs/{host}"),
        "http" | "https" => format!("/vsicurl/{root}"),
        _ => format!("/vsiaz/{}", host.split('@').next().unwrap_or_default()),
    };
    vec![of_gdal, root.to_owned()]
}

/// Splits a URL at the end of its path.
fn split(url: &str) -> (&str, &str) {
    url.split_at(url.find(['?', '#']).unwrap_or(url.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn url_is_distinguished_from_path() {
        for url in [
            "https://h/a.tif",
            "s3://bucket/key",
            "az://c/b?x",
            "abfs+x://a",
        ] {
            assert!(is_url(url), "{url}");
        }
        for path in [
            "a.tif",
            "C:\\a.tif",
            "C://a",
            "/a://b",
            "https://",
            "://x",
            "a b://c",
        ] {
            assert!(!is_url(path), "{path}");
        }
    }

    #[test]
    fn query_key_is_hidden_but_used_in_neighbour_urls() {
        let url = "https://h/d.e/a.b.tif?sig=x/y.z";
        assert_eq!(without_key(Path::new(url)), "https://h/d.e/a.b.tif");
        assert_eq!(without_key(Path::new("what?.tif")), "what?.tif");
        let named = Path::new("https://me:secret@h:81/a@b.tif");
        assert_eq!(without_key(named), "https://h:81/a@b.tif");
        assert_eq!(file_name(url), "a.b.tif");
        assert_eq!(
            neighbour(url, "prj"),
            [
                "https://h/d.e/a.b.prj?sig=x/y.z",
                "https://h/d.e/a.b.tif.prj?sig=x/y.z"
            ]
        );
        assert_eq!(parts(url), ["https://h/", "d.e/a.b.tif", "?sig=x/y.z"]);
        assert_eq!(parts("s3://bucket/a"), ["s3://bucket/", "a", ""]);
        assert_eq!(
            neighbour("s3://b.c/dem", "hdr"),
            ["s3://b.c/dem.hdr", "s3://b.c/dem.hdr"]
        );
    }
}
