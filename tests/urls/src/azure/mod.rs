//! A server of containers with the API of Azure Blob Storage.
//!
//! A request is signed with the account's key (`shared_key`), has a shared access signature made
//! with that key (`sas`), or has the token of a registered program (`principal`). The server
//! computes signatures again by Microsoft's documented rules, without code of the client.

mod principal;
mod sas;
mod shared_key;

use std::path::Path;

use axum::http::header::AUTHORIZATION;
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
pub use principal::{PRINCIPAL, TOKEN};
use ring::hmac::{HMAC_SHA256, Key, sign};

use crate::bucket::{Answer, PUBLIC, Refusal, Server, Service, bucket, headers, refusal};

/// A storage account.
#[derive(Clone, Copy)]
pub struct Account {
    /// Its name.
    pub name: &'static str,
    /// Its key, in base 64.
    pub key: &'static str,
    /// True if its containers may be public.
    is_public_allowed: bool,
}

/// An account with Microsoft's present defaults: nothing in it is public. Its key was made for
/// these tests and gives access to nothing else.
pub const SURVEYORS: Account = Account {
    name: "surveyors",
    key: "c3VydmV5b3JzIGtub3cgdGhlIGhpbGxzIGJ5IHRoZWlyIGhlaWdodHMsIGFuZCB0aGUgaGlsbHMgZG8gbm90Lg==",
    is_public_allowed: false,
};
/// The account of Microsoft's emulators, whose key is public.
pub const EMULATOR: Account = Account {
    name: "devstoreaccount1",
    key: "Eby8vdM02xNOcqFlqUwJPLlmEtlCDXJ1OUzFT50uSRZ6IFsuFq2UVErCz4I6tq/K1SZFPTOtr/KBHBeksoGMGw==",
    is_public_allowed: true,
};

impl Account {
    /// Returns a shared access signature with which a container may be read until a time such as
    /// `2030-01-31T00:00:00Z`.
    #[must_use]
    pub fn sas(&self, container: &str, until: &str) -> String {
        sas::made(self, container, until)
    }

    /// Returns the signature of a text, in base 64.
    fn signature(&self, text: &str) -> String {
        let key = BASE64_STANDARD.decode(self.key).expect("a key");
        let signature = sign(&Key::new(HMAC_SHA256, &key), text.as_bytes());
        BASE64_STANDARD.encode(signature)
    }
}

/// Serves the subfolders of a folder as containers of an account.
#[must_use]
pub fn served(folder: &Path, account: Account) -> Server {
    Server::of(folder, Microsoft(account))
}

struct Microsoft(Account);

impl Service for Microsoft {
    fn answer(&self, request: &Parts, body: &str) -> Result<Answer, Refusal> {
        let Self(account) = self;
        let path = request.uri.path();
        if path == principal::PATH {
            return principal::token_for(body);
        }
        // An emulator is not a host of the account's: the path begins with the account.
        let own = format!("/{}/", account.name);
        let within = path.strip_prefix(&own);
        let path = within.map_or(path.to_owned(), |rest| format!("/{rest}"));
        let authorization = request.headers.get(AUTHORIZATION);
        match authorization.map(|authorization| authorization.to_str().unwrap_or_default()) {
            Some(authorization) if authorization.starts_with("Bearer ") => {
                principal::check(authorization)?;
            }
            Some(authorization) => shared_key::check(account, request, authorization)?,
            None if sas::is_in(request) => sas::check(account, request, bucket(&path))?,
            None => check_public(account, bucket(&path))?,
        }
        Ok(Answer::File(path))
    }

    fn missing(&self) -> Refusal {
        let why = "The specified blob does not exist.";
        refusal(StatusCode::NOT_FOUND, "BlobNotFound", why)
    }

    fn words(&self, refusal: &Refusal) -> (String, HeaderMap) {
        let Refusal { code, message, .. } = refusal;
        let text = format!(
            "\u{feff}<?xml version=\"1.0\" encoding=\"utf-8\"?><Error><Code>{code}</Code><Message>{message}\nRequestId:5a7e0000\nTime:2026-01-31T00:00:00.0000000Z</Message></Error>"
        );
        let mut head = headers([("content-type", "application/xml")]);
        head.insert("x-ms-error-code", HeaderValue::from_static(code));
        (text, head)
    }

    fn head(&self) -> HeaderMap {
        headers([
            ("server", "Windows-Azure-Blob/1.0 Microsoft-HTTPAPI/2.0"),
            ("x-ms-version", "2023-11-03"),
            ("x-ms-request-id", "5a7e0000"),
            ("x-ms-blob-type", "BlockBlob"),
        ])
    }
}

/// Checks that a container may be read without a key.
fn check_public(account: &Account, container: &str) -> Result<(), Refusal> {
    if !account.is_public_allowed {
        let why = "Public access is not permitted on this storage account.";
        return Err(refusal(
            StatusCode::CONFLICT,
            "PublicAccessNotPermitted",
            why,
        ));
    }
    if container != PUBLIC {
        let why = "Server failed to authenticate the request. Please refer to the information in the www-authenticate header.";
        return Err(refusal(
            StatusCode::UNAUTHORIZED,
            "NoAuthenticationInformation",
            why,
        ));
    }
    Ok(())
}

/// Returns the refusal of an invalid signature.
fn failed(why: &str) -> Refusal {
    let message = format!(
        "Server failed to authenticate the request. Make sure the value of Authorization header is formed correctly including the signature. {why}"
    );
    refusal(StatusCode::FORBIDDEN, "AuthenticationFailed", &message)
}
