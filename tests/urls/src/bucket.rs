//! A server of buckets that requires a key. The service that it represents, Google's or
//! Microsoft's, determines its requests for a key and its refusals.

use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::body::{Body, to_bytes};
use axum::extract::{Request, State};
use axum::http::header::{CONTENT_LENGTH, ETAG};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::Response;
use axum::{Router, serve};
use tokio::runtime::Runtime;
use tower_http::services::ServeDir;

/// Upper bound of the size of any file here, bytes.
const MAX: usize = 1 << 30;

/// The public bucket.
pub const PUBLIC: &str = "open";

/// A server on this machine.
pub struct Server {
    url: String,
    log: Arc<Mutex<RequestLog>>,
    _runtime: Runtime,
}

/// Requests to a server, and its answers.
#[derive(Clone, Debug, Default)]
pub struct RequestLog {
    /// Methods, paths and answered statuses.
    pub requests: Vec<String>,
    /// Bytes of files that were sent.
    pub bytes: usize,
}

/// Reason for an answer without a file.
pub(crate) struct Refusal {
    pub(crate) status: StatusCode,
    /// Its code for programs.
    pub(crate) code: &'static str,
    /// Its message for people.
    pub(crate) message: String,
}

/// Answer to an authorised request.
pub(crate) enum Answer {
    /// The file at a path of the served folder.
    File(String),
    /// Another answer, as JSON.
    Text(String),
}

/// The service that the server represents.
pub(crate) trait Service: Send + Sync + 'static {
    /// # Errors
    /// If the key of a request does not permit it.
    fn answer(&self, request: &Parts, body: &str) -> Result<Answer, Refusal>;

    /// Returns the refusal for a missing file.
    fn missing(&self) -> Refusal;

    /// Returns the body and head of a refusal.
    fn words(&self, refusal: &Refusal) -> (String, HeaderMap);

    /// Returns the additional headers of an answer with a file.
    fn head(&self) -> HeaderMap;
}

struct Shared<S> {
    service: S,
    log: Arc<Mutex<RequestLog>>,
}

impl Server {
    /// Serves the subfolders of a folder as buckets.
    ///
    /// # Panics
    /// If no port is free.
    pub(crate) fn of(folder: &Path, service: impl Service) -> Self {
        let log = Arc::<Mutex<RequestLog>>::default();
        let shared = Arc::new(Shared {
            service,
            log: log.clone(),
        });
        let files = Router::new().fallback_service(ServeDir::new(folder));
        let router = files.layer(from_fn_with_state(shared, answered));
        let (port, runtime) = crate::listening(async move |listener| {
            serve(listener, router).await.expect("it serves");
        });
        Self {
            url: format!("http://127.0.0.1:{port}"),
            log,
            _runtime: runtime,
        }
    }

    /// Returns its address.
    #[must_use]
    pub fn endpoint(&self) -> &str {
        &self.url
    }

    /// Takes the requests since the last call.
    #[must_use]
    pub fn take_log(&self) -> RequestLog {
        std::mem::take(&mut lock(&self.log))
    }
}

fn lock(log: &Mutex<RequestLog>) -> MutexGuard<'_, RequestLog> {
    log.lock().unwrap_or_else(PoisonError::into_inner)
}

async fn answered<S: Service>(
    State(shared): State<Arc<Shared<S>>>,
    request: Request,
    next: Next,
) -> Response {
    let request_line = format!("{} {}", request.method(), request.uri().path());
    let (parts, body) = request.into_parts();
    let body = to_bytes(body, MAX).await.unwrap_or_default();
    let answer = shared
        .service
        .answer(&parts, &String::from_utf8_lossy(&body));
    let (response, bytes) = match answer {
        Ok(Answer::File(path)) => served(&shared.service, path, parts, next).await,
        Ok(Answer::Text(text)) => (Response::new(Body::from(text)), 0),
        Err(refusal) => (refused(&shared.service, &refusal), 0),
    };
    let mut log = lock(&shared.log);
    log.requests
        .push(format!("{request_line} {}", response.status()));
    log.bytes += bytes;
    response
}

/// Returns the file at a path of the folder, and the number of its bytes.
async fn served(
    service: &impl Service,
    path: String,
    mut parts: Parts,
    next: Next,
) -> (Response, usize) {
    parts.uri = path.parse().expect("part of a URL");
    let response = next.run(Request::from_parts(parts, Body::empty())).await;
    if response.status() == StatusCode::NOT_FOUND {
        return (refused(service, &service.missing()), 0);
    }
    let (mut head, body) = response.into_parts();
    head.headers.extend(service.head());
    let tag = HeaderValue::from_static("\"0x8DC0FFEE0000001\"");
    head.headers.insert(ETAG, tag);
    let bytes = to_bytes(body, MAX).await.unwrap_or_default();
    let count = bytes.len();
    (Response::from_parts(head, Body::from(bytes)), count)
}

fn refused(service: &impl Service, refusal: &Refusal) -> Response {
    let (text, head) = service.words(refusal);
    let length = text.len();
    let mut response = Response::new(Body::from(text));
    *response.status_mut() = refusal.status;
    response.headers_mut().extend(head);
    response.headers_mut().insert(CONTENT_LENGTH, length.into());
    response
}

/// Returns the bucket of a path.
pub(crate) fn bucket(path: &str) -> &str {
    path.split('/').nth(1).unwrap_or_default()
}

/// Returns a refusal with its own message.
pub(crate) fn refusal(status: StatusCode, code: &'static str, message: &str) -> Refusal {
    Refusal {
        status,
        code,
        message: message.to_owned(),
    }
}

/// Returns the headers of an answer.
pub(crate) fn headers<const N: usize>(of: [(&'static str, &'static str); N]) -> HeaderMap {
    let entry = |(name, value)| {
        let name = HeaderName::from_static(name);
        (name, HeaderValue::from_static(value))
    };
    of.map(entry).into_iter().collect()
}

/// Returns the answer of a server to a key that it exchanges for a token.
pub(crate) fn token(token: &str) -> Answer {
    Answer::Text(format!(
        r#"{{"access_token":"{token}","expires_in":3599,"token_type":"Bearer"}}"#
    ))
}
