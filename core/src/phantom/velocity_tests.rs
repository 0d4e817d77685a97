//! The estimator against motions in f64, rounded to counts.

use super::*;
use crate::cases::cases;

/// Errors over a motion, counts a reading.
#[derive(Clone, Copy, Debug, Default)]
struct Errors {
    worst: f64,
    squares: f64,
    n: u32,
}

impl Errors {
    fn add(&mut self, error: f64) {
        self.worst = self.worst.max(error.abs());
        self.squares += error * error;
        self.n += 1;
    }

    fn rms(&self) -> f64 {
        (self.squares / f64::from(self.n)).sqrt()
    }
}

/// Reads a motion (counts at a tick) for `ticks`; returns the errors of the estimate and of raw
/// differences after the first `WINDOW`.
fn errors(ticks: u32, at: impl Fn(f64) -> f64, speed: impl Fn(f64) -> f64) -> (Errors, Errors) {
    let mut readings = Readings::default();
    readings.restart([at(0.0).round() as i32; 3]);
    let (mut fitted, mut raw) = (Errors::default(), Errors::default());
    for tick in 1..ticks {
        let t = f64::from(tick);
        readings.push([at(t).round() as i32; 3]);
        if tick < WINDOW as u32 {
            continue;
        }
        let velocity = readings.velocity();
        assert_eq!(velocity.x, velocity.z);
        fitted.add(f64::from(velocity.y) - speed(t));
        raw.add(f64::from(readings.moved()[1]) - speed(t));
    }
    (fitted, raw)
}

#[test]
fn constant_velocity_is_estimated_within_the_stated_bound() {
    let mut worst = 0.0f64;
    for i in (0..2000).step_by(cases(1, 200) as usize) {
        let speed = 0.0137 * f64::from(i) - 13.7;
        let offset = 0.37 * f64::from(i);
        let (fitted, raw) = errors(200, |t| offset + speed * t, |_| speed);
        worst = worst.max(fitted.worst);
        assert!(fitted.worst <= raw.worst.max(1e-6), "{speed}");
    }
    std::eprintln!("worst {worst:.4} counts");
    assert!(worst < 0.11, "{worst}");
}

#[test]
fn fitted_velocity_beats_differences_for_sinusoidal_motion() {
    // Read a thousand times a second. A fast change of speed shortens the window and its gain: ±20
    // mm at 2 Hz changes by 0.13 counts from one reading to the next.
    for (amplitude, hz, share) in [(800.0, 2.0, 1.0), (800.0, 0.5, 0.15), (200.0, 0.5, 0.06)] {
        let w = core::f64::consts::TAU * hz * 1e-3;
        let (fitted, raw) = errors(
            4000,
            |t| amplitude * (w * t).sin(),
            |t| amplitude * w * (w * t).cos(),
        );
        let (rms, raw_rms) = (fitted.rms(), raw.rms());
        std::eprintln!("{hz} Hz: rms {rms:.3} counts of {raw_rms:.3} by differences");
        assert!(rms < share * raw_rms, "{hz} Hz: {rms} {raw_rms}");
    }
}

#[test]
fn sudden_stop_is_detected_within_two_readings() {
    let mut readings = Readings::default();
    readings.restart([0; 3]);
    let mut counts = 0;
    for tick in 0..100 {
        counts += if tick < 50 { 20 } else { 0 };
        readings.push([counts; 3]);
        if tick == 49 {
            assert!((readings.velocity().x - 20.0).abs() < 0.01);
        }
        if tick == 51 {
            assert!(
                readings.velocity().x.abs() <= 1.0,
                "{}",
                readings.velocity()
            );
        }
    }
    assert_eq!(readings.velocity().x, 0.0);
}

#[test]
fn restart_clears_velocity_and_wrapping_counts_are_handled() {
    let mut readings = Readings::default();
    for i in 0..40 {
        readings.push([i * 10; 3]);
    }
    readings.restart([-5000; 3]);
    assert_eq!(readings.velocity(), Vec3::ZERO);
    assert_eq!(readings.moved(), [0; 3]);
    let mut count = i32::MAX - 20;
    readings.restart([count; 3]);
    for _ in 0..20 {
        count = count.wrapping_add(3);
        readings.push([count; 3]);
    }
    assert!((readings.velocity().x - 3.0).abs() < 1e-5);
}
