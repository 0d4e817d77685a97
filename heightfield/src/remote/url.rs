//! The parts of a URL, as far as file names have them.

use std::path::Path;

/// Whether a name is a URL.
pub fn is_url(name: &str) -> bool {
    let Some((scheme, rest)) = name.split_once("://") else {
        return false;
    };
    let is_word = |c: char| c.is_ascii_alphanumeric() || "+-.".contains(c);
    scheme.len() > 1 && scheme.chars().all(is_word) && !rest.is_empty()
}

/// A path or URL as it is told to the user: without a key.
pub fn without_key(path: &Path) -> String {
    let text = path.display().to_string();
    match is_url(&text) {
        true => in_text(&text),
        false => text,
    }
}

/// The same of a URL: neither what follows its path nor a name and password before the host.
pub(super) fn in_text(url: &str) -> String {
    let (scheme, rest) = shown(url).split_once("://").unwrap_or(("", url));
    let (host, path) = rest.split_at(rest.find('/').unwrap_or(rest.len()));
    let host = host.rsplit('@').next().unwrap_or_default();
    format!("{scheme}://{host}{path}")
}

/// A URL without what follows its path, which may be a key that opens it.
pub(crate) fn shown(url: &str) -> &str {
    split(url).0
}

/// The last part of a URL's path.
pub fn file_name(url: &str) -> &str {
    shown(url).rsplit('/').next().unwrap_or_default()
}

/// The URLs that a file beside another may have: with another extension, and with one
/// behind its own.
pub(crate) fn neighbour(url: &str, extension: &str) -> [String; 2] {
    let (path, rest) = split(url);
    let name = file_name(url);
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let folder = &path[..path.len() - name.len()];
    [
        format!("{folder}{stem}.{extension}{rest}"),
        format!("{path}.{extension}{rest}"),
    ]
}

/// The URL of a file of a name in the folder of another.
pub(crate) fn beside(url: &str, name: &str) -> String {
    let (path, rest) = split(url);
    let mut folder = &path[..path.len() - file_name(url).len()];
    let mut steps = vec![];
    for step in name.split('/') {
        match step {
            "" | "." => {}
            ".." if steps.pop().is_none() => folder = above(folder),
            ".." => {}
            step => steps.push(step),
        }
    }
    format!("{folder}{}{rest}", escaped(&steps.join("/")))
}

/// A name with escapes for what would mean something in a URL.
pub(crate) fn escaped(name: &str) -> String {
    let name = name.replace('%', "%25").replace('#', "%23");
    name.replace('?', "%3F")
}

/// The folder in which a folder lies; the host's own where there is none.
fn above(folder: &str) -> &str {
    let inner = folder.strip_suffix('/').unwrap_or(folder);
    let above = inner.rfind('/').map_or(folder, |at| &folder[..=at]);
    if above.ends_with("://") {
        folder
    } else {
        above
    }
}

/// Up to the path's end, and what follows.
fn split(url: &str) -> (&str, &str) {
    url.split_at(url.find(['?', '#']).unwrap_or(url.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_url_is_told_from_a_path() {
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
    fn a_key_behind_the_path_is_not_shown_and_goes_with_the_neighbours() {
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
        for (name, there) in [
            ("c.tif", "https://h/a/b/c.tif?k"),
            ("./d/../c.tif", "https://h/a/b/c.tif?k"),
            ("../c#1.tif", "https://h/a/c%231.tif?k"),
            ("../../../../c.tif", "https://h/c.tif?k"),
        ] {
            assert_eq!(beside("https://h/a/b/x.vrt?k", name), there);
        }
        assert_eq!(
            neighbour("s3://b.c/dem", "hdr"),
            ["s3://b.c/dem.hdr", "s3://b.c/dem.hdr"]
        );
    }
}
