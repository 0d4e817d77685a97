//! A viewer that runs, and what it is told.
#![allow(dead_code)]

pub mod browser;
pub mod recorded;
pub mod scene;

use std::io::{BufRead, BufReader, Read as _, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use hapterra_view_stream::{Message, write};

/// For what takes long on a busy machine.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// A viewer under test. It is killed where it has not ended by itself.
pub struct Viewer {
    child: Child,
    to: Option<ChildStdin>,
    said: Receiver<String>,
}

impl Viewer {
    /// Starts one with options.
    pub fn start(options: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_hapterra-view"))
            .args(["--no-browser", "--port", "0"])
            .args(options)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the viewer starts");
        let said = lines_of(child.stderr.take().expect("a pipe"));
        Self {
            to: child.stdin.take(),
            child,
            said,
        }
    }

    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Tells it something; whether it reads.
    pub fn tell(&mut self, message: &Message) -> bool {
        let to = self.to.as_mut().expect("the stream is open");
        write(to, message).is_ok() && to.flush().is_ok()
    }

    /// Ends the stream.
    pub fn hang_up(&mut self) {
        self.to = None;
    }

    /// The next line that it says.
    pub fn line(&self) -> String {
        self.said.recv_timeout(PATIENCE).expect("it says a line")
    }

    /// Where its page is, as it says.
    pub fn port(&self) -> u16 {
        port_said(&self.said)
    }

    /// Waits for its end; whether it ended well.
    pub fn end(mut self) -> bool {
        self.to = None;
        let until = Instant::now() + PATIENCE;
        loop {
            if let Some(ended) = self.child.try_wait().expect("a child") {
                return ended.success();
            }
            assert!(Instant::now() < until, "it does not end");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Memory that it takes, bytes.
    pub fn memory(&self) -> u64 {
        memory_of(self.id())
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Memory that a process takes, bytes.
pub fn memory_of(process: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status"));
    let status = status.unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmRSS:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().nth(1)?.parse().ok());
    1024 * kilobytes.unwrap_or(0u64)
}

/// A process that another one started; none where it has started none.
pub fn started_by(process: u32) -> Option<u32> {
    let children = format!("/proc/{process}/task/{process}/children");
    let children = std::fs::read_to_string(children).ok()?;
    children.split_whitespace().next()?.parse().ok()
}

/// Lines of a stream, as they come.
pub fn lines_of(from: impl std::io::Read + Send + 'static) -> Receiver<String> {
    let (say, said) = channel();
    std::thread::spawn(move || {
        let lines = BufReader::new(from).lines().map_while(Result::ok);
        lines.into_iter().try_for_each(|line| say.send(line))
    });
    said
}

/// Where a viewer's page is, as one of the lines says.
pub fn port_said(said: &Receiver<String>) -> u16 {
    loop {
        let line = said.recv_timeout(PATIENCE).expect("it says a line");
        if let Some((_, port)) = line.rsplit_once(':')
            && line.starts_with("view ")
        {
            return port.trim_matches('/').parse().expect("a port");
        }
    }
}

/// A request, head and all, and the whole answer.
pub fn asked(port: u16, request: &str) -> String {
    let mut line = TcpStream::connect(("127.0.0.1", port)).expect("a connection");
    line.set_read_timeout(Some(PATIENCE)).expect("a limit");
    line.write_all(request.as_bytes()).expect("it is read");
    let mut answer = Vec::new();
    let _ = line.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

/// A folder for one test, empty.
pub fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("hapterra-view-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// `hapterra`, as `cargo xtask view --test` names it; none where nobody does.
pub fn hapterra() -> Option<Command> {
    let program = std::env::var_os("HAPTERRA")?;
    let mut command = Command::new(program);
    command
        .env("HAPTERRA_VIEW", env!("CARGO_BIN_EXE_hapterra-view"))
        .stdin(Stdio::null());
    Some(command)
}
