//! `hapterra-touch` for C, C++ and WebAssembly: what `include/hapterra.h` declares.
//!
//! Objects are made by `..._new` and end by `..._free`; each keeps a message of its last error. A null
//! pointer is an error, and so is what the library does not know. A panic would be a fault of the
//! library: it ends in [`HapterraStatus::Internal`](status::HapterraStatus::Internal) where it can be caught, and traps in WebAssembly.

mod border;
pub mod contact;
pub mod memory;
pub mod status;
pub mod surface_params;
pub mod terrain;

#[cfg(test)]
mod tests;
