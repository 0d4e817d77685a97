//! Loaders and boards on the system's USB.

use std::io;
use std::time::Duration;

use nusb::MaybeFuture;
use nusb::transfer::{ControlIn, ControlOut, ControlType, Recipient};

use super::choice::ConnectedDevice;
use super::error::UpdateError;
use super::loader::{ControlPipe, Loader};
use crate::link::{is_board, place_on_usb, printable, usb_devices};

/// The USB numbers of the loader in every STM32's ROM, assigned by ST.
pub const LOADER_VENDOR_ID: u16 = 0x0483;
/// See [`LOADER_VENDOR_ID`].
pub const LOADER_PRODUCT_ID: u16 = 0xDF11;

/// Time limit of a control transfer. An erase continues after its transfer.
const TIMEOUT: Duration = Duration::from_secs(5);
/// Prefix of the description of internal flash.
const FLASH: &str = "@Internal Flash";
/// The type of a DFU functional descriptor.
const FUNCTIONAL: u8 = 0x21;

/// A loader's interface on the system's USB.
pub struct SystemPipe(nusb::Interface);

impl ControlPipe for SystemPipe {
    fn read(&mut self, request: u8, value: u16, length: u16) -> io::Result<Vec<u8>> {
        let transfer = ControlIn {
            control_type: ControlType::Class,
            recipient: Recipient::Interface,
            request,
            value,
            index: self.0.interface_number().into(),
            length,
        };
        let done = self.0.control_in(transfer, TIMEOUT).wait();
        done.map_err(io::Error::other)
    }

    fn write(&mut self, request: u8, value: u16, bytes: &[u8]) -> io::Result<()> {
        let transfer = ControlOut {
            control_type: ControlType::Class,
            recipient: Recipient::Interface,
            request,
            value,
            index: self.0.interface_number().into(),
            data: bytes,
        };
        let done = self.0.control_out(transfer, TIMEOUT).wait();
        done.map_err(io::Error::other)
    }

    fn wait(&mut self, time: Duration) {
        std::thread::sleep(time);
    }
}

fn is_loader(info: &nusb::DeviceInfo) -> bool {
    (info.vendor_id(), info.product_id()) == (LOADER_VENDOR_ID, LOADER_PRODUCT_ID)
}

/// Returns the connected boards and loaders.
#[must_use]
pub fn connected_devices() -> Vec<ConnectedDevice> {
    let devices = usb_devices();
    let fitting = devices
        .iter()
        .filter(|info| is_loader(info) || is_board(info));
    let described = fitting.map(|info| ConnectedDevice {
        place: place_on_usb(info),
        serial: info.serial_number().map(printable),
        is_loader: is_loader(info),
    });
    described.collect()
}

/// Opens the loader at a USB port, if there is one.
///
/// # Errors
/// [`UpdateError`]: the loader is present but cannot be used.
pub fn open_loader(place: &str) -> Result<Option<Loader<SystemPipe>>, UpdateError> {
    let here = |info: &nusb::DeviceInfo| is_loader(info) && place_on_usb(info) == place;
    let Some(info) = usb_devices().into_iter().find(here) else {
        return Ok(None);
    };
    let device = info.open().wait().map_err(disconnected)?;
    let configuration = device.active_configuration().map_err(disconnected)?;
    for setting in configuration.interface_alt_settings() {
        let Some(text) = setting.string_index() else {
            continue;
        };
        let text = device.get_string_descriptor(text, ENGLISH, TIMEOUT).wait();
        let text = text.map_err(disconnected)?;
        if !text.starts_with(FLASH) {
            continue;
        }
        let number = setting.interface_number();
        let descriptors = configuration.interface_alt_settings();
        let mut descriptors = descriptors
            .filter(|other| other.interface_number() == number)
            .flat_map(|other| other.descriptors());
        let functional = descriptors.find(|found| found.descriptor_type() == FUNCTIONAL);
        let functional = functional.map(|found| found.to_vec()).unwrap_or_default();
        let interface = device.detach_and_claim_interface(number).wait();
        let interface = interface.map_err(disconnected)?;
        let chosen = interface
            .set_alt_setting(setting.alternate_setting())
            .wait();
        chosen.map_err(disconnected)?;
        return Loader::open(SystemPipe(interface), &text, &functional).map(Some);
    }
    Err(UpdateError::Layout("it names no internal flash".into()))
}

/// The language of a loader's strings.
const ENGLISH: u16 = 0x0409;

fn disconnected(error: impl std::error::Error + Send + Sync + 'static) -> UpdateError {
    UpdateError::Disconnected {
        operation: "begin",
        source: io::Error::other(error),
    }
}
