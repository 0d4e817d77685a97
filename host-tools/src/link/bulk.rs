//! The link on USB: devices and transfers, without the system's USB, so that a device in memory can
//! replace it.

use std::io;
use std::time::Duration;

use hapterra_firmware::usb::{INTERFACE_CLASS, PACKET, PRODUCT, PRODUCT_ID, VENDOR_ID};
use nusb::descriptors::{ConfigurationDescriptor, InterfaceDescriptor, TransferType};
use nusb::transfer::Direction;

use super::transport::{Transport, is_time_out};

/// Max bytes of a transfer, a multiple of the packet size.
pub(super) const TRANSFER: usize = 64 * PACKET;

/// Returns true if a device with these numbers is a hapterra board, and its product string agrees
/// if it can be read.
#[must_use]
pub fn is_hapterra(vendor: u16, product: u16, name: Option<&str>) -> bool {
    let named = name.is_none_or(|name| name.contains(PRODUCT));
    vendor == VENDOR_ID && product == PRODUCT_ID && named
}

/// Reason why no board on USB is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SelectionError {
    /// No board matches.
    None,
    /// Several boards match.
    Several,
}

/// Returns the index of the board with the serial number `requested`, or of the only board. It never
/// chooses between two boards, because each has an arm.
///
/// # Errors
/// [`SelectionError`].
pub fn select(
    serials: &[Option<String>],
    requested: Option<&str>,
) -> Result<usize, SelectionError> {
    let fits = |serial: &Option<String>| match (serial, requested) {
        (_, None) => true,
        (Some(serial), Some(requested)) => serial.eq_ignore_ascii_case(requested),
        (None, Some(_)) => false,
    };
    let mut fitting = (0..serials.len()).filter(|i| fits(&serials[*i]));
    match (fitting.next(), fitting.next()) {
        (Some(only), None) => Ok(only),
        (None, _) => Err(SelectionError::None),
        (Some(_), Some(_)) => Err(SelectionError::Several),
    }
}

/// Returns a device's text without characters that a terminal might act on.
#[must_use]
pub fn printable(text: &str) -> String {
    let shown = |c: &char| c.is_ascii_graphic();
    text.chars().filter(shown).take(64).collect()
}

/// Endpoints of a board's link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BulkEndpoints {
    /// Number of the interface to claim.
    pub interface: u8,
    /// Address of the endpoint that is read.
    pub input: u8,
    /// Address of the endpoint that is written.
    pub output: u8,
}

impl BulkEndpoints {
    /// Finds the first interface of the link's class that has a bulk endpoint in each direction.
    #[must_use]
    pub fn find(configuration: &ConfigurationDescriptor<'_>) -> Option<Self> {
        let mut settings = configuration.interface_alt_settings();
        settings.find_map(|setting| {
            let ours = setting.class() == INTERFACE_CLASS;
            let [input, output] =
                [Direction::In, Direction::Out].map(|direction| bulk(&setting, direction));
            ours.then_some(Self {
                interface: setting.interface_number(),
                input: input?,
                output: output?,
            })
        })
    }
}

fn bulk(setting: &InterfaceDescriptor<'_>, direction: Direction) -> Option<u8> {
    let mut endpoints = setting.endpoints();
    let found = endpoints.find(|endpoint| {
        endpoint.transfer_type() == TransferType::Bulk && endpoint.direction() == direction
    });
    found.map(|endpoint| endpoint.address())
}

/// The two bulk pipes of a device, on any USB implementation.
pub trait Pipes {
    /// Sends one transfer of at most 4 KiB, cut into whole packets and a shorter last one; no empty
    /// packet ends it.
    ///
    /// # Errors
    /// When the device is disconnected or does not accept the transfer.
    fn send(&mut self, transfer: &[u8]) -> io::Result<()>;

    /// Receives the available bytes; waits at most `wait` for the first. A time-out may be zero
    /// bytes or an error that reports it.
    ///
    /// # Errors
    /// When the device is disconnected.
    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize>;
}

/// A byte stream over two bulk pipes.
pub struct Bulk<P>(pub P);

impl<P: Pipes> Transport for Bulk<P> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        bytes
            .chunks(TRANSFER)
            .try_for_each(|transfer| self.0.send(transfer))
    }

    fn send_some(&mut self, bytes: &[u8], _: Duration) -> io::Result<usize> {
        let transfer = bytes.get(..TRANSFER).unwrap_or(bytes);
        self.0.send(transfer).map(|()| transfer.len())
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
        match self.0.receive(into, wait) {
            Err(error) if is_time_out(&error) => Ok(0),
            other => other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usb_ids_and_optional_product_name_identify_a_board() {
        assert!(is_hapterra(VENDOR_ID, PRODUCT_ID, Some("hapterra nucleo")));
        assert!(is_hapterra(VENDOR_ID, PRODUCT_ID, None));
        assert!(!is_hapterra(VENDOR_ID, PRODUCT_ID, Some("blinky")));
        assert!(!is_hapterra(VENDOR_ID, 0x0002, Some(PRODUCT)));
    }

    /// Safety: 34.
    #[test]
    fn selection_among_several_boards_needs_a_unique_serial() {
        let serials = ["0039001A", "0039001B"].map(|serial| Some(serial.to_owned()));
        assert_eq!(select(&serials, None), Err(SelectionError::Several));
        assert_eq!(select(&serials, Some("0039001b")), Ok(1));
        assert_eq!(select(&serials, Some("0039001")), Err(SelectionError::None));
        assert_eq!(select(&serials[..1], None), Ok(0));
        assert_eq!(
            select(&serials[..1], Some("0039001B")),
            Err(SelectionError::None)
        );
        assert_eq!(select(&[None], None), Ok(0));
        assert_eq!(select(&[None], Some("")), Err(SelectionError::None));
        assert_eq!(select(&[], None), Err(SelectionError::None));
        let twins = [&serials[0], &serials[0]].map(Clone::clone);
        assert_eq!(
            select(&twins, Some("0039001A")),
            Err(SelectionError::Several)
        );
    }

    #[test]
    fn serial_number_is_sanitised_for_the_terminal() {
        assert_eq!(printable("00\u{1b}[2J3A\r\n"), "00[2J3A");
        assert_eq!(printable(&"F".repeat(500)).len(), 64);
    }

    #[test]
    fn endpoint_search_skips_non_vendor_or_one_way_interfaces() {
        let interface = |number, class, endpoints: &[u8]| {
            let mut bytes = vec![9, 4, number, 0, endpoints.len() as u8, class, 0, 0, 0];
            for address in endpoints {
                bytes.extend([7, 5, *address, 2, 64, 0, 0]);
            }
            bytes
        };
        let found = |interfaces: &[Vec<u8>]| {
            let body = interfaces.concat();
            let total = (9 + body.len()) as u16;
            let [low, high] = total.to_le_bytes();
            let head = [9, 2, low, high, interfaces.len() as u8, 1, 0, 0x80, 50];
            let bytes = [head.as_slice(), &body].concat();
            BulkEndpoints::find(&ConfigurationDescriptor::new(&bytes).expect("well formed"))
        };
        let [other, half, ours] = [
            interface(0, 0x0A, &[0x02, 0x82]),
            interface(1, 0xFF, &[0x83]),
            interface(2, 0xFF, &[0x04, 0x85]),
        ];
        assert_eq!(found(&[other.clone(), half.clone()]), None);
        let expected = BulkEndpoints {
            interface: 2,
            input: 0x85,
            output: 0x04,
        };
        assert_eq!(found(&[other, half, ours]), Some(expected));
    }

    /// Pipes that accept a limited number of bytes and return scripted ones.
    struct Scripted {
        sent: Vec<usize>,
        answer: fn() -> io::Result<usize>,
    }

    impl Pipes for Scripted {
        fn send(&mut self, transfer: &[u8]) -> io::Result<()> {
            self.sent.push(transfer.len());
            Ok(())
        }

        fn receive(&mut self, _into: &mut [u8], _wait: Duration) -> io::Result<usize> {
            (self.answer)()
        }
    }

    #[test]
    fn long_sends_are_split_and_receive_time_out_is_no_error() {
        let pipes = Scripted {
            sent: vec![],
            answer: || Err(io::ErrorKind::TimedOut.into()),
        };
        let mut stream = Bulk(pipes);
        stream.send(&[0; 2 * TRANSFER + 5]).expect("sent");
        assert_eq!(stream.0.sent, [TRANSFER, TRANSFER, 5]);
        assert_eq!(stream.receive(&mut [0; 8], Duration::ZERO).ok(), Some(0));
        stream.0.answer = || Err(io::ErrorKind::NotConnected.into());
        assert!(stream.receive(&mut [0; 8], Duration::ZERO).is_err());
    }
}
