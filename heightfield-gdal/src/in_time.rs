//! A bound on the time that GDAL takes to open a file: some files lead a driver round in circles.

use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::thread::Builder;
use std::time::Duration;

use crate::dataset::Dataset;
use crate::error::Error;
use crate::library::Loaded;

/// A VRT of 26,000 files opens within a second.
const OPEN_WITHIN: Duration = Duration::from_secs(8);

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
    opened
        .recv_timeout(OPEN_WITHIN)
        .unwrap_or_else(|_| Err(slow()))
}
