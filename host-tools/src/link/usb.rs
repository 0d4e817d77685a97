//! A board on USB.

use std::io::{self, Read, Write};
use std::time::Duration;

use hapterra_firmware::usb::{INTERFACE_CLASS, PACKET, PRODUCT, PRODUCT_ID, VENDOR_ID};
use nusb::MaybeFuture;
use nusb::descriptors::TransferType;
use nusb::io::{EndpointRead, EndpointWrite};
use nusb::transfer::{Bulk, Direction, In, Out};

use super::transport::is_time_out;
use super::{LinkError, Transport};

/// Bytes in a transfer, a multiple of the packet size.
const TRANSFER: usize = 64 * PACKET;
/// Transfers under way from the device, so that none of its packets waits.
const TRANSFERS: usize = 4;
/// How long the board may leave a transfer unread before it counts as gone.
const WRITE_TIMEOUT: Duration = Duration::from_secs(5);

/// The bulk endpoints of a hapterra board.
pub struct Usb {
    reader: EndpointRead<Bulk>,
    writer: EndpointWrite<Bulk>,
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
        (devices.into_iter().filter(is_hapterra).collect(), count)
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
        let number = info
            .interfaces()
            .find(|interface| interface.class() == INTERFACE_CLASS)
            .map_or(0, nusb::InterfaceInfo::interface_number);
        let interface = device
            .detach_and_claim_interface(number)
            .wait()
            .map_err(cannot)?;
        let [input, output] = [Direction::In, Direction::Out].map(|direction| {
            let descriptor = interface.descriptor()?;
            let mut endpoints = descriptor.endpoints();
            let bulk = endpoints.find(|endpoint| {
                endpoint.transfer_type() == TransferType::Bulk && endpoint.direction() == direction
            });
            bulk.map(|endpoint| endpoint.address())
        });
        let (Some(input), Some(output)) = (input, output) else {
            return Err(absent("found it, but it has no bulk endpoints".into()));
        };
        let input = interface.endpoint::<Bulk, In>(input).map_err(cannot)?;
        let output = interface.endpoint::<Bulk, Out>(output).map_err(cannot)?;
        Ok(Self {
            reader: input.reader(TRANSFER).with_num_transfers(TRANSFERS),
            writer: output.writer(TRANSFER).with_write_timeout(WRITE_TIMEOUT),
        })
    }
}

impl Transport for Usb {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.writer.write_all(bytes)?;
        self.writer.flush()
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
        self.reader.set_read_timeout(wait);
        match self.reader.read(into) {
            Err(error) if is_time_out(&error) => Ok(0),
            other => other,
        }
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

fn is_hapterra(info: &nusb::DeviceInfo) -> bool {
    info.vendor_id() == VENDOR_ID
        && info.product_id() == PRODUCT_ID
        && info
            .product_string()
            .is_none_or(|name| name.contains(PRODUCT))
}

fn absent(why: String) -> LinkError {
    LinkError::Absent {
        looked_for: Usb::looked_for(),
        why,
    }
}
