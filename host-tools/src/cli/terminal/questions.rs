//! Questions at a terminal, or from a pipe whose lines are the answers.

use super::keyboard::keyboard;
use super::writer::{print_line, show};

/// Prints a question and returns the trimmed answer; `None` if the input ends, an end is requested,
/// or the answer is `q`. Earlier input is discarded.
pub(in crate::cli) fn prompt(question: &str) -> Option<String> {
    let mut keyboard = keyboard();
    keyboard.forget_typed();
    show(format!("{question} "));
    match keyboard.line() {
        None => {
            print_line("");
            None
        }
        Some(line) if line.trim() == "q" => None,
        Some(line) => Some(line.trim().to_owned()),
    }
}

/// Repeats a question until the answer is a number or empty; returns `None` as [`ask`].
pub(in crate::cli) fn number(question: &str) -> Option<Option<f64>> {
    loop {
        let answer = prompt(question)?.replace(',', ".");
        match answer.parse::<f64>() {
            _ if answer.is_empty() => return Some(None),
            Ok(number) if number.is_finite() => return Some(Some(number)),
            _ => print_line(format!("  {answer} is no number (q stops)")),
        }
    }
}
