//! The page and its stream over HTTP, for this machine only by default.
//!
//! [`access_check`] refuses requests of other origins; the server has only files and the stream.

pub mod access_check;
mod files;
mod stream;

use std::io::Write as _;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::{Context as _, Result, anyhow};
use tiny_http::{Header, Request, Response};

use crate::history::{Batching, History};
use access_check::RequestHead;
use files::Files;

/// Max number of pages and files in transfer at the same time.
const MAX: usize = 24;

/// A server that runs until the program ends.
pub struct Server {
    address: SocketAddr,
}

/// State that all requests share.
struct Shared {
    history: Arc<History>,
    files: Files,
    port: u16,
    under_way: AtomicUsize,
}

impl Server {
    /// Serves on the first free one of `ports`.
    ///
    /// # Errors
    /// If none is free.
    pub fn start(
        bind: IpAddr,
        ports: &[u16],
        history: Arc<History>,
        page_bytes: u64,
    ) -> Result<Self> {
        let files = Files::load(page_bytes)?;
        let mut why = anyhow!("no port to try");
        let server = ports.iter().find_map(|port| {
            let opened = tiny_http::Server::http((bind, *port));
            let failed = |error| why = anyhow!("{bind} port {port}: {error}");
            opened.map_err(failed).ok()
        });
        let server = server.ok_or(why).context("the page cannot be served")?;
        let address = server.server_addr().to_ip();
        let address = address.context("the page's address is unknown")?;
        let shared = Arc::new(Shared {
            history,
            files,
            port: address.port(),
            under_way: AtomicUsize::new(0),
        });
        std::thread::Builder::new()
            .name("page".into())
            .spawn(move || serve(&server, &shared))
            .context("the page cannot be served")?;
        Ok(Self { address })
    }

    /// Returns the URL of the page.
    #[must_use]
    pub fn url(&self) -> String {
        let mut address = self.address;
        if address.ip().is_unspecified() {
            address.set_ip(std::net::Ipv4Addr::LOCALHOST.into());
        }
        format!("http://{address}/")
    }

    /// Returns true if other machines can reach it.
    #[must_use]
    pub fn is_open(&self) -> bool {
        !self.address.ip().is_loopback()
    }
}

fn serve(server: &tiny_http::Server, shared: &Arc<Shared>) {
    for request in server.incoming_requests() {
        if shared.under_way.fetch_add(1, Ordering::AcqRel) >= MAX {
            shared.under_way.fetch_sub(1, Ordering::AcqRel);
            refuse(request, 503);
            continue;
        }
        let shared = Arc::clone(shared);
        // A slow page blocks only its own thread. If no thread can be started, the request and its
        // connection are dropped.
        let _ = std::thread::Builder::new().spawn(move || {
            answer(request, &shared);
            shared.under_way.fetch_sub(1, Ordering::AcqRel);
        });
    }
}

fn answer(request: Request, shared: &Shared) {
    let header = |name: &'static str| {
        let found = request.headers().iter().find(|h| h.field.equiv(name));
        found.map(|header| header.value.as_str().to_owned())
    };
    let [host, origin, site] = ["Host", "Origin", "Sec-Fetch-Site"].map(header);
    let (path, query) = match request.url().split_once('?') {
        Some((path, query)) => (path, query),
        None => (request.url(), ""),
    };
    let batching = match query {
        "gathered" => Batching::Joined,
        _ => Batching::Fine,
    };
    let request_head = RequestHead {
        method: request.method().as_str(),
        host: host.as_deref(),
        origin: origin.as_deref(),
        site: site.as_deref(),
        path,
    };
    if let Err(status) = request_head.check(shared.port) {
        return refuse(request, status);
    }
    let is_head = request_head.method == "HEAD";
    match request_head.path {
        "/feed" if !is_head => {
            let page = shared.history.add_page(batching);
            let mut to = request.into_writer();
            // In all cases (end, cut off, disconnected) the page reconnects.
            let _ = stream::run(&mut to, &page);
            let _ = to.flush();
            shared.history.remove_page(&page);
        }
        path => match shared.files.named(path) {
            Some(file) => {
                let mut response = Response::from_data(file.bytes.clone());
                for (name, value) in file.headers() {
                    response.add_header(header_of(name, &value));
                }
                let _ = request.respond(response);
            }
            None => refuse(request, 404),
        },
    }
}

fn refuse(request: Request, status: u16) {
    let _ = request.respond(Response::empty(status));
}

fn header_of(name: &str, value: &str) -> Header {
    Header::from_bytes(name, value).unwrap_or_else(|()| {
        // Names and values are this program's own, and all of them are ASCII.
        Header {
            field: "X-Unnamed".parse().unwrap_or_else(|()| unreachable!()),
            value: Default::default(),
        }
    })
}
