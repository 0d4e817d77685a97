//! Questions at a terminal, or at a pipe, whose lines are the answers.

use super::keyboard::keyboard;
use super::writer::{say, show};

/// Asks, and gives the answer without the space around it; none where the input ends, an
/// end is asked for, or the answer is `q`. What was typed before is no answer.
pub(in crate::cli) fn ask(question: &str) -> Option<String> {
    let mut keyboard = keyboard();
    keyboard.forget_typed();
    show(format!("{question} "));
    match keyboard.line() {
        None => {
            say("");
            None
        }
        Some(line) if line.trim() == "q" => None,
        Some(line) => Some(line.trim().to_owned()),
    }
}

/// Asks until the answer is a number, or nothing; none as [`ask`].
pub(in crate::cli) fn number(question: &str) -> Option<Option<f64>> {
    loop {
        let answer = ask(question)?.replace(',', ".");
        match answer.parse::<f64>() {
            _ if answer.is_empty() => return Some(None),
            Ok(number) if number.is_finite() => return Some(Some(number)),
            _ => say(format!("  {answer} is no number (q stops)")),
        }
    }
}
