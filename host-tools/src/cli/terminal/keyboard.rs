//! Lines or single keys from standard input, for any thread that waits.
//!
//! A separate thread reads, so that Ctrl-C works during a wait for a line, and input before a
//! question is no answer. If the terminal is in raw mode at the start, it reads keys instead of
//! lines.

use std::io::{self, BufRead, IsTerminal};
use std::mem;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

use super::interrupt;
use super::raw_keys::{self, Pressed};
use super::raw_mode;
use crate::steering::keys::Key;

/// Maximum pending lines.
const MAX_WAITING: usize = 64;
/// Interval of checks for Ctrl-C.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Standard input, line by line.
pub(in crate::cli) struct Keyboard {
    lines: Receiver<String>,
    pressed: Receiver<Pressed>,
    /// Keys read while Enter was expected.
    keys: Vec<Key>,
    /// Number of unused presses of Enter.
    enters: usize,
    /// True for a keyboard, whose lines before a question are no answer. Lines from a pipe are
    /// always answers.
    is_typed: bool,
}

/// Returns the one keyboard; the first call starts to read it.
pub(in crate::cli) fn keyboard() -> MutexGuard<'static, Keyboard> {
    static KEYBOARD: OnceLock<Mutex<Keyboard>> = OnceLock::new();
    let keyboard = KEYBOARD.get_or_init(|| Mutex::new(Keyboard::listening()));
    keyboard.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Keyboard {
    fn listening() -> Self {
        let (typed, lines) = sync_channel(MAX_WAITING);
        let (press, pressed) = sync_channel(MAX_WAITING);
        let is_typed = io::stdin().is_terminal();
        let reads_keys = raw_mode::is_raw();
        std::thread::spawn(move || {
            if reads_keys {
                raw_keys::read(&press);
            }
            read(&typed, is_typed);
        });
        Self {
            lines,
            pressed,
            keys: vec![],
            enters: 0,
            is_typed,
        }
    }

    /// Separates Enter from other keys.
    fn sort(&mut self) {
        for pressed in self.pressed.try_iter() {
            match pressed {
                Pressed::Enter => self.enters += 1,
                Pressed::Key(key) => self.keys.push(key),
            }
        }
    }

    /// Returns the keys except Enter that were pressed since the last call.
    pub(in crate::cli) fn keys(&mut self) -> Vec<Key> {
        self.sort();
        mem::take(&mut self.keys)
    }

    /// Returns the keys since the last call, in order. A line becomes an Enter, after its digit if
    /// it is a single digit. Empty without a keyboard.
    pub(super) fn pressed(&mut self) -> Vec<Pressed> {
        let mut pressed: Vec<_> = self.pressed.try_iter().collect();
        if self.is_typed {
            for line in self.lines.try_iter() {
                pressed.extend(digit(&line).map(|digit| Pressed::Key(Key::Char(digit))));
                pressed.push(Pressed::Enter);
            }
        }
        pressed
    }

    /// Discards earlier lines and presses of Enter. Other keys remain, because they are no answers.
    pub(in crate::cli) fn forget_typed(&mut self) {
        self.sort();
        self.enters = 0;
        while self.is_typed && self.lines.try_recv().is_ok() {}
    }

    /// Returns true if a line was typed, or Enter pressed, since the last call; false for a pipe.
    pub(in crate::cli) fn was_pressed(&mut self) -> bool {
        self.sort();
        let pressed = mem::take(&mut self.enters) > 0;
        pressed || (self.is_typed && self.lines.try_iter().count() > 0)
    }

    /// Waits for the next line; returns `None` if the input ends or an end is requested.
    pub(in crate::cli) fn line(&self) -> Option<String> {
        while !interrupt::requested() {
            match self.lines.recv_timeout(POLL_INTERVAL) {
                Ok(line) => return Some(line),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return None,
            }
        }
        None
    }
}

/// Returns the digit of a line that has only this digit.
fn digit(line: &str) -> Option<char> {
    let mut chars = line.trim().chars();
    let digit = chars.next().filter(char::is_ascii_digit);
    digit.filter(|_| chars.next().is_none())
}

fn read(typed: &SyncSender<String>, is_typed: bool) {
    for line in io::stdin().lock().lines() {
        let Ok(line) = line else {
            return;
        };
        let queued = match is_typed {
            // Input beyond the limit is older than any question, so it is no answer.
            true => !matches!(typed.try_send(line), Err(TrySendError::Disconnected(_))),
            false => typed.send(line).is_ok(),
        };
        if !queued {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Safety: 6.
    #[test]
    fn forget_typed_drops_typed_answers_but_not_piped_lines() {
        let (typed, lines) = sync_channel(MAX_WAITING);
        let (press, pressed) = sync_channel(MAX_WAITING);
        let mut keyboard = Keyboard {
            lines,
            pressed,
            keys: vec![],
            enters: 0,
            is_typed: true,
        };
        press.send(Pressed::Enter).expect("read");
        let zoom = Key::Char('+');
        press.send(Pressed::Key(zoom)).expect("read");
        keyboard.forget_typed();
        assert!(!keyboard.was_pressed());
        assert_eq!(keyboard.keys(), [zoom], "which answers no question");
        press.send(Pressed::Enter).expect("read");
        assert!(keyboard.was_pressed() && !keyboard.was_pressed());
        typed.send("y".into()).expect("read");
        keyboard.forget_typed();
        assert!(!keyboard.was_pressed());
        typed.send("n".into()).expect("read");
        assert_eq!(keyboard.line().as_deref(), Some("n"));
        keyboard.is_typed = false;
        typed.send("1".into()).expect("read");
        keyboard.forget_typed();
        drop(typed);
        assert_eq!(keyboard.line().as_deref(), Some("1"));
        assert_eq!(keyboard.line(), None);
    }

    #[test]
    fn typed_lines_become_key_presses_but_piped_lines_do_not() {
        let (typed, lines) = sync_channel(MAX_WAITING);
        let (press, pressed) = sync_channel(MAX_WAITING);
        let mut keyboard = Keyboard {
            lines,
            pressed,
            keys: vec![],
            enters: 0,
            is_typed: true,
        };
        let (two, enter) = (Pressed::Key(Key::Char('2')), Pressed::Enter);
        press.send(two).expect("read");
        press.send(enter).expect("read");
        for line in ["2", " 2 ", "22", "", "y"] {
            typed.send(line.into()).expect("read");
        }
        let expected = [two, enter, two, enter, two, enter, enter, enter, enter];
        assert_eq!(keyboard.pressed(), expected);
        keyboard.is_typed = false;
        typed.send("2".into()).expect("read");
        assert_eq!(keyboard.pressed(), [], "a pipe's lines have another reader");
    }
}
