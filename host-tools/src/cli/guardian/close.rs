//! Closes the devices of an ended worker, until they confirm.

use std::sync::mpsc::Sender;
use std::thread;
use std::time::{Duration, Instant};

use crate::link::{ControlSession, DeviceAddress, HostClock, LinkError, Native};

/// Time limit for all attempts on a device.
const MAX_DURATION: Duration = Duration::from_secs(10);
/// Time limit for a device's reply.
const TIMEOUT: Duration = Duration::from_secs(2);
/// Interval between attempts.
const RETRY: Duration = Duration::from_millis(200);

/// Closes the device in a separate thread, which sends the address and the result.
pub(super) fn begin(address: String, done: Sender<(String, Result<(), LinkError>)>) {
    thread::spawn(move || {
        let closed = until_confirmed(&address);
        let _ = done.send((address, closed));
    });
}

fn until_confirmed(address: &str) -> Result<(), LinkError> {
    let began = Instant::now();
    loop {
        match close(address) {
            Err(_) if began.elapsed() < MAX_DURATION => thread::sleep(RETRY),
            closed => return closed,
        }
    }
}

fn close(address: &str) -> Result<(), LinkError> {
    let absent = |why| LinkError::Absent {
        searched_for: address.to_owned(),
        why,
    };
    let address: DeviceAddress = address.parse().map_err(absent)?;
    let line = address.connect(|| Native::new(HostClock::default(), None))?;
    ControlSession::open(line, TIMEOUT)?.disarm()
}
