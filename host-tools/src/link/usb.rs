//! A board on USB.

use std::io::{self, Read, Write};
use std::time::Duration;

use hapterra_firmware::usb::{PRODUCT_ID, VENDOR_ID};
use nusb::MaybeFuture;
use nusb::io::{EndpointRead, EndpointWrite};
use nusb::transfer::{self, In, Out};

use super::bulk::{Bulk, BulkEndpoints, Pipes, TRANSFER, is_hapterra};
use super::error::LinkError;

/// Transfers under way from the device, so that none of its packets waits.
const TRANSFERS: usize = 4;
/// How long the board may leave a transfer unread before it counts as gone.
const WRITE_TIMEOUT: Duration = Duration::from_secs(5);

/// A hapterra board on USB.
pub type Usb = Bulk<SystemPipes>;

/// A board's two bulk pipes, by the system's USB.
pub struct SystemPipes {
    reader: EndpointRead<transfer::Bulk>,
    writer: EndpointWrite<transfer::Bulk>,
}

impl Usb {
    /// Opens the first board found.
    ///
    /// # Errors
    /// [`LinkError::Absent`] says what was looked for and what is there.
    pub fn connect() -> Result<Self, LinkError> {
        match Self::list() {
            (found, _) if !found.is_empty() => Self::open(&found[0]),
            (_, 0) => Err(absent("no USB devices at all are visible here".into())),
            (_, n) => Err(absent(format!(
                "{n} USB devices, none of them a hapterra board"
            ))),
        }
    }

    /// The boards on USB, and how many USB devices there are in all.
    #[must_use]
    pub fn list() -> (Vec<nusb::DeviceInfo>, usize) {
        let devices = usb_devices();
        let count = devices.len();
        (devices.into_iter().filter(is_board).collect(), count)
    }

    /// What is looked for on USB, in words: its vendor and product numbers.
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
