//! The campaign of link faults: a host, a device with a virtual arm in a hand, and a line
//! between them to which everything happens, at random, in the device's own time.
//!
//! ```text
//! terrain ── host ══ cable (harm) ══ device ─▶ currents ─▶ arm ── hand
//!             │                  tap ─┘  ▲                  │
//!            end, view, counts           └───── counts ─────┘
//! ```
//!
//! A *run* is one host from its hello to its end, with one fault in it ([`fault`]) that
//! begins in one of the run's steps ([`play`]). In every tick [`segment`](mod@segment) judges what is
//! felt: force and currents ([`crate::campaign::watch`]), the proxy against the bilinear
//! surface ([`surface`]), amplifiers that nobody asked for, a user who sees something
//! else than what is. At the end of a run [`play`] judges what the host said of it:
//! - each step ends within its time, with what it is for or with an error;
//! - an end that host and device agree on is one with the amplifiers off;
//! - received, lost and dropped samples are together the samples made ([`tap`]).
//!
//! A segment depends on the seed and its own number alone, so a violation is repeated by
//! itself.

pub mod cable;
pub mod device;
pub mod fault;
pub mod host;
pub mod hostile;
pub mod impostor;
pub mod play;
pub mod report;
pub mod segment;
pub mod surface;
pub mod tally;
pub mod tap;
pub mod wire;

use hapterra::synth::{Kind as Look, Synth};
use hapterra::terrain::{Scale, Terrain};
use heightfield::Raster;

use crate::campaign::Violation;
use crate::chance::Chance;
use fault::Kind;
use segment::Segment;
pub use tally::LinkStats;

/// The seed that is used without being told another.
pub const SEED: u64 = 1;
/// Samples along the side of the terrain, and the side of a cell, mm.
const SAMPLES: u32 = 512;
const CELL_MM: f64 = 0.5;

/// Runs segments, from the first on, until devices have run for so many seconds. `done`
/// is told each segment's number and the tally so far.
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
    while tally.ticks[0] < seconds * 1_000 {
        segment(seed, number, &mut tally)?;
        done(number, &tally);
        number += 1;
    }
    Ok(tally)
}

/// Runs a segment of a campaign, every kind of fault once in an order of its own, and
/// adds it to the tally.
///
/// # Errors
/// The first [`Violation`].
pub fn segment(seed: u64, number: u64, tally: &mut LinkStats) -> Result<(), Violation> {
    let mut chance = Chance::new(seed ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let raster = terrain(&mut chance);
    let scale = Scale::new(CELL_MM, 1.0).expect("a scale");
    let terrain = Terrain::new(&raster, scale, 0).expect("a terrain");
    let mut segment = Segment::new(&terrain, chance);
    let mut deck = Kind::ALL;
    for left in (1..deck.len()).rev() {
        deck.swap(left, segment.chance.below(left + 1));
    }
    let played = deck
        .into_iter()
        .try_for_each(|kind| play::run(&mut segment, kind, tally).map_err(|what| (kind, what)));
    let (board, off) = (&segment.board, segment.off_surface);
    tally.add(board.ticks, segment.touching, off, &board.watch.extremes);
    played.map_err(|(kind, what)| Violation {
        ground: crate::campaign::Ground::Ice,
        segment: number,
        tick: segment.now,
        what: format!("{kind:?}: {what}"),
    })
}

/// Hills or steps; no sample is higher above a tile's base than the bound of
/// [`surface::OFF_SURFACE`] has room for.
fn terrain(chance: &mut Chance) -> Raster {
    let looks = [Look::Fractal, Look::Ridge, Look::Fractal];
    let amplitude_mm = chance.between(6.0, 16.0);
    let synth = Synth::new(looks[chance.below(3)], chance.bits(), amplitude_mm);
    Raster::from_fn(SAMPLES, SAMPLES, |column, row| synth.height(column, row)).expect("a terrain")
}
