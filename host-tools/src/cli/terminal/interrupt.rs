//! Ctrl-C, and the signals that ask a program to end or tell that its terminal is
//! gone: the first asks for a clean end, the second ends at once.

use std::collections::BTreeSet;
use std::io;
use std::process::exit;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Mutex, MutexGuard, Once, PoisonError};
use std::thread::Builder;
use std::time::Duration;

use super::raw_keys;
use super::voice::put;

static REQUESTED: AtomicBool = AtomicBool::new(false);
/// The boards that may be armed by this program, by what lines about them begin with: nothing,
/// where there is one.
static MAY_BE_ARMED: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// In this time that is written, or nobody reads it.
const WRITTEN: Duration = Duration::from_millis(200);

/// Exit code of a program that was interrupted twice, as shells have it.
const INTERRUPTED: i32 = 130;

/// Listens from now on.
pub(in crate::cli) fn listen() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let listening = ctrlc::set_handler(press);
        if let Err(error) = listening {
            // Then it ends this program the hard way, as without a handler.
            tracing::debug!("cannot listen to Ctrl-C: {error}");
        }
    });
}

/// Ctrl-C, from wherever it is heard: the first asks for an end, the second ends at once.
pub(in crate::cli) fn press() {
    if REQUESTED.swap(true, Ordering::Relaxed) {
        raw_keys::put_back();
        if let Some(line) = not_confirmed(&may_be_armed()) {
            say(line);
        }
        exit(INTERRUPTED);
    }
}

/// What is said where a program ends that may leave these boards armed.
fn not_confirmed(boards: &BTreeSet<String>) -> Option<String> {
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

/// Writes to a terminal that somebody reads; one that nobody reads does not hold the end
/// up.
fn say(line: String) {
    let (done, is_done) = channel();
    let write = move || {
        put(io::stderr(), &line);
        let _ = done.send(());
    };
    if Builder::new().spawn(write).is_ok() {
        let _ = is_done.recv_timeout(WRITTEN);
    }
}

/// Says whether a board may be armed by this program from now on: who ends it at once
/// is then told to switch the amplifiers off.
pub(in crate::cli) fn board_may_be_armed(may: bool) {
    device_may_be_armed("", may);
}

/// The same of one of several boards, by what lines about it begin with.
pub(in crate::cli) fn device_may_be_armed(name: &str, may: bool) {
    let mut boards = may_be_armed();
    match may {
        true => boards.insert(name.to_owned()),
        false => boards.remove(name),
    };
}

fn may_be_armed() -> MutexGuard<'static, BTreeSet<String>> {
    // Nothing that panics runs while this is held.
    MAY_BE_ARMED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whether an end was asked for.
#[must_use]
pub(in crate::cli) fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_ends_it_at_once_is_told_of_each_board_that_may_be_armed() {
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
