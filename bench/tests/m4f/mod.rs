//! The parts of the count on the emulated Cortex-M4F, and of the cycles (`tests/images`).

pub(crate) mod chain;
pub(crate) mod contact;
pub(crate) mod soak;
pub(crate) mod table;
pub(crate) mod tiles;
