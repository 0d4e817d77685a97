//! The worker's end of the two pipes.

use std::fs::File;
use std::io::{self, Read, Write};
use std::os::unix::process::parent_id;
use std::sync::{Mutex, OnceLock, PoisonError};
use std::thread::Builder;

use super::WorkerMessage;
use crate::cli::terminal::interrupt;

/// The variable with the guardian's process number and the descriptors of the two pipes. The
/// worker's child processes ignore it, because their parent is another process.
pub(super) const VARIABLE: &str = "HAPTERRA_GUARDIAN";

/// Destination of messages; empty if this process is no worker.
static MESSAGES: OnceLock<Mutex<File>> = OnceLock::new();

/// Connects to the guardian. Returns false if no guardian started this process.
pub(super) fn begin() -> bool {
    let Some([presses, message]) = descriptors() else {
        return false;
    };
    let connected = pipes(presses, message).and_then(|(presses, message)| {
        let _ = MESSAGES.set(Mutex::new(message));
        let listen = move || listen(presses);
        Builder::new().name("guardian".into()).spawn(listen)
    });
    if let Err(error) = connected {
        // The guardian still detects the end of this process, and sends signals on.
        eprintln!("warning: the guardian does not know which arm may be armed: {error}");
    }
    true
}

pub(super) fn has_guardian() -> bool {
    descriptors().is_some()
}

/// Returns the two descriptors if this process is the guardian's child.
fn descriptors() -> Option<[u32; 2]> {
    let variable = std::env::var(VARIABLE).ok()?;
    let numbers: Vec<u32> = variable.split(':').map_while(|n| n.parse().ok()).collect();
    match numbers[..] {
        [guardian, presses, message] if guardian == parent_id() => Some([presses, message]),
        _ => None,
    }
}

fn pipes(presses: u32, message: u32) -> io::Result<(File, File)> {
    let of = |descriptor: u32| format!("/dev/fd/{descriptor}");
    let presses = File::open(of(presses))?;
    let message = File::options().write(true).open(of(message))?;
    Ok((presses, message))
}

pub(super) fn is_worker() -> bool {
    MESSAGES.get().is_some()
}

pub(super) fn report(message: &WorkerMessage) {
    if let Some(to) = MESSAGES.get() {
        let line = [message.line(), b"\n".to_vec()].concat();
        let mut to = to.lock().unwrap_or_else(PoisonError::into_inner);
        // The reader detects the end of the guardian.
        let _ = to.write_all(&line);
    }
}

/// Reads presses: each byte is one of Ctrl-C; the end of the pipe is the guardian's end.
fn listen(mut presses: File) {
    while let Ok(1) = presses.read(&mut [0]) {
        interrupt::press_if_listening();
    }
    interrupt::end_without_guardian();
}
