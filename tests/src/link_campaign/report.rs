//! The report of a campaign of link faults: `docs/link-campaign.md`.

use super::fault::Kind;
use super::surface::OFF_SURFACE;
use super::tally::Tally;
use crate::rows;

/// The page of a campaign that ran with the source at `commit`.
#[must_use]
pub fn page(commit: Option<&str>, seed: u64, seconds: u64, tally: &Tally) -> String {
    let at = &tally.extremes;
    let commit = commit.map_or(String::new(), |commit| format!(" at commit {commit}"));
    let [ticks, armed] = tally.ticks.map(|ticks| ticks / 1_000);
    format!(
        "# The campaign of link faults

Written by `cargo xtask campaign --link --seconds {seconds} --seed {seed}`{commit}; the same source repeats it to the last figure.

The host's own client and the application of the boards compiled for the desktop, with a virtual Phantom Premium 1.5 in a
wandering hand, talk over a line to which everything happens (`tests/src/link_campaign`). Time is the device's: {ticks} s of it
passed, {armed} s with the amplifiers on. A run is one host from its hello to its end: {} runs, {} of which ended as host
and device agreed. In each run one thing goes wrong, and it begins while the session opens, while the arm is armed, while
terrain is felt, or while the host leaves. In one segment of four the device's clock stands still while it waits for a tile.

Held in every tick:

- everything that the [closed-loop campaign](campaign.md) holds a device to: currents, force, its change in a tick, no force while
  disarmed;
- the proxy in contact lies on the bilinear surface of the terrain that the host serves, by an oracle in f64
  (`tests/src/link_campaign/surface.rs`);
- amplifiers go on only where a host that lives has asked for it;
- on a line that works the user sees whether the amplifiers are on.

Held at the end of each step of a run (`tests/src/link_campaign/play.rs`):

- opening, arming and leaving end within their times, with what they are for or with an error that the user is told;
- where host and device agree on the end the amplifiers are off;
- where one host talked to one device, received, lost and dropped samples are together the samples that the device made,
  by the numbers of their ticks;
- a device does not ask for a tile again before its time-out, but for those that were under way at a hello;
- a device whose host vanished lets the force out and disarms in the time that the host had told it.

| the largest seen | | bound |
| --- | ---: | ---: |
| force told by the device | {:.4} N | 7.65 N |
| change of the force in a tick | {:.4} N | 1 N |
| current of a motor | {:.4} A | 5.5 A |
| distance of a proxy in contact from the surface, of {} samples | {:.2e} cells | {OFF_SURFACE:.2e} cells |

{}",
        tally.runs(),
        tally.agreed(),
        at.force_n,
        at.slew_n,
        at.current_a,
        tally.touching,
        tally.off_surface,
        tally.table(),
    )
}

/// Kinds of faults that a page does not have, or not with a count.
#[must_use]
pub fn missing(page: &str) -> Vec<Kind> {
    rows::missing(page, &Kind::ALL)
}
