//! A web server on this machine with a delay, in place of a distant one.

use std::fs::File;
use std::io::{self, Cursor, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use tiny_http::{Header, Method, Request, Response, StatusCode};

use super::meter::Traffic;

/// Serves the files of one folder, in ranges, until it is dropped.
pub(super) struct Server {
    http: Arc<tiny_http::Server>,
    shared: Arc<Shared>,
    url: String,
    listener: Option<JoinHandle<()>>,
}

struct Shared {
    folder: PathBuf,
    latency_ms: AtomicU64,
    requests: AtomicU64,
    bytes: AtomicU64,
}

impl Server {
    /// Starts a server on a free port of the loopback address.
    ///
    /// # Errors
    /// If no port is free.
    pub(super) fn of(folder: &Path) -> io::Result<Self> {
        let http = tiny_http::Server::http(("127.0.0.1", 0)).map_err(io::Error::other)?;
        let http = Arc::new(http);
        let port = http
            .server_addr()
            .to_ip()
            .map_or(0, |address| address.port());
        let shared = Arc::new(Shared {
            folder: folder.to_owned(),
            latency_ms: AtomicU64::new(0),
            requests: AtomicU64::new(0),
            bytes: AtomicU64::new(0),
        });
        let (listens, answers) = (http.clone(), shared.clone());
        let listener = std::thread::spawn(move || {
            for request in listens.incoming_requests() {
                let shared = answers.clone();
                // An answer that waits does not delay others.
                std::thread::spawn(move || shared.answer(request));
            }
        });
        Ok(Self {
            http,
            shared,
            url: format!("http://127.0.0.1:{port}"),
            listener: Some(listener),
        })
    }

    /// Returns the URL of a file of the folder.
    pub(super) fn url(&self, name: &str) -> String {
        format!("{}/{name}", self.url)
    }

    /// Sets the delay of every answer.
    pub(super) fn set_latency_ms(&self, latency_ms: u32) {
        let latency = latency_ms.into();
        self.shared.latency_ms.store(latency, Ordering::Relaxed);
    }

    /// Returns the requests up to now, and the bytes of files that were sent.
    pub(super) fn traffic(&self) -> Traffic {
        Traffic {
            requests: self.shared.requests.load(Ordering::Relaxed),
            bytes: self.shared.bytes.load(Ordering::Relaxed),
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.http.unblock();
        if let Some(listener) = self.listener.take() {
            // It only passes requests on.
            let _ = listener.join();
        }
    }
}

impl Shared {
    fn answer(&self, request: Request) {
        self.requests.fetch_add(1, Ordering::Relaxed);
        let latency = self.latency_ms.load(Ordering::Relaxed);
        std::thread::sleep(Duration::from_millis(latency));
        let response = self.response(&request).unwrap_or_else(|error| {
            let status = match error.kind() {
                io::ErrorKind::NotFound => 404,
                io::ErrorKind::InvalidInput => 416,
                _ => 500,
            };
            Response::from_data([]).with_status_code(status)
        });
        // A program that has all it needs may have disconnected.
        let _ = request.respond(response);
    }

    fn response(&self, request: &Request) -> io::Result<Response<Cursor<Vec<u8>>>> {
        let name = request.url().trim_start_matches('/');
        if name.contains(['/', '\\', '%']) || name.starts_with('.') {
            return Err(io::ErrorKind::NotFound.into());
        }
        let mut file = File::open(self.folder.join(name))?;
        let len = file.metadata()?.len();
        let requested = request
            .headers()
            .iter()
            .find(|header| header.field.equiv("Range"));
        let requested = requested
            .map(|header| range(header.value.as_str(), len))
            .transpose()?;
        let [from, to] = requested.unwrap_or([0, len]);
        let mut bytes = vec![];
        if *request.method() != Method::Head {
            file.seek(SeekFrom::Start(from))?;
            file.take(to - from).read_to_end(&mut bytes)?;
        }
        self.bytes.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        let mut headers = vec![
            header("Accept-Ranges", "bytes"),
            header("ETag", &format!("\"{len}\"")),
        ];
        if requested.is_some() {
            let place = format!("bytes {from}-{}/{len}", to.saturating_sub(1));
            headers.push(header("Content-Range", &place));
        }
        let status = if requested.is_some() { 206 } else { 200 };
        let length = Some((to - from) as usize);
        let body = Cursor::new(bytes);
        let response = Response::new(
            StatusCode(status),
            headers.into_iter().flatten().collect(),
            body,
            length,
            None,
        );
        Ok(response.with_chunked_threshold(usize::MAX))
    }
}

fn header(name: &str, value: &str) -> Option<Header> {
    Header::from_bytes(name, value).ok()
}

/// Returns the range in `bytes=FROM-TO` or `bytes=FROM-`, of `len` bytes, without its end.
fn range(requested: &str, len: u64) -> io::Result<[u64; 2]> {
    let wrong = || io::Error::from(io::ErrorKind::InvalidInput);
    let ends = requested.strip_prefix("bytes=").ok_or_else(wrong)?;
    let (from, to) = ends.split_once('-').ok_or_else(wrong)?;
    let from: u64 = from.parse().map_err(|_| wrong())?;
    let to = match to {
        "" => len,
        to => to
            .parse::<u64>()
            .map_err(|_| wrong())?
            .saturating_add(1)
            .min(len),
    };
    (from < to).then_some([from, to]).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;
    use std::net::TcpStream;

    fn send_request(server: &Server, request: &str) -> String {
        let address = server.url.trim_start_matches("http://");
        let mut stream = TcpStream::connect(address).expect("it listens");
        write!(
            stream,
            "{request}\r\nHost: here\r\nConnection: close\r\n\r\n"
        )
        .expect("sent");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("answered");
        answer
    }

    #[test]
    fn ranges_are_served_and_counted_and_other_paths_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("a.tif"), "0123456789").expect("written");
        let server = Server::of(folder.path()).expect("a port");
        let part = send_request(&server, "GET /a.tif HTTP/1.1\r\nRange: bytes=2-4");
        assert!(
            part.starts_with("HTTP/1.1 206") && part.ends_with("\r\n\r\n234"),
            "{part}"
        );
        assert!(part.contains("Content-Range: bytes 2-4/10"), "{part}");
        let end = send_request(&server, "GET /a.tif HTTP/1.1\r\nRange: bytes=8-99");
        assert!(end.ends_with("\r\n\r\n89"), "{end}");
        let counted = Traffic {
            requests: 2,
            bytes: 5,
        };
        assert_eq!(server.traffic(), counted);
        let beyond = send_request(&server, "GET /a.tif HTTP/1.1\r\nRange: bytes=10-11");
        assert!(beyond.starts_with("HTTP/1.1 416"), "{beyond}");
        for name in ["/b.tif", "/../a.tif", "/.hidden"] {
            let missing = send_request(&server, &format!("GET {name} HTTP/1.1"));
            assert!(missing.starts_with("HTTP/1.1 404"), "{missing}");
        }
    }
}
