//! A device behind a socket, and the command that serves it.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::hapterra_binary;
use hapterra::link::{Dialogue, Native, Tcp, Transport};
use hapterra_core::wire::session::SessionEnd;
use hapterra_core::wire::status::Status;

/// A device behind a socket, one host after the other. While it is deaf nothing reaches
/// it, and what it says still comes.
pub struct Served {
    /// Where it is.
    pub address: SocketAddr,
    /// Whether nothing reaches it.
    pub deaf: Arc<AtomicBool>,
}

impl Served {
    /// A device whose arm rests.
    pub fn start() -> Self {
        Self::with(|| (Native::for_replay().restless(), || {}))
    }

    /// The device that `make` makes in its own thread, and what is done there each few
    /// milliseconds of its time.
    pub fn with<F: FnMut()>(make: impl FnOnce() -> (Native, F) + Send + 'static) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("a port");
        let deaf = Arc::new(AtomicBool::new(false));
        let is_deaf = Arc::clone(&deaf);
        std::thread::spawn(move || {
            let (mut device, mut between) = make();
            for stream in listener.incoming() {
                serve(&mut device, stream.expect("a host"), &is_deaf, &mut between);
            }
        });
        Self { address, deaf }
    }

    /// How the last session ended, as the next host hears it.
    pub fn last_end(&self) -> SessionEnd {
        self.dialogue().device().last.end
    }

    /// How the device is.
    pub fn status(&self) -> Status {
        self.dialogue().fresh_status().expect("it answers")
    }

    fn dialogue(&self) -> Dialogue<'static> {
        self.deaf.store(false, Ordering::Relaxed);
        let link = Tcp::connect(&self.address.to_string()).expect("there");
        Dialogue::open(Box::new(link), Duration::from_secs(20)).expect("answers")
    }
}

/// Until the host is gone.
fn serve(device: &mut Native, mut stream: TcpStream, deaf: &AtomicBool, between: &mut dyn FnMut()) {
    let wait = Some(Duration::from_millis(1));
    stream.set_read_timeout(wait).expect("set");
    let mut chunk = [0; 4096];
    loop {
        match stream.read(&mut chunk) {
            Ok(0) => return,
            Ok(n) if !deaf.load(Ordering::Relaxed) => device.send(&chunk[..n]).expect("in memory"),
            Ok(_) => {}
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {}
            Err(_) => return,
        }
        between();
        // A few milliseconds of its time go by.
        device.pass(2);
        let said = device
            .receive(&mut chunk, Duration::ZERO)
            .expect("in memory");
        if stream.write_all(&chunk[..said]).is_err() {
            return;
        }
    }
}

/// A terrain in a folder; its path.
pub fn terrain(folder: &Path) -> String {
    let file = folder.join("hills.tif");
    let path = file.to_str().expect("a plain path").to_owned();
    let made = Command::new(hapterra_binary())
        .args(["synth", "fractal", "-o", &path, "--size", "64"])
        .output()
        .expect("it runs");
    assert!(made.status.success());
    path
}

/// The command that serves terrain to the device at this address, and records.
pub fn command(address: SocketAddr, folder: &Path) -> Command {
    let mut command = Command::new(hapterra_binary());
    command
        .args(["run", &terrain(folder), "--cell-mm", "1"])
        .args(["--height-mm-per-unit", "0.1"])
        .args(["--device", &format!("tcp:{address}")])
        .arg("--record")
        .arg(folder.join("felt.csv"))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// Starts serving, and waits until samples have come.
pub fn start(served: &Served, folder: &Path, more: &[&str]) -> Child {
    let mut child = command(served.address, folder)
        .args(more)
        .spawn()
        .expect("it runs");
    has_begun(child.stdout.as_mut().expect("piped"));
    child
}

/// Waits until the command names the terrain, which it does when the session is open.
pub fn has_begun(stdout: &mut impl Read) {
    let mut begun = [0; 16];
    stdout.read_exact(&mut begun).expect("a session");
}

/// Sends a signal by its name.
pub fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill")
        .args([format!("-{name}"), child.id().to_string()])
        .status();
    assert!(sent.expect("kill runs").success());
}

/// Waits for its end; none where it does not end within this time. It is ended then.
pub fn ended_within(mut child: Child, time: Duration) -> Option<Output> {
    let began = Instant::now();
    while began.elapsed() < time {
        if child.try_wait().expect("a child").is_some() {
            return child.wait_with_output().ok();
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    child.kill().expect("ended");
    child.wait().expect("ended");
    None
}

/// What it has written, to both.
pub fn told(output: &Output) -> String {
    let both = [output.stdout.as_slice(), output.stderr.as_slice()].concat();
    String::from_utf8_lossy(&both).into_owned()
}
