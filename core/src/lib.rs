//! Height-field haptics for a Phantom, from encoder counts to amplifier
//! currents, without `std`, allocation or `unsafe`.
//!
//! A haptic interface point (HIP) presses a proxy onto a slope, and the spring
//! between them makes the force:
//!
//! ```
//! use hapterra_core::Vec3;
//! use hapterra_core::contact::{Contact, ContactSettings, ContactState};
//! use hapterra_core::force::SurfaceParams;
//! use hapterra_core::grid::GridPoint;
//! use hapterra_core::terrain::{FieldSize, TileArena};
//!
//! // 40 × 40 cells that rise to the east, one cell in four.
//! let size = FieldSize::new(40, 40);
//! let mut slope = TileArena::<2>::from_fn(size, |x, _y| 0.25 * x as f32)?;
//! let window = slope.window();
//!
//! // The HIP descends through the air and one cell into the ground.
//! let mut contact = Contact::new(ContactSettings::AT_1_KHZ);
//! for height in [9.0, 6.0, 4.125] {
//!     let hip = GridPoint::new([20, 20, 0], Vec3::new(0.5, 0.5, height));
//!     contact.step(&window, &hip);
//! }
//! let hip = GridPoint::new([20, 20, 0], Vec3::new(0.5, 0.5, 4.125));
//! let output = contact.step(&window, &hip);
//! assert_eq!(output.state, ContactState::Touching);
//!
//! // At 2 mm a cell: up, and back down the slope.
//! let force_n = SurfaceParams::PREMIUM.spring().force_n(output.displacement * 2.0);
//! assert!(force_n.z > 0.9 && force_n.x < -0.2 && force_n.y.abs() < 1e-6);
//! # Ok::<(), hapterra_core::terrain::FieldError>(())
//! ```
//!
//! The crate has longer examples, such as `forces_along_a_path`, `closed_loop` (the whole tick with
//! a simulated arm) and `serve_tiles` (a host and a device that exchange the messages of the link
//! in memory).
//!
//! Read the modules in this order to follow the data through one tick; each depends only on those
//! before it, which `tests/imports.rs` checks:
//!
//! 1. [`phantom`] turns encoder counts into the tip position, and forces back
//!    into motor currents.
//! 2. [`grid`] places that tip over the terrain: an integer cell plus a
//!    fraction, so that nothing depends on the distance from the origin.
//! 3. [`terrain`] stores the device's part of the height field: a window of tiles, and the rule for
//!    its requests to the host.
//! 4. [`contact`] moves the proxy over bilinear patches.
//! 5. [`force`] turns proxy and HIP into newtons.
//! 6. [`guard`] limits forces and currents, and raises faults.
//! 7. [`scene`] is the input of the loop, and its record of a tick. The [`clutch`] allows a change
//!    of placement without a step in force.
//! 8. [`tick`] combines them in one pure function, called 1,000 to 10,000 times a second
//!    ([`rate::TickRate`]): counts, pose, HIP, force, guard, currents. `renderer.rs` combines
//!    contact and effects, also for `replay.rs`; `haptics.rs` applies commands and scene changes
//!    between ticks, and `change_in_contact.rs` those under a pressing hand.
//! 9. [`wire`] defines the messages between the device and the host.
//!
//! [`crc`] is separate: the check sum of frames and records.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

#[cfg(test)]
mod cases;

/// Runs the README's example as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod change_in_contact;
pub mod clutch;
pub mod contact;
pub mod crc;
pub mod force;
pub mod grid;
pub mod guard;
mod haptics;
pub mod phantom;
pub mod rate;
mod renderer;
mod replay;
mod scalar;
pub mod scene;
pub mod terrain;
pub mod tick;
pub mod wire;

pub use glam::{Vec2, Vec3};
