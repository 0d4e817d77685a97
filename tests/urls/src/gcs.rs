//! A server of buckets with the XML API of Google Cloud Storage.
//!
//! A service account signs its requests itself: each has a token (RFC 7519) that names the account
//! and its key, signed with that key (AIP-4111). The server has the keys, as Google does, and
//! verifies tokens without code of the client.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use axum::http::header::AUTHORIZATION;
use axum::http::request::Parts;
use axum::http::{HeaderMap, StatusCode};
use base64::Engine as _;
use base64::prelude::{BASE64_STANDARD, BASE64_URL_SAFE_NO_PAD};
use ring::signature::{KeyPair as _, RSA_PKCS1_2048_8192_SHA256, RsaKeyPair, UnparsedPublicKey};
use serde_json::{Value, json};

use crate::bucket::{Answer, PUBLIC, Refusal, Server, Service, bucket, headers, refusal, token};

/// Scopes with which a service account may read files.
const SCOPES: [&str; 3] = [
    "https://www.googleapis.com/auth/cloud-platform",
    "https://www.googleapis.com/auth/devstorage.read_only",
    "https://www.googleapis.com/auth/devstorage.full_control",
];
/// Longest validity of a token, seconds.
const MAX: u64 = 3600;

/// A token of an account that may read everything, as `gcloud auth print-access-token` prints it.
pub const TOKEN: &str = "ya29.a0-of-the-surveyor";

/// A service account. Its key was made for these tests and gives access to nothing else.
pub struct Account {
    mail: &'static str,
    key_id: &'static str,
    pem: &'static str,
}

/// An account that may read all buckets.
pub const SURVEYOR: Account = Account {
    mail: "surveyor@hills.iam.gserviceaccount.com",
    key_id: "5f1d",
    pem: include_str!("keys/surveyor.pem"),
};
/// A valid account that may read none.
pub const UNPRIVILEGED: Account = Account {
    mail: "stranger@hills.iam.gserviceaccount.com",
    key_id: "08a7",
    pem: include_str!("keys/stranger.pem"),
};

impl Account {
    /// Returns the account's file in Google's format, with the key of `other`.
    #[must_use]
    pub fn file_with_key_of(&self, other: &Self) -> String {
        json!({
            "type": "service_account",
            "project_id": "hills",
            "private_key_id": self.key_id,
            "private_key": other.pem,
            "client_email": self.mail,
            "client_id": "1000",
            "auth_uri": "https://accounts.google.com/o/oauth2/auth",
            "token_uri": "https://oauth2.googleapis.com/token",
            "universe_domain": "googleapis.com",
        })
        .to_string()
    }

    /// Returns the account's file in Google's format.
    #[must_use]
    pub fn file(&self) -> String {
        self.file_with_key_of(self)
    }

    fn has_signed(&self, text: &str, signature: &[u8]) -> bool {
        let lines = self.pem.lines().filter(|line| !line.starts_with('-'));
        let der = BASE64_STANDARD.decode(lines.collect::<String>());
        let pair = RsaKeyPair::from_pkcs8(&der.expect("a key")).expect("a key");
        let public = pair.public_key().as_ref();
        UnparsedPublicKey::new(&RSA_PKCS1_2048_8192_SHA256, public)
            .verify(text.as_bytes(), signature)
            .is_ok()
    }
}

/// Serves the subfolders of a folder as buckets.
#[must_use]
pub fn served(folder: &Path) -> Server {
    Server::of(folder, Google)
}

struct Google;

impl Service for Google {
    fn answer(&self, request: &Parts, _: &str) -> Result<Answer, Refusal> {
        let path = request.uri.path();
        // The request of a computer in Google's cloud for a token.
        if path == "/computeMetadata/v1/instance/service-accounts/default/token" {
            let is_asked = request.headers.contains_key("metadata-flavor");
            return is_asked.then(|| token(TOKEN)).ok_or_else(|| denied("This"));
        }
        let file = Answer::File(path.to_owned());
        let Some(authorization) = request.headers.get(AUTHORIZATION) else {
            return match bucket(path) {
                PUBLIC => Ok(file),
                _ => Err(denied("Anonymous caller")),
            };
        };
        // A token is checked even if none is needed.
        let authorization = authorization.to_str().ok();
        match authorization.and_then(|authorization| holder(authorization.strip_prefix("Bearer ")?))
        {
            Some(mail) if mail == SURVEYOR.mail => Ok(file),
            Some(mail) => Err(denied(mail)),
            None => Err(refusal(
                StatusCode::UNAUTHORIZED,
                "AuthenticationRequired",
                "Authentication required.",
            )),
        }
    }

    fn missing(&self) -> Refusal {
        let why = "The specified key does not exist.";
        refusal(StatusCode::NOT_FOUND, "NoSuchKey", why)
    }

    fn words(&self, Refusal { code, message, .. }: &Refusal) -> (String, HeaderMap) {
        let text = format!(
            "<?xml version='1.0' encoding='UTF-8'?><Error><Code>{code}</Code><Message>{message}</Message></Error>"
        );
        let head = headers([("content-type", "application/xml; charset=UTF-8")]);
        (text, head)
    }

    fn head(&self) -> HeaderMap {
        headers([
            ("x-goog-generation", "1700000000000001"),
            ("x-goog-metageneration", "1"),
            ("x-goog-storage-class", "STANDARD"),
        ])
    }
}

fn denied(who: &str) -> Refusal {
    let why = "does not have storage.objects.get access to the Google Cloud Storage object.";
    let message = format!("{who} {why}");
    refusal(StatusCode::FORBIDDEN, "AccessDenied", &message)
}

/// Returns the account of a token, or `None` if the token is unknown or invalid.
fn holder(token: &str) -> Option<&'static str> {
    if token == TOKEN {
        return Some(SURVEYOR.mail);
    }
    let (signed, signature) = token.rsplit_once('.')?;
    let (head, claims) = signed.split_once('.')?;
    let [head, claims] = [head, claims].map(decoded);
    let (head, claims) = (head?, claims?);
    let account = [SURVEYOR, UNPRIVILEGED]
        .into_iter()
        .find(|account| head["kid"] == account.key_id && claims["iss"] == account.mail)?;
    let signature = BASE64_URL_SAFE_NO_PAD.decode(signature).ok()?;
    let now = SystemTime::now().duration_since(UNIX_EPOCH).ok()?.as_secs();
    let [made, ends] = ["iat", "exp"].map(|name| claims[name].as_u64());
    let (made, ends) = (made?, ends?);
    let holds = made <= now && now < ends && ends <= made + MAX;
    let scopes = claims["scope"].as_str()?;
    let may_read = scopes.split(' ').any(|scope| SCOPES.contains(&scope));
    let is_signed = head["alg"] == "RS256" && account.has_signed(signed, &signature);
    (holds && may_read && is_signed).then_some(account.mail)
}

fn decoded(part: &str) -> Option<Value> {
    let bytes = BASE64_URL_SAFE_NO_PAD.decode(part).ok()?;
    serde_json::from_slice(&bytes).ok()
}
