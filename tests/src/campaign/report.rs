//! The report of a campaign: `docs/campaign.md`.

use super::Tally;
use super::kind::{Kind, STALL_TICKS};

/// The page.
#[must_use]
pub fn page(seed: u64, seconds: u64, tally: &Tally) -> String {
    let at = &tally.extremes;
    format!(
        "# The closed-loop campaign

Written by `cargo xtask campaign --seconds {seconds} --seed {seed}`, which repeats it to the last figure.

A virtual Phantom Premium 1.5 in a wandering hand, and the application of the boards compiled for the desktop, tick by
tick (`tests/src/campaign`). The amplifiers were on for {} s of {} s. {} times something went wrong, each kind of the
table as often as the others, in random order, place and strength. The mishaps are described in
`tests/src/campaign/kind.rs` beside what is expected of each; anything else ends the campaign.

Held in every tick: no current with the amplifiers off, none above the motor's peak, none that is not a number;
amplifiers never on with the dead-man switch open, the emergency stop pressed or hardware that failed, in the very
tick; no force told while disarmed or faulted; force told within the guard's clamp (90 % of the record's 8.5 N), and changing by
at most 1 N a tick; the virtual motors' windings below 112 °C. The force at the tip, worked out from the currents in f64 with the
true levers and the share of the arm's weight that explains it best, stays within the record's 8.5 N, whatever the
encoders say: one that is wrong makes the device push with levers that are not the arm's.

The largest seen: {:.4} N told, {:.3} N worked out from the currents, {:.4} A, {:.4} N change
in a tick, {:.1} °C.

{}
The last column counts the ticks after the first of the mishap in which the amplifiers were still on, at most, where they
went off. A hanging task is noticed after {STALL_TICKS} ticks at most, before the watchdog resets the board.
",
        tally.armed / 1_000,
        tally.ticks / 1_000,
        tally.injected(),
        at.force_n,
        at.motor_force_n,
        at.current_a,
        at.slew_n,
        at.winding_c,
        tally.table(),
    )
}

/// Kinds that a page does not have, or not with a count.
#[must_use]
pub fn missing(page: &str) -> Vec<Kind> {
    let has = |kind: &Kind| {
        page.lines().any(|line| {
            let mut cells = line.split('|').map(str::trim).skip(1);
            cells.next() == Some(&format!("{kind:?}"))
                && cells
                    .next()
                    .is_some_and(|count| count.parse().is_ok_and(|n: u32| n > 0))
        })
    };
    Kind::ALL.into_iter().filter(|kind| !has(kind)).collect()
}
