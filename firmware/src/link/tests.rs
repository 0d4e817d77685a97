//! The link against a scripted host in memory, with each fault injected byte by byte.

mod buffers;
mod cancels;
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
