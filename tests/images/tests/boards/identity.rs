//! Identity of boards in their own images: the chip's identifier.

use std::cell::RefCell;
use std::rc::Rc;

use hapterra::link::{Bulk, BulkEndpoints, ControlSession};
use hapterra_firmware::usb::{PRODUCT, PRODUCT_ID, VENDOR_ID};
use hapterra_image_tests::device::machines;
use hapterra_tests::timeouts::HANG;
use hapterra_tests::usb::host::{ScriptedPipes, enumerate, string};
use nusb::descriptors::{ConfigurationDescriptor, DeviceDescriptor};

#[test]
fn serial_number_on_usb_and_link_is_the_chip_identifier() {
    for mut machine in machines() {
        let board = machine.chip.board;
        // RM0440, 48.1; RM0433, 61.1.
        let identifier = if machine.chip.is_m7 {
            0x1FF1_E800
        } else {
            0x1FFF_7590
        };
        let bytes: Vec<u8> = (0..12).map(|i| 0x1F + 0x11 * i).collect();
        machine.patch(identifier, &bytes);
        let found = enumerate(&mut machine).expect("enumerated");
        let device = DeviceDescriptor::new(&found.device).expect("well formed");
        let numbers = (device.vendor_id(), device.product_id());
        assert_eq!(numbers, (VENDOR_ID, PRODUCT_ID), "{board}");
        let mut named = |index: Option<std::num::NonZeroU8>| {
            string(&mut machine, index.expect("has one").get()).expect("read")
        };
        assert_eq!(named(device.product_string_index()), PRODUCT, "{board}");
        let serial = named(device.serial_number_string_index());
        let expected: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
        assert_eq!(serial, expected, "{board}");
        // The `Hello` message on the link has the same identifier.
        let configuration = ConfigurationDescriptor::new(&found.configuration);
        let endpoints = BulkEndpoints::find(&configuration.expect("well formed"));
        let pipes = ScriptedPipes::new(Rc::new(RefCell::new(machine)), endpoints.expect("two"));
        let opened = ControlSession::open(Box::new(Bulk(pipes)), HANG);
        let reported = opened.expect("it answers").device().serial.to_string();
        assert_eq!(reported, expected, "{board}");
    }
}
