//! The boards' own images in an emulated core, from reset, without the boards.
//!
//! ```text
//!   scripted host ── usb ──┐                 ┌── DAC, PWM, SPI: caught
//!                          ▼                 │
//!   encoder counts ──▶  bus (MMIO)  ◀──▶  unicorn: the unmodified ELF
//!                          ▲
//!   time ── timers ── nvic ┘
//! ```
//!
//! [`machine::Machine`] is the core with its exceptions; [`bus::Bus`] the peripherals at their
//! addresses. Only the parts that the images use are modelled, by the reference manuals of the
//! chips (RM0440, RM0433) and of the architecture (ARM DDI 0403E); each module names its registers.
//! A register without a model reads back its last written value.
//!
//! This shows the effects of the image's instructions. It cannot show electrical faults, or
//! faults of the silicon or of these models.

pub mod adc;
pub mod bench;
pub mod bus;
pub mod chip;
pub mod converter;
pub mod counting;
pub mod device;
pub mod elf;
pub mod machine;
pub mod nvic;
pub mod quadrature;
pub mod shutdown;
pub mod stopwatch;
pub mod supply;
pub mod timer;
pub mod usb;
pub mod watchdog;
