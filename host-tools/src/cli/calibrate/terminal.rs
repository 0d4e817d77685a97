//! The walk at a terminal; or at a pipe, whose lines are the answers.

use std::io::{self, BufRead, Write};

use crate::calibrate::{Attendant, Direction, Review, Stopped, VirtualUser};

/// Newtons of a gram's weight.
const N_PER_GRAM: f64 = 9.806_65e-3;

/// A user at a terminal.
pub(super) struct Terminal {
    yes: bool,
}

impl Terminal {
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

impl Attendant for Terminal {
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
                "gravity: hold the tip by a thread on a spring or kitchen scale, everything still, in poses that differ;"
            );
            println!(
                "  tell what the scale reads upwards and towards you (negative: down, away from you)"
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
        show(review);
        if self.yes {
            return Ok(true);
        }
        let answer = self.ask("take this record? [y/N]")?;
        Ok(matches!(answer.as_str(), "y" | "Y" | "yes"))
    }
}

/// Shows what a virtual user does.
pub(super) struct Watched<'u>(pub(super) &'u mut VirtualUser);

impl Attendant for Watched<'_> {
    fn hear(&mut self, line: &str) {
        println!("  {line}");
    }

    fn zero_pose(&mut self) -> Result<(), Stopped> {
        println!("into the zero pose");
        self.0.zero_pose()
    }

    fn move_along(&mut self, direction: Direction, about_mm: f64) -> Result<f64, Stopped> {
        let moved = self.0.move_along(direction, about_mm)?;
        println!("{moved:.1} mm {}", direction.words());
        Ok(moved)
    }

    fn hold_still(&mut self, number: usize) -> Result<Option<[f64; 2]>, Stopped> {
        let held = self.0.hold_still(number)?;
        if let Some(force) = held {
            let [up, towards] = force.map(|n| n / N_PER_GRAM);
            println!("pose {number}: {up:.1} g upwards, {towards:.1} g towards the user");
        }
        Ok(held)
    }

    fn agrees(&mut self, review: &Review) -> Result<bool, Stopped> {
        show(review);
        self.0.agrees(review)
    }
}

/// Old and new numbers side by side.
fn show(review: &Review) {
    let (before, after) = (&review.before, &review.after);
    let [a, b, c] = review.zero;
    println!("zero pose      {a} {b} {c} counts");
    match &review.ratios {
        None => println!("ratios         not measured: {}", after.ratio),
        Some(fit) => {
            for joint in 0..3 {
                println!(
                    "joint {}        {:.3} motor turns a joint turn (was {:.3}), counts {} with the angle",
                    joint + 1,
                    after.ratio[joint],
                    before.ratio[joint],
                    if after.encoder_sign[joint] > 0.0 {
                        "rise"
                    } else {
                        "fall"
                    },
                );
            }
            println!("left over      {:.2} mm a move", fit.off_mm);
        }
    }
    match &review.gravity {
        None => println!(
            "gravity        not measured: {} Nm, {} Nm",
            after.gravity_2_nm, after.gravity_3_nm
        ),
        Some(fit) => println!(
            "gravity        {:.4} Nm (was {:.4}), {:.4} Nm (was {:.4}), left over {:.4} Nm",
            after.gravity_2_nm,
            before.gravity_2_nm,
            after.gravity_3_nm,
            before.gravity_3_nm,
            fit.off_nm
        ),
    }
}
