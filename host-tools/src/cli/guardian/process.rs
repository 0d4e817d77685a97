//! The guardian process.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs;
use std::io::{self, ErrorKind, PipeReader, PipeWriter, Read, Write, pipe};
use std::os::fd::AsRawFd;
use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rustix::io::{FdFlags, fcntl_setfd, ioctl_fionbio};
use rustix::process::{Pid, Signal, kill_process};
use rustix::termios::{OptionalActions, Termios, tcgetattr, tcsetattr};
use signal_hook::iterator::Signals;
use signal_hook::low_level::signal_name;

use super::close;
use crate::cli::failure::Failure;
use crate::cli::terminal::interrupt::{self, EXIT_SIGNALS, INTERRUPTED};
use crate::cli::worker_pipe::{self, WorkerMessage};

/// Interval of checks.
const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// Time after which a serving thread that does not react to a press counts as blocked. Together
/// with the board's time to confirm, it stays below 3 s.
pub(super) const BLOCKED_AFTER: Duration = Duration::from_secs(2);
/// Time limit for a worker to end at once.
const EXIT_TIMEOUT: Duration = Duration::from_secs(1);

/// The worker and its reported state.
struct Watch {
    child: Child,
    signals: Signals,
    presses: PipeWriter,
    message: PipeReader,
    /// An incomplete line.
    unparsed: Vec<u8>,
    terminal: Option<Termios>,
    is_listening: bool,
    may_be_armed: BTreeSet<String>,
    leaving: BTreeSet<String>,
    recordings: Vec<PathBuf>,
    /// Times of the presses, each of which requests an end.
    pressed: Vec<Instant>,
    /// Time when the input ended, which requests an end.
    input_ended: Option<Instant>,
}

/// Starts the worker and waits for its end; returns its exit code.
pub(super) fn watch(program: &[OsString], arguments: &[OsString]) -> u8 {
    match Watch::begin(program, arguments) {
        Ok(mut watch) => watch.until_end(),
        Err(error) => {
            let error = format!("cannot start the serving process: {error}");
            Failure::new(error).report();
            1
        }
    }
}

impl Watch {
    fn begin(program: &[OsString], arguments: &[OsString]) -> io::Result<Self> {
        let signals = Signals::new(EXIT_SIGNALS)?;
        let (its_presses, presses) = pipe()?;
        let (message, its_messages) = pipe()?;
        ioctl_fionbio(&message, true)?;
        // The worker inherits these two ends.
        fcntl_setfd(&its_presses, FdFlags::empty())?;
        fcntl_setfd(&its_messages, FdFlags::empty())?;
        let descriptors = (its_presses.as_raw_fd(), its_messages.as_raw_fd());
        let (me, (presses_fd, messages_fd)) = (std::process::id(), descriptors);
        // Saved before the worker changes the modes.
        let terminal = tcgetattr(io::stdin()).ok();
        let (program, words) = program.split_first().ok_or(ErrorKind::NotFound)?;
        let child = Command::new(program)
            .args(words)
            .args(arguments)
            .env(
                worker_pipe::VARIABLE,
                format!("{me}:{presses_fd}:{messages_fd}"),
            )
            .spawn()?;
        Ok(Self {
            child,
            signals,
            presses,
            message,
            unparsed: vec![],
            terminal,
            is_listening: false,
            may_be_armed: BTreeSet::new(),
            leaving: BTreeSet::new(),
            recordings: vec![],
            pressed: vec![],
            input_ended: None,
        })
    }

    fn until_end(&mut self) -> u8 {
        let mut was_killed = false;
        let status = loop {
            // Check for the end before the messages are read, so that none of an ended worker is
            // missed.
            let ended = self.child.try_wait();
            self.read_messages();
            match ended {
                Ok(None) => {}
                Ok(Some(status)) => break status,
                // The worker's state cannot be read any more.
                Err(_) => break ExitStatus::from_raw(1 << 8),
            }
            self.pass_signals();
            if !was_killed && self.is_stuck() {
                was_killed = self.child.kill().is_ok();
            }
            sleep(POLL_INTERVAL);
        };
        if status.signal().is_some() || !self.may_be_armed.is_empty() {
            self.clean_up(status, was_killed);
        }
        self.name_recordings();
        let code = match (was_killed, status.signal()) {
            (true, _) => INTERRUPTED,
            (false, Some(signal)) => 128 + signal,
            (false, None) => status.code().unwrap_or(1),
        };
        u8::try_from(code).unwrap_or(1)
    }

    /// Sends each signal on to the worker.
    fn pass_signals(&mut self) {
        for signal in self.signals.pending() {
            self.pressed.push(Instant::now());
            let _ = self.presses.write_all(b"!");
            // The worker does not read the pipe yet. It counts the same signal twice as one.
            let pid = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
            if let (false, Some(pid), Some(signal)) =
                (self.is_listening, pid, Signal::from_named_raw(signal))
            {
                let _ = kill_process(pid, signal);
            }
        }
    }

    fn is_stuck(&self) -> bool {
        let since = |requests: &Instant| requests.elapsed();
        let is_deaf = !self.may_be_armed.is_subset(&self.leaving);
        let mut requests = self.pressed.first().into_iter().chain(&self.input_ended);
        is_deaf && requests.any(|requests| since(requests) > BLOCKED_AFTER)
            || self.pressed.get(1).map(since) > Some(EXIT_TIMEOUT)
    }

    fn read_messages(&mut self) {
        let mut chunk = [0; 4096];
        loop {
            match self.message.read(&mut chunk) {
                Ok(n @ 1..) => self
                    .unparsed
                    .extend_from_slice(chunk.get(..n).unwrap_or(&[])),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                _ => break,
            }
        }
        while let Some(end) = self.unparsed.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = self.unparsed.drain(..=end).collect();
            if let Some(message) = line.get(..end).and_then(WorkerMessage::read) {
                self.on_message(message);
            }
        }
    }

    fn on_message(&mut self, message: WorkerMessage) {
        match message {
            WorkerMessage::Listening => self.is_listening = true,
            WorkerMessage::Pressed => self.pressed.push(Instant::now()),
            WorkerMessage::InputEnded => self.input_ended = Some(Instant::now()),
            WorkerMessage::MayBeArmed(address) => drop(self.may_be_armed.insert(address)),
            WorkerMessage::Leaving(address) => drop(self.leaving.insert(address)),
            WorkerMessage::Settled(address) => drop(self.may_be_armed.remove(&address)),
            WorkerMessage::Recording(path) => self.recordings.push(path),
        }
    }

    /// Closes devices, restores the terminal and names recordings, if the worker did not.
    fn clean_up(&mut self, status: ExitStatus, was_killed: bool) {
        let (done, closed) = channel();
        for address in &self.may_be_armed {
            close::begin(address.clone(), done.clone());
        }
        drop(done);
        self.restore_terminal();
        if let Some(signal) = status.signal() {
            interrupt::print_line(match was_killed {
                true => "the program did not react to Ctrl-C and was killed\n".into(),
                false => {
                    let name = signal_name(signal).unwrap_or("a signal");
                    format!("the serving process was ended by {name}\n")
                }
            });
        }
        let _ = self.signals.pending().count();
        while !self.may_be_armed.is_empty() && self.signals.pending().next().is_none() {
            let line = match closed.recv_timeout(POLL_INTERVAL) {
                Ok((address, Ok(()))) => {
                    self.may_be_armed.remove(&address);
                    format!("{address}: the board has confirmed that it is disarmed\n")
                }
                Ok((_, Err(_))) | Err(RecvTimeoutError::Timeout) => continue,
                Err(RecvTimeoutError::Disconnected) => break,
            };
            interrupt::print_line(line);
        }
        if let Some(line) = interrupt::not_confirmed(&self.may_be_armed) {
            interrupt::print_line(line);
        }
    }

    /// Names the incomplete recordings.
    fn name_recordings(&self) {
        for path in &self.recordings {
            if let Ok(file) = fs::metadata(path) {
                let (path, bytes) = (path.display(), file.len());
                interrupt::print_line(format!(
                    "recording      {path} ({bytes} bytes) is incomplete (its last line may be cut); it stays until you delete it\n"
                ));
            }
        }
    }

    /// Restores the terminal's modes. The cursor may be anywhere in a line.
    fn restore_terminal(&self) {
        if let Some(before) = &self.terminal {
            let _ = tcsetattr(io::stdin(), OptionalActions::Now, before);
            interrupt::print_line("\n".into());
        }
    }
}
