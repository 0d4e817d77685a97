//! `hapterra-touch` for C, C++ and WebAssembly: the functions of `include/hapterra.h`.
//!
//! Objects are created by `..._new` and freed by `..._free`; each keeps a message of its last
//! error. A null pointer is an error, and so is an unknown value. A panic is a defect of the
//! library: it is returned as [`HapterraStatus::Internal`](status::HapterraStatus::Internal) where
//! it can be caught, and traps in WebAssembly.

mod border;
pub mod contact;
pub mod memory;
pub mod status;
pub mod surface_params;
pub mod terrain;

#[cfg(test)]
mod tests;
