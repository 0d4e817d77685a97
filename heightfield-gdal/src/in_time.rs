//! A bound on the time that GDAL takes to open a file: some files lead a driver round in circles.

use std::ffi::c_int;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread::Builder;
use std::time::Duration;

use crate::dataset::Dataset;
use crate::error::Error;
use crate::library::Loaded;

/// A VRT of 26,000 files opens within a second.
const OPEN_WITHIN: Duration = Duration::from_secs(6);

/// Calls of GDAL that were given up and have not returned.
static STUCK: AtomicUsize = AtomicUsize::new(0);

unsafe extern "C" {
    /// Ends the process without what libraries do at its end.
    fn _exit(code: c_int) -> !;
}

/// Ends the process with an exit code if a call of GDAL has not returned: GDAL's own end would wait
/// for it. Else does nothing.
pub fn exit_if_stuck(code: u8) {
    if STUCK.load(Ordering::Acquire) > 0 {
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
        let opened = Dataset::open(loaded, &own, &options);
        // Given up: then it has returned after all.
        if send.send(opened).is_err() {
            STUCK.fetch_sub(1, Ordering::AcqRel);
        }
    };
    let thread = Builder::new().name("GDAL opens a file".into());
    thread.spawn(open).map_err(|_| slow())?;
    opened.recv_timeout(OPEN_WITHIN).unwrap_or_else(|_| {
        STUCK.fetch_add(1, Ordering::AcqRel);
        Err(slow())
    })
}
