//! Writes an image to a board without a debug probe, through the USB loader in the chip's ROM.
//!
//! ```text
//! Image ── Plan ── update() ── Loader ── ControlPipe ══ the chip's ROM
//! ```
//!
//! - [`Plan`] lists the pages of flash to erase and their new content. It is checked against the
//!   loader's description of its flash before anything is erased.
//! - [`Loader`] implements DFU 1.1 with ST's extensions (AN3156, UM0424).
//! - [`update`] erases, writes, verifies and starts the program. The page with the vectors is
//!   erased first and their word is written last, so that an incomplete program never starts.
//! - [`choose`] selects the device. [`SystemPipe`] is a loader on the system's USB; tests replace
//!   it with a scripted one.

mod choice;
mod error;
mod layout;
mod loader;
mod plan;
mod procedure;
#[cfg(test)]
mod scripted;
mod system;
#[cfg(test)]
mod tests;

pub use choice::{Choice, ConnectedDevice, choose};
pub use error::{UpdateError, UpdateFailure};
pub use layout::Layout;
pub use loader::{ControlPipe, Loader, request};
pub use plan::{FlashRange, Plan};
pub use procedure::{Step, update};
pub use system::{LOADER_PRODUCT_ID, LOADER_VENDOR_ID, SystemPipe, connected_devices, open_loader};
