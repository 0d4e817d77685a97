//! Requests: redirects follow the rules of `redirects`, and the bodies of errors are truncated,
//! because the library would read an endless error page until memory is full.

use std::future::Future;
use std::pin::Pin;
use std::time::Duration;

use futures_util::StreamExt;
use object_store::client::{
    ClientConfigKey as Key, HttpClient, HttpConnector, HttpError, HttpErrorKind, HttpRequest,
    HttpResponse, HttpResponseBody, HttpService,
};
use object_store::{ClientOptions, Error};
use reqwest::header::LOCATION;
use reqwest::redirect::Policy;
use reqwest::tls::Certificate;
use reqwest::{Client, NoProxy, Proxy, Url};

use super::redirects::{self, RedirectError};

/// Max bytes of an error's body; some hundred of them are shown.
const MAX_ERROR_BYTES: usize = 1 << 16;
/// Max number of successive redirects.
const MAX_REDIRECTS: usize = 10;

/// A factory of clients for servers.
#[derive(Debug, Default)]
pub(super) struct Connector;

impl HttpConnector for Connector {
    fn connect(&self, options: &ClientOptions) -> object_store::Result<HttpClient> {
        let client = client(options).map_err(|error| Error::Generic {
            store: "HTTP client",
            source: Box::new(error),
        })?;
        Ok(HttpClient::new(Requests(HttpClient::new(client))))
    }
}

/// Creates a client that does not follow redirects itself: it would send keys and a `Referer`.
fn client(options: &ClientOptions) -> reqwest::Result<Client> {
    let value = |key: Key| options.get_config_value(&key);
    let is_on = |key: Key| value(key).is_some_and(|text| text.parse() == Ok(true));
    // All are in whole seconds (`servers`), or the library's default of one second.
    let seconds = |key: Key| {
        let text = value(key)?;
        let digits = text.split(|c: char| !c.is_ascii_digit()).next()?;
        digits.parse().ok().map(Duration::from_secs)
    };
    let mut builder = Client::builder()
        .user_agent(concat!(
            env!("CARGO_PKG_NAME"),
            "/",
            env!("CARGO_PKG_VERSION")
        ))
        .redirect(Policy::none())
        .referer(false)
        .http1_only()
        .https_only(!is_on(Key::AllowHttp))
        .tls_danger_accept_invalid_certs(is_on(Key::AllowInvalidCertificates));
    if let Some(headers) = options.get_default_headers() {
        builder = builder.default_headers(headers.clone());
    }
    if let Some(timeout) = seconds(Key::Timeout) {
        builder = builder.timeout(timeout);
    }
    if let Some(timeout) = seconds(Key::ReadTimeout) {
        builder = builder.read_timeout(timeout);
    }
    if let Some(timeout) = seconds(Key::ConnectTimeout) {
        builder = builder.connect_timeout(timeout);
    }
    if let Some(proxy) = value(Key::ProxyUrl) {
        let excluded = value(Key::ProxyExcludes).and_then(|hosts| NoProxy::from_string(&hosts));
        builder = builder.proxy(Proxy::all(proxy)?.no_proxy(excluded));
        if let Some(certificate) = value(Key::ProxyCaCertificate) {
            let certificate = Certificate::from_pem(certificate.as_bytes())?;
            builder = builder.tls_certs_merge([certificate]);
        }
    }
    builder.build()
}

/// Makes requests by the module's rules.
#[derive(Debug)]
struct Requests(HttpClient);

impl HttpService for Requests {
    fn call<'s, 'f>(
        &'s self,
        request: HttpRequest,
    ) -> Pin<Box<dyn Future<Output = Result<HttpResponse, HttpError>> + Send + 'f>>
    where
        's: 'f,
        Self: 'f,
    {
        Box::pin(async move {
            let response = self.follow_redirects(request).await?;
            Ok(match response.status().is_success() {
                true => response,
                false => truncate(response).await,
            })
        })
    }
}

impl Requests {
    /// Returns the response after all redirects.
    async fn follow_redirects(&self, mut request: HttpRequest) -> Result<HttpResponse, HttpError> {
        for _ in 0..=MAX_REDIRECTS {
            let response = self.0.execute(request.clone()).await?;
            let location = response.headers().get(LOCATION);
            let (true, Some(location)) = (response.status().is_redirection(), location) else {
                return Ok(response);
            };
            // Requests that send data are not redirected.
            if !request.method().is_safe() {
                return Ok(response);
            }
            let location = String::from_utf8_lossy(location.as_bytes());
            let to = redirect_target(&request, &location).map_err(refused)?;
            let uri = to.as_str().parse();
            *request.uri_mut() = uri.map_err(|_| refused(RedirectError::NotAUrl))?;
        }
        Err(refused(RedirectError::TooMany))
    }
}

/// Returns the target of a redirect.
fn redirect_target(request: &HttpRequest, location: &str) -> Result<Url, RedirectError> {
    let from = Url::parse(&request.uri().to_string()).map_err(|_| RedirectError::NotAUrl)?;
    let has_key = redirects::has_key(&from, request.headers());
    redirects::target(&from, location, has_key)
}

fn refused(why: RedirectError) -> HttpError {
    // Errors of this kind are not retried.
    HttpError::new(HttpErrorKind::Unknown, why)
}

/// Truncates a response to [`MAX_ERROR_BYTES`]. If it breaks off, the received part is returned.
async fn truncate(response: HttpResponse) -> HttpResponse {
    let (parts, body) = response.into_parts();
    let mut stream = body.bytes_stream();
    let mut bytes = Vec::new();
    while bytes.len() < MAX_ERROR_BYTES
        && let Some(Ok(part)) = stream.next().await
    {
        let capacity = MAX_ERROR_BYTES - bytes.len();
        bytes.extend_from_slice(part.get(..capacity).unwrap_or(&part));
    }
    HttpResponse::from_parts(parts, HttpResponseBody::from(bytes))
}
