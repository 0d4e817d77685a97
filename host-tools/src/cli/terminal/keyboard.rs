//! Lines from standard input, whoever waits for them.
//!
//! A thread reads, so that Ctrl-C is heeded while a line is waited for, and so that what
//! was typed before a question is not taken for its answer.

use std::io::{self, BufRead, IsTerminal};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

use super::interrupt;

/// Lines that wait to be taken.
const WAITING: usize = 64;
/// Between two looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// Standard input, line by line.
pub(in crate::cli) struct Keyboard {
    lines: Receiver<String>,
    /// Somebody types: a line that was typed before a question is no answer. What a pipe
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
        let is_typed = io::stdin().is_terminal();
        std::thread::spawn(move || read(&typed, is_typed));
        Self { lines, is_typed }
    }

    /// Forgets what was typed so far.
    pub(in crate::cli) fn forget_typed(&self) {
        while self.is_typed && self.lines.try_recv().is_ok() {}
    }

    /// Whether a line was typed since the last look; never where nobody types.
    pub(in crate::cli) fn was_pressed(&self) -> bool {
        self.is_typed && self.lines.try_iter().count() > 0
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

fn read(typed: &SyncSender<String>, is_typed: bool) {
    for line in io::stdin().lock().lines() {
        let Ok(line) = line else {
            return;
        };
        let taken = match is_typed {
            // Whoever types ahead so far does not answer anything.
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
        let mut keyboard = Keyboard {
            lines,
            is_typed: true,
        };
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
}
