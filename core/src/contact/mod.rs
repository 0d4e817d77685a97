//! The proxy: where the hand would be if it could not enter the terrain.
//!
//! [`Contact::step`] takes the haptic interface point of one tick and answers
//! with the proxy (`proxy`, `swept`). Read [`patch`] first, then [`crossing`],
//! `steps`, `reach` and `sweep` (from free space into contact), then [`closest`]
//! and `descent` (in contact), [`presence`] (at the borders of the data), and
//! `paper` for the rule as it was published.

pub mod closest;
pub mod crossing;
pub mod patch;
pub mod presence;

mod descent;
#[cfg(test)]
mod dice;
mod exit;
mod gentle;
mod glide;
mod neighbours;
mod paper;
mod proxy;
mod quick;
mod reach;
mod ruling;
mod spot;
mod steps;
mod sweep;
mod swept;
#[cfg(test)]
mod tally;
#[cfg(test)]
mod tests;
mod track;
mod work;

use glam::Vec3;
use serde::{Deserialize, Serialize};

pub use proxy::Contact;
pub use spot::Spot;
pub use work::WORK_PER_TICK;

use crate::grid::GridPoint;

/// Which contact rule is in force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Rule {
    /// Continuous: the first true crossing starts a contact, and the proxy
    /// moves on the surface.
    #[default]
    Swept,
    /// As published, for comparison.
    Paper,
}

/// What happens when a tick cannot finish: a tile is missing, or the work is
/// spent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// The loop goes on; the proxy waits, and a force that has to wait comes
    /// in gently.
    RealTime,
    /// The tick will be repeated with the same hand until it can finish, and
    /// only then counts; nothing of the wait is felt.
    LockStep,
}

/// What the proxy is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum State {
    /// The hand has not been seen above the surface yet: no force.
    #[default]
    Waiting,
    /// The proxy is free.
    Free,
    /// The proxy is on the surface and the hand below it.
    Touching,
    /// The surface it was on has come to an end: what was felt last fades away.
    LettingGo,
}

/// One tick's answer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Felt {
    /// What the proxy is doing.
    pub state: State,
    /// Where the proxy is.
    pub proxy: GridPoint,
    /// From the hand to the proxy in cells, times the presence: what the
    /// spring feels. Zero unless touching.
    pub stretch: Vec3,
    /// Whether the tick did all there was to do for this hand.
    pub settled: bool,
    /// The tile (column, row) whose absence held the tick up.
    pub held_up_by: Option<[i32; 2]>,
    /// Units of work spent, at most [`WORK_PER_TICK`].
    pub work: u32,
}
