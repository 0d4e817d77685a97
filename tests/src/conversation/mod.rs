//! The conversation as a model that is checked: the host's client and the device's link
//! as they ship, tick by tick, and between them a line that loses, repeats and delays
//! any frame that it is told to. What is delayed is overtaken.
//!
//! ```text
//! Client ──▶ Line ──▶ Device        World: one run
//!        ◀── Line ◀──               Plan: what goes wrong in it
//! ```

mod account;
mod line;
mod plan;
mod world;

pub use line::{Direction, Harm};
pub use plan::{Interruption, Plan};
pub use world::{End, Report, Wrong, check, frames};
