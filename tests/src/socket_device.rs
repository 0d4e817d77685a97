//! A device behind a socket, and the command that serves a terrain to it.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use crate::hapterra_binary;
use crate::link_campaign::frames::parse_host_frame;
use crate::terrain_file;
use crate::timeouts::{HANG, wait_until};
use hapterra::link::{ControlSession, Native, Tcp, Transport};
use hapterra::synth::Kind;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME};
use hapterra_core::wire::message::ToDevice;
use hapterra_core::wire::session::SessionEnd;
use hapterra_core::wire::status::Status;

/// A device behind a socket, one host after the other. While it is deaf it receives nothing, but
/// still sends.
pub struct SocketDevice {
    /// Its address.
    pub address: SocketAddr,
    /// True if it receives nothing.
    pub deaf: Arc<AtomicBool>,
    counts: Arc<MessageCounts>,
}

/// Counters that tests wait for.
#[derive(Default)]
struct MessageCounts {
    /// Ticks of the device.
    ticks: AtomicU64,
    /// Messages to open and close a session that it missed while deaf.
    ignored_hellos: AtomicU64,
    ignored_byes: AtomicU64,
}

impl SocketDevice {
    /// Starts a device whose arm rests.
    pub fn start() -> Self {
        Self::with(|| (Native::for_replay().free_running(), || {}))
    }

    /// Starts the device that `make` creates in its own thread, with a function called every few
    /// milliseconds of its time.
    pub fn with<F: FnMut()>(make: impl FnOnce() -> (Native, F) + Send + 'static) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("a port");
        let deaf = Arc::new(AtomicBool::new(false));
        let counts = Arc::new(MessageCounts::default());
        let (is_deaf, to_see) = (Arc::clone(&deaf), Arc::clone(&counts));
        std::thread::spawn(move || {
            let (mut device, mut between) = make();
            for stream in listener.incoming() {
                let stream = stream.expect("a host");
                serve(&mut device, stream, &is_deaf, &to_see, &mut between);
            }
        });
        Self {
            address,
            deaf,
            counts,
        }
    }

    /// Waits until this many milliseconds of the device's time have passed.
    pub fn pass_ms(&self, ms: u64) {
        let ticks = || self.counts.ticks.load(Ordering::Relaxed);
        let until = ticks() + ms;
        wait_until("ticks of the device", || ticks() >= until);
    }

    /// Waits until a host has sent an open to the deaf device.
    pub fn wait_for_ignored_hello(&self) {
        let hellos = &self.counts.ignored_hellos;
        wait_until("an open message", || hellos.load(Ordering::Relaxed) > 0);
    }

    /// Waits until a host has sent a close to the deaf device.
    pub fn wait_for_ignored_bye(&self) {
        let byes = &self.counts.ignored_byes;
        wait_until("a close message", || byes.load(Ordering::Relaxed) > 0);
    }

    /// Waits until a host or its guardian has sent the deaf device a message that ends a session.
    pub fn wait_for_ignored_end(&self) {
        let count = |of: &AtomicU64| of.load(Ordering::Relaxed);
        let MessageCounts {
            ignored_hellos,
            ignored_byes,
            ..
        } = &*self.counts;
        wait_until("an end", || count(ignored_hellos) + count(ignored_byes) > 0);
    }

    /// Returns the end of the last session, as reported to the next host.
    pub fn last_end(&self) -> SessionEnd {
        self.control().device().last.end
    }

    /// Returns the status of the device.
    pub fn status(&self) -> Status {
        self.control().fresh_status().expect("it answers")
    }

    fn control(&self) -> ControlSession<'static> {
        self.deaf.store(false, Ordering::Relaxed);
        let link = Tcp::connect(&self.address.to_string()).expect("there");
        ControlSession::open(Box::new(link), HANG).expect("answers")
    }
}

/// Ticks of the device between two checks of its host.
const TICKS: u32 = 2;

/// Serves a host until it disconnects.
fn serve(
    device: &mut Native,
    mut stream: TcpStream,
    deaf: &AtomicBool,
    counts: &MessageCounts,
    between: &mut dyn FnMut(),
) {
    let mut ignored = FrameReader::<MAX_FRAME>::new();
    let wait = Some(Duration::from_millis(1));
    stream.set_read_timeout(wait).expect("set");
    let mut chunk = [0; 4096];
    loop {
        match stream.read(&mut chunk) {
            Ok(0) => return,
            Ok(n) if !deaf.load(Ordering::Relaxed) => device.send(&chunk[..n]).expect("in memory"),
            Ok(n) => note(counts, &mut ignored, &chunk[..n]),
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {}
            Err(_) => return,
        }
        between();
        // A few milliseconds of its time pass.
        device.run_ticks(TICKS);
        counts.ticks.fetch_add(TICKS.into(), Ordering::Relaxed);
        let sent = device
            .receive(&mut chunk, Duration::ZERO)
            .expect("in memory");
        if stream.write_all(&chunk[..sent]).is_err() {
            return;
        }
    }
}

/// Counts the messages that the deaf device misses.
fn note(counts: &MessageCounts, reader: &mut FrameReader<MAX_FRAME>, mut bytes: &[u8]) {
    while !bytes.is_empty() {
        let (taken, content) = reader.push(bytes);
        bytes = &bytes[taken..];
        let count = match content.and_then(Result::ok).and_then(parse_host_frame) {
            Some(framed) if matches!(framed.message, ToDevice::Hello(_)) => &counts.ignored_hellos,
            Some(framed) if framed.message == ToDevice::Bye => &counts.ignored_byes,
            _ => continue,
        };
        count.fetch_add(1, Ordering::Relaxed);
    }
}

/// Writes a terrain to a folder. Returns its path.
pub fn terrain(folder: &Path) -> String {
    let file = folder.join("hills.tif");
    let path = file.to_str().expect("a plain path").to_owned();
    terrain_file(&file, Kind::Fractal, 64, 1);
    path
}

/// Returns the command that serves a terrain to the device at this address, and records.
pub fn command(address: SocketAddr, folder: &Path) -> Command {
    command_over(&terrain(folder), address, folder)
}

/// Same as `command`, for the terrain at this path.
pub fn command_over(terrain: &str, address: SocketAddr, folder: &Path) -> Command {
    let mut command = Command::new(hapterra_binary());
    command
        .args(["run", terrain, "--scale", "1mm/cell"])
        .args(["--exaggeration", "0.1mm/unit"])
        .args(["--device", &format!("tcp:{address}")])
        .arg("--out")
        .arg(folder.join("felt.csv"))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// Starts the command, and waits until samples have arrived.
pub fn start(served: &SocketDevice, folder: &Path, more: &[&str]) -> Child {
    let mut child = command(served.address, folder)
        .args(more)
        .spawn()
        .expect("it runs");
    has_begun(child.stdout.as_mut().expect("piped"));
    child
}

/// Waits until the command prints the terrain's name, which it does when the session is open.
pub fn has_begun(stdout: &mut impl Read) {
    let mut first_bytes = [0; 16];
    stdout.read_exact(&mut first_bytes).expect("a session");
}

/// Sends a signal by its name.
pub fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill")
        .args([format!("-{name}"), child.id().to_string()])
        .status();
    assert!(sent.expect("kill runs").success());
}

/// Returns the standard output and error output.
pub fn output_text(output: &Output) -> String {
    let both = [output.stdout.as_slice(), output.stderr.as_slice()].concat();
    String::from_utf8_lossy(&both).into_owned()
}
