//! A board on USB.

use std::io::{self, Read, Write};
use std::time::Duration;

use hapterra_firmware::usb::{PRODUCT_ID, VENDOR_ID};
use nusb::MaybeFuture;
use nusb::io::{EndpointRead, EndpointWrite};
use nusb::transfer::{self, In, Out};

use super::bulk::{Bulk, BulkEndpoints, Pipes, TRANSFER, is_hapterra};
use super::{LinkError, Transport};

/// Transfers under way from the device, so that none of its packets waits.
const TRANSFERS: usize = 4;
/// How long the board may leave a transfer unread before it counts as gone.
const WRITE_TIMEOUT: Duration = Duration::from_secs(5);

/// A hapterra board.
pub struct Usb(Bulk<SystemPipes>);

/// Its pipes, by the system's USB.
struct SystemPipes {
    reader: EndpointRead<transfer::Bulk>,
    writer: EndpointWrite<transfer::Bulk>,
}

impl Usb {
    /// Opens the first board found.
    ///
    /// # Errors
    /// [`LinkError::Absent`] says what was looked for and what is there.
    pub fn connect() -> Result<Self, LinkError> {
        let (found, looked_at) = Self::list();
        match found.first() {
            Some(info) => Self::open(info),
            None => Err(absent(match looked_at {
                0 => "no USB devices at all are visible here".into(),
                n => format!("{n} USB devices, none of them a hapterra board"),
            })),
        }
    }

    /// The boards on USB, and how many USB devices there are in all.
    #[must_use]
    pub fn list() -> (Vec<nusb::DeviceInfo>, usize) {
        let devices = usb_devices();
        let count = devices.len();
        (devices.into_iter().filter(is_board).collect(), count)
    }

    /// What is looked for, in words.
    #[must_use]
    pub fn looked_for() -> String {
        format!("a hapterra board on USB ({VENDOR_ID:04x}:{PRODUCT_ID:04x})")
    }

    /// Where a board is plugged in, and its serial number.
    #[must_use]
    pub fn place(info: &nusb::DeviceInfo) -> String {
        let (bus, address) = (info.bus_id(), info.device_address());
        let serial = info.serial_number().unwrap_or("no serial number");
        format!("bus {bus} device {address}, {serial}")
    }

    /// Opens a board.
    ///
    /// # Errors
    /// [`LinkError::Absent`] says why not.
    pub fn open(info: &nusb::DeviceInfo) -> Result<Self, LinkError> {
        let cannot = |error: nusb::Error| absent(format!("found it, but cannot open it: {error}"));
        let device = info.open().wait().map_err(cannot)?;
        let endpoints = match device.active_configuration() {
            Ok(configuration) => BulkEndpoints::find(&configuration),
            Err(error) => return Err(absent(format!("found it, but {error}"))),
        };
        let Some(endpoints) = endpoints else {
            return Err(absent("found it, but it has no bulk endpoints".into()));
        };
        let interface = device
            .detach_and_claim_interface(endpoints.interface)
            .wait()
            .map_err(cannot)?;
        let input = interface.endpoint::<transfer::Bulk, In>(endpoints.input);
        let output = interface.endpoint::<transfer::Bulk, Out>(endpoints.output);
        let (input, output) = (input.map_err(cannot)?, output.map_err(cannot)?);
        Ok(Self(Bulk(SystemPipes {
            reader: input.reader(TRANSFER).with_num_transfers(TRANSFERS),
            writer: output.writer(TRANSFER).with_write_timeout(WRITE_TIMEOUT),
        })))
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

impl Transport for Usb {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.send(bytes)
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
        self.0.receive(into, wait)
    }
}

/// All USB devices; none where the system has no USB to list.
pub(crate) fn usb_devices() -> Vec<nusb::DeviceInfo> {
    match nusb::list_devices().wait() {
        Ok(devices) => devices.collect(),
        Err(error) => {
            tracing::debug!("cannot list USB devices: {error}");
            Vec::new()
        }
    }
}

fn is_board(info: &nusb::DeviceInfo) -> bool {
    is_hapterra(info.vendor_id(), info.product_id(), info.product_string())
}

fn absent(why: String) -> LinkError {
    LinkError::Absent {
        looked_for: Usb::looked_for(),
        why,
    }
}
