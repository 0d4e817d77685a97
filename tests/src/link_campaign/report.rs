//! The report of a campaign of link faults: `link-campaign.md` of a month in `log/`.

use super::fault::Kind;
use super::proxy_oracle::OFF_SURFACE;
use super::run_outcomes::LinkStats;
use crate::campaign_table;

/// Returns the page of a campaign that ran with the source at `commit`.
#[must_use]
pub fn page(commit: Option<&str>, seed: u64, seconds: u64, stats: &LinkStats) -> String {
    let at = &stats.extremes;
    let commit = commit.map_or(String::new(), |commit| format!(" at commit {commit}"));
    let [ticks, armed] = stats.ticks.map(|ticks| ticks / 1_000);
    format!(
        "# The campaign of link faults

This page reports a randomised test of the link between host and device. It shows which faults were injected, and
whether host and device agreed on the end of each session.

Written by `cargo xtask campaign --link --seconds {seconds} --seed {seed}`{commit}.
The same source repeats every figure.

The host's own client and the application of the boards, compiled for the desktop, exchange frames over a faulty line
(`tests/src/link_campaign`). A wandering hand holds a virtual Phantom Premium 1.5. Time is the device's: {ticks} s passed,
{armed} s with the amplifiers on. A run is one host from opening to closing: {} runs, {} of which ended with host and
device in agreement. Each run has one fault. It begins while the session opens, while the arm is armed, during a
contact, or while the host closes. In one segment of four the device's clock stops while it waits for a tile.

## Checks in every tick

- The checks of the closed-loop campaign on currents, force and its change in a tick hold.
- The proxy in contact lies on the bilinear surface of the terrain that the host serves, by an oracle in f64.
- The amplifiers are switched on only if a live host has requested it.
- On a working line, the user sees whether the amplifiers are on.

## Checks at the end of each step of a run

- Opening, arming and closing end within their time-outs, with their result or with an error that the user sees.
- If host and device agree on the end, the amplifiers are off.
- If one host used one device, its received, lost and dropped samples are together the samples that the device made.
- The device does not request a tile again before its time-out, except for requests that were in flight at an opening.
- A device whose host vanished ramps the force down and disarms within the time that the host had set.

## Maxima

| quantity | maximum | bound |
| --- | ---: | ---: |
| force, as the device reports it | {:.4} N | 7.65 N |
| change of the force in a tick | {:.4} N | 1 N |
| current of a motor | {:.4} A | 5.5 A |
| distance of a proxy in contact from the surface, of {} samples | {:.2e} cells | {OFF_SURFACE:.2e} cells |

## Faults

{}",
        stats.runs(),
        stats.agreed(),
        at.force_n,
        at.slew_n,
        at.current_a,
        stats.touching,
        stats.off_surface,
        stats.table(),
    )
}

/// Returns the kinds of faults that a page lacks, or lists without a count.
#[must_use]
pub fn missing(page: &str) -> Vec<Kind> {
    campaign_table::missing(page, &Kind::ALL)
}
