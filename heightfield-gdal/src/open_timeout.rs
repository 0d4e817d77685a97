//! A time limit for opening a file with GDAL: some files cause an endless loop in a driver.

use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread::Builder;
use std::time::{Duration, Instant};

use crate::dataset::Dataset;
use crate::error::Error;
use crate::libgdal::Libgdal;
use crate::mount;
use crate::pending_calls::Call;

/// Time limit for opening, without GDAL's waits for files from the caller. A VRT of 26,000 files
/// opens within a second.
const OPEN_TIMEOUT: Duration = Duration::from_secs(6);
/// Max time of waits that is not counted: a single request is shorter.
const MAX_SERVER_WAIT: Duration = Duration::from_secs(120);
/// Interval between checks of the time.
const MIN_POLL: Duration = Duration::from_millis(50);

/// Opens a raster in its own thread, which is abandoned if it does not end.
///
/// # Errors
/// As [`Dataset::open`]; [`Error::Slow`].
pub(crate) fn open(
    libgdal: &Arc<Libgdal>,
    path: &Path,
    options: &[&str],
) -> Result<Dataset, Error> {
    let started = Instant::now();
    let slow = || Error::Slow {
        path: path.to_owned(),
        seconds: started.elapsed().as_secs(),
    };
    let (send, opened) = sync_channel(1);
    let (libgdal, own) = (libgdal.clone(), path.to_owned());
    let options: Vec<String> = options.iter().map(|&option| option.to_owned()).collect();
    let call = Call::begin();
    let open = move || {
        let _call = call;
        let options: Vec<&str> = options.iter().map(String::as_str).collect();
        // The caller may no longer wait.
        let _ = send.send(Dataset::open(libgdal, &own, &options));
    };
    let thread = Builder::new().name("GDAL opens a file".into());
    thread.spawn(open).map_err(|_| slow())?;
    let name = path.to_string_lossy();
    let files = mount::at(&name).map(|(files, _)| files);
    loop {
        let waited = files
            .as_ref()
            .map_or(Duration::ZERO, |files| files.waited());
        let remaining = remaining(started.elapsed(), waited);
        match opened.recv_timeout(remaining.max(MIN_POLL)) {
            Ok(opened) => return opened,
            Err(RecvTimeoutError::Timeout) if !remaining.is_zero() => {}
            Err(_) => break,
        }
    }
    Err(slow())
}

/// Returns the time left for opening; `waited` is the time of waits for the caller.
fn remaining(elapsed: Duration, waited: Duration) -> Duration {
    (OPEN_TIMEOUT + waited.min(MAX_SERVER_WAIT)).saturating_sub(elapsed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn server_wait_is_not_counted_but_bounded() {
        let [zero, second] = [0, 1].map(Duration::from_secs);
        assert_eq!(remaining(zero, zero), OPEN_TIMEOUT);
        assert_eq!(remaining(OPEN_TIMEOUT, zero), zero);
        assert_eq!(
            remaining(60 * second, 58 * second),
            OPEN_TIMEOUT - 2 * second
        );
        assert_eq!(
            remaining(OPEN_TIMEOUT + MAX_SERVER_WAIT, 2 * MAX_SERVER_WAIT),
            zero
        );
    }
}
