//! A server of a folder's files, in ranges, with injected faults.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use axum::body::{Body, Bytes, to_bytes};
use axum::extract::{Request, State};
use axum::http::header::{CONTENT_RANGE, ETAG, LOCATION, RANGE};
use axum::http::{HeaderValue, StatusCode};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::{Router, serve};
use tokio::runtime::Runtime;
use tokio::sync::watch;
use tower_http::services::ServeDir;

/// Upper bound of the size of any file here, bytes.
const MAX: usize = 1 << 30;

/// A server on this machine.
pub struct Server {
    url: String,
    shared: Arc<Shared>,
    _runtime: Runtime,
}

/// Fault of an answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fault {
    /// Nothing.
    #[default]
    None,
    /// The server reports an error.
    Error500,
    /// The file may not be read.
    Forbidden,
    /// The connection ends in the middle.
    Cut,
    /// Another range is sent than requested, and declared.
    OtherRange,
    /// Fewer bytes are sent than declared.
    Short,
    /// More bytes are sent than requested, with the header of the requested ones.
    Endless,
    /// A page for a browser is sent, as by sites that have one for every name.
    Page,
    /// Ranges are not supported.
    NoRanges,
    /// The file does not exist, with a page of 64 MB as the error.
    LongError,
    /// The file is at another URL ([`Server::redirect`]).
    Redirect,
}

struct Shared {
    state: Mutex<Faults>,
    /// False while answers are held back.
    is_open: watch::Sender<bool>,
}

#[derive(Default)]
struct Faults {
    fault: Fault,
    /// Number of faulty answers; the next ones are right again.
    count: usize,
    /// Suffix of the affected files' names.
    of: String,
    /// True if only data after a file's beginning is affected.
    is_beyond: bool,
    latency: Duration,
    /// Suffixes of the files whose answers are held back; if empty, all are.
    held_endings: Vec<String>,
    /// The version of all files.
    version: u32,
    requests: Vec<String>,
    /// Names of the headers of all requests.
    headers: BTreeSet<String>,
    /// Target of redirects.
    redirect: String,
    bytes: usize,
    /// Requests that wait for their answers: now, and the most at once.
    concurrent: [usize; 2],
}

impl Server {
    /// Serves the files of a folder.
    ///
    /// # Panics
    /// If no port is free.
    #[must_use]
    pub fn of(folder: &Path) -> Self {
        let shared = Arc::new(Shared {
            state: Mutex::default(),
            is_open: watch::Sender::new(true),
        });
        let files = Router::new().fallback_service(ServeDir::new(folder));
        let router = files.layer(from_fn_with_state(shared.clone(), between));
        let (port, runtime) = crate::listening(async move |listener| {
            serve(listener, router).await.expect("it serves");
        });
        Self {
            url: format!("http://127.0.0.1:{port}"),
            shared,
            _runtime: runtime,
        }
    }

    /// Returns the URL of a file of the folder.
    #[must_use]
    pub fn url(&self, name: &str) -> String {
        format!("{}/{name}", self.url)
    }

    /// Makes the next `count` answers faulty.
    pub fn fail(&self, fault: Fault, count: usize) {
        self.fail_at("", fault, count);
    }

    /// Makes all answers about a TIFF redirect to a URL.
    pub fn redirect(&self, to: &str) {
        self.shared.state().redirect = to.to_owned();
        self.fail_at(".tif", Fault::Redirect, usize::MAX);
    }

    /// Returns the names of the headers of all requests up to now, in lower case.
    #[must_use]
    pub fn headers(&self) -> BTreeSet<String> {
        self.shared.state().headers.clone()
    }

    /// Makes the next `count` answers about files with this suffix faulty.
    pub fn fail_at(&self, ending: &str, fault: Fault, count: usize) {
        let mut state = self.shared.state();
        (state.fault, state.count) = (fault, count);
        state.of = ending.to_owned();
        state.is_beyond = false;
    }

    /// Makes all answers about data after a file's beginning faulty.
    pub fn fail_beyond(&self, fault: Fault) {
        self.fail_at("", fault, usize::MAX);
        self.shared.state().is_beyond = true;
    }

    /// Delays each answer by this time.
    pub fn set_latency(&self, latency: Duration) {
        self.shared.state().latency = latency;
    }

    /// Holds answers back, or releases them.
    pub fn hold(&self, hold: bool) {
        self.shared.state().held_endings.clear();
        self.shared.is_open.send_replace(!hold);
    }

    /// Holds answers about files with these suffixes back, in lower or upper case.
    pub fn hold_at(&self, endings: &[&str]) {
        self.shared.state().held_endings = endings.iter().map(ToString::to_string).collect();
        self.shared.is_open.send_replace(false);
    }

    /// Changes the version of all files.
    pub fn change(&self) {
        self.shared.state().version += 1;
    }

    /// Returns the most requests that waited for their answers at once.
    #[must_use]
    pub fn max_concurrent(&self) -> usize {
        self.shared.state().concurrent[1]
    }

    /// Returns the methods and paths of the requests up to now, and the bytes of the answers.
    #[must_use]
    pub fn log(&self) -> (Vec<String>, usize) {
        let state = self.shared.state();
        (state.requests.clone(), state.bytes)
    }
}

impl Shared {
    fn state(&self) -> std::sync::MutexGuard<'_, Faults> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Records a request. Returns its fault, its delay, and the version.
    fn next(&self, request: &Request) -> (Fault, Duration, String) {
        let mut state = self.state();
        let line = format!("{} {}", request.method(), request.uri());
        state.requests.push(line);
        let names = request.headers().keys().map(ToString::to_string);
        state.headers.extend(names);
        let [now, max] = &mut state.concurrent;
        *now += 1;
        *max = (*max).max(*now);
        let mut fault = Fault::None;
        let range = request.headers().get(RANGE);
        let begins = range.is_none_or(|range| range.as_bytes().starts_with(b"bytes=0-"));
        let is_meant = request.uri().path().ends_with(&state.of) && !(state.is_beyond && begins);
        if state.count > 0 && is_meant {
            fault = state.fault;
            state.count -= 1;
        }
        (fault, state.latency, format!("\"v{}\"", state.version))
    }
}

async fn between(State(shared): State<Arc<Shared>>, mut request: Request, next: Next) -> Response {
    let (fault, latency, version) = shared.next(&request);
    tokio::time::sleep(latency).await;
    let path = request.uri().path().to_lowercase();
    let is_held = |held_endings: &[String]| {
        held_endings.is_empty() || held_endings.iter().any(|end| path.ends_with(end))
    };
    let is_held = is_held(&shared.state().held_endings);
    if is_held {
        let mut gate = shared.is_open.subscribe();
        let _ = gate.wait_for(|is_open| *is_open).await;
    }
    shared.state().concurrent[0] -= 1;
    match fault {
        Fault::Error500 => return StatusCode::INTERNAL_SERVER_ERROR.into_response(),
        Fault::Forbidden => return StatusCode::FORBIDDEN.into_response(),
        Fault::Page => return "<!doctype html><title>Hills</title>".into_response(),
        Fault::Redirect => {
            let to = shared.state().redirect.clone();
            return (StatusCode::FOUND, [(LOCATION, to)]).into_response();
        }
        Fault::LongError => {
            let page = Body::new(Page(shared.clone(), 64));
            return (StatusCode::NOT_FOUND, page).into_response();
        }
        Fault::NoRanges => drop(request.headers_mut().remove(RANGE)),
        Fault::OtherRange => {
            let other = HeaderValue::from_static("bytes=4096-8191");
            request.headers_mut().insert(RANGE, other);
        }
        Fault::None | Fault::Cut | Fault::Short | Fault::Endless => {}
    }
    let (mut head, body) = next.run(request).await.into_parts();
    let bytes = to_bytes(body, MAX).await.unwrap_or_default();
    shared.state().bytes += bytes.len();
    if head.status.is_success() {
        head.headers
            .insert(ETAG, version.parse().expect("a version"));
    }
    let half = bytes.slice(..bytes.len() / 2);
    let body = match fault {
        Fault::Cut => Body::new(Ending(Some(half))),
        Fault::Short => {
            assert!(head.headers.contains_key(CONTENT_RANGE), "a range");
            head.headers.insert("content-length", half.len().into());
            Body::from(half)
        }
        Fault::Endless => {
            head.headers.remove("content-length");
            Body::from([&bytes[..], &[7; 4 << 20]].concat())
        }
        _ => Body::from(bytes),
    };
    Response::from_parts(head, body)
}

/// This many megabytes, which are counted as they are sent.
struct Page(Arc<Shared>, usize);

impl axum::body::HttpBody for Page {
    type Data = Bytes;
    type Error = std::io::Error;

    fn poll_frame(
        mut self: std::pin::Pin<&mut Self>,
        _: &mut std::task::Context<'_>,
    ) -> std::task::Poll<Option<Result<http_body::Frame<Bytes>, Self::Error>>> {
        let megabyte = Bytes::from_static(&[b'E'; 1 << 20]);
        let next = self.1.checked_sub(1).map(|left| {
            self.1 = left;
            self.0.state().bytes += megabyte.len();
            Ok(http_body::Frame::data(megabyte))
        });
        std::task::Poll::Ready(next)
    }
}

/// Some bytes, followed by a closed connection.
struct Ending(Option<Bytes>);

impl axum::body::HttpBody for Ending {
    type Data = Bytes;
    type Error = std::io::Error;

    fn poll_frame(
        mut self: std::pin::Pin<&mut Self>,
        _: &mut std::task::Context<'_>,
    ) -> std::task::Poll<Option<Result<http_body::Frame<Bytes>, Self::Error>>> {
        let next = match self.0.take() {
            Some(bytes) => Ok(http_body::Frame::data(bytes)),
            None => Err(std::io::ErrorKind::ConnectionReset.into()),
        };
        std::task::Poll::Ready(Some(next))
    }
}
