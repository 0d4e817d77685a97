//! A bound on the time that GDAL takes to open a file: some files lead a driver round in circles.

use std::ffi::c_int;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread::Builder;
use std::time::Duration;

use crate::dataset::Dataset;
use crate::error::Error;
use crate::library::Loaded;

/// A VRT of 26,000 files opens within a second.
const OPEN_WITHIN: Duration = Duration::from_secs(6);

/// Whether a call of GDAL has not returned.
static IS_STUCK: AtomicBool = AtomicBool::new(false);

unsafe extern "C" {
    /// Ends the process without what libraries do at its end.
    fn _exit(code: c_int) -> !;
}

/// Ends the process with an exit code if a call of GDAL has not returned: GDAL's own end would wait
/// for it. Else does nothing.
pub fn exit_if_stuck(code: u8) {
    if IS_STUCK.load(Ordering::Acquire) {
        // Nobody is left who could be told.
        let _ = (std::io::stdout().flush(), std::io::stderr().flush());
        // SAFETY: it does not return, and nothing of this process is used after it.
        unsafe { _exit(code.into()) }
    }
}

/// Opens a raster in a thread of its own, which is left behind where it does not come to an end.
///
/// # Errors
/// As [`Dataset::open`]; [`Error::Slow`].
pub(crate) fn open(loaded: &Arc<Loaded>, path: &Path, options: &[&str]) -> Result<Dataset, Error> {
    let slow = || Error::Slow {
        path: path.to_owned(),
        seconds: OPEN_WITHIN.as_secs(),
    };
    let (send, opened) = sync_channel(1);
    let (loaded, own) = (loaded.clone(), path.to_owned());
    let options: Vec<String> = options.iter().map(|&option| option.to_owned()).collect();
    let open = move || {
        let options: Vec<&str> = options.iter().map(String::as_str).collect();
        // Nobody may wait for it any more.
        drop(send.send(Dataset::open(loaded, &own, &options)));
    };
    let thread = Builder::new().name("GDAL opens a file".into());
    thread.spawn(open).map_err(|_| slow())?;
    opened.recv_timeout(OPEN_WITHIN).unwrap_or_else(|_| {
        IS_STUCK.store(true, Ordering::Release);
        Err(slow())
    })
}
