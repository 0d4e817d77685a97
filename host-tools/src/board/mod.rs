//! The firmware's boards: their USB links, debug probes and images. An image is written through the
//! loader in the chip's ROM or, with the feature `probe`, through a debug probe.

mod boards;
mod checkout;
#[cfg(feature = "probe")]
mod flash;
mod image;
mod memories;
mod probes;
pub mod update;

pub use boards::{BOARDS, Board};
pub use checkout::{BuildError, Checkout};
#[cfg(feature = "probe")]
pub use flash::{FlashError, Flashed, Progress, flash};
pub use image::{Image, ImageError, Placed};
pub use memories::Memories;
pub use probes::{Probe, probes};
