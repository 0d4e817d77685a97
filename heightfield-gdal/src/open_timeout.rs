//! A time limit for opening a file with GDAL: some files cause an endless loop in a driver.

use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread::Builder;
use std::time::{Duration, Instant};

use crate::dataset::Dataset;
use crate::error::Error;
use crate::loaded::Loaded;
use crate::mount;
use crate::pending_calls::Call;

/// Time limit for opening, without GDAL's waits for files from the caller. A VRT of 26,000 files
/// opens within a second.
const OPEN_WITHIN: Duration = Duration::from_secs(6);
/// Max time of waits that is not counted: a single request takes less.
const WAIT_WITHIN: Duration = Duration::from_secs(120);
/// Interval between checks of the time.
const LOOK: Duration = Duration::from_millis(50);

/// Opens a raster in its own thread, which is abandoned if it does not end.
///
/// # Errors
/// As [`Dataset::open`]; [`Error::Slow`].
pub(crate) fn open(loaded: &Arc<Loaded>, path: &Path, options: &[&str]) -> Result<Dataset, Error> {
    let begun = Instant::now();
    let slow = || Error::Slow {
        path: path.to_owned(),
        seconds: begun.elapsed().as_secs(),
    };
    let (send, opened) = sync_channel(1);
    let (loaded, own) = (loaded.clone(), path.to_owned());
    let options: Vec<String> = options.iter().map(|&option| option.to_owned()).collect();
    let call = Call::begin();
    let open = move || {
        let _call = call;
        let options: Vec<&str> = options.iter().map(String::as_str).collect();
        // The caller may have given up.
        let _ = send.send(Dataset::open(loaded, &own, &options));
    };
    let thread = Builder::new().name("GDAL opens a file".into());
    thread.spawn(open).map_err(|_| slow())?;
    let name = path.to_string_lossy();
    let files = mount::at(&name).map(|(files, _)| files);
    loop {
        let waited = files
            .as_ref()
            .map_or(Duration::ZERO, |files| files.waited());
        let left = left(begun.elapsed(), waited);
        match opened.recv_timeout(left.max(LOOK)) {
            Ok(opened) => return opened,
            Err(RecvTimeoutError::Timeout) if !left.is_zero() => {}
            Err(_) => break,
        }
    }
    Err(slow())
}

/// Returns the time left for opening; `waited` is the time of waits for the caller.
fn left(elapsed: Duration, waited: Duration) -> Duration {
    (OPEN_WITHIN + waited.min(WAIT_WITHIN)).saturating_sub(elapsed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waiting_for_a_server_is_not_counted_but_it_ends() {
        let [zero, second] = [0, 1].map(Duration::from_secs);
        assert_eq!(left(zero, zero), OPEN_WITHIN);
        assert_eq!(left(OPEN_WITHIN, zero), zero);
        assert_eq!(left(60 * second, 58 * second), OPEN_WITHIN - 2 * second);
        assert_eq!(left(OPEN_WITHIN + WAIT_WITHIN, 2 * WAIT_WITHIN), zero);
    }
}
