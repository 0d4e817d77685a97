//! Output to the terminal while a board may be armed, and the log. Commands that
//! hold no device print (`print_macros.rs`).
//!
//! One thread writes, and callers do not wait for it. A window that was closed,
//! a reader that is gone and a disk that is full therefore end nothing. A terminal that
//! was stopped (Ctrl-S), or a reader that does not read, delays nothing: the lines that
//! do not fit any more are left out.

use std::fmt::Display;
use std::io::{self, Write};
use std::sync::OnceLock;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::Builder;

use indicatif::ProgressBar;

use super::raw_mode;
use heightfield::printable_text::printable_lines;

/// Lines that wait to be written; beyond them, lines are left out.
const WAITING: usize = 512;

/// Text to write.
enum Said {
    /// To standard output, as it is.
    Out(String),
    /// A line to standard error.
    Err(String),
    /// The line at the bottom of the terminal.
    Status(Option<String>),
    /// Nothing: everything before is written.
    Flush(SyncSender<()>),
}

/// The way to the thread that writes; none where there can be no such thread.
static WRITER: OnceLock<Option<SyncSender<Said>>> = OnceLock::new();

/// Writes a line to standard output.
pub(in crate::cli) fn say(line: impl Display) {
    speak(Said::Out(format!("{line}\n")));
}

/// Writes to standard output, without an end of the line.
pub(in crate::cli) fn show(text: impl Display) {
    speak(Said::Out(text.to_string()));
}

/// Writes a line to standard error.
pub(in crate::cli) fn tell(line: impl Display) {
    speak(Said::Err(format!("{line}\n")));
}

/// Replaces the line at the bottom of the terminal, or takes it away.
pub(in crate::cli) fn status(line: Option<String>) {
    speak(Said::Status(line));
}

/// Waits until all output is written.
pub(in crate::cli) fn finish() {
    if let Some(Some(writer)) = WRITER.get() {
        let (done, is_done) = sync_channel(1);
        // Where the thread is gone there is nothing to wait for.
        if writer.send(Said::Flush(done)).is_ok() {
            let _ = is_done.recv();
        }
    }
}

fn speak(said: Said) {
    let writer = WRITER.get_or_init(|| {
        let (writer, said) = sync_channel(WAITING);
        let thread = Builder::new().name("voice".into());
        thread.spawn(move || write_all(said)).ok().map(|_| writer)
    });
    match writer {
        // Without a reader this cannot be reported either.
        Some(writer) => drop(writer.try_send(said)),
        None => write(said, &mut None),
    }
}

fn write_all(said: Receiver<Said>) {
    let mut bottom = None;
    for said in said {
        write(said, &mut bottom);
    }
}

/// Writes around the line at the bottom.
fn write(said: Said, bottom: &mut Option<ProgressBar>) {
    match said {
        Said::Out(text) => above(bottom, || put(io::stdout(), &text)),
        Said::Err(line) => above(bottom, || put(io::stderr(), &line)),
        Said::Status(Some(line)) => {
            let bar = bottom.get_or_insert_with(ProgressBar::new_spinner);
            bar.set_message(printable_lines(&line));
            bar.tick();
        }
        Said::Status(None) => {
            if let Some(bar) = bottom.take() {
                bar.finish_and_clear();
            }
        }
        Said::Flush(done) => {
            let _ = done.send(());
        }
    }
}

fn above(bottom: &Option<ProgressBar>, put: impl FnOnce()) {
    match bottom {
        Some(bar) => bar.suspend(put),
        None => put(),
    }
}

/// Writes, where that can be written, what a terminal may show. In raw mode a terminal does not go
/// back to the first column by itself.
pub(in crate::cli) fn put(mut to: impl Write, text: &str) {
    let mut text = printable_lines(text);
    if raw_mode::is_raw() {
        text = text.replace('\n', "\r\n");
    }
    let _ = to.write_all(text.as_bytes()).and_then(|()| to.flush());
}
