//! The worker's ends of the two pipes between it and its guardian.

#[cfg(unix)]
mod ends;
mod message;

#[cfg(unix)]
pub(in crate::cli) use ends::{VARIABLE, connect};
pub(in crate::cli) use message::WorkerMessage;

/// Returns true in a worker whose guardian counts the presses of Ctrl-C.
pub(in crate::cli) fn counts_presses() -> bool {
    #[cfg(unix)]
    return ends::is_connected();
    #[cfg(not(unix))]
    false
}

/// Returns true in a process that a guardian started.
pub(in crate::cli) fn is_worker() -> bool {
    #[cfg(unix)]
    return ends::has_guardian();
    #[cfg(not(unix))]
    false
}

/// Sends a message to the guardian, if there is one.
pub(in crate::cli) fn report(message: &WorkerMessage) {
    #[cfg(unix)]
    ends::report(message);
    #[cfg(not(unix))]
    let _ = message;
}
