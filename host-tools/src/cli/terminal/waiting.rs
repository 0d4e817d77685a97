//! Progress of long work: a status line on a terminal, otherwise a line every few seconds.

use std::io::{IsTerminal, stderr};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use indicatif::ProgressBar;

use crate::cli::failure::Failure;
use heightfield::Raster;

/// Time before the first line without a terminal, and between two lines.
const FIRST_LINE_AFTER: Duration = Duration::from_secs(1);
const LINE_INTERVAL: Duration = Duration::from_secs(3);
/// Interval of updates of the status line.
const POLL_INTERVAL: Duration = Duration::from_millis(200);

/// Runs `work` and shows `line` meanwhile. For work before a device is served.
pub(in crate::cli) fn shown_meanwhile<T>(
    line: impl Fn() -> String + Sync,
    work: impl FnOnce() -> T,
) -> T {
    std::thread::scope(|scope| {
        // The channel also closes if the work panics.
        let (_working, ended) = channel::<()>();
        let line = &line;
        scope.spawn(move || {
            let should_continue = |time| ended.recv_timeout(time) == Err(RecvTimeoutError::Timeout);
            match stderr().is_terminal() {
                true => at_bottom(line, should_continue),
                false => in_lines(line, should_continue, |line| eprintln!("{line}")),
            }
        });
        work()
    })
}

/// The same for planning a path over an open terrain.
///
/// # Errors
/// The reason why heights could not be read, or else the error of the work.
pub(in crate::cli) fn shown_planning<T, E>(
    name: &str,
    raster: &Raster,
    work: impl FnOnce() -> Result<T, E>,
) -> Result<T, Failure>
where
    Failure: From<E>,
{
    let line = || match raster.blocks() {
        0 => format!("planning a path over {name}"),
        all => format!(
            "planning a path over {name}: {} of {all} blocks read",
            raster.blocks_read()
        ),
    };
    let done = shown_meanwhile(line, work);
    raster.check_complete()?;
    Ok(done?)
}

fn at_bottom(line: impl Fn() -> String, should_continue: impl Fn(Duration) -> bool) {
    let bar = ProgressBar::new_spinner();
    while should_continue(POLL_INTERVAL) {
        bar.set_message(line());
        bar.tick();
    }
    bar.finish_and_clear();
}

/// Prints lines until `should_continue` returns false; it waits for the given time first.
fn in_lines(
    line: impl Fn() -> String,
    should_continue: impl Fn(Duration) -> bool,
    mut print: impl FnMut(String),
) {
    let mut time = FIRST_LINE_AFTER;
    let mut all = Duration::ZERO;
    while should_continue(time) {
        all += time;
        print(format!("{} ({} s)", line(), all.as_secs()));
        time = LINE_INTERVAL;
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    #[test]
    fn progress_lines_appear_from_first_second_until_work_ends() {
        let (blocks, waits) = (Cell::new(0), Cell::new(0));
        let should_continue = |time| {
            assert_eq!(
                time,
                if waits.get() == 0 {
                    FIRST_LINE_AFTER
                } else {
                    LINE_INTERVAL
                }
            );
            waits.set(waits.get() + 1);
            blocks.set(blocks.get() + 10);
            waits.get() < 4
        };
        let mut lines = vec![];
        in_lines(
            || format!("{} of 40", blocks.get()),
            should_continue,
            |line| lines.push(line),
        );
        assert_eq!(
            lines,
            ["10 of 40 (1 s)", "20 of 40 (4 s)", "30 of 40 (7 s)"]
        );
        in_lines(String::new, |_| false, |line| panic!("{line}"));
    }

    #[test]
    fn progress_ends_with_the_work() {
        assert_eq!(shown_meanwhile(String::new, || 7), 7);
        let panics = || shown_meanwhile(String::new, || panic!("of the work"));
        assert!(std::panic::catch_unwind(panics).is_err());
    }
}
