//! Finding what the commands need, and installing it where that is allowed.

pub(crate) mod packages;
pub(crate) mod qemu;
pub(crate) mod toolchain;
