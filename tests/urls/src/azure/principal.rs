//! A service principal: a program registered at Microsoft, which exchanges its secret for a token,
//! by the rule of
//! <https://learn.microsoft.com/entra/identity-platform/v2-oauth2-client-creds-grant-flow>.

use axum::http::StatusCode;

use super::shared_key::decoded;
use crate::bucket::{Answer, Refusal, refusal, token};

/// The tenant, name and secret of the only registered one.
pub const PRINCIPAL: [&str; 3] = ["hills-tenant", "surveying", "under the stone"];

/// Its token, in the form that `az account get-access-token` prints.
pub const TOKEN: &str = "eyJ0.of-the-surveying.program";

/// Path for the exchange of the secret.
pub(super) const PATH: &str = "/hills-tenant/oauth2/v2.0/token";

/// # Errors
/// If name or secret are wrong.
pub(super) fn token_for(body: &str) -> Result<Answer, Refusal> {
    let parameter = |name: &str| {
        let mut pairs = body.split('&').filter_map(|pair| pair.split_once('='));
        let pair = pairs.find(|(other, _)| *other == name);
        decoded(&pair.map_or("", |(_, value)| value).replace('+', " "))
    };
    let [_, name, secret] = PRINCIPAL;
    let is_known = parameter("client_id") == name
        && parameter("client_secret") == secret
        && parameter("grant_type") == "client_credentials"
        && parameter("scope") == "https://storage.azure.com/.default";
    let why = "AADSTS7000215: Invalid client secret provided.";
    match is_known {
        true => Ok(token(TOKEN)),
        false => Err(refusal(StatusCode::UNAUTHORIZED, "invalid_client", why)),
    }
}

/// # Errors
/// If it is not the token of the registered program.
pub(super) fn check(authorization: &str) -> Result<(), Refusal> {
    let why = "Server failed to authenticate the request.";
    match authorization.strip_prefix("Bearer ") == Some(TOKEN) {
        true => Ok(()),
        false => Err(refusal(
            StatusCode::UNAUTHORIZED,
            "InvalidAuthenticationInfo",
            why,
        )),
    }
}
