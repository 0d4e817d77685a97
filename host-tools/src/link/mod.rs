//! The host's end of the link: tiles out, what was felt in.
//!
//! ```text
//! Terrain ── Client ── Session ──┐
//!                                ├─ Transport ═══ device
//!    questions ─── Dialogue ─────┘
//! ```
//!
//! - `conversation` is the host's table of states in [`hapterra_core::wire`], without
//!   I/O and without a clock. [`Client`] holds it and serves a terrain; [`Session`]
//!   runs that over a [`Transport`]. The device asks and the host answers, so a
//!   session holds nothing that a new one would need: either end may vanish
//!   and come back.
//! - [`Dialogue`] asks and requests without a terrain: status, calibration,
//!   arming.
//! - Transports are [`Tcp`], [`Usb`], and [`Native`], a device in this
//!   program's memory; [`DeviceAddress`] is how a user names one.
//! - [`heightfield::shown`] is what of a device's own words a terminal may show.
//! - [`Emulator`] runs the emulated board; [`serve_plant`] moves the virtual
//!   Phantom at its second line.

mod ahead;
mod ask;
mod asking;
mod bulk;
mod client;
mod conversation;
mod device_address;
mod dialogue;
mod emulator;
mod error;
mod line;
mod link_stats;
mod messages;
mod native;
mod plant_line;
mod session;
mod tcp;
mod timeouts;
mod transport;
mod usb;

pub use ask::Ask;
pub use bulk::{Bulk, BulkEndpoints, NotOne, Pipes, is_hapterra, printable, the_one};
#[cfg(test)]
pub(crate) use client::tests::hello;
pub use client::{Arming, Client, Event};
pub use conversation::State;
pub use device_address::DeviceAddress;
pub(crate) use device_address::tcp_address;
pub use dialogue::Dialogue;
pub use emulator::{
    EMULATED, Emulator, EmulatorError, IMAGE_VARIABLE, INSTRUCTIONS_PER_COUNT, Lines, QEMU,
    QEMU_VARIABLE,
};
pub use error::LinkError;
pub use link_stats::LinkStats;
pub use native::{FaultInjector, HostClock, Native};
pub use plant_line::{move_arm_while, serve_plant};
pub use session::Session;
pub use tcp::Tcp;
pub use timeouts::Timeouts;
pub use transport::Transport;
pub use usb::{SystemPipes, Usb};
pub(crate) use usb::{is_board, place_on_usb, usb_devices};
