//! An image onto a board without a debug probe: through the USB loader in the chip's
//! ROM.
//!
//! ```text
//! Image ── Plan ── update() ── Loader ── ControlPipe ══ the chip's ROM
//! ```
//!
//! - [`Plan`] is which pages of flash are erased and what they hold then, held against
//!   what the loader says of its flash, before anything is erased.
//! - [`Loader`] speaks DFU 1.1 with ST's extensions (AN3156, UM0424).
//! - [`update`] erases, writes, reads back and compares, and starts the program. The
//!   page with the vectors is erased first and their word written last, so that no half
//!   of a program is ever started.
//! - [`choose`] picks the device; [`SystemPipe`] is a loader on the system's USB, and a
//!   test puts a scripted one in its place.

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

pub use choice::{Choice, Plugged, choose};
pub use error::{UpdateError, UpdateFailure};
pub use layout::Layout;
pub use loader::{ControlPipe, Loader, request};
pub use plan::{FlashRange, Plan};
pub use procedure::{Step, update};
pub use system::{LOADER_PRODUCT_ID, LOADER_VENDOR_ID, SystemPipe, open_loader, plugged};
