//! Runs along a path: the first contact, a motion, and the fastest speed without a missing tick.

use hapterra_core::contact::ContactState;

use super::MeasureError;
use super::chain::Chain;
use super::hand::Hand;
use super::hip_path::HipPath;
use super::tick_counts::{TickCounts, lacks_terrain};

/// Ticks after which a wait fails: more than a server's 10 s time-out.
const MAX_WAIT_TICKS: u64 = 30_000;
/// Ticks of rest before the motion, so that all tiles within the margin arrive.
const REST_TICKS: u32 = 400;
/// Ticks in which the hand accelerates evenly to its speed.
const ACCELERATION_TICKS: f64 = 100.0;
/// Ticks after the motion in which its last samples arrive.
const DRAIN_TICKS: u32 = 300;
/// Slowest and fastest speed of the trials, cells a second. At the fastest the tip moves at 1 m/s,
/// beyond which the guard reduces the force.
pub(super) const SPEEDS: [f64; 2] = [100.0, 20_000.0];

/// Taps on the start of a path until there is a contact.
///
/// # Errors
/// If there is none, or the session ends.
pub(super) fn touch(
    chain: &mut Chain<'_>,
    hand: &Hand,
    path: &HipPath,
) -> Result<(), MeasureError> {
    let (above, below) = (hand.above(path.at(0.0))?, hand.below(path.at(0.0))?);
    let mut is_touching = false;
    while !is_touching {
        // A contact begins where the HIP comes down onto ground in the window.
        let inputs = if chain.now().is_multiple_of(2) {
            above
        } else {
            below
        };
        chain.tick(inputs, &mut |sample| {
            is_touching |= sample.state == ContactState::Touching;
        })?;
        if chain.now() > MAX_WAIT_TICKS {
            let why = format!("no contact for {MAX_WAIT_TICKS} ticks");
            return Err(MeasureError(why));
        }
    }
    Ok(())
}

/// Moves along a path at this many cells a second, after a touch and a rest, with a tenth of a
/// second to reach the speed. With `stop_at_no_data`, the motion ends at the first tick without its
/// terrain. Returns the counts and the ticks in which the motion began and ended.
///
/// # Errors
/// If the session ends, or samples are lost.
pub(super) fn travel(
    chain: &mut Chain<'_>,
    hand: &Hand,
    path: &HipPath,
    speed: f64,
    stop_at_no_data: bool,
) -> Result<(TickCounts, [u64; 2]), MeasureError> {
    let start = hand.below(path.at(0.0))?;
    let mut at_rest = None;
    for _ in 0..REST_TICKS {
        chain.tick(start, &mut |sample| at_rest = Some(sample.hip))?;
    }
    let ticks = duration(path.cells(), 1e-3 * speed).ceil() as u32;
    let (mut counts, mut is_moving) = (TickCounts::default(), false);
    let started = chain.now();
    let mut ended = started + u64::from(ticks);
    for tick in 1..=ticks + DRAIN_TICKS {
        let inputs = hand.below(path.at(distance(tick.into(), 1e-3 * speed)))?;
        let mut is_no_data = false;
        chain.tick(inputs, &mut |sample| {
            is_moving |= Some(sample.hip) != at_rest;
            if is_moving && counts.ticks < ticks {
                counts.add(sample);
                is_no_data |= lacks_terrain(sample);
            }
        })?;
        if counts.ticks == ticks || stop_at_no_data && is_no_data {
            ended = ended.min(chain.now());
            break;
        }
    }
    let stats = chain.stats();
    if stats.lost + stats.dropped > 0 {
        let lost = stats.lost + stats.dropped;
        let why = format!("{lost} samples were lost, so gaps cannot be counted");
        return Err(MeasureError(why));
    }
    Ok((counts, [started, ended]))
}

/// Returns the cells covered this many ticks after the start, at a speed in cells a tick.
fn distance(ticks: f64, speed: f64) -> f64 {
    match ticks < ACCELERATION_TICKS {
        true => 0.5 * speed * ticks * ticks / ACCELERATION_TICKS,
        false => speed * (ticks - 0.5 * ACCELERATION_TICKS),
    }
}

/// Returns the ticks that the hand needs for this many cells: the inverse of [`distance`].
fn duration(cells: f64, speed: f64) -> f64 {
    let start = distance(ACCELERATION_TICKS, speed);
    match cells < start {
        true => (2.0 * cells * ACCELERATION_TICKS / speed).sqrt(),
        false => ACCELERATION_TICKS + (cells - start) / speed,
    }
}

/// Returns the fastest speed that `is_complete`, by `steps` bisections between the slowest and the
/// fastest, in ratios; zero if the slowest does not hold.
///
/// Bisection finds one border between speeds that hold and speeds that do not; a faster one that
/// holds by chance may be missed.
///
/// # Errors
/// The errors of `is_complete`.
pub(super) fn fastest<E>(
    steps: u32,
    mut is_complete: impl FnMut(f64) -> Result<bool, E>,
) -> Result<f64, E> {
    let [mut low, mut high] = SPEEDS;
    if is_complete(high)? {
        return Ok(high);
    }
    if !is_complete(low)? {
        return Ok(0.0);
    }
    for _ in 0..steps {
        let middle = (low * high).sqrt();
        match is_complete(middle)? {
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
                assert!((distance(ticks, speed) - cells).abs() < 1e-9 * cells.max(1.0));
            }
            let at = |ticks| distance(ticks, speed);
            for ticks in [
                ACCELERATION_TICKS,
                ACCELERATION_TICKS + 1.0,
                ACCELERATION_TICKS + 500.0,
            ] {
                let step = at(ticks) - at(ticks - 1.0);
                assert!((step / speed - 1.0).abs() < 0.01, "{ticks}: {step}");
            }
            assert!((at(1.0) - at(0.0)) < 0.01 * speed);
        }
    }

    #[test]
    fn bisection_finds_the_limit_from_below() {
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
