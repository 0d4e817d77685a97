//! The questions of a calibration, at a terminal or from a pipe whose lines are the answers.

use crate::calibrate::{Attendant, Direction, N_PER_GRAM, Review, Stopped};
use crate::cli::terminal::questions::{number, prompt};
use crate::cli::terminal::writer::{print_line, show};

/// A user at a terminal.
pub(super) struct UserAtTerminal {
    yes: bool,
}

impl UserAtTerminal {
    /// Creates a user; `yes` accepts every question in advance.
    pub(super) fn new(yes: bool) -> Self {
        Self { yes }
    }
}

impl Attendant for UserAtTerminal {
    fn notify(&mut self, line: &str) {
        print_line(format!("  {line}"));
    }

    fn zero_pose(&mut self) -> Result<(), Stopped> {
        print_line(
            "put the arm into its zero pose and hold it: upper link level and pointing at you, fore link hanging straight down",
        );
        prompt("  press Enter when it is there (q stops)")
            .map(drop)
            .ok_or(Stopped)
    }

    fn move_along(&mut self, direction: Direction, about_mm: f64) -> Result<f64, Stopped> {
        print_line(format!(
            "place a ruler at the tip, {}; move the tip along it by about {about_mm} mm and hold it",
            direction.words()
        ));
        let moved =
            number(&format!("  how far did it move, in mm? [{about_mm}]")).ok_or(Stopped)?;
        Ok(moved.unwrap_or(about_mm))
    }

    fn hold_still(&mut self, pose: usize) -> Result<Option<[f64; 2]>, Stopped> {
        if pose == 1 {
            print_line(
                "gravity: hold the tip by a thread on a spring or kitchen scale, everything still, in poses that differ;\n  \
                 state the scale's reading upwards and towards you (negative: down, away from you)",
            );
        }
        let grams = |question: String| number(&question).ok_or(Stopped);
        let Some(up) = grams(format!("  pose {pose}: grams upwards? [no more poses]"))? else {
            return Ok(None);
        };
        let towards = grams(format!("  pose {pose}: grams towards you? [0]"))?;
        Ok(Some(
            [up, towards.unwrap_or(0.0)].map(|grams| grams * N_PER_GRAM),
        ))
    }

    fn confirm_record(&mut self, review: &Review) -> Result<bool, Stopped> {
        show(review);
        if self.yes {
            return Ok(true);
        }
        let answer = prompt("accept this record? [y/N]").ok_or(Stopped)?;
        Ok(matches!(answer.as_str(), "y" | "Y" | "yes"))
    }
}
