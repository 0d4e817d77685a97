//! Progress bars, one look for all commands.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar over `length` steps, or a spinner if it is unknown how many there
/// are, drawn as the template says.
#[must_use]
pub fn bar(length: Option<u64>, template: &str) -> ProgressBar {
    let bar = length.map_or_else(ProgressBar::new_spinner, ProgressBar::new);
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style),
        // Templates are constant; the default style is no worse a fallback.
        Err(_) => bar,
    }
}
