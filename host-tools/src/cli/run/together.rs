//! Several devices at once: each is served by its own thread, and none ends another's session.

use std::thread::{self, ScopedJoinHandle};

use super::session::Serving;
use crate::cli::failure::Failure;

/// Serves each device until its end; a single device in this thread.
///
/// # Errors
/// The error of the one device. With several, each failure with the device's name; it is also
/// printed when it occurs, because other devices may continue for long.
pub(super) fn serve_each(mut servings: Vec<Serving<'_, '_>>) -> Result<(), Failure> {
    if servings.len() == 1
        && let Some(only) = servings.pop()
    {
        return only.serve();
    }
    let count = servings.len();
    let failures = thread::scope(|scope| {
        let threads: Vec<_> = servings
            .into_iter()
            .map(|serving| {
                let device_console = serving.device.device_console.clone();
                let name = device_console.name().unwrap_or_default().to_owned();
                let thread = scope.spawn(move || {
                    // Adds the device's name to the log lines of its link.
                    let _named =
                        tracing::error_span!("device", name = device_console.name()).entered();
                    let ended = serving.serve();
                    ended.inspect_err(|failure| device_console.notify(failure.text()))
                });
                (name, thread)
            })
            .collect();
        threads
            .into_iter()
            .filter_map(failure_of)
            .collect::<Vec<_>>()
    });
    all_failures(count, failures)
}

/// Returns the failure of a thread, with the device's name; `None` after success.
fn failure_of(
    (name, thread): (String, ScopedJoinHandle<'_, Result<(), Failure>>),
) -> Option<(String, Failure)> {
    // A session that panics closes the device, and reports a missing confirmation.
    let panicked = |_| {
        Err(Failure::new(
            "the program failed while it served this device",
        ))
    };
    let ended = thread.join().unwrap_or_else(panicked);
    ended.err().map(|failure| (name, failure))
}

/// Combines the failures of several devices.
fn all_failures(count: usize, failures: Vec<(String, Failure)>) -> Result<(), Failure> {
    if failures.is_empty() {
        return Ok(());
    }
    let of = match failures.len() == count {
        true => format!("all {count} devices failed"),
        false => format!(
            "{} of {count} devices failed, the others did not",
            failures.len()
        ),
    };
    let each = failures.iter().map(|(name, failure)| {
        let text = failure.text();
        format!("\n{name} {}", text.replace('\n', &format!("\n{name} ")))
    });
    Err(Failure::new(of + ":" + &each.collect::<String>()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_failed_device_is_named_with_a_hint() {
        assert!(all_failures(2, vec![]).is_ok());
        let lost = || Failure::new("it is gone").hint("plug it in");
        let reported = |count, failures| match all_failures(count, failures) {
            Ok(()) => panic!("nothing failed"),
            Err(failure) => failure.text(),
        };
        let one = reported(2, vec![("[2 usb:7]".into(), lost())]);
        assert_eq!(
            one,
            "error: 1 of 2 devices failed, the others did not:\n[2 usb:7] error: it is gone\n[2 usb:7] hint: plug it in"
        );
        let both = ["[1 a]", "[2 b]"].map(|name| (name.to_owned(), lost()));
        assert!(reported(2, both.into()).starts_with("error: all 2 devices failed:\n[1 a] "));
    }
}
