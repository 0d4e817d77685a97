//! Failures of subcommands: the error and the next step for the user.

use std::error::Error;
use std::fmt::Write as _;

use super::terminal::writer;

/// Any error, as the standard library boxes it.
type AnyError = Box<dyn Error + Send + Sync>;

/// An error as shown to the user: `error: …` and, if there is one, `hint: …`.
#[derive(Debug)]
pub struct Failure {
    error: AnyError,
    hint: Option<String>,
    /// Subject of the error, if it is one of several.
    about: Option<String>,
}

/// An error that has its own hint; `?` converts it to a [`Failure`].
pub trait Hint {
    /// Returns the next step, in the imperative.
    fn hint(&self) -> String;
}

impl<E: Hint + Error + Send + Sync + 'static> From<E> for Failure {
    fn from(error: E) -> Self {
        let hint = error.hint();
        Self::new(error).hint(hint)
    }
}

/// A result whose hint depends on the command, not on the error.
pub trait OrHint<T> {
    /// Returns the value, or the failure with the next step, in the imperative.
    ///
    /// # Errors
    /// The result's error.
    fn or_hint(self, next_step: impl Into<String>) -> Result<T, Failure>;
}

impl<T, E: Into<AnyError>> OrHint<T> for Result<T, E> {
    fn or_hint(self, next_step: impl Into<String>) -> Result<T, Failure> {
        self.map_err(|error| Failure::new(error).hint(next_step))
    }
}

impl Failure {
    /// Creates a failure without a hint. The error's message states what failed and on what.
    pub fn new(error: impl Into<AnyError>) -> Self {
        Self {
            error: error.into(),
            hint: None,
            about: None,
        }
    }

    /// Adds the next step, in the imperative.
    #[must_use]
    pub fn hint(mut self, next_step: impl Into<String>) -> Self {
        self.hint = Some(next_step.into());
        self
    }

    /// Adds the name of the error's subject, if it has one.
    #[must_use]
    pub(super) fn about(mut self, name: Option<&str>) -> Self {
        self.about = name.map(str::to_owned);
        self
    }

    /// Returns the text for the user: the error with its causes, then the hint.
    pub fn text(&self) -> String {
        let about = self.about.as_ref().map(|name| format!("{name} "));
        let mut text = format!("error: {}{}", about.unwrap_or_default(), self.error);
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

    /// Prints the failure on standard error, after all earlier output.
    pub fn report(&self) {
        writer::finish();
        writer::write_text(std::io::stderr(), &format!("{}\n", self.text()));
    }
}
