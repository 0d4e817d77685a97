//! Runs along a path: the first contact, a motion, and the fastest speed without a missing tick.

use hapterra_core::contact::ContactState;

use super::NotMeasured;
use super::chain::Chain;
use super::hand::Hand;
use super::hip_path::HipPath;
use super::tick_counts::{TickCounts, lacks_terrain};

/// Ticks after which a wait fails: more than a server's 10 s time-out.
const MAX: u64 = 30_000;
/// Ticks of rest before the motion, so that all tiles within the margin arrive.
const REST: u32 = 400;
/// Ticks in which the hand accelerates evenly to its speed.
const START: f64 = 100.0;
/// Ticks after the motion in which its last samples arrive.
const AFTER: u32 = 300;
/// Slowest and fastest speed of the trials, cells a second. At the fastest the tip moves at 1 m/s,
/// beyond which the guard reduces the force.
pub(super) const SPEEDS: [f64; 2] = [100.0, 20_000.0];

/// Taps on the start of a path until there is a contact.
///
/// # Errors
/// If there is none, or the session ends.
pub(super) fn touch(chain: &mut Chain<'_>, hand: &Hand, way: &HipPath) -> Result<(), NotMeasured> {
    let (above, below) = (hand.above(way.at(0.0))?, hand.below(way.at(0.0))?);
    let mut is_touching = false;
    while !is_touching {
        // A contact begins where the HIP comes down onto ground in the window.
        let sense = if chain.now().is_multiple_of(2) {
            above
        } else {
            below
        };
        chain.tick(sense, &mut |sample| {
            is_touching |= sample.state == ContactState::Touching;
        })?;
        if chain.now() > MAX {
            let why = format!("no contact for {MAX} ticks");
            return Err(NotMeasured(why));
        }
    }
    Ok(())
}

/// Moves along a path at this many cells a second, after a touch and a rest, with a tenth of a
/// second to reach the speed. With `to_no_data`, the motion ends at the first tick without its
/// terrain. Returns the counts and the ticks in which the motion began and ended.
///
/// # Errors
/// If the session ends, or samples are lost.
pub(super) fn travel(
    chain: &mut Chain<'_>,
    hand: &Hand,
    way: &HipPath,
    speed: f64,
    to_no_data: bool,
) -> Result<(TickCounts, [u64; 2]), NotMeasured> {
    let start = hand.below(way.at(0.0))?;
    let mut at_rest = None;
    for _ in 0..REST {
        chain.tick(start, &mut |sample| at_rest = Some(sample.hip))?;
    }
    let ticks = duration(way.cells(), 1e-3 * speed).ceil() as u32;
    let (mut counts, mut moves) = (TickCounts::default(), false);
    let began = chain.now();
    let mut ended = began + u64::from(ticks);
    for tick in 1..=ticks + AFTER {
        let sense = hand.below(way.at(covered(tick.into(), 1e-3 * speed)))?;
        let mut is_no_data = false;
        chain.tick(sense, &mut |sample| {
            moves |= Some(sample.hip) != at_rest;
            if moves && counts.ticks < ticks {
                counts.add(sample);
                is_no_data |= lacks_terrain(sample);
            }
        })?;
        if counts.ticks == ticks || to_no_data && is_no_data {
            ended = ended.min(chain.now());
            break;
        }
    }
    let stats = chain.stats();
    if stats.lost + stats.dropped > 0 {
        let lost = stats.lost + stats.dropped;
        let why = format!("{lost} samples were lost, so gaps cannot be counted");
        return Err(NotMeasured(why));
    }
    Ok((counts, [began, ended]))
}

/// Returns the cells covered this many ticks after the start, at a speed in cells a tick.
fn covered(ticks: f64, speed: f64) -> f64 {
    match ticks < START {
        true => 0.5 * speed * ticks * ticks / START,
        false => speed * (ticks - 0.5 * START),
    }
}

/// Returns the ticks that the hand needs for this many cells: the inverse of [`covered`].
fn duration(cells: f64, speed: f64) -> f64 {
    let start = covered(START, speed);
    match cells < start {
        true => (2.0 * cells * START / speed).sqrt(),
        false => START + (cells - start) / speed,
    }
}

/// Returns the fastest speed that `holds`, by `steps` bisections between the slowest and the
/// fastest, in ratios; zero if the slowest does not hold.
///
/// Bisection finds one border between speeds that hold and speeds that do not; a faster one that
/// holds by chance may be missed.
///
/// # Errors
/// The errors of `holds`.
pub(super) fn fastest<E>(
    steps: u32,
    mut holds: impl FnMut(f64) -> Result<bool, E>,
) -> Result<f64, E> {
    let [mut low, mut high] = SPEEDS;
    if holds(high)? {
        return Ok(high);
    }
    if !holds(low)? {
        return Ok(0.0);
    }
    for _ in 0..steps {
        let middle = (low * high).sqrt();
        match holds(middle)? {
            true => low = middle,
            false => high = middle,
        }
    }
    Ok(low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hand_ramps_up_to_speed_and_arrives_in_the_duration() {
        for speed in [0.1, 2.0, 20.0] {
            for cells in [1.0, 90.0, 2800.0] {
                let ticks = duration(cells, speed);
                assert!((covered(ticks, speed) - cells).abs() < 1e-9 * cells.max(1.0));
            }
            let at = |ticks| covered(ticks, speed);
            for ticks in [START, START + 1.0, START + 500.0] {
                let step = at(ticks) - at(ticks - 1.0);
                assert!((step / speed - 1.0).abs() < 0.01, "{ticks}: {step}");
            }
            assert!((at(1.0) - at(0.0)) < 0.01 * speed);
        }
    }

    #[test]
    fn halving_finds_the_border_from_below() {
        let found = |border: f64| {
            let mut tried = 0;
            let speed = fastest(8, |speed| {
                tried += 1;
                Ok::<_, ()>(speed <= border)
            });
            assert!(tried <= 10);
            speed.expect("no error")
        };
        for border in [120.0, 2_000.0, 19_000.0] {
            let speed = found(border);
            assert!(speed <= border && border / speed < 1.0211, "{speed}");
        }
        assert_eq!((found(99.0), found(20_000.0)), (0.0, 20_000.0));
    }
}
