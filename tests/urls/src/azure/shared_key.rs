//! Requests that are signed with an account's key, by the rule of
//! <https://learn.microsoft.com/rest/api/storageservices/authorize-with-shared-key>.

use axum::http::request::Parts;
use jiff::fmt::rfc2822;
use jiff::{SignedDuration, Timestamp};
use percent_encoding::percent_decode_str;

use super::{Account, failed};
use crate::bucket::Refusal;

/// Largest difference of a request's time from the server's.
const OLDEST: SignedDuration = SignedDuration::from_mins(15);

/// # Errors
/// If the request is not signed with the key of the account, or is too old.
pub(super) fn check(
    account: &Account,
    request: &Parts,
    authorization: &str,
) -> Result<(), Refusal> {
    let date = header(request, "x-ms-date");
    let date = if date.is_empty() {
        header(request, "date")
    } else {
        date
    };
    let date = rfc2822::parse(date).map_err(|_| failed("There is no date."))?;
    let age = Timestamp::now().duration_since(date.timestamp());
    if age.abs() > OLDEST {
        return Err(failed("The date is too old."));
    }
    let signature = account.signature(&string_to_sign(account.name, request));
    match authorization == format!("SharedKey {}:{signature}", account.name) {
        true => Ok(()),
        false => Err(failed("The signature did not match.")),
    }
}

fn string_to_sign(account: &str, request: &Parts) -> String {
    const SIGNED: [&str; 11] = [
        "content-encoding",
        "content-language",
        "content-length",
        "content-md5",
        "content-type",
        "date",
        "if-modified-since",
        "if-match",
        "if-none-match",
        "if-unmodified-since",
        "range",
    ];
    let is_dated = !header(request, "x-ms-date").is_empty();
    let values = SIGNED.map(|name| match (name, header(request, name)) {
        ("content-length", "0") => "",
        ("date", _) if is_dated => "",
        (_, value) => value,
    });
    format!(
        "{}\n{}\n{}{}",
        request.method,
        values.join("\n"),
        own_headers(request),
        resource(account, request)
    )
}

fn header<'a>(request: &'a Parts, name: &str) -> &'a str {
    let value = request.headers.get(name);
    value
        .and_then(|value| value.to_str().ok())
        .unwrap_or_default()
}

/// Returns Microsoft's own headers in order, one a line.
fn own_headers(request: &Parts) -> String {
    let names = request.headers.keys().map(|name| name.as_str());
    let mut names: Vec<&str> = names.filter(|name| name.starts_with("x-ms-")).collect();
    names.sort_unstable();
    let line = |name: &&str| format!("{name}:{}\n", header(request, name).trim());
    values(&names, line)
}

/// Returns the account, the path as in the URL, and the query's parameters in order, one a line.
fn resource(account: &str, request: &Parts) -> String {
    let query = request.uri.query().unwrap_or_default();
    let pairs = query.split('&').filter_map(|pair| pair.split_once('='));
    let mut pairs: Vec<(String, String)> = pairs
        .map(|(name, value)| (name.to_lowercase(), decoded(value)))
        .collect();
    pairs.sort();
    let line = |(name, value): &(String, String)| format!("\n{name}:{value}");
    format!("/{account}{}{}", request.uri.path(), values(&pairs, line))
}

fn values<T>(of: &[T], line: impl Fn(&T) -> String) -> String {
    of.iter().map(line).collect()
}

/// Returns a part of a query without its escapes.
pub(super) fn decoded(text: &str) -> String {
    percent_decode_str(text).decode_utf8_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use axum::http::Request;

    use super::*;

    /// The example from Microsoft's page.
    #[test]
    fn string_to_sign_matches_microsofts_example() {
        let request = Request::get("http://myaccount.blob.core.windows.net/mycontainer?restype=container&comp=metadata&timeout=20")
            .header("x-ms-version", "2015-02-21")
            .header("x-ms-date", "Fri, 26 Jun 2015 23:39:12 GMT")
            .header("date", "Fri, 26 Jun 2015 23:39:12 GMT")
            .header("content-length", "0");
        let (request, ()) = request.body(()).expect("a request").into_parts();
        assert_eq!(
            string_to_sign("myaccount", &request),
            "GET\n\n\n\n\n\n\n\n\n\n\n\nx-ms-date:Fri, 26 Jun 2015 23:39:12 GMT\nx-ms-version:2015-02-21\n/myaccount/mycontainer\ncomp:metadata\nrestype:container\ntimeout:20"
        );
    }
}
