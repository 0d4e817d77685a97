//! A server of one folder, only for this machine's browser.
//!
//! It listens on the loopback address. The name in `Host` must be that address or `localhost`, so
//! that a page of another site whose name points here (DNS rebinding) cannot read it. Requests only
//! read, and only files that the folder had at the start.

use std::collections::BTreeMap;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The port that is tried first, so that the address stays the same from run to run.
const PORT: u16 = 8766;
/// Maximum bytes of a request's head.
const MAX_HEAD: u64 = 16 << 10;
const TIMEOUT: Duration = Duration::from_secs(10);

/// A server that is bound to its port.
pub(crate) struct Server {
    listener: TcpListener,
    port: u16,
    /// Files by their requested paths.
    files: BTreeMap<String, PathBuf>,
}

impl Server {
    /// Binds a port for the files of `folder`.
    ///
    /// # Errors
    /// A folder that cannot be read, or no port.
    pub(crate) fn bind(folder: &Path) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, PORT))
            .or_else(|_| TcpListener::bind((Ipv4Addr::LOCALHOST, 0)))?;
        let mut files = BTreeMap::new();
        list(folder, "", &mut files)?;
        if let Some(index) = files.get("/index.html").cloned() {
            files.insert("/".to_owned(), index);
        }
        Ok(Self {
            port: listener.local_addr()?.port(),
            listener,
            files,
        })
    }

    /// Returns the address for a browser.
    pub(crate) fn address(&self) -> String {
        format!("http://127.0.0.1:{}/", self.port)
    }

    /// Answers requests until the program ends.
    pub(crate) fn serve(self) {
        let server: &'static Self = Box::leak(Box::new(self));
        for stream in server.listener.incoming().flatten() {
            // A browser that disconnects is no error here.
            std::thread::spawn(move || server.answer(&stream));
        }
    }

    fn answer(&self, mut stream: &TcpStream) -> io::Result<()> {
        stream.set_read_timeout(Some(TIMEOUT))?;
        stream.set_write_timeout(Some(TIMEOUT))?;
        let head: Vec<String> = BufReader::new(stream.take(MAX_HEAD))
            .lines()
            .map_while(Result::ok)
            .take_while(|line| !line.is_empty())
            .collect();
        let (status, file) = match self.find(&head) {
            Ok(file) => ("200 OK", Some(file)),
            Err(status) => (status, None),
        };
        let bytes = file.map_or_else(|| Ok(status.as_bytes().to_vec()), std::fs::read)?;
        let kind = kind(file.unwrap_or(Path::new("error.txt")));
        let length = bytes.len();
        write!(
            stream,
            "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n\
             X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
             Cross-Origin-Resource-Policy: same-origin\r\nCache-Control: no-cache\r\n\
             Connection: close\r\n\r\n"
        )?;
        stream.write_all(&bytes)
    }

    fn find(&self, head: &[String]) -> Result<&Path, &'static str> {
        let mut words = head.first().map_or("", |line| line).split(' ');
        if words.next() != Some("GET") {
            return Err("405 Method Not Allowed");
        }
        let mut headers = head.iter().skip(1).filter_map(|line| line.split_once(':'));
        let host = headers.find(|(name, _)| name.eq_ignore_ascii_case("host"));
        let own = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", self.port));
        if !host.is_some_and(|(_, host)| own.iter().any(|own| own == host.trim())) {
            return Err("421 Misdirected Request");
        }
        let path = words.next().unwrap_or_default().split('?').next();
        let file = path.and_then(|path| self.files.get(path));
        file.map(PathBuf::as_path).ok_or("404 Not Found")
    }
}

/// Collects the files of a folder, by the paths that a browser requests.
fn list(folder: &Path, under: &str, files: &mut BTreeMap<String, PathBuf>) -> io::Result<()> {
    for entry in folder.read_dir()? {
        let entry = entry?;
        let path = format!("{under}/{}", entry.file_name().to_string_lossy());
        match entry.file_type()?.is_dir() {
            true => list(&entry.path(), &path, files)?,
            false => drop(files.insert(path, entry.path())),
        }
    }
    Ok(())
}

fn kind(file: &Path) -> &'static str {
    match file.extension().and_then(|it| it.to_str()) {
        Some("html") => "text/html; charset=utf-8",
        Some("css") => "text/css",
        Some("js") => "text/javascript",
        Some("json") => "application/json",
        Some("wasm") => "application/wasm",
        Some("txt") => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}
