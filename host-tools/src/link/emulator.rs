//! The emulated board: QEMU as a child of this program.
//!
//! The image may be from any source. QEMU runs without semihosting, because an image could use it
//! to read and write all files of the user: all its output uses three serial lines, and a reset
//! ends it.

use std::io::{self, Read};
use std::net::{Ipv4Addr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::tcp::Tcp;
use heightfield::printable_text::printable_lines;
use heightfield::regular_file;

/// Environment variable that names the image when no option does.
pub const IMAGE_VARIABLE: &str = "HAPTERRA_MPS2_ELF";
/// Environment variable that names QEMU when no option does.
pub const QEMU_VARIABLE: &str = "HAPTERRA_QEMU";
/// QEMU's default name.
pub const QEMU: &str = "qemu-system-arm";
/// Max time for QEMU to connect its lines.
const START_TIMEOUT: Duration = Duration::from_secs(60);
/// Max time for the board to end after a close message, on a shared machine.
const END_TIMEOUT: Duration = Duration::from_secs(60);

/// Max bytes of a report.
const MAX_REPORT_BYTES: u64 = 16 << 10;

/// The name of the board whose clock counts instructions.
pub const EMULATED: &str = "mps2-an386";
/// Instructions for each count of the emulated board's clock: `-icount shift=3` makes an
/// instruction 8 ns, and a count of its 25 MHz clock is 40 ns.
pub const INSTRUCTIONS_PER_COUNT: f64 = 5.0;

/// Reason why the board cannot be emulated.
#[derive(Debug, thiserror::Error)]
pub enum EmulatorError {
    /// The image was not stated.
    #[error("no image of the emulated board was named")]
    NoImage,
    /// The image cannot be read.
    #[error("cannot read the emulated board's image {}", path.display())]
    Image {
        /// The image.
        path: PathBuf,
        /// The reason.
        #[source]
        source: io::Error,
    },
    /// QEMU does not start.
    #[error("cannot start {}", path.display())]
    Qemu {
        /// The program.
        path: PathBuf,
        /// The reason.
        #[source]
        source: io::Error,
    },
    /// QEMU ended, or did not connect.
    #[error("{} did not bring the board up: {reports}", path.display())]
    NotUp {
        /// The program.
        path: PathBuf,
        /// Its output, or its exit status.
        reports: String,
    },
    /// A socket for the lines cannot be opened.
    #[error("cannot listen on the loopback address")]
    Listen(#[source] io::Error),
}

/// A running emulated board, which is ended when this value is dropped.
#[derive(Debug)]
pub struct Emulator {
    child: Child,
    path: PathBuf,
}

/// The two lines of an emulated board.
#[derive(Debug)]
pub struct Lines {
    /// The link to the host.
    pub link: Tcp,
    /// The plant line: encoder counts to the board, currents from it.
    pub plant: Tcp,
}

impl Emulator {
    /// Starts the board from an image and connects its two lines.
    ///
    /// # Errors
    /// [`EmulatorError`] names the missing part or contains QEMU's message.
    pub fn start(qemu: &Path, image: &Path) -> Result<(Self, Lines), EmulatorError> {
        let path = image.to_owned();
        regular_file::open(image).map_err(|source| EmulatorError::Image { path, source })?;
        let path = qemu.to_owned();
        let lines = [listen()?, listen()?];
        let mut emulator = match command(qemu, image, &lines).spawn() {
            Ok(child) => Self { child, path },
            Err(source) => return Err(EmulatorError::Qemu { path, source }),
        };
        let deadline = Instant::now() + START_TIMEOUT;
        let [link, plant] = lines.map(|line| emulator.accept(&line, deadline));
        let (link, plant) = (link?, plant?);
        Ok((emulator, Lines { link, plant }))
    }

    /// Waits for the board to end by itself, as it does after a close message; ends it otherwise.
    ///
    /// # Errors
    /// When it has to be ended, or reports a failure.
    pub fn finish(mut self) -> io::Result<()> {
        let deadline = Instant::now() + END_TIMEOUT;
        while Instant::now() < deadline {
            if let Some(status) = self.child.try_wait()? {
                // A board that ended without an error has an empty report.
                let report = self.report();
                return match status.success() && report.is_empty() {
                    true => Ok(()),
                    false => Err(io::Error::other(format!(
                        "{status}; {report} {}",
                        self.stderr_text()
                    ))),
                };
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Err(io::Error::other(format!(
            "it still ran after {END_TIMEOUT:?}"
        )))
    }

    /// Returns the output of the board or QEMU if it has ended by itself; ends it otherwise.
    #[must_use]
    pub fn failure(mut self) -> Option<String> {
        // The link breaks a moment before the process ends.
        std::thread::sleep(Duration::from_millis(200));
        let status = self.child.try_wait().ok().flatten()?;
        Some(format!("{status}; {}", self.reports()))
    }

    fn accept(&mut self, line: &TcpListener, deadline: Instant) -> Result<Tcp, EmulatorError> {
        loop {
            match line.accept() {
                Ok((stream, _)) => return Tcp::over(stream).map_err(EmulatorError::Listen),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                Err(error) => return Err(EmulatorError::Listen(error)),
            }
            if let Some(status) = self.child.try_wait().ok().flatten() {
                return Err(self.startup_error(status.to_string()));
            }
            if Instant::now() > deadline {
                // Its output can be read to the end only after it has ended.
                let _ = self.child.kill();
                return Err(self.startup_error(format!("no connection in {START_TIMEOUT:?}")));
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Returns the reports of the board on its third line, which is QEMU's standard output, and
    /// QEMU's errors.
    fn reports(&mut self) -> String {
        let report = self.report();
        let stderr_text = self.stderr_text();
        [report, stderr_text].join(" ").trim().to_owned()
    }

    /// Returns the board's report, read to its end: QEMU has ended.
    fn report(&mut self) -> String {
        self.child.stdout.take().map_or(String::new(), text)
    }

    /// Returns the standard error of QEMU, read to its end: QEMU has ended.
    fn stderr_text(&mut self) -> String {
        self.child.stderr.take().map_or(String::new(), text)
    }

    fn startup_error(&mut self, how: String) -> EmulatorError {
        let reports = match self.reports() {
            nothing if nothing.is_empty() => how,
            words => words,
        };
        let path = self.path.clone();
        EmulatorError::NotUp { path, reports }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // Ends QEMU if it still runs.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns the printable text of a stream: the beginning of an endless one, and nothing if it
/// cannot be read.
fn text(from: impl Read) -> String {
    let mut reports = Vec::new();
    let _ = from.take(MAX_REPORT_BYTES).read_to_end(&mut reports);
    printable_lines(String::from_utf8_lossy(&reports).trim())
}

fn listen() -> Result<TcpListener, EmulatorError> {
    let bound = TcpListener::bind((Ipv4Addr::LOCALHOST, 0));
    let listener = bound.and_then(|listener| listener.set_nonblocking(true).map(|()| listener));
    listener.map_err(EmulatorError::Listen)
}

fn command(qemu: &Path, image: &Path, lines: &[TcpListener; 2]) -> Command {
    let mut command = Command::new(qemu);
    command.args(["-M", "mps2-an386", "-display", "none", "-monitor", "none"]);
    command.args(["-icount", "shift=3,sleep=off"]);
    // A reset is the only way for the board to end the program.
    command.arg("-no-reboot");
    for (index, line) in lines.iter().enumerate() {
        let port = line.local_addr().map_or(0, |address| address.port());
        let socket = format!("socket,id=u{index},host=127.0.0.1,port={port},nodelay=on");
        command.args(["-chardev", &socket, "-serial", &format!("chardev:u{index}")]);
    }
    command.args(["-chardev", "stdio,id=report,signal=off,mux=off"]);
    command.args(["-serial", "chardev:report"]);
    command.arg("-kernel").arg(image);
    // Without its own group, QEMU would get the terminal's Ctrl-C: this program ends the session
    // first, and then the board.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}
