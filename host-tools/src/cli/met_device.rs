//! What a device tells of its arm before it is given a terrain.

use hapterra_core::phantom::{Calibration, Model};

use super::bringup::PATIENCE;
use super::bringup::required::brought_up;
use super::failure::{Failure, OrHint};
use crate::link::{DeviceAddress, Dialogue, HostClock, Native, Transport};

/// A device that somebody holds.
pub(super) struct MetDevice {
    /// The way to it.
    pub(super) transport: Box<dyn Transport>,
    /// Its calibration; the preset to begin with where it has none.
    pub(super) calibration: Calibration,
}

/// Connects to a device, refuses a real one that was not brought up unless it is
/// `unchecked`, and asks for its calibration.
///
/// # Errors
/// No device, one that was not brought up, or one that does not answer.
pub(super) fn meet(address: &DeviceAddress, unchecked: bool) -> Result<MetDevice, Failure> {
    let mut transport = address.connect(|| Native::new(HostClock::default(), None))?;
    if !unchecked {
        brought_up(&mut *transport)?;
    }
    let mut dialogue = Dialogue::open(Box::new(&mut *transport), PATIENCE)?;
    let calibration = match dialogue.calibration()? {
        Some(calibration) => calibration,
        None => {
            let model = dialogue.status()?.model.unwrap_or(Model::Premium15);
            eprintln!("the device has no calibration: the terrain is laid for a {model:?}");
            model.preset()
        }
    };
    dialogue.end()?;
    calibration
        .validate()
        .map_err(|bad| format!("the device's calibration cannot be used: {bad}"))
        .or_hint("measure it anew: hapterra calibrate")?;
    Ok(MetDevice {
        transport,
        calibration,
    })
}
