//! Questions at a terminal, or at a pipe, whose lines are the answers.

use std::io::{self, BufRead, Write};

/// Asks, and gives the answer without the space around it; none where the input ends or
/// the answer is `q`.
pub(in crate::cli) fn ask(question: &str) -> Option<String> {
    print!("{question} ");
    // What cannot be shown cannot be answered either: the read decides.
    let _ = io::stdout().flush();
    let mut line = String::new();
    match io::stdin().lock().read_line(&mut line) {
        Ok(0) | Err(_) => {
            println!();
            None
        }
        Ok(_) if line.trim() == "q" => None,
        Ok(_) => Some(line.trim().to_owned()),
    }
}

/// Asks until the answer is a number, or nothing; none as [`ask`].
pub(in crate::cli) fn number(question: &str) -> Option<Option<f64>> {
    loop {
        let answer = ask(question)?.replace(',', ".");
        match answer.parse::<f64>() {
            _ if answer.is_empty() => return Some(None),
            Ok(number) if number.is_finite() => return Some(Some(number)),
            _ => println!("  {answer} is no number (q stops)"),
        }
    }
}
