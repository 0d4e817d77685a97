//! Progress bars, in one style for all commands.

use indicatif::{ProgressBar, ProgressStyle};

/// Returns a bar of `length` steps, or a spinner if the number is unknown, in the style of
/// `template`.
#[must_use]
pub fn bar(length: Option<u64>, template: &str) -> ProgressBar {
    let bar = length.map_or_else(ProgressBar::new_spinner, ProgressBar::new);
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style),
        // Templates are constants; if one is invalid, the default style is used.
        Err(_) => bar,
    }
}
