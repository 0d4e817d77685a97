//! Programs that run under test: the viewer, and `hapterra` with its viewer.
#![allow(dead_code)]

pub mod browser;
pub mod feed;
pub mod framed;
pub mod recorded;
pub mod scene;

use std::io::{BufRead, BufReader, Read as _, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use hapterra_view_stream::{Message, write};

/// Time-out of a page: pages that software draws on a busy machine take minutes.
pub const HANG: Duration = Duration::from_secs(900);

/// Options of a viewer without a browser, on any free port.
const HEADLESS_OPTIONS: &str = "--no-browser --port 0";

/// A program under observation by a test. It is killed if it has not ended by itself.
pub struct Running {
    child: Child,
    stdout: Receiver<String>,
    stderr: Receiver<String>,
}

impl Running {
    /// Starts a program with options for its viewer, separated by spaces.
    pub fn start(command: &mut Command, options: &str) -> Self {
        let mut child = command
            .env(
                "HAPTERRA_VIEW_OPTIONS",
                format!("{HEADLESS_OPTIONS} {options}"),
            )
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        Self {
            stdout: lines_of(child.stdout.take().expect("a pipe")),
            stderr: lines_of(child.stderr.take().expect("a pipe")),
            child,
        }
    }

    /// Starts `hapterra` with a viewer that ends with it.
    pub fn start_with_viewer(command: &mut Command, options: &str) -> Self {
        Self::start(command, &format!("--linger 0s {options}"))
    }

    /// Runs `hapterra` with such a viewer to its end and returns the output of both.
    pub fn run_to_end(command: &mut Command, options: &str) -> String {
        let mut running = Self::start_with_viewer(command, options);
        let is_success = running.end();
        let output = running.output();
        assert!(is_success, "{output}");
        output
    }

    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Returns the next line on standard error.
    pub fn line(&self) -> String {
        self.stderr.recv_timeout(HANG).expect("it prints a line")
    }

    /// Waits for a line on standard output with this beginning.
    pub fn wait_for_line(&self, beginning: &str) {
        while !{ self.stdout.recv_timeout(HANG).expect("it prints a line") }.starts_with(beginning)
        {
        }
    }

    /// Returns the port of its viewer's page, from one of the lines.
    pub fn port(&self) -> u16 {
        loop {
            let line = self.line();
            if let Some((_, port)) = line.rsplit_once(':')
                && line.starts_with("view ")
            {
                return port.trim_matches('/').parse().expect("a port");
            }
        }
    }

    /// Returns the address of its viewer's page.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/", self.port())
    }

    /// Returns true if it still runs.
    pub fn is_running(&mut self) -> bool {
        self.child.try_wait().expect("a child").is_none()
    }

    /// Writes lines to its standard input, if this is a pipe.
    pub fn type_lines(&mut self, lines: &str) {
        let to = self.child.stdin.as_mut().expect("a pipe");
        to.write_all(lines.as_bytes()).expect("it reads");
    }

    /// Interrupts it, as Ctrl-C does.
    pub fn interrupt(&self) {
        signal("-INT", self.id());
    }

    /// Waits for its end and returns true if it was successful.
    pub fn end(&mut self) -> bool {
        let until = Instant::now() + HANG;
        while self.is_running() {
            assert!(Instant::now() < until, "it does not end");
            std::thread::sleep(Duration::from_millis(50));
        }
        self.child.wait().expect("a child").success()
    }

    /// Returns its unread output, and waits until it and its viewer have ended.
    pub fn output(&self) -> String {
        self.stdout
            .iter()
            .chain(&self.stderr)
            .collect::<Vec<_>>()
            .join("\n")
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Sends a signal to a process.
pub fn signal(which: &str, process: u32) {
    let sent = Command::new("kill")
        .args([which, &process.to_string()])
        .status();
    assert!(sent.expect("kill").success());
}

/// A viewer under test, and its input.
pub struct Viewer {
    running: Running,
    to: Option<ChildStdin>,
}

impl Viewer {
    /// Starts a viewer with options, separated by spaces.
    pub fn start(options: &str) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hapterra-view"));
        let mut running = Running::start(command.stdin(Stdio::piped()), options);
        Self {
            to: running.child.stdin.take(),
            running,
        }
    }

    /// Sends a message to it and returns true if it reads.
    pub fn send(&mut self, message: &Message) -> bool {
        let to = self.to.as_mut().expect("the stream is open");
        write(to, message).is_ok() && to.flush().is_ok()
    }

    /// Ends the stream.
    pub fn close_stream(&mut self) {
        self.to = None;
    }

    /// Returns the next line that it prints.
    pub fn line(&self) -> String {
        self.running.line()
    }

    /// Returns the port of its page.
    pub fn port(&self) -> u16 {
        self.running.port()
    }

    /// Returns the address of its page.
    pub fn address(&self) -> String {
        self.running.address()
    }

    /// Waits for its end and returns true if it was successful.
    pub fn end(mut self) -> bool {
        self.to = None;
        self.running.end()
    }
}

/// Returns the memory of a process, bytes.
pub fn memory_of(process: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status"));
    let status = status.unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmRSS:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().nth(1)?.parse().ok());
    1024 * kilobytes.unwrap_or(0u64)
}

/// Returns the process of a program that another process started; `None` if there is none.
pub fn child_process(process: u32, program: &str) -> Option<u32> {
    let children = format!("/proc/{process}/task/{process}/children");
    let children = std::fs::read_to_string(children).ok()?;
    let mut children = { children.split_whitespace() }.filter_map(|child| child.parse().ok());
    children.find(|child: &u32| {
        let name = std::fs::read_to_string(format!("/proc/{child}/cmdline"));
        name.is_ok_and(|name| {
            name.split('\0')
                .next()
                .is_some_and(|it| it.ends_with(program))
        })
    })
}

/// Returns the lines of a stream, as they arrive.
fn lines_of(from: impl std::io::Read + Send + 'static) -> Receiver<String> {
    let (sender, stderr) = channel();
    std::thread::spawn(move || {
        let lines = BufReader::new(from).lines().map_while(Result::ok);
        lines.into_iter().try_for_each(|line| sender.send(line))
    });
    stderr
}

/// Sends a complete request and returns the whole answer.
pub fn send_request(port: u16, request: &str) -> String {
    let mut line = TcpStream::connect(("127.0.0.1", port)).expect("a connection");
    line.set_read_timeout(Some(HANG)).expect("a limit");
    line.write_all(request.as_bytes()).expect("it is read");
    let mut answer = Vec::new();
    let _ = line.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

/// Creates an empty folder for one test.
pub fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("hapterra-view-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// Returns `hapterra`, as set by `cargo xtask view --test`; `None` if it is not set.
pub fn hapterra() -> Option<Command> {
    let program = std::env::var_os("HAPTERRA")?;
    let mut command = Command::new(program);
    command
        .env("HAPTERRA_VIEW", env!("CARGO_BIN_EXE_hapterra-view"))
        .stdin(Stdio::null());
    Some(command)
}

/// Returns the emulated board's image, as set by `cargo xtask view --test`; `None` if it is not
/// set.
pub fn emulated() -> Option<std::ffi::OsString> {
    std::env::var_os("HAPTERRA_MPS2_ELF").filter(|image| !image.is_empty())
}
