//! Closes devices that a worker has left, until they confirm.

use std::sync::mpsc::Sender;
use std::thread;
use std::time::{Duration, Instant};

use crate::link::{ControlSession, DeviceAddress, HostClock, LinkError, Native};

/// For so long a device is tried.
const TRIED_FOR: Duration = Duration::from_secs(10);
/// For so long a device may take to answer.
const PATIENCE: Duration = Duration::from_secs(2);
/// Between two tries.
const RETRY: Duration = Duration::from_millis(200);

/// Closes the device in a thread of its own, and sends the address with what came of it.
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
            Err(_) if began.elapsed() < TRIED_FOR => thread::sleep(RETRY),
            closed => return closed,
        }
    }
}

fn close(address: &str) -> Result<(), LinkError> {
    let absent = |why| LinkError::Absent {
        looked_for: address.to_owned(),
        why,
    };
    let address: DeviceAddress = address.parse().map_err(absent)?;
    let line = address.connect(|| Native::new(HostClock::default(), None))?;
    ControlSession::open(line, PATIENCE)?.disarm()
}
