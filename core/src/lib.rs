//! Height-field haptics for a Phantom, from encoder counts to amplifier
//! currents, without `std`, allocation or `unsafe`.
//!
//! Read the modules in this order to follow the data through one tick:
//!
//! 1. [`phantom`] turns encoder counts into the tip position, and forces back
//!    into motor currents.
//! 2. [`grid`] places that tip over the terrain: an integer cell plus a
//!    fraction, so that nothing depends on the distance from the origin.
//! 3. [`terrain`] is what the device holds of the height field: a window of
//!    tiles, and the rule by which it asks the host for more.
//! 4. [`contact`] moves the proxy over bilinear patches.
//! 5. [`force`] turns proxy and haptic interface point into newtons.
//! 6. [`guard`] decides what may reach the amplifiers.
//! 7. [`tick`] is all of it as one pure function, called 1,000 to 10,000 times a
//!    second ([`guard::TickRate`]).
//! 8. [`wire`] is what travels between the device and the host.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

#[cfg(test)]
mod cases;

pub mod contact;
pub mod force;
pub mod grid;
pub mod guard;
pub mod phantom;
pub mod terrain;
pub mod tick;
pub mod wire;

pub use glam::{Vec2, Vec3};
