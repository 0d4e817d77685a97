//! How a subcommand fails: what went wrong, and the one thing to do next.

use std::error::Error;
use std::fmt::Write as _;

/// An error as the user sees it: `error: …` and, where there is one, `hint: …`.
#[derive(Debug)]
pub struct Failure {
    error: Box<dyn Error + Send + Sync>,
    hint: Option<String>,
}

impl Failure {
    /// A failure with no hint yet. The error's message says what failed and on what.
    pub fn new(error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self {
            error: error.into(),
            hint: None,
        }
    }

    /// Adds what to do next, in the imperative.
    #[must_use]
    pub fn hint(mut self, next_step: impl Into<String>) -> Self {
        self.hint = Some(next_step.into());
        self
    }

    /// The lines shown to the user.
    pub fn text(&self) -> String {
        let mut text = format!("error: {}", self.error);
        let mut cause = self.error.source();
        while let Some(error) = cause {
            // Writing to a String cannot fail.
            let _ = write!(text, ": {error}");
            cause = error.source();
        }
        if let Some(hint) = &self.hint {
            let _ = write!(text, "\nhint: {hint}");
        }
        text
    }

    /// Prints the failure on standard error.
    pub fn report(&self) {
        eprintln!("{}", self.text());
    }
}
