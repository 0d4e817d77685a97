//! The boards' images in an emulated core: interrupts, pins, motors, encoders, faults, shutdown.

mod boots;
mod chip_checks;
mod chips;
mod clutch;
mod encoders;
mod endpoint_halt;
mod faults;
mod halts;
mod identity;
mod latency;
mod loader;
mod marks;
mod motors;
mod outputs;
mod pins;
mod plane;
mod priorities;
mod read_back;
mod shutdown;
