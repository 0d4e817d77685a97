//! Failures of subcommands: what went wrong, and the one thing to do next.

use std::error::Error;
use std::fmt::Write as _;

use super::terminal::writer;

/// Any error, as the standard library boxes it.
type AnyError = Box<dyn Error + Send + Sync>;

/// An error as the user sees it: `error: …` and, where there is one, `hint: …`.
#[derive(Debug)]
pub struct Failure {
    error: AnyError,
    hint: Option<String>,
    /// Subject of the error, if it is one of several.
    about: Option<String>,
}

/// An error that tells by itself what to do next; `?` makes a [`Failure`] of it.
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

/// A result whose error becomes a [`Failure`] where the hint depends on the
/// command, not on the error.
pub trait OrHint<T> {
    /// The value, or the failure with what to do next, in the imperative.
    ///
    /// # Errors
    /// That of the result.
    fn or_hint(self, next_step: impl Into<String>) -> Result<T, Failure>;
}

impl<T, E: Into<AnyError>> OrHint<T> for Result<T, E> {
    fn or_hint(self, next_step: impl Into<String>) -> Result<T, Failure> {
        self.map_err(|error| Failure::new(error).hint(next_step))
    }
}

impl Failure {
    /// A failure with no hint yet. The error's message says what failed and on what.
    pub fn new(error: impl Into<AnyError>) -> Self {
        Self {
            error: error.into(),
            hint: None,
            about: None,
        }
    }

    /// Adds what to do next, in the imperative.
    #[must_use]
    pub fn hint(mut self, next_step: impl Into<String>) -> Self {
        self.hint = Some(next_step.into());
        self
    }

    /// Names what the error is about, where that has a name.
    #[must_use]
    pub(super) fn about(mut self, name: Option<&str>) -> Self {
        self.about = name.map(str::to_owned);
        self
    }

    /// The lines shown to the user: the error with its causes, then the hint.
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
        writer::put(std::io::stderr(), &format!("{}\n", self.text()));
    }
}
