//! Lines from standard input for any waiting thread, or its keys one by one.
//!
//! A thread reads, so that Ctrl-C is heeded while a line is waited for, and so that what
//! was typed before a question is not taken for its answer. Where the terminal is in raw mode
//! when that begins, it reads keys, and no lines.

use std::io::{self, BufRead, IsTerminal};
use std::mem;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

use super::interrupt;
use super::raw_keys::{self, Pressed};
use super::raw_mode;
use crate::steering::keys::Key;

/// Lines that wait to be taken.
const WAITING: usize = 64;
/// Between two looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// Standard input, line by line.
pub(in crate::cli) struct Keyboard {
    lines: Receiver<String>,
    pressed: Receiver<Pressed>,
    /// Keys that were taken while Enter was looked for.
    keys: Vec<Key>,
    /// Number of times that Enter was pressed and not taken.
    enters: usize,
    /// A keyboard: a line that was typed before a question is no answer. What a pipe
    /// holds is there on purpose.
    is_typed: bool,
}

/// The one keyboard, which is read from the first call on.
pub(in crate::cli) fn keyboard() -> MutexGuard<'static, Keyboard> {
    static KEYBOARD: OnceLock<Mutex<Keyboard>> = OnceLock::new();
    let keyboard = KEYBOARD.get_or_init(|| Mutex::new(Keyboard::listening()));
    keyboard.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Keyboard {
    fn listening() -> Self {
        let (typed, lines) = sync_channel(WAITING);
        let (press, pressed) = sync_channel(WAITING);
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

    /// Sorts the keys that were pressed.
    fn sort(&mut self) {
        for pressed in self.pressed.try_iter() {
            match pressed {
                Pressed::Enter => self.enters += 1,
                Pressed::Key(key) => self.keys.push(key),
            }
        }
    }

    /// The keys besides Enter that were pressed since the last look.
    pub(in crate::cli) fn keys(&mut self) -> Vec<Key> {
        self.sort();
        mem::take(&mut self.keys)
    }

    /// Returns the keys since the last call, in order; a line of a single digit is that key, and
    /// each line ends in Enter. Nothing without a keyboard.
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

    /// Forgets what was typed so far. Keys that change a view are no answer anyway.
    pub(in crate::cli) fn forget_typed(&mut self) {
        self.sort();
        self.enters = 0;
        while self.is_typed && self.lines.try_recv().is_ok() {}
    }

    /// Returns true if a line was typed, or Enter was pressed, since the last look; never where
    /// there is no input.
    pub(in crate::cli) fn was_pressed(&mut self) -> bool {
        self.sort();
        let pressed = mem::take(&mut self.enters) > 0;
        pressed || (self.is_typed && self.lines.try_iter().count() > 0)
    }

    /// Waits for the next line; none where the input ends or an end is asked for.
    pub(in crate::cli) fn line(&self) -> Option<String> {
        while !interrupt::requested() {
            match self.lines.recv_timeout(LOOK) {
                Ok(line) => return Some(line),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return None,
            }
        }
        None
    }
}

/// The digit that is all of a line.
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
        let taken = match is_typed {
            // Earlier input is no answer.
            true => !matches!(typed.try_send(line), Err(TrySendError::Disconnected(_))),
            false => typed.send(line).is_ok(),
        };
        if !taken {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_typed_before_a_question_is_no_answer_and_what_a_pipe_holds_is() {
        let (typed, lines) = sync_channel(WAITING);
        let (press, pressed) = sync_channel(WAITING);
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
        assert_eq!(keyboard.keys(), [zoom], "which answers nothing");
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
    fn keys_and_lines_come_in_their_order() {
        let (typed, lines) = sync_channel(WAITING);
        let (press, pressed) = sync_channel(WAITING);
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
        assert_eq!(
            keyboard.pressed(),
            [],
            "a pipe's lines are for somebody else"
        );
    }
}
