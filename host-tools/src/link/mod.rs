//! The host's end of the link: tiles out, what was felt in.
//!
//! ```text
//! Terrain ── Client ── Session ── Transport ═══ device
//! ```
//!
//! [`Client`] is the conversation without I/O; [`Session`] runs it over a
//! [`Transport`]: TCP (the emulated board), USB, or a device in this program's
//! memory ([`Native`]). The device asks and the host answers, so a session
//! holds nothing that a new one would need: either end may vanish and come
//! back.

mod bulk;
mod client;
mod dialogue;
mod emulator;
mod error;
mod native;
mod plant;
mod session;
mod tally;
mod target;
mod transport;
mod usb;

pub use bulk::{Bulk, BulkEndpoints, Pipes, is_hapterra};
#[cfg(test)]
pub(crate) use client::tests::hello;
pub use client::{Arming, Client, Event};
pub use dialogue::Dialogue;
pub use emulator::{
    Emulator, EmulatorError, IMAGE_VARIABLE, INSTRUCTIONS_PER_COUNT, Lines, QEMU, QEMU_VARIABLE,
};
pub use error::LinkError;
pub use native::{HostClock, Meddler, Native};
pub use plant::{PlantLine, serve_plant};
pub use session::{Patience, Session};
pub use tally::Tally;
pub use target::Target;
pub(crate) use target::tcp_address;
pub use transport::{Tcp, Transport};
pub use usb::Usb;
pub(crate) use usb::usb_devices;
