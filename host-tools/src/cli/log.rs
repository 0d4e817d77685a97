//! Diagnostics on standard error. A device can cause some of them, at any rate and with any text.
//! Therefore every line passes through [`printable`], and each kind of line about the link is
//! limited to one a second, with the number of omitted lines. Each device is served by its own
//! thread, and the limit is separate for each.

use std::collections::HashMap;
use std::io::{self, Write};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, ThreadId};
use std::time::Instant;

use tracing::Metadata;
use tracing::callsite::Identifier;
use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::fmt::format::{DefaultFields, Format, Full};
use tracing_subscriber::fmt::{MakeWriter, SubscriberBuilder};

use super::line_limit::LineLimit;
use super::terminal::writer;
use heightfield::printable_text::printable;

/// Log target of lines that a device can cause.
const BY_DEVICE: &str = "hapterra::link";

/// Starts the log. `RUST_LOG` overrides the `-v` count.
pub(super) fn to_stderr(verbose: u8) -> Log<StderrLines> {
    let level = match verbose {
        // A probe library warns of each kind of probe that it cannot search for; the error reports
        // the result.
        0 => "warn,probe_rs=error",
        1 => "info",
        2 => "debug",
        _ => "trace",
    };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(level));
    let log = Log::to(|| StderrLines);
    subscriber(log.clone()).with_env_filter(filter).init();
    log
}

/// A subscriber with the format of this log.
type Subscriber<W> = SubscriberBuilder<DefaultFields, Format<Full, ()>, LevelFilter, Log<W>>;

/// Returns the builder of the subscriber that writes to `log`.
fn subscriber<W: Write + 'static>(log: Log<W>) -> Subscriber<W> {
    tracing_subscriber::fmt()
        .with_writer(log)
        // Colours are control sequences, which no line may contain.
        .with_ansi(false)
        .without_time()
        // Module paths are internal names.
        .with_target(false)
        // If standard error is closed, there is no reader.
        .log_internal_errors(false)
}

/// Sends lines to the thread that writes to standard error. The logging thread, perhaps with an
/// armed arm on its link, never waits for a terminal.
pub(super) struct StderrLines;

impl Write for StderrLines {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let text = String::from_utf8_lossy(bytes);
        writer::notify(text.trim_end_matches('\n'));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A log that writes to the value of `open`.
pub(super) struct Log<W> {
    open: Arc<dyn Fn() -> W + Send + Sync>,
    /// The limit for each kind of line that a device can cause, and each serving thread.
    kinds: Arc<Mutex<HashMap<(Identifier, ThreadId), LineLimit>>>,
}

impl<W> Clone for Log<W> {
    fn clone(&self) -> Self {
        Self {
            open: Arc::clone(&self.open),
            kinds: Arc::clone(&self.kinds),
        }
    }
}

impl<W: Write> Log<W> {
    fn to(open: impl Fn() -> W + Send + Sync + 'static) -> Self {
        Self {
            open: Arc::new(open),
            kinds: Arc::default(),
        }
    }

    /// Returns the number of lines of this kind omitted before the one at `now`; `None` if this one
    /// is omitted too.
    fn admit(&self, about: &Metadata<'_>, now: Instant) -> Option<u64> {
        if !about.target().starts_with(BY_DEVICE) {
            return Some(0);
        }
        let mut kinds = self.kinds.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (about.callsite(), thread::current().id());
        let kind = kinds.entry(key).or_insert(LineLimit::new(1));
        kind.admit(now)
    }

    /// Reports the number of lines omitted at the end.
    pub(super) fn end(&self) {
        let kinds = self.kinds.lock().unwrap_or_else(PoisonError::into_inner);
        let omitted: u64 = kinds.values().map(LineLimit::omitted).sum();
        if omitted > 0 {
            // There is no channel left to report this.
            let _ = writeln!((self.open)(), "{}", omitted_text(omitted));
        }
    }
}

fn omitted_text(count: u64) -> String {
    format!("({count} lines about the device were left out)")
}

impl<W: Write> MakeWriter<'_> for Log<W> {
    type Writer = Line<W>;

    fn make_writer(&self) -> Line<W> {
        Line(Some((self.open)()), 0)
    }

    fn make_writer_for(&self, about: &Metadata<'_>) -> Line<W> {
        match self.admit(about, Instant::now()) {
            Some(omitted) => Line(Some((self.open)()), omitted),
            None => Line(None, 0),
        }
    }
}

/// Writes one line, unless it is omitted, with the number of lines omitted before it.
pub(super) struct Line<W>(Option<W>, u64);

impl<W: Write> Write for Line<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Line(Some(out), omitted) = self {
            let text = String::from_utf8_lossy(bytes);
            let mut line = printable(text.trim_end_matches('\n'));
            let omitted = std::mem::take(omitted);
            if omitted > 0 {
                line += " ";
                line += &omitted_text(omitted);
            }
            line.push('\n');
            // A write error is ignored: its report on standard error would fail as well, and would
            // panic.
            let _ = out.write_all(line.as_bytes());
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let _ = self.0.as_mut().map_or(Ok(()), Write::flush);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A log shared by its copies.
    #[derive(Clone, Default)]
    struct Page(Arc<Mutex<Vec<u8>>>);

    impl Page {
        fn text(&self) -> String {
            String::from_utf8(self.0.lock().expect("one thread").clone()).expect("text")
        }
    }

    impl Write for Page {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().expect("one thread").write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// Returns the log of `log_lines` and of its end.
    fn log_of(log_lines: impl FnOnce()) -> String {
        let page = Page::default();
        let copy = page.clone();
        let log = Log::to(move || copy.clone());
        let subscriber = subscriber(log.clone()).finish();
        tracing::subscriber::with_default(subscriber, log_lines);
        log.end();
        page.text()
    }

    #[test]
    fn log_line_has_level_and_message_without_module_path() {
        let text = log_of(|| tracing::warn!(stiffness = 2.0, "above the limit"));
        assert_eq!(text, " WARN above the limit stiffness=2.0\n");
    }

    #[test]
    fn flooding_device_gets_one_log_line_a_second() {
        let text = log_of(|| {
            for tile in 0..100_000 {
                tracing::warn!(target: "hapterra::link::client", tile, "no such tile");
            }
        });
        let logged = text.lines().filter(|line| line.contains("no such tile"));
        // One line for each second of the test, and the final number.
        let (logged, lines) = (logged.count(), text.lines().count());
        assert!((1..60).contains(&logged) && lines == logged + 1, "{text}");
        let omitted = text.lines().filter_map(|line| {
            let (_, rest) = line.split_once('(')?;
            rest.split(' ').next()?.parse::<usize>().ok()
        });
        assert_eq!(logged + omitted.sum::<usize>(), 100_000, "{text}");
    }

    #[test]
    fn flooding_device_omits_no_line_of_another_device() {
        let text = log_of(|| {
            let subscriber = tracing::dispatcher::get_default(Clone::clone);
            let flood = |device: &'static str, lines: u32| {
                let subscriber = subscriber.clone();
                move || {
                    tracing::dispatcher::with_default(&subscriber, || {
                        for _ in 0..lines {
                            tracing::warn!(target: "hapterra::link", device, "odd");
                        }
                    });
                }
            };
            for (device, lines) in [("first", 10_000), ("second", 1)] {
                thread::scope(|scope| drop(scope.spawn(flood(device, lines))));
            }
        });
        assert!(text.contains("second"), "{text}");
    }

    #[test]
    fn host_log_lines_are_never_omitted_and_have_no_controls() {
        let text = log_of(|| {
            for row in 0..10 {
                tracing::warn!(target: "hapterra::replay", row, "odd");
            }
            tracing::warn!(target: "hapterra::link", name = "\x1b[2J\r\n\u{202e}", "\x1b]0;owned\x07");
        });
        assert_eq!(text.lines().count(), 11, "{text}");
        let controls = |c: char| c.is_control() && c != '\n';
        assert!(
            !text.contains(controls) && !text.contains('\u{202e}'),
            "{text:?}"
        );
    }
}
