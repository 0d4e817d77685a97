//! The questions of a calibration at a terminal, or at a pipe, whose lines are
//! the answers.

use std::io::{self, BufRead, Write};

use crate::calibrate::{Attendant, Direction, N_PER_GRAM, Review, Stopped};

/// A user at a terminal.
pub(super) struct UserAtTerminal {
    yes: bool,
}

impl UserAtTerminal {
    /// A user who may have agreed beforehand.
    pub(super) fn new(yes: bool) -> Self {
        Self { yes }
    }

    /// Asks, and gives the answer without the space around it. The end of the
    /// input, and `q`, stop.
    fn ask(&self, question: &str) -> Result<String, Stopped> {
        print!("{question} ");
        // What cannot be shown cannot be answered either: the read decides.
        let _ = io::stdout().flush();
        let mut line = String::new();
        match io::stdin().lock().read_line(&mut line) {
            Ok(0) | Err(_) => {
                println!();
                Err(Stopped)
            }
            Ok(_) if line.trim() == "q" => Err(Stopped),
            Ok(_) => Ok(line.trim().to_owned()),
        }
    }

    /// Asks until the answer is a number, or nothing.
    fn number(&self, question: &str) -> Result<Option<f64>, Stopped> {
        loop {
            let answer = self.ask(question)?.replace(',', ".");
            match answer.parse::<f64>() {
                _ if answer.is_empty() => return Ok(None),
                Ok(number) if number.is_finite() => return Ok(Some(number)),
                _ => println!("  {answer} is no number (q stops)"),
            }
        }
    }
}

impl Attendant for UserAtTerminal {
    fn hear(&mut self, line: &str) {
        println!("  {line}");
    }

    fn zero_pose(&mut self) -> Result<(), Stopped> {
        println!(
            "put the arm into its zero pose and hold it: upper link level and pointing at you, fore link hanging straight down"
        );
        self.ask("  press Enter when it is there (q stops)")
            .map(drop)
    }

    fn move_along(&mut self, direction: Direction, about_mm: f64) -> Result<f64, Stopped> {
        println!(
            "lay a ruler at the tip, {}; move the tip along it by about {about_mm} mm and hold it",
            direction.words()
        );
        let moved = self.number(&format!("  how far did it go, in mm? [{about_mm}]"))?;
        Ok(moved.unwrap_or(about_mm))
    }

    fn hold_still(&mut self, number: usize) -> Result<Option<[f64; 2]>, Stopped> {
        if number == 1 {
            println!(
                "gravity: hold the tip by a thread on a spring or kitchen scale, everything still, in poses that differ;\n  \
                 tell what the scale reads upwards and towards you (negative: down, away from you)"
            );
        }
        let Some(up) = self.number(&format!("  pose {number}: grams upwards? [no more poses]"))?
        else {
            return Ok(None);
        };
        let towards = self.number(&format!("  pose {number}: grams towards you? [0]"))?;
        Ok(Some(
            [up, towards.unwrap_or(0.0)].map(|grams| grams * N_PER_GRAM),
        ))
    }

    fn agrees(&mut self, review: &Review) -> Result<bool, Stopped> {
        print!("{review}");
        if self.yes {
            return Ok(true);
        }
        let answer = self.ask("take this record? [y/N]")?;
        Ok(matches!(answer.as_str(), "y" | "Y" | "yes"))
    }
}
