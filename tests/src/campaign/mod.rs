//! The randomised closed-loop campaign: a virtual Phantom in a hand, the real application, and
//! random injected faults of all kinds.
//!
//! ```text
//! hand ─ arm ─▶ counts ─ fault ─▶ device ─▶ currents ─▶ arm
//!                                    ║ pipes (fault)
//!                                   host ── terrain
//! ```
//!
//! In every tick [`tick_invariants`] and [`force_invariants`] check the device; after every
//! injected fault [`fault_outcomes`] compares the outcome with that of [`fault_kind`]. A segment
//! depends only on the seed and its number, so a violation can be repeated.

pub mod arm;
pub mod board;
pub mod clock;
pub mod fault_effect;
pub mod fault_kind;
pub mod fault_outcomes;
pub mod faulty_pipe;
pub mod force_invariants;
pub mod force_share;
pub mod ground;
pub mod host;
pub mod hostile_calibrations;
pub mod limit_cycle;
pub mod maxima;
pub mod motor_forces;
pub mod report;
pub mod segment;
pub mod tick_invariants;

pub use fault_outcomes::LinkStats;
pub use ground::Ground;
pub use segment::Violation;

/// The default seed.
pub const SEED: u64 = 4;

/// Runs segments from the first on, each frictionless and with effects, until the amplifiers were
/// on for the requested seconds. `done` receives each segment's number and the outcomes up to then.
///
/// # Errors
/// The first [`Violation`].
pub fn run(
    seed: u64,
    seconds: u64,
    done: &mut dyn FnMut(u64, &LinkStats),
) -> Result<LinkStats, Violation> {
    let mut stats = LinkStats::default();
    let mut number = 0;
    while stats.armed < seconds * 1_000 {
        for ground in [Ground::Ice, Ground::Drawn] {
            segment::run(seed, number, ground, &mut stats)?;
        }
        done(number, &stats);
        number += 1;
    }
    Ok(stats)
}
