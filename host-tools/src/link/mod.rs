//! The host's end of the link: tiles out, what was felt in.
//!
//! ```text
//! Terrain ── Client ── Session ──┐
//!                                ├─ Transport ═══ device
//!    questions ─── Dialogue ─────┘
//! ```
//!
//! - [`Client`] is the conversation about a terrain without I/O; [`Session`]
//!   runs it over a [`Transport`]. The device asks and the host answers, so a
//!   session holds nothing that a new one would need: either end may vanish
//!   and come back.
//! - [`Dialogue`] asks and requests without a terrain: status, calibration,
//!   arming.
//! - Transports are [`Tcp`], [`Usb`], and [`Native`], a device in this
//!   program's memory; [`DeviceAddress`] is how a user names one.
//! - [`Emulator`] runs the emulated board; [`serve_plant`] moves the virtual
//!   Phantom at its second line.

mod bulk;
mod client;
mod device_address;
mod dialogue;
mod emulator;
mod error;
mod messages;
mod native;
mod plant_line;
mod session;
mod tally;
mod tcp;
mod transport;
mod usb;

pub use bulk::{Bulk, BulkEndpoints, Pipes, is_hapterra};
#[cfg(test)]
pub(crate) use client::tests::hello;
pub use client::{Arming, Client, Event};
pub use device_address::DeviceAddress;
pub(crate) use device_address::tcp_address;
pub use dialogue::Dialogue;
pub use emulator::{
    Emulator, EmulatorError, IMAGE_VARIABLE, INSTRUCTIONS_PER_COUNT, Lines, QEMU, QEMU_VARIABLE,
};
pub use error::LinkError;
pub use native::{HostClock, Meddler, Native};
pub use plant_line::{move_arm_while, serve_plant};
pub use session::{Patience, Session};
pub use tally::Tally;
pub use tcp::Tcp;
pub use transport::Transport;
pub(crate) use usb::usb_devices;
pub use usb::{SystemPipes, Usb};
