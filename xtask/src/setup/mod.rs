//! Finding the programs that the commands need, and installing them if that is allowed.

mod distribution;
pub(crate) mod emulator;
pub(crate) mod gdal;
pub(crate) mod packages;
pub(crate) mod qemu;
pub(crate) mod toolchain;
