//! Shared access signatures of a container, by the rule of
//! <https://learn.microsoft.com/rest/api/storageservices/create-service-sas> for the versions
//! from 2020-12-06 on.

use axum::http::request::Parts;
use jiff::Timestamp;
use percent_encoding::{NON_ALPHANUMERIC, utf8_percent_encode};

use super::shared_key::decoded;
use super::{Account, failed};
use crate::bucket::Refusal;

/// The version of the rule.
const VERSION: &str = "2023-11-03";

/// Returns a signature with which a container may be read until this time.
pub(super) fn made(account: &Account, container: &str, until: &str) -> String {
    let text = string_to_sign(
        account,
        container,
        ["r", "", until, "https,http", VERSION, "c"],
    );
    let signature = account.signature(&text);
    let [until, signature] =
        [until, &signature].map(|text| utf8_percent_encode(text, NON_ALPHANUMERIC).to_string());
    format!("sp=r&se={until}&spr=https,http&sv={VERSION}&sr=c&sig={signature}")
}

/// Returns true if a request has one.
pub(super) fn is_in(request: &Parts) -> bool {
    let query = request.uri.query().unwrap_or_default();
    query.split('&').any(|pair| pair.starts_with("sig="))
}

/// # Errors
/// If a request's signature was not made with the account's key, or has expired.
pub(super) fn check(account: &Account, request: &Parts, container: &str) -> Result<(), Refusal> {
    let query = request.uri.query().unwrap_or_default();
    let parameter = |name: &str| {
        let mut pairs = query.split('&').filter_map(|pair| pair.split_once('='));
        let pair = pairs.find(|(other, _)| *other == name);
        decoded(pair.map_or("", |(_, value)| value))
    };
    let parts = ["sp", "st", "se", "spr", "sv", "sr"].map(parameter);
    let parts = parts.each_ref().map(String::as_str);
    let text = string_to_sign(account, container, parts);
    if parameter("sig") != account.signature(&text) {
        return Err(failed("Signature did not match."));
    }
    let [may, _, until, ..] = parts;
    let holds = until
        .parse()
        .is_ok_and(|until: Timestamp| Timestamp::now() < until);
    if !holds || !may.contains('r') {
        return Err(failed(
            "Signature not valid in the specified time frame, or for reading.",
        ));
    }
    Ok(())
}

fn string_to_sign(
    account: &Account,
    container: &str,
    [may, from, until, protocols, version, of]: [&str; 6],
) -> String {
    let resource = format!("/blob/{}/{container}", account.name);
    // Policy and address; snapshot, encryption, and five headers of the answer.
    let [policy, address] = [""; 2];
    let rest = [""; 7].join("\n");
    [
        may, from, until, &resource, policy, address, protocols, version, of, &rest,
    ]
    .join("\n")
}
