//! Converts errors of `object_store` to one-line messages that the user can act on.

use std::io::{Error, ErrorKind};

use object_store::Error as StoreError;

use super::OUTAGE;
use super::redirects::RedirectError;
use super::url::{is_url, without_credentials};
use crate::printable_text::printable;

/// Max characters of a server's response in a message.
const MAX_SHOWN: usize = 300;

/// Parts of the URLs at which a virtual machine of Amazon, Google or Microsoft requests its own
/// key. Other computers have no such server.
const METADATA_PATHS: [&str; 4] = [
    "/latest/api/token",
    "/latest/meta-data/",
    "/computeMetadata/",
    "/metadata/identity/",
];

/// Returns true if the server answers a range request with the whole file.
pub(super) fn is_without_ranges(error: &StoreError) -> bool {
    // The library's own errors differ only in their texts.
    let text = match error {
        StoreError::NotSupported { source } | StoreError::Generic { source, .. } => {
            source.to_string()
        }
        _ => return false,
    };
    text.contains("Range request not supported") || text.contains("non-partial response")
}

/// Returns the error for a wrong URL or a wrong environment variable.
pub(super) fn configuration_error(error: &dyn std::error::Error) -> Error {
    let text = error.to_string();
    let why = match text.contains("Account must be specified") {
        true => "the environment names no storage account".into(),
        false => in_short(&text),
    };
    Error::new(ErrorKind::InvalidInput, why)
}

/// Returns the error for a server's response at opening, where missing environment variables show
/// first.
pub(super) fn at_opening(error: &StoreError) -> Error {
    let invalid = |why: String| Error::new(ErrorKind::InvalidInput, why);
    let text = match error {
        StoreError::Generic { store, .. } if *store != "HTTP" => error.to_string(),
        _ => return reported(error),
    };
    if METADATA_PATHS.iter().any(|part| text.contains(part)) {
        return invalid(
            "the environment contains no key, and this computer has none of its own".into(),
        );
    }
    let is_refused = ["400", "401", "403"]
        .iter()
        .any(|status| has_status(error, status));
    if text.contains("token request") && is_refused {
        return invalid(format!(
            "the key of the environment was refused: {}",
            in_short(&text)
        ));
    }
    if text.contains("builder error") {
        return invalid(in_short(&with_cause(error)));
    }
    if text.contains("incorrectly configured region") {
        return invalid("the bucket is in another region".into());
    }
    reported(error)
}

/// Returns the error for a server's response.
pub(super) fn reported(error: &StoreError) -> Error {
    if let Some(why) = redirect_error(error) {
        return Error::new(ErrorKind::Unsupported, why.to_string());
    }
    let kind = match error {
        StoreError::NotFound { .. } => {
            return Error::new(ErrorKind::NotFound, "there is no such file");
        }
        _ if has_status(error, "410") => {
            return Error::new(ErrorKind::NotFound, "there is no such file any more");
        }
        // The file has no first byte.
        _ if has_status(error, "416") => {
            return Error::new(ErrorKind::NotFound, "the file is empty");
        }
        StoreError::PermissionDenied { .. } | StoreError::Unauthenticated { .. } => {
            return forbidden(error);
        }
        // Microsoft's servers respond so if nothing in an account is public.
        _ if code(&error.to_string()) == Some("PublicAccessNotPermitted") => {
            return forbidden(error);
        }
        // Microsoft's servers also respond so for archived files, and others for files that are
        // being changed. The library interprets it as an error of a write.
        StoreError::AlreadyExists { .. } => {
            let why = "its server does not provide it";
            return Error::new(ErrorKind::Unsupported, with_code(why, error));
        }
        _ if has_status(error, "400") && code(&error.to_string()).is_some() => {
            let why = match error {
                StoreError::Generic { store: "HTTP", .. } => "the server rejects the URL",
                _ => "the server rejects the settings of the environment",
            };
            return Error::new(ErrorKind::InvalidInput, with_code(why, error));
        }
        StoreError::InvalidPath { .. } | StoreError::UnknownConfigurationKey { .. } => {
            ErrorKind::InvalidInput
        }
        _ => OUTAGE,
    };
    Error::new(kind, in_short(&with_cause(error)))
}

/// Returns the redirect error that caused an error, if any.
fn redirect_error(error: &StoreError) -> Option<&RedirectError> {
    let first: &dyn std::error::Error = error;
    let mut causes = std::iter::successors(Some(first), |cause| cause.source());
    causes.find_map(|cause| cause.downcast_ref())
}

fn forbidden(error: &StoreError) -> Error {
    let why = "reading it requires a key";
    Error::new(ErrorKind::PermissionDenied, with_code(why, error))
}

fn has_status(error: &StoreError, status: &str) -> bool {
    error
        .to_string()
        .contains(&format!("status code: {status}"))
}

fn with_code(why: &str, error: &StoreError) -> String {
    match code(&error.to_string()) {
        Some(code) => format!("{why}: the server reports {code}"),
        None => why.into(),
    }
}

/// Returns the error code in a server's response, in the format of Amazon, Google and Microsoft.
fn code(text: &str) -> Option<&str> {
    let (_, rest) = text.split_once("<Code>")?;
    let (code, _) = rest.split_once("</Code>")?;
    let is_word = code.len() < 80 && code.chars().all(|c| c.is_ascii_alphanumeric());
    is_word.then_some(code)
}

/// Returns the text of an error, with its cause if the text does not include it.
fn with_cause(error: &StoreError) -> String {
    let text = error.to_string();
    let mut last: &dyn std::error::Error = error;
    while let Some(cause) = last.source() {
        last = cause;
    }
    let cause = last.to_string();
    match text.contains(&cause) {
        true => text,
        false => format!("{text}: {cause}"),
    }
}

/// Shortens a text to one readable line without keys.
fn in_short(text: &str) -> String {
    // The library's name for the server is redundant beside the URL.
    let named = text.strip_prefix("Generic ");
    let named = named.and_then(|text| text.split_once(" error: "));
    let text = named.map_or(text, |(_, text)| text);
    // The text after the status is HTML for a browser.
    let status = text.find("status code: ").map_or(0, |at| at + 13);
    let end = text[status..].find(':').filter(|_| status > 0);
    let text = end.map_or(text, |end| &text[..status + end]);
    let word = |word: &str| match is_url(word) {
        true => without_credentials(word),
        false => word.to_owned(),
    };
    let words: Vec<String> = text.split_whitespace().map(word).collect();
    printable(&words.join(" "))
        .chars()
        .take(MAX_SHOWN)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn server_text_is_shortened_to_one_line_without_secrets() {
        let response =
            "GET https://h/a.tif?sig=secret:\n\t500 \u{1b}[2J".to_owned() + &" x".repeat(900);
        let reported = in_short(&response);
        assert!(
            reported.starts_with("GET https://h/a.tif 500 \\u{1b}[2J x"),
            "{reported}"
        );
        assert!(reported.len() <= MAX_SHOWN);
        let page = "Server returned status code: 400 Bad Request: <html>?sig=secret";
        assert_eq!(
            in_short(page),
            "Server returned status code: 400 Bad Request"
        );
    }

    fn generic(text: &str) -> StoreError {
        StoreError::Generic {
            store: "S3",
            source: text.into(),
        }
    }

    #[test]
    fn environment_errors_are_permanent_only_at_opening() {
        for (text, why) in [
            (
                "Error performing PUT http://169.254.169.254/latest/api/token in 1s",
                "contains no key",
            ),
            (
                "Received redirect without LOCATION, this normally indicates an incorrectly configured region",
                "another region",
            ),
        ] {
            let error = at_opening(&generic(text));
            assert_eq!(error.kind(), ErrorKind::InvalidInput);
            assert!(error.to_string().contains(why), "{error}");
            // For an open file, a retry may succeed.
            assert_eq!(reported(&generic(text)).kind(), OUTAGE);
        }
    }

    #[test]
    fn server_error_code_is_reported_only_if_well_formed() {
        let response = |body: &str| {
            let text = format!("Server returned non-2xx status code: 400 Bad Request: {body}");
            reported(&generic(&text)).to_string()
        };
        let expired = response("<Error><Code>ExpiredToken</Code></Error>");
        assert!(
            expired.ends_with("the server reports ExpiredToken"),
            "{expired}"
        );
        let page = response("<Code>see https://h?sig=secret</Code>");
        assert!(page.ends_with("400 Bad Request"), "{page}");
    }
}
