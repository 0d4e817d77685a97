//! A device's calibration before it has a terrain.

use hapterra_core::phantom::{Calibration, Model};

use super::bringup::TIMEOUT;
use super::failure::{Failure, OrHint};
use crate::calibrate::file;
use crate::link::{ControlSession, DeviceAddress, HostClock, Native};

/// Reads a device's calibration; a session of another host continues. If it has none, returns its
/// model's preset, with a message.
///
/// # Errors
/// No device, no reply, or an unusable calibration.
pub(super) fn calibration_of(
    address: &DeviceAddress,
    notify: &dyn Fn(String),
) -> Result<Calibration, Failure> {
    let transport = address.connect(|| Native::new(HostClock::default(), None))?;
    let mut control = ControlSession::open_read_only(transport, TIMEOUT)?;
    let calibration = match control.calibration()? {
        Some(calibration) => calibration,
        None => {
            let model = control.status()?.model.unwrap_or(Model::Premium15);
            notify(format!(
                "the device has no calibration: the terrain is placed for a {}",
                file::model_name(model)
            ));
            model.preset()
        }
    };
    control.end()?;
    calibration
        .validate()
        .map_err(|bad| format!("the device's calibration cannot be used: {bad}"))
        .or_hint("measure it again: hapterra calibrate")?;
    Ok(calibration)
}
