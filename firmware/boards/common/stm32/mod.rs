//! Common parts of the STM32 boards: everything except pins, clocks and outputs.
//!
//! Each image defines its pins and clocks in `chip.rs`, its outputs in `outputs.rs`, and the
//! reading of its flash in `flash.rs`; [`start`] assembles the application from them.

pub(crate) mod calibration_memory;
pub(crate) mod clock;
#[path = "../critical.rs"]
mod critical;
pub(crate) mod encoders;
pub(crate) mod failure;
pub(crate) mod feedback;
pub(crate) mod heartbeat;
pub(crate) mod injected;
pub(crate) mod loader;
pub(crate) mod mark_pin;
pub(crate) mod motor_memory;
pub(crate) mod parts;
pub(crate) mod priorities;
#[path = "../stack.rs"]
pub(crate) mod stack;
pub(crate) mod stack_guard;
pub(crate) mod start;
pub(crate) mod supervisor;
pub(crate) mod supply;
pub(crate) mod tasks;
pub(crate) mod usb_clock;
pub(crate) mod usb_interrupt;
