//! The first power-up's tasks and questions at a terminal.

use crate::bringup::{Attendant, Question, Reading, Stopped, Task};
use crate::cli::terminal::questions::{ask, number};

/// A user at a terminal.
pub(super) struct UserAtTerminal;

impl Attendant for UserAtTerminal {
    fn hear(&mut self, line: &str) {
        println!("{line}");
    }

    fn begin(&mut self, task: Task) {
        println!("  > {task}");
    }

    fn finish(&mut self, task: Task) -> Result<(), Stopped> {
        println!("  > {task}");
        ask("    press Enter when that is done (q stops)")
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

    fn confirms(&mut self, question: Question) -> Result<bool, Stopped> {
        let answer = ask(&format!("  ? {question} [y/N]")).ok_or(Stopped)?;
        Ok(matches!(answer.as_str(), "y" | "Y" | "yes"))
    }
}
