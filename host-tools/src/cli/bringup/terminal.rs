//! Tasks and questions of a bring-up at a terminal.

use std::time::Instant;

use crate::bringup::{Attendant, Question, Reading, Stopped, Task};
use crate::cli::terminal::interrupt;
use crate::cli::terminal::questions::{number, prompt};
use crate::cli::terminal::writer::print_line;
use crate::link::DeviceAddress;

/// A user at a terminal.
pub(super) struct UserAtTerminal {
    /// Start of the time measurement on this computer's clock.
    pub(super) since: Instant,
    /// The board.
    pub(super) address: DeviceAddress,
}

impl Attendant for UserAtTerminal {
    fn notify(&mut self, line: &str) {
        print_line(line);
    }

    fn begin(&mut self, task: Task) {
        print_line(format!("  > {task}"));
    }

    fn finish(&mut self, task: Task) -> Result<(), Stopped> {
        print_line(format!("  > {task}"));
        prompt("    press Enter when that is done (q stops)")
            .map(drop)
            .ok_or(Stopped)
    }

    fn read(&mut self, reading: Reading) -> Result<f64, Stopped> {
        loop {
            if let Some(value) = number(&format!("  ? {reading}")).ok_or(Stopped)? {
                return Ok(value);
            }
        }
    }

    fn confirm(&mut self, question: Question) -> Result<bool, Stopped> {
        let answer = prompt(&format!("  ? {question} [y/N]")).ok_or(Stopped)?;
        Ok(matches!(answer.as_str(), "y" | "Y" | "yes"))
    }

    fn stop_check(&self) -> fn() -> bool {
        interrupt::requested
    }

    fn time_s(&self, _board_ms: f64) -> f64 {
        self.since.elapsed().as_secs_f64()
    }

    fn may_be_armed(&mut self, may: bool) {
        interrupt::device_may_be_armed("", &self.address, may);
    }
}
