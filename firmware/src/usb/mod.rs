//! USB descriptors of the boards: one vendor-specific interface with a bulk endpoint in each
//! direction, identified by these numbers.
//!
//! Windows needs no driver (WinUSB, by Microsoft OS 2.0 descriptors); on Linux, the rule in
//! `host-tools/udev/` grants users access. The stack is embassy-usb over any driver: the boards'
//! peripherals, or in tests a scripted host.

#[cfg(feature = "usb")]
mod bulk_stream;
#[cfg(feature = "usb")]
mod device;
#[cfg(feature = "usb")]
mod endpoint_filter;

#[cfg(feature = "usb")]
pub use bulk_stream::BulkStream;
#[cfg(feature = "usb")]
pub use device::{DescriptorBuffers, UsbParts, device};
#[cfg(feature = "usb")]
pub use endpoint_filter::{EndpointFilter, EndpointHalt};

/// Vendor: pid.codes, shared by open-source projects.
pub const VENDOR_ID: u16 = 0x1209;
/// Product: one of pid.codes' numbers for testing, until the project has its own.
pub const PRODUCT_ID: u16 = 0x0001;
/// The product string; the test numbers alone identify no vendor.
pub const PRODUCT: &str = "hapterra";
/// Class code of the link's interface: vendor-specific.
pub const INTERFACE_CLASS: u8 = 0xFF;
/// Bytes in a full-speed bulk packet.
pub const PACKET: usize = 64;
/// Request code of the Microsoft OS descriptors; any unused code.
pub const MSOS_VENDOR_CODE: u8 = 0x01;
/// Identifier by which a Windows program finds the interface.
pub const INTERFACE_GUIDS: [&str; 1] = ["{7B0D3C64-5F6E-4A0B-9C7C-6B1E5A0C2D11}"];
