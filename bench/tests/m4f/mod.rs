//! The parts of the counts on the emulated Cortex-M4F, also for the cycles (`tests/images`).

pub(crate) mod chain;
pub(crate) mod contact;
pub(crate) mod soak;
pub(crate) mod table;
pub(crate) mod tiles;
