//! The campaign of link faults: a host, a device with a virtual arm in a hand, and a line between
//! them with random faults, in the device's own time.
//!
//! ```text
//! terrain ── host ══ cable (harm) ══ device ─▶ currents ─▶ arm ── hand
//!             │                  tap ─┘  ▲                  │
//!            end, view, counts           └───── counts ─────┘
//! ```
//!
//! A *run* is one host from its open to its end, with one fault ([`fault`]) that begins in one of
//! the run's steps ([`runs`]). In every tick [`segment`](mod@segment) checks force and currents
//! ([`crate::campaign::tick_invariants`]), the proxy against the bilinear surface
//! ([`proxy_oracle`]), amplifiers that are on without a request, and wrong messages to the user. At
//! the end of a run [`runs`] checks the report of the host:
//! - each step ends within its time, with its result or with an error;
//! - if host and device agree on the end, the amplifiers are off;
//! - received, lost and dropped samples add up to the samples made ([`frame_tap`]).
//!
//! A segment depends only on the seed and its number, so a violation can be repeated alone.

pub mod cable;
pub mod device;
pub mod fault;
pub mod frame_tap;
pub mod frames;
pub mod host;
pub mod hostile_programs;
pub mod not_a_device;
pub mod proxy_oracle;
pub mod report;
pub mod run_outcomes;
pub mod runs;
pub mod segment;

use hapterra::synth::{Kind as Look, Synth};
use hapterra::terrain::{Scale, Terrain};
use heightfield::Raster;

use crate::campaign::Violation;
use crate::random::Random;
use fault::Kind;
pub use run_outcomes::LinkStats;
use segment::Segment;

/// The default seed.
pub const SEED: u64 = 1;
/// Samples along the side of the terrain, and the side of a cell, mm.
const SAMPLES: u32 = 512;
const CELL_MM: f64 = 0.5;

/// Runs segments from the first on, until devices have run for the requested seconds. `done`
/// receives each segment's number and the outcomes up to then.
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
    while stats.ticks[0] < seconds * 1_000 {
        segment(seed, number, &mut stats)?;
        done(number, &stats);
        number += 1;
    }
    Ok(stats)
}

/// Runs a segment of a campaign, with each kind of fault once in random order, and adds it to
/// `stats`.
///
/// # Errors
/// The first [`Violation`].
pub fn segment(seed: u64, number: u64, stats: &mut LinkStats) -> Result<(), Violation> {
    let mut random = Random::new(seed ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let raster = terrain(&mut random);
    let scale = Scale::new(CELL_MM, 1.0).expect("a scale");
    let terrain = Terrain::new(&raster, scale, 0).expect("a terrain");
    let mut segment = Segment::new(&terrain, random);
    let mut deck = Kind::ALL;
    for left in (1..deck.len()).rev() {
        deck.swap(left, segment.random.below(left + 1));
    }
    let played = deck
        .into_iter()
        .try_for_each(|kind| runs::run(&mut segment, kind, stats).map_err(|what| (kind, what)));
    let (board, off) = (&segment.board, segment.off_surface);
    stats.add(
        board.ticks,
        segment.touching,
        off,
        &board.tick_checks.extremes,
    );
    played.map_err(|(kind, what)| Violation {
        ground: crate::campaign::Ground::Ice,
        segment: number,
        tick: segment.now,
        what: format!("{kind:?}: {what}"),
    })
}

/// Returns hills or steps; no sample is higher above a tile's base than
/// [`proxy_oracle::OFF_SURFACE`] allows for.
fn terrain(random: &mut Random) -> Raster {
    let kinds = [Look::Fractal, Look::Ridge, Look::Fractal];
    let amplitude_mm = random.between(6.0, 16.0);
    let synth = Synth::new(kinds[random.below(3)], random.bits(), amplitude_mm);
    Raster::from_fn(SAMPLES, SAMPLES, |column, row| synth.height(column, row)).expect("a terrain")
}
