//! Output to the terminal while a board may be armed, and the log. Commands without an open device
//! print directly (`print_macros.rs`).
//!
//! One thread writes, and callers do not wait for it. Therefore a closed window, a closed pipe or a
//! full disk ends nothing, and a terminal stopped by Ctrl-S, or a reader that does not read, delays
//! nothing: lines beyond the queue are omitted.

use std::fmt::Display;
use std::io::{self, Write};
use std::sync::OnceLock;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::Builder;

use indicatif::ProgressBar;

use super::raw_mode;
use heightfield::printable_text::printable_lines;

/// Maximum pending lines; further lines are omitted.
const MAX_WAITING: usize = 512;

/// Text to write.
enum TerminalOutput {
    /// Unchanged text for standard output.
    Out(String),
    /// A line for standard error.
    Err(String),
    /// The status line of the terminal.
    Status(Option<String>),
    /// Confirms that all earlier text is written.
    Flush(SyncSender<()>),
}

/// Queue of the writing thread; `None` if the thread cannot be started.
static WRITER: OnceLock<Option<SyncSender<TerminalOutput>>> = OnceLock::new();

/// Writes a line to standard output.
pub(in crate::cli) fn print_line(line: impl Display) {
    enqueue(TerminalOutput::Out(format!("{line}\n")));
}

/// Writes to standard output, without a line end.
pub(in crate::cli) fn show(text: impl Display) {
    enqueue(TerminalOutput::Out(text.to_string()));
}

/// Writes a line to standard error.
pub(in crate::cli) fn notify(line: impl Display) {
    enqueue(TerminalOutput::Err(format!("{line}\n")));
}

/// Replaces or removes the status line.
pub(in crate::cli) fn status(line: Option<String>) {
    enqueue(TerminalOutput::Status(line));
}

/// Waits until all output is written.
pub(in crate::cli) fn finish() {
    if let Some(Some(writer)) = WRITER.get() {
        let (done, is_done) = sync_channel(1);
        // If the thread has ended, there is nothing to wait for.
        if writer.send(TerminalOutput::Flush(done)).is_ok() {
            let _ = is_done.recv();
        }
    }
}

fn enqueue(output: TerminalOutput) {
    let writer = WRITER.get_or_init(|| {
        let (writer, output) = sync_channel(MAX_WAITING);
        let thread = Builder::new().name("terminal".into());
        thread.spawn(move || write_all(output)).ok().map(|_| writer)
    });
    match writer {
        // If the queue is full or closed, this cannot be reported either.
        Some(writer) => drop(writer.try_send(output)),
        None => write(output, &mut None),
    }
}

fn write_all(output: Receiver<TerminalOutput>) {
    let mut bottom = None;
    for output in output {
        write(output, &mut bottom);
    }
}

/// Writes above the status line.
fn write(output: TerminalOutput, bottom: &mut Option<ProgressBar>) {
    match output {
        TerminalOutput::Out(text) => write_above(bottom, || write_text(io::stdout(), &text)),
        TerminalOutput::Err(line) => write_above(bottom, || write_text(io::stderr(), &line)),
        TerminalOutput::Status(Some(line)) => {
            let bar = bottom.get_or_insert_with(ProgressBar::new_spinner);
            bar.set_message(printable_lines(&line));
            bar.tick();
        }
        TerminalOutput::Status(None) => {
            if let Some(bar) = bottom.take() {
                bar.finish_and_clear();
            }
        }
        TerminalOutput::Flush(done) => {
            let _ = done.send(());
        }
    }
}

fn write_above(bottom: &Option<ProgressBar>, write: impl FnOnce()) {
    match bottom {
        Some(bar) => bar.suspend(write),
        None => write(),
    }
}

/// Writes text that is safe for a terminal, and ignores errors. In raw mode the terminal needs a CR
/// for the first column.
pub(in crate::cli) fn write_text(mut to: impl Write, text: &str) {
    let mut text = printable_lines(text);
    if raw_mode::is_raw() {
        text = text.replace('\n', "\r\n");
    }
    let _ = to.write_all(text.as_bytes()).and_then(|()| to.flush());
}
