//! The conversation as a model that is checked: the host's client and the device's link
//! as they ship, tick by tick, and between them a line that loses, repeats and delays
//! any frame that it is told to. What is delayed is overtaken.
//!
//! ```text
//! Client ──▶ Line ──▶ Device        World: one run
//!        ◀── Line ◀──               Plan: what goes wrong in it
//!                                   Judge: what must not come of it
//! ```

mod account;
mod errands;
mod forged;
mod judge;
mod line;
mod plan;
mod questions;
mod world;

pub use judge::Wrong;
pub use line::{Direction, Harm};
pub use plan::{Interruption, Plan};
pub use world::{End, Report, check, frames};
