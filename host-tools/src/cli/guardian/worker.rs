//! The worker's reaction to its guardian.

use std::fs::File;
use std::io::Read;
use std::thread::Builder;

use crate::cli::terminal::interrupt;
use crate::cli::worker_pipe;

/// Connects to the guardian. Returns false if no guardian started this process.
pub(super) fn begin() -> bool {
    let Some(connected) = worker_pipe::connect() else {
        return false;
    };
    let listening = connected.and_then(|presses| {
        let listen = move || listen(presses);
        Builder::new().name("guardian".into()).spawn(listen)
    });
    if let Err(error) = listening {
        // The guardian still detects the end of this process, and sends signals on.
        eprintln!("warning: the guardian cannot be notified of an arm that may be armed: {error}");
    }
    true
}

/// Reads presses: each byte is one of Ctrl-C; the end of the pipe is the guardian's end.
fn listen(mut presses: File) {
    while let Ok(1) = presses.read(&mut [0]) {
        interrupt::press_if_listening();
    }
    interrupt::end_without_guardian();
}
