//! Finding what the commands need, and installing it where that is allowed.

mod distribution;
mod packages;
pub(crate) mod qemu;
pub(crate) mod toolchain;
