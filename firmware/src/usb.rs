//! How the boards present themselves on USB: one vendor-specific interface
//! with a bulk endpoint in each direction, found by these numbers.

/// Vendor: pid.codes, shared by open-source projects.
pub const VENDOR_ID: u16 = 0x1209;
/// Product: one of pid.codes' numbers for testing, until the project has its own.
pub const PRODUCT_ID: u16 = 0x0001;
/// What the product string says; the test numbers alone could be anybody's.
pub const PRODUCT: &str = "hapterra";
/// Class code of the link's interface: vendor-specific.
pub const INTERFACE_CLASS: u8 = 0xFF;
/// Bytes in a full-speed bulk packet.
pub const PACKET: usize = 64;
