//! The contact: the proxy, where the haptic interface point (HIP) would be if it
//! could not enter the terrain.
//!
//! [`Contact::step`] receives the HIP of one tick and returns the proxy. Reading order: `proxy`
//! (the phases of a tick), [`sweep`] (from free space to the surface), [`closest_point`] (over the
//! surface), `friction` (resistance to its slide), [`edge_fade`] (at the border of the data); all
//! use [`surface`]. `tolerance` defines how exact each is, `budget` limits the work of a tick, and
//! `fast_path` handles nearly every tick.

pub mod closest_point;
pub mod edge_fade;
pub mod surface;
pub mod sweep;

mod budget;
mod fast_path;
mod friction;
mod output;
mod proxy;
mod settings;
mod straight_path;
mod tolerance;

#[cfg(test)]
mod crest_tests;
#[cfg(test)]
#[path = "cost_tests.rs"]
mod stats;
#[cfg(test)]
mod test_random;
#[cfg(test)]
mod tests;

pub use budget::{MAX_ATOMIC_WORK, WORK_PER_TICK, work_per_tick};
pub use friction::Friction;
pub use output::{ContactOutput, ContactState};
pub use proxy::Contact;
pub use settings::ContactSettings;
