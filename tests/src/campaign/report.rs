//! The report of a campaign: `docs/campaign.md`.

use super::Tally;
use super::extremes::OFF_COUNTS;
use super::kind::{Kind, STALL_TICKS};
use super::swing::MOST_TURNS;
use crate::rows;

/// The page of a campaign that ran with the source at `commit`.
#[must_use]
pub fn page(commit: Option<&str>, seed: u64, seconds: u64, tally: &Tally) -> String {
    let at = &tally.extremes;
    let commit = commit.map_or(String::new(), |commit| format!(" at commit {commit}"));
    format!(
        "# The closed-loop campaign

Written by `cargo xtask campaign --seconds {seconds} --seed {seed}`{commit}; the same source repeats it to the last figure.

A virtual Phantom Premium 1.5 in a wandering hand, and the application of the boards compiled for the desktop, tick by
tick (`tests/src/campaign`). Each segment is run twice: on ground like ice, and with effects at random
(`tests/src/campaign/ground.rs`: friction, shading, texture, damping, the passivity controller on or off, up to 2.6 N/mm,
and in every second of them up to 16 materials of up to 1.7 times that). The amplifiers were on for {} s of {} s. {} times something went wrong, each kind of the
table as often as the others, in random order, place and strength. The mishaps are described in
`tests/src/campaign/kind.rs` beside what is expected of each; anything else ends the campaign.

Held in every tick, by `tests/src/campaign/watch.rs`:

- no current with the amplifiers off, none above the motor's peak, none that is not a number;
- amplifiers never on with the dead-man switch open, the emergency stop pressed or hardware that failed, in the very tick;
- no force told while disarmed or faulted; force told within the guard's clamp (90 % of the record's 8.5 N), and changing by at
  most 1 N a tick;
- the force that the currents make in the pose *that the encoders tell*, worked out in f64 with that pose's levers,
  within the same clamp, whatever is wrong with the encoders;
- the force that they make at the true tip, with the arm's true levers, within the record's 8.5 N while no encoder is off by
  more than {OFF_COUNTS} counts, as much as two jumps may add before they are found;
- the virtual motors' windings below 112 °C, and no winding more than 1 K warmer than the device takes it to be, whatever reset
  came between;
- no calibration in force above the ceilings of a Premium 1.5, and none stored that nobody agreed to;
- in the ramp after arming, armed, and while the clutch opens and closes (`tests/src/campaign/felt.rs`): no force against the way from
  the HIP to the proxy, but where both shading and texture turn it, and none larger than the share that is let through of what the
  stiffest material, the highest texture and all of the damping make of the depth;
- in the same modes, with the controller on and while nothing has gone wrong: no contact with ground of one stiffness has given the
  tip more than 0.05 mJ, 2 k A times its depth, and with shading 2 E ([effects](effects.md)), besides what a spring is given that
  becomes stiffer; and the tip does not swing: it turns back by more than 0.3 mm at most {MOST_TURNS} times in 0.25 s, where tremor does so 6 times;
- the device keeps no more than 2 mJ to be taken back;
- while the last force goes out it only becomes less, and with an open clutch there is none;
- while the core stands still with its command on, all of this but what needs an encoder that is read.

Both forces are the least that explain the currents with any share of the arm's weight held. They are not worked out within
30° of the links in line or 80 mm of the base's axis.

| the largest seen | | bound |
| --- | ---: | ---: |
| force told by the device | {:.4} N | 7.65 N |
| force made by the currents in the pose that the encoders tell | {:.4} N | 7.65 N |
| force at the true tip, encoders off by {OFF_COUNTS} counts at most | {:.3} N | 8.5 N |
| current of a motor | {:.4} A | 5.5 A |
| change of the force in a tick | {:.4} N | 1 N |
| temperature of a winding | {:.1} °C | 112 °C |
| energy that a contact had given with the controller on, in {:.0} s of contacts, {:.1} s of them in the ramp and {:.1} s while the clutch moved | {:.4} mJ | 0.05 mJ and 2 k A d, with shading 2 E |
| turns back of the tip in 0.25 s | {} | {MOST_TURNS} |
| energy that the device keeps to be taken back | {:.3} mJ | 2 mJ |

**What is not bounded.** An encoder that creeps within the joint's limits cannot be told from a hand that moves, and while one is
off by more than {OFF_COUNTS} counts nobody knows the arm's true levers. That was so in {:.1} s of this run; the largest
force at the true tip was then {:.3} N, with an encoder off by {} counts. What bounds it then are the motors' peak
currents.

{}
The last column counts the ticks after the first of the mishap in which the amplifiers were still on, at most, where they
went off. A hanging task is noticed after {STALL_TICKS} ticks at most, before the watchdog resets the board. Near a singular
pose were {:.1} s.
",
        tally.armed / 1_000,
        tally.ticks / 1_000,
        tally.injected(),
        at.force_n,
        at.read_force_n,
        at.tip_force_n,
        at.current_a,
        at.slew_n,
        at.winding_c,
        1e-3 * at.watched_ticks as f64,
        1e-3 * at.ramp_ticks as f64,
        1e-3 * at.clutch_ticks as f64,
        at.given_mj,
        at.turns,
        at.created_mj,
        1e-3 * at.misled_ticks as f64,
        at.misled.force_n,
        at.misled.off_counts,
        tally.table(),
        1e-3 * at.singular_ticks as f64,
    )
}

/// Kinds that a page does not have, or not with a count.
#[must_use]
pub fn missing(page: &str) -> Vec<Kind> {
    rows::missing(page, &Kind::ALL)
}
