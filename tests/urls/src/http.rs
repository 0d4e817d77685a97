//! A server of a folder's files, in ranges, and what goes wrong on the way to it.

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

/// More than any file here has, bytes.
const LARGEST: usize = 1 << 30;

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
    /// The server says that it cannot answer.
    Error500,
    /// It may not be read.
    Forbidden,
    /// The line ends in the middle.
    Cut,
    /// Other bytes come than were asked for, and it reports it.
    OtherRange,
    /// Fewer bytes come than the answer's head promises.
    Short,
    /// More bytes come than were asked for, under the head of those that were.
    Endless,
    /// A page for a browser comes, as of sites that have one for every name.
    Page,
    /// Ranges are not known.
    NoRanges,
    /// There is no such file, which a page of 64 MB says.
    LongError,
    /// Another URL has the file ([`Server::redirect`]).
    Redirect,
}

struct Shared {
    state: Mutex<Faults>,
    /// Answers wait while it is closed.
    is_open: watch::Sender<bool>,
}

#[derive(Default)]
struct Faults {
    fault: Fault,
    /// So many answers are faulty; then they are right again.
    count: usize,
    /// Of files whose names end so.
    of: String,
    /// Only of what is behind a file's beginning.
    is_beyond: bool,
    latency: Duration,
    /// Of files whose names end so, answers alone are held back; of all where there are none.
    held: Vec<String>,
    /// The version of all files.
    version: u32,
    requests: Vec<String>,
    /// Names of the headers of all requests.
    headers: BTreeSet<String>,
    /// Target of redirects.
    redirect: String,
    bytes: usize,
    /// Requests that wait for their answers, now and at most.
    at_once: [usize; 2],
}

impl Server {
    /// Serves the files of a folder.
    ///
    /// # Panics
    /// When there is no port.
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

    /// The URL of a file of the folder.
    #[must_use]
    pub fn url(&self, name: &str) -> String {
        format!("{}/{name}", self.url)
    }

    /// The next `count` answers are faulty.
    pub fn fail(&self, fault: Fault, count: usize) {
        self.fail_at("", fault, count);
    }

    /// All answers about a TIFF redirect to a URL.
    pub fn redirect(&self, to: &str) {
        self.shared.state().redirect = to.to_owned();
        self.fail_at(".tif", Fault::Redirect, usize::MAX);
    }

    /// Names of the headers of all requests so far, in small letters.
    #[must_use]
    pub fn headers(&self) -> BTreeSet<String> {
        self.shared.state().headers.clone()
    }

    /// The next `count` answers about files whose names end so are faulty.
    pub fn fail_at(&self, ending: &str, fault: Fault, count: usize) {
        let mut state = self.shared.state();
        (state.fault, state.count) = (fault, count);
        state.of = ending.to_owned();
        state.is_beyond = false;
    }

    /// All answers about what is behind a file's beginning are faulty.
    pub fn fail_beyond(&self, fault: Fault) {
        self.fail_at("", fault, usize::MAX);
        self.shared.state().is_beyond = true;
    }

    /// Each answer comes so much later.
    pub fn set_latency(&self, latency: Duration) {
        self.shared.state().latency = latency;
    }

    /// Holds answers back, or lets them go.
    pub fn hold(&self, hold: bool) {
        self.shared.state().held.clear();
        self.shared.is_open.send_replace(!hold);
    }

    /// Holds answers back about files whose names end so, in small or capital letters.
    pub fn hold_at(&self, endings: &[&str]) {
        self.shared.state().held = endings.iter().map(ToString::to_string).collect();
        self.shared.is_open.send_replace(false);
    }

    /// All files are others now.
    pub fn change(&self) {
        self.shared.state().version += 1;
    }

    /// Returns the number of requests that were waiting for their answers at once, at most.
    #[must_use]
    pub fn most_at_once(&self) -> usize {
        self.shared.state().at_once[1]
    }

    /// Requests so far, their methods and paths, and bytes of the answers.
    #[must_use]
    pub fn seen(&self) -> (Vec<String>, usize) {
        let state = self.shared.state();
        (state.requests.clone(), state.bytes)
    }
}

impl Shared {
    fn state(&self) -> std::sync::MutexGuard<'_, Faults> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes a request; what goes wrong with it, how late it is answered, and the version.
    fn next(&self, request: &Request) -> (Fault, Duration, String) {
        let mut state = self.state();
        let line = format!("{} {}", request.method(), request.uri());
        state.requests.push(line);
        let names = request.headers().keys().map(ToString::to_string);
        state.headers.extend(names);
        let [now, most] = &mut state.at_once;
        *now += 1;
        *most = (*most).max(*now);
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
    let is_held = |held: &[String]| held.is_empty() || held.iter().any(|end| path.ends_with(end));
    let is_held = is_held(&shared.state().held);
    if is_held {
        let mut gate = shared.is_open.subscribe();
        let _ = gate.wait_for(|is_open| *is_open).await;
    }
    shared.state().at_once[0] -= 1;
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
    let bytes = to_bytes(body, LARGEST).await.unwrap_or_default();
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

/// So many megabytes, which are counted as they are sent.
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

/// Some bytes, and then the line is gone.
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
