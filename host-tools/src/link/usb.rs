//! A board on USB.

use std::io::{self, Read, Write};
use std::time::Duration;

use hapterra_firmware::usb::{PRODUCT_ID, VENDOR_ID};
use nusb::MaybeFuture;
use nusb::io::{EndpointRead, EndpointWrite};
use nusb::transfer::{self, In, Out};

use super::bulk::{
    Bulk, BulkEndpoints, Pipes, SelectionError, TRANSFER, is_hapterra, printable, select,
};
use super::error::LinkError;

/// Number of concurrent transfers from the device, so that none of its packets waits.
const TRANSFERS: usize = 4;
/// Max time for the board to read a transfer before it counts as disconnected. A board reads within
/// milliseconds, and the user's end of a session waits for this.
const WRITE_TIMEOUT: Duration = Duration::from_secs(1);

/// A hapterra board on USB.
pub type Usb = Bulk<SystemPipes>;

/// A board's two bulk pipes, through the system's USB.
pub struct SystemPipes {
    reader: EndpointRead<transfer::Bulk>,
    writer: EndpointWrite<transfer::Bulk>,
}

impl Usb {
    /// Opens the board with a serial number, or the only one.
    ///
    /// # Errors
    /// [`LinkError::Absent`] reports the searched and the found devices; [`LinkError::Several`]
    /// names the boards that match.
    pub fn connect(serial: Option<&str>) -> Result<Self, LinkError> {
        let (found, looked_at) = Self::list();
        let serials: Vec<_> = found.iter().map(serial_of).collect();
        match (select(&serials, serial), serial, looked_at) {
            (Ok(i), ..) => Self::open(&found[i]),
            (Err(SelectionError::Several), ..) => {
                Err(LinkError::Several(found.iter().map(Self::place).collect()))
            }
            (Err(SelectionError::None), _, 0) => {
                Err(absent("no USB devices at all are visible here".into()))
            }
            (Err(SelectionError::None), Some(requested), _) if !found.is_empty() => {
                let there: Vec<_> = found.iter().map(Self::place).collect();
                let requested = printable(requested);
                let there = there.join(", ");
                Err(absent(format!("none is usb:{requested}; there is {there}")))
            }
            (Err(SelectionError::None), _, n) => Err(absent(format!(
                "{n} USB devices, none of them a hapterra board"
            ))),
        }
    }

    /// Returns the serial number of the only board, if there is exactly one and it has a number.
    #[must_use]
    pub fn only_serial() -> Option<String> {
        let (found, _) = Self::list();
        match &found[..] {
            [only] => serial_of(only),
            _ => None,
        }
    }

    /// Returns the boards on USB, and the number of all USB devices.
    #[must_use]
    pub fn list() -> (Vec<nusb::DeviceInfo>, usize) {
        let devices = usb_devices();
        let count = devices.len();
        (devices.into_iter().filter(is_board).collect(), count)
    }

    /// Returns the description of the searched USB devices.
    #[must_use]
    pub fn searched_for() -> String {
        format!("a hapterra board on USB ({VENDOR_ID:04x}:{PRODUCT_ID:04x})")
    }

    /// Returns a board's `--device` address and its USB port.
    #[must_use]
    pub fn place(info: &nusb::DeviceInfo) -> String {
        let serial =
            serial_of(info).map_or("usb (no serial number)".into(), |s| format!("usb:{s}"));
        format!("{serial} at {}", place_on_usb(info))
    }

    /// Opens a board.
    ///
    /// # Errors
    /// [`LinkError::Absent`] reports the reason.
    pub fn open(info: &nusb::DeviceInfo) -> Result<Self, LinkError> {
        let cannot = |error: nusb::Error| absent(format!("found it, but cannot open it: {error}"));
        let device = info.open().wait().map_err(cannot)?;
        let configuration = device.active_configuration();
        let configuration =
            configuration.map_err(|error| absent(format!("found it, but {error}")))?;
        let endpoints = BulkEndpoints::find(&configuration)
            .ok_or_else(|| absent("found it, but it has no bulk endpoints".into()))?;
        let interface = device
            .detach_and_claim_interface(endpoints.interface)
            .wait()
            .map_err(cannot)?;
        let input = interface.endpoint::<transfer::Bulk, In>(endpoints.input);
        let output = interface.endpoint::<transfer::Bulk, Out>(endpoints.output);
        let (input, output) = (input.map_err(cannot)?, output.map_err(cannot)?);
        Ok(Bulk(SystemPipes {
            reader: input.reader(TRANSFER).with_num_transfers(TRANSFERS),
            writer: output.writer(TRANSFER).with_write_timeout(WRITE_TIMEOUT),
        }))
    }
}

impl Pipes for SystemPipes {
    fn send(&mut self, transfer: &[u8]) -> io::Result<()> {
        self.writer.write_all(transfer)?;
        self.writer.flush()
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
        self.reader.set_read_timeout(wait);
        self.reader.read(into)
    }
}

/// Returns all USB devices, or none if the system cannot list them.
pub(crate) fn usb_devices() -> Vec<nusb::DeviceInfo> {
    match nusb::list_devices().wait() {
        Ok(devices) => devices.collect(),
        Err(error) => {
            tracing::debug!("cannot list USB devices: {error}");
            Vec::new()
        }
    }
}

fn serial_of(info: &nusb::DeviceInfo) -> Option<String> {
    info.serial_number().map(printable)
}

/// Returns the USB port of a device, in either of its forms.
pub(crate) fn place_on_usb(info: &nusb::DeviceInfo) -> String {
    let ports: Vec<_> = info.port_chain().iter().map(u8::to_string).collect();
    format!("bus {} port {}", info.bus_id(), ports.join("."))
}

pub(crate) fn is_board(info: &nusb::DeviceInfo) -> bool {
    is_hapterra(info.vendor_id(), info.product_id(), info.product_string())
}

fn absent(why: String) -> LinkError {
    LinkError::Absent {
        searched_for: Usb::searched_for(),
        why,
    }
}
