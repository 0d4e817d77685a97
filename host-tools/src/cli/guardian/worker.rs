//! The worker's end of the two pipes.

use std::fs::File;
use std::io::{Read, Write};
use std::os::unix::process::parent_id;
use std::sync::{Mutex, OnceLock, PoisonError};
use std::thread::Builder;

use super::News;
use crate::cli::terminal::interrupt;

/// The variable with the guardian's process number and the descriptors of the two pipes.
/// Programs that the worker starts have other parents, so it is nothing to them.
pub(super) const VARIABLE: &str = "HAPTERRA_GUARDIAN";

/// Where news goes; none where this is no worker.
static NEWS: OnceLock<Mutex<File>> = OnceLock::new();

/// Connects to the guardian. Returns false if no guardian has started this process.
pub(super) fn begin() -> bool {
    let Some((presses, news)) = pipes() else {
        return false;
    };
    let _ = NEWS.set(Mutex::new(news));
    // Without the thread the guardian still ends this process by force.
    let _ = Builder::new()
        .name("guardian".into())
        .spawn(move || listen(presses));
    true
}

fn pipes() -> Option<(File, File)> {
    let variable = std::env::var(VARIABLE).ok()?;
    let [parent, presses, news] = &variable.split(':').collect::<Vec<_>>()[..] else {
        return None;
    };
    let of = |descriptor: &str| format!("/dev/fd/{descriptor}");
    match parent.parse() == Ok(parent_id()) {
        true => File::open(of(presses))
            .and_then(|presses| Ok((presses, File::options().write(true).open(of(news))?)))
            .ok(),
        false => None,
    }
}

pub(super) fn is_worker() -> bool {
    NEWS.get().is_some()
}

pub(super) fn report(news: &News) {
    if let Some(to) = NEWS.get() {
        let line = [news.line(), b"\n".to_vec()].concat();
        let mut to = to.lock().unwrap_or_else(PoisonError::into_inner);
        // A guardian that is gone is noticed by whoever reads from it.
        let _ = to.write_all(&line);
    }
}

/// A byte is a press of Ctrl-C. The end of the pipe is the end of the guardian.
fn listen(mut presses: File) {
    while let Ok(1) = presses.read(&mut [0]) {
        interrupt::press_if_listening();
    }
    interrupt::end_without_guardian();
}
