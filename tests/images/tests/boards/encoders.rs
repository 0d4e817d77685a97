//! The encoders' inputs, as the boards' own images set them up: the fastest motion without a fault
//! is counted, and a disturbance shorter than the filter is not.

use hapterra_image_tests::device::machines;
use hapterra_image_tests::machine::{Machine, Stop};

/// Counts a second beyond which the guard reports a fault.
const MAX_SPEED: f64 = 128_000.0;
/// Longest disturbance that is never counted, ns, on the board with the shorter filter.
const DISTURBANCE_NS: f64 = 1_800.0;

/// Returns the channels of an encoder that turns at `speed` counts a second, forwards or back.
/// `skew` shifts channel B by this many counts: a real disc's channels are not exactly a quarter of
/// a line apart.
fn turning(speed: f64, skew: f64) -> impl Fn(f64) -> [bool; 2] {
    move |ns| {
        let at = ns * 1e-9 * speed;
        let half = |at: f64| at.rem_euclid(4.0) < 2.0;
        [half(at + 3.0), half(at + 2.0 + skew)]
    }
}

/// The machines, set up and ticking.
fn on_each(mut then: impl FnMut(Machine)) {
    for mut machine in machines() {
        assert_eq!(machine.run_ms(10), Stop::Time, "{}", machine.chip.board);
        then(machine);
    }
}

/// Safety: 8, images.
#[test]
fn five_times_the_fastest_motion_is_counted() {
    on_each(|machine| {
        let board = machine.chip.board;
        for axis in 0..3 {
            for (speed, skew) in [
                (MAX_SPEED, 0.0),
                (-MAX_SPEED, 0.0),
                (MAX_SPEED, 0.5),
                (-MAX_SPEED, -0.5),
                (5.0 * MAX_SPEED, 0.0),
            ] {
                let counted = machine.bus().play_encoder(axis, 10, turning(speed, skew));
                let expected = speed * 0.01;
                // The last edges are still in the filter.
                let off = (f64::from(counted) - expected).abs();
                assert!(
                    off <= 4.0,
                    "{board} {axis}: {counted} of {expected} at {speed}"
                );
            }
        }
    });
}

/// Safety: 8, images.
#[test]
fn disturbance_shorter_than_the_filter_is_not_counted() {
    on_each(|machine| {
        let board = machine.chip.board;
        for axis in 0..3 {
            for speed in [1_000.0, -10_000.0, MAX_SPEED] {
                let clean = turning(speed, 0.0);
                // On channel A around every edge of channel B, the worst case: there a pulse is
                // four counts of drift.
                let disturbed = |ns: f64| {
                    let [a, b] = clean(ns);
                    let later = clean(ns + DISTURBANCE_NS / 2.0)[1];
                    let earlier = clean(ns - DISTURBANCE_NS / 2.0)[1];
                    [a ^ (later != earlier), b]
                };
                let counted = machine.bus().play_encoder(axis, 20, disturbed);
                let expected = speed * 0.02;
                let off = (f64::from(counted) - expected).abs();
                assert!(
                    off <= 4.0,
                    "{board} {axis}: {counted} of {expected} at {speed}"
                );
            }
        }
    });
}
