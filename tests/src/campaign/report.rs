//! The report of a campaign: `campaign.md` of a month in `log/`.

use super::LinkStats;
use super::fault_kind::{Kind, STALL_TICKS};
use super::limit_cycle::MAX_TURNS;
use super::maxima::OFF_COUNTS;
use crate::campaign_table;

/// Returns the page of a campaign that ran with the source at `commit`.
#[must_use]
pub fn page(commit: Option<&str>, seed: u64, seconds: u64, stats: &LinkStats) -> String {
    let at = &stats.extremes;
    let commit = commit.map_or(String::new(), |commit| format!(" at commit {commit}"));
    format!(
        "# The closed-loop campaign

This page reports a randomised test of the whole device with injected faults. A safety engineer reads here which
faults were tried, and the largest force, current and temperature that followed.

Written by `cargo xtask campaign --seconds {seconds} --seed {seed}`{commit}.
The same source repeats every figure.

The test runs the application of the boards, compiled for the desktop, with a virtual Phantom Premium 1.5. A virtual
hand holds the arm and wanders. Each segment runs twice: on a frictionless surface, and with random effects
(friction, shading, texture, damping, the passivity controller on or off, up to 2.6 N/mm). Every second segment with
effects has up to 16 materials, of up to 1.7 times that stiffness. The amplifiers were on for {} s of {} s.
{} faults were injected, each kind equally often, in random order, place and strength.

## Checks in every tick

- No current with the amplifiers off, none above the motor's peak, none that is not a number.
- The amplifiers are never on with the dead-man switch open, the emergency stop pressed or failed hardware.
- The reported force is zero while disarmed or faulted. Else it is within the guard's clamp (90 % of the record's
  8.5 N) and changes by at most 1 N a tick.
- The force of the currents in the pose *that the encoders read* is within the same clamp.
- The force of the currents at the true tip is within 8.5 N while no encoder is off by more than {OFF_COUNTS} counts.
  Two jumps may add that much before they are found.
- No winding is above 112 °C, or more than 1 K warmer than the device estimates, after any reset.
- No calibration is in force above the absolute limits of a Premium 1.5. None is stored without consent.
- While force is on, it does not pull the HIP away from the proxy, except where both shading and texture turn it.
  It is at most the force of the stiffest material, the highest texture and all of the damping at this depth.
- With the controller on and no fault yet, a contact on one stiffness adds at most 0.05 mJ to the tip, 2 k A times its
  depth, and with shading 2 E ([effects](../../docs/explanation/effects.md)). Energy of a stiffening spring is not counted.
- With the controller on and no fault yet, the tip turns back by more than 0.3 mm at most {MAX_TURNS} times in 0.25 s.
  Tremor does so 6 times.
- The device stores at most 2 mJ of energy to dissipate.
- While the last force ramps down it only decreases. With an open clutch there is none.
- While the core is halted with a command set, all checks apply that need no encoder.

The pose and the levers are computed in f64. Both forces are the least that explain the currents, with any share of the
arm's weight. They are not computed within 30° of the links in line or 80 mm of the base's axis.

## Maxima

The energy was observed in {:.0} s of contact: {:.1} s of them in the ramp, {:.1} s while the clutch moved.

| quantity | maximum | bound |
| --- | ---: | ---: |
| force, as the device reports it | {:.4} N | 7.65 N |
| force of the currents in the pose that the encoders read | {:.4} N | 7.65 N |
| force at the true tip, encoders off by {OFF_COUNTS} counts at most | {:.3} N | 8.5 N |
| current of a motor | {:.4} A | 5.5 A |
| change of the force in a tick | {:.4} N | 1 N |
| temperature of a winding | {:.1} °C | 112 °C |
| energy added by a contact, controller on | {:.4} mJ | 0.05 mJ and 2 k A d, with shading 2 E |
| turns of the tip in 0.25 s | {} | {MAX_TURNS} |
| stored energy to dissipate | {:.3} mJ | 2 mJ |

**Not bounded.** The device cannot distinguish an encoder that creeps within the joint's limits from a moving hand.
While an encoder is off by more than {OFF_COUNTS} counts, the true levers are unknown. This lasted {:.1} s of the run. The
largest force at the true tip was then {:.3} N, with an encoder off by {} counts. Only the motors' peak currents
bound it.

## Faults

The kinds and their expected results are in `tests/src/campaign/fault_kind.rs`. Any other result ends the campaign. The last
column is the maximum number of ticks from the first tick of the fault until the amplifiers are off. A hanging task is
detected within {STALL_TICKS} ticks, before the watchdog resets the board. The arm was near a singular pose for {:.1} s.

{}",
        stats.armed / 1_000,
        stats.ticks / 1_000,
        stats.injected(),
        1e-3 * at.watched_ticks as f64,
        1e-3 * at.ramp_ticks as f64,
        1e-3 * at.clutch_ticks as f64,
        at.force_n,
        at.read_force_n,
        at.tip_force_n,
        at.current_a,
        at.slew_n,
        at.winding_c,
        at.gained_mj,
        at.turns,
        at.created_mj,
        1e-3 * at.misled_ticks as f64,
        at.misled.force_n,
        at.misled.off_counts,
        1e-3 * at.singular_ticks as f64,
        stats.table(),
    )
}

/// Returns the kinds that a page lacks, or lists without a count.
#[must_use]
pub fn missing(page: &str) -> Vec<Kind> {
    campaign_table::missing(page, &Kind::ALL)
}
