//! The host's end of the link: tiles out, samples in.
//!
//! ```text
//! Terrain ── Client ── Session ──┐
//!                                ├─ Transport ═══ device
//!      queries ── ControlSession ┘
//! ```
//!
//! - `host_protocol`: the host's states of [`hapterra_core::wire`], without I/O and without a
//!   clock; `host_request` and `request_queue`: the host's requests, repeated until they are
//!   answered.
//! - [`Client`] serves a terrain by that protocol, and [`Session`] runs it over a [`Transport`].
//!   The device requests tiles and the host answers, so a new session needs nothing from the one
//!   before: either end may fail and reconnect.
//! - `prefetch` reads the tiles ahead of the HIP before the device requests them.
//! - [`ControlSession`] sends queries and requests without a terrain: status, calibration, arming.
//! - Transports are [`Tcp`], [`Usb`], and [`Native`], a device in this program's memory; a
//!   [`DeviceAddress`] selects one.
//! - [`heightfield::printable_text`] escapes text of a device before a terminal shows it.
//! - [`Emulator`] runs the emulated board; [`serve_plant`] moves the virtual Phantom at its second
//!   line.

mod bulk;
mod client;
mod control_session;
mod device_address;
mod emulator;
mod error;
mod host_protocol;
mod host_request;
mod line;
mod link_stats;
mod messages;
mod native;
mod plant_line;
mod prefetch;
mod request_queue;
mod session;
mod tcp;
mod timeouts;
mod transport;
mod usb;

pub use bulk::{Bulk, BulkEndpoints, Pipes, SelectionError, is_hapterra, printable, select};
#[cfg(test)]
pub(crate) use client::tests::hello;
pub use client::{Arming, Client, Event};
pub use control_session::ControlSession;
pub use device_address::DeviceAddress;
pub(crate) use device_address::tcp_address;
pub use emulator::{
    EMULATED, Emulator, EmulatorError, IMAGE_VARIABLE, INSTRUCTIONS_PER_COUNT, Lines, QEMU,
    QEMU_VARIABLE,
};
pub use error::LinkError;
pub use host_protocol::State;
pub use host_request::HostRequest;
pub use link_stats::LinkStats;
pub use native::{FaultInjector, HostClock, Native};
pub use plant_line::{move_arm_while, serve_plant};
pub use session::Session;
pub use tcp::Tcp;
pub use timeouts::Timeouts;
pub use transport::Transport;
pub use usb::{SystemPipes, Usb};
pub(crate) use usb::{is_board, place_on_usb, usb_devices};
