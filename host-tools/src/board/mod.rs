//! The boards the firmware is built for, and what of them is here: their USB
//! links, debug probes, their images and, with the feature `probe`, the way of
//! an image onto a chip.

mod boards;
mod checkout;
#[cfg(feature = "probe")]
mod flash;
#[cfg(feature = "probe")]
mod image;
mod probes;

pub use boards::{BOARDS, Board};
pub use checkout::{BuildError, Checkout};
#[cfg(feature = "probe")]
pub use flash::{FlashError, Flashed, Progress, flash};
#[cfg(feature = "probe")]
pub use image::{Image, ImageError, Placed};
pub use probes::{Probe, probes};
