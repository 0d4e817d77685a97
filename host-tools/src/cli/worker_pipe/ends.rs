//! The worker's end of the two pipes.

use std::fs::File;
use std::io::{self, Write};
use std::os::unix::process::parent_id;
use std::sync::{Mutex, OnceLock, PoisonError};

use super::WorkerMessage;

/// The variable with the guardian's process number and the descriptors of the two pipes. The
/// worker's child processes ignore it, because their parent is another process.
pub(in crate::cli) const VARIABLE: &str = "HAPTERRA_GUARDIAN";

/// Destination of messages; empty if this process is no worker.
static MESSAGES: OnceLock<Mutex<File>> = OnceLock::new();

/// Connects to the guardian, and returns the pipe of its presses of Ctrl-C; `None` if no guardian
/// started this process.
pub(in crate::cli) fn connect() -> Option<io::Result<File>> {
    let [presses, message] = descriptors()?;
    let connected = pipes(presses, message).map(|(presses, message)| {
        let _ = MESSAGES.set(Mutex::new(message));
        presses
    });
    Some(connected)
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

pub(super) fn is_connected() -> bool {
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
