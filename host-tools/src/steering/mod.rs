//! Changes of the placement during a session.
//!
//! ```text
//! keys ─────┐             ┌─ the hand presses: placement changed in contact
//!           ├─ Steer ─ Steering ─ otherwise: clutch held ─ placement changed ─ clutch released
//! commands ─┘             ▲                                        │
//!                         └──────────── samples ───────────────────┘
//! ```
//!
//! [`Steer`] is the user's request, from every source: [`command`] reads lines of text, [`keys`]
//! reads keys. [`Steering`] executes both. It computes the next placement from the positions of HIP
//! and proxy ([`crate::place::Bounds::apply`]). Under a pressing hand it sends the placement at once,
//! and the device changes it without losing the force. Otherwise it requests the device to hold its
//! clutch, waits until there is no force, sends the placement, and releases the clutch.

pub mod command;
mod engine;
pub mod keys;
mod level_by_speed;
mod marks;
mod queue;

use crate::place::PlacementChange;

pub use engine::{PlacementUpdate, Steering};
pub use marks::{Marks, UserMark};
pub use queue::{CommandQueue, Origin};

/// Request of a command.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// A change of placement or clutch.
    Steer(Steer),
    /// A mark with this text.
    Mark(String),
    /// The user's Enter, as an answer to the question with this number.
    Enter(u32),
}

/// Request of the user for the placement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Steer {
    /// A change of the placement.
    Change(PlacementChange),
    /// Holds the clutch (true) or releases it: while it is held, the terrain moves with the hand.
    Clutch(bool),
}
