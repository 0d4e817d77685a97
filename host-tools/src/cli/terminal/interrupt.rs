//! Ctrl-C, and the signals that request an end or report a closed terminal: the first requests a
//! clean end, the second ends the program at once.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::io;
use std::process::exit;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Mutex, MutexGuard, Once, PoisonError};
use std::thread::Builder;
use std::time::Duration;

use super::raw_mode;
use super::writer::write_text;
use crate::cli::worker_pipe::{self, WorkerMessage};
use crate::link::DeviceAddress;

/// Signals that request an end.
#[cfg(unix)]
pub(in crate::cli) const EXIT_SIGNALS: [i32; 7] = {
    use signal_hook::consts::signal::{
        SIGALRM, SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGUSR1, SIGUSR2,
    };
    [SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1, SIGUSR2, SIGALRM]
};

static IS_LISTENING: AtomicBool = AtomicBool::new(false);
/// True if an end was requested.
static REQUESTED: AtomicBool = AtomicBool::new(false);
/// True if the user pressed Ctrl-C, or its equivalent.
static PRESSED: AtomicBool = AtomicBool::new(false);
/// The boards that this program may have armed, by the prefix of their lines; the prefix is empty
/// for a single board.
static MAY_BE_ARMED: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// Time-out of a write to a terminal without a reader.
const WRITE_TIMEOUT: Duration = Duration::from_millis(200);

/// Exit code of a program that was interrupted twice, by the convention of shells.
pub(in crate::cli) const INTERRUPTED: i32 = 130;

thread_local! {
    /// The device that this thread serves, until it detects the request to end.
    static SERVES: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Starts to handle signals.
pub fn listen() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| match handle(on_signal) {
        Ok(()) => {
            IS_LISTENING.store(true, Ordering::Relaxed);
            worker_pipe::report(&WorkerMessage::Listening);
        }
        // Then Ctrl-C ends the program at once, as without a handler.
        Err(error) => tracing::debug!("cannot listen to Ctrl-C: {error}"),
    });
}

#[cfg(unix)]
fn handle(on_signal: fn()) -> io::Result<()> {
    let mut signals = signal_hook::iterator::Signals::new(EXIT_SIGNALS)?;
    let wait = move || signals.forever().for_each(|_| on_signal());
    Builder::new().name("signals".into()).spawn(wait).map(drop)
}

#[cfg(windows)]
fn handle(on_signal: fn()) -> io::Result<()> {
    ctrlc::set_handler(on_signal).map_err(io::Error::other)
}

/// Handles a signal. In a terminal Ctrl-C reaches the worker and its guardian, which sends it on.
/// The signal alone only requests an end; presses from the guardian are counted.
fn on_signal() {
    match worker_pipe::counts_presses() {
        true => REQUESTED.store(true, Ordering::Relaxed),
        false => press(),
    }
}

/// Handles a press from the guardian, which also sends the signal until this program handles
/// presses.
#[cfg(unix)]
pub(in crate::cli) fn press_if_listening() {
    if IS_LISTENING.load(Ordering::Relaxed) {
        press();
    }
}

/// Ends this program as after Ctrl-C, because its guardian has ended.
#[cfg(unix)]
pub(in crate::cli) fn end_without_guardian() {
    if !IS_LISTENING.load(Ordering::Relaxed) {
        exit(INTERRUPTED);
    }
    super::writer::notify("the supervising process has ended: this one ends as well");
    REQUESTED.store(true, Ordering::Relaxed);
}

/// Handles Ctrl-C as a key.
pub(super) fn press_key() {
    worker_pipe::report(&WorkerMessage::Pressed);
    press();
}

/// Requests an end because the program that sends commands has ended. A press at the same time is
/// the first, because in a terminal Ctrl-C reaches both programs.
pub(in crate::cli) fn input_ended() {
    worker_pipe::report(&WorkerMessage::InputEnded);
    REQUESTED.store(true, Ordering::Relaxed);
}

/// Handles a Ctrl-C from any source: the first requests an end, the second ends the program at
/// once.
fn press() {
    REQUESTED.store(true, Ordering::Relaxed);
    if PRESSED.swap(true, Ordering::Relaxed) {
        raw_mode::restore();
        if let Some(line) = not_confirmed(&may_be_armed()) {
            print_line(line);
        }
        exit(INTERRUPTED);
    }
}

/// Returns the final message of a program that may leave these boards armed.
pub(in crate::cli) fn not_confirmed(boards: &BTreeSet<String>) -> Option<String> {
    let names: Vec<&str> = boards.iter().map(String::as_str).collect();
    let (who, is) = match &names[..] {
        [] => return None,
        [""] => ("the board".to_owned(), "it is"),
        [one] => ((*one).to_owned(), "it is"),
        several => (several.join(" and "), "they are"),
    };
    Some(format!(
        "ended at once: {who} did not confirm that {is} disarmed: switch the amplifiers off\n"
    ))
}

/// Writes to a terminal; one without a reader does not delay the end.
pub(in crate::cli) fn print_line(line: String) {
    let (done, is_done) = channel();
    let write = move || {
        write_text(io::stderr(), &line);
        let _ = done.send(());
    };
    if Builder::new().spawn(write).is_ok() {
        let _ = is_done.recv_timeout(WRITE_TIMEOUT);
    }
}

/// Sets whether this program may have armed a board. If so, a user who ends the program at once
/// gets the message to switch the amplifiers off. The thread that serves the board calls this
/// function, and then [`requested`] many times a second. `name` is the prefix of the board's lines,
/// empty for a single board.
pub(in crate::cli) fn device_may_be_armed(name: &str, address: &DeviceAddress, may: bool) {
    match may {
        true => may_be_armed().insert(name.to_owned()),
        false => may_be_armed().remove(name),
    };
    if *address != DeviceAddress::Native {
        let address = address.to_string();
        SERVES.set(may.then(|| address.clone()));
        worker_pipe::report(&match may {
            true => WorkerMessage::MayBeArmed(address),
            false => WorkerMessage::Settled(address),
        });
    }
}

fn may_be_armed() -> MutexGuard<'static, BTreeSet<String>> {
    // No code that panics runs while the lock is held.
    MAY_BE_ARMED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns true if an end was requested.
#[must_use]
pub fn requested() -> bool {
    let requested = REQUESTED.load(Ordering::Relaxed);
    if requested && let Some(address) = SERVES.take() {
        worker_pipe::report(&WorkerMessage::Leaving(address));
    }
    requested
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn immediate_exit_names_each_board_that_may_be_armed() {
        let of = |names: &[&str]| {
            let names = names.iter().map(|name| (*name).to_owned());
            not_confirmed(&names.collect())
        };
        assert_eq!(of(&[]), None);
        let one = of(&[""]).expect("a line");
        assert!(one.contains("the board did not confirm that it is disarmed: switch"));
        let two = of(&["[2 usb:7]", "[1 native]"]).expect("a line");
        let both = "[1 native] and [2 usb:7] did not confirm that they are disarmed: switch";
        assert!(two.contains(both), "{two}");
    }
}
