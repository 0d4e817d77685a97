//! Another view of the terrain while it is touched.
//!
//! ```text
//! keys ─────┐
//!           ├─ Steer ─ Steering ─ clutch held ─ placement changed ─ clutch let go
//! commands ─┘             ▲                                        │
//!                         └──────────── samples ───────────────────┘
//! ```
//!
//! [`Steer`] is the user's wish, from every source: [`command`] reads lines of text,
//! [`keys`] reads keys. [`Steering`] is the one engine behind both. It has the device
//! hold its clutch, waits until there is no force, works out the next
//! view from where HIP and proxy are ([`crate::place::Bounds::apply`]), puts it in, and lets the
//! clutch go.

pub mod command;
mod engine;
pub mod keys;
mod marks;
mod queue;

use crate::place::PlacementChange;

pub use engine::{Put, Steering};
pub use marks::{Made, Marks};
pub use queue::{CommandQueue, Origin};

/// Request of a command.
#[derive(Clone, Debug, PartialEq)]
pub enum Wanted {
    /// Another view.
    Steer(Steer),
    /// A mark with this text.
    Mark(String),
    /// The user's Enter, as an answer to the question of this number.
    Enter(u32),
}

/// Request of the user for the placement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Steer {
    /// Another view.
    Change(PlacementChange),
    /// Hold the clutch, or let it go: while it is held the terrain goes with the hand.
    Clutch(bool),
}
