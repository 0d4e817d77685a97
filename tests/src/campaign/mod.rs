//! The randomized closed-loop campaign: a virtual Phantom in a hand, the real
//! application, and everything that can go wrong, at random.
//!
//! ```text
//! hand ─ arm ─▶ counts ─ mishap ─▶ device ─▶ currents ─▶ arm
//!                                    ║ pipes (mishap)
//!                                   host ── terrain
//! ```
//!
//! In every tick [`watch`] and [`force_watch`] hold the device to its bounds; after every mishap
//! [`tally`] holds it to what [`kind`] expects. A segment depends on the seed
//! and its own number alone, so a violation is repeated by itself.

pub mod arm;
pub mod board;
pub mod clock;
pub mod effect;
pub mod extremes;
pub mod force_watch;
pub mod ground;
pub mod host;
pub mod hostile;
pub mod kind;
pub mod levers;
pub mod pipe;
pub mod report;
pub mod segment;
pub mod share;
pub mod swing;
pub mod tally;
pub mod watch;

pub use ground::Ground;
pub use segment::Violation;
pub use tally::LinkStats;

/// The seed that is used without being told another.
pub const SEED: u64 = 4;

/// Runs segments, from the first on, each on ice and with effects, until the amplifiers were on for so many
/// seconds. `done` is told each segment's number and the tally so far.
///
/// # Errors
/// The first [`Violation`].
pub fn run(
    seed: u64,
    seconds: u64,
    done: &mut dyn FnMut(u64, &LinkStats),
) -> Result<LinkStats, Violation> {
    let mut tally = LinkStats::default();
    let mut number = 0;
    while tally.armed < seconds * 1_000 {
        for ground in [Ground::Ice, Ground::Drawn] {
            segment::run(seed, number, ground, &mut tally)?;
        }
        done(number, &tally);
        number += 1;
    }
    Ok(tally)
}
