//! The link against a scripted host in memory: every fault byte by byte.

mod buffers;
mod commands;
mod device_state;
mod faults;
mod loader;
mod marks;
mod materials;
mod rig;
mod session;
mod task;
mod views;
