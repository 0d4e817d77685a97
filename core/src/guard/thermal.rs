//! How warm the motors are, and what current they may still be given.
//!
//! A winding heats in seconds, the housing around it in minutes, so two nodes
//! a motor. The winding's resistance is taken hot, which errs on the warm side.
//!
//! Both change little in a tick, so little at 10 kHz that single precision
//! would lose it. The heat of each tick is added up and the temperatures follow
//! every 10 ms.

use glam::Vec3;

use crate::phantom::{Calibration, Thermal};
use crate::rate::TickRate;

/// Air, °C.
const AIR_C: f32 = 25.0;
/// Between two steps of the temperatures, ms.
const STEP_MS: u32 = 10;

/// From this winding temperature on the current is reduced, °C.
pub const DERATE_C: f32 = 80.0;
/// Here no more than the continuous current is left, °C.
pub const CONTINUOUS_C: f32 = 100.0;
/// Here the guard trips, °C. Derating alone never comes this far.
pub const TRIP_C: f32 = 110.0;

/// Temperatures of the three motors above the air's, and what follows.
#[derive(Clone, Copy, Debug)]
pub struct Motors {
    /// Ticks between two steps of the temperatures.
    step_ticks: u32,
    thermal: Thermal,
    /// What each axis may be given while it is cool, A.
    pub(super) peak_a: Vec3,
    /// What each axis may be given for ever, A.
    pub(super) continuous_a: Vec3,
    winding_k: Vec3,
    housing_k: Vec3,
    /// Σ I² since the last step, A², and of how many ticks.
    squares: Vec3,
    ticks: u32,
    /// The most that each axis may be given now, A.
    pub(super) allowed_a: Vec3,
    /// Whether a winding is too hot to go on.
    pub(super) too_hot: bool,
}

impl Motors {
    /// Motors as cold as the air, that may have no current yet.
    #[must_use]
    pub fn new(rate: TickRate) -> Self {
        Self {
            step_ticks: rate.ticks(STEP_MS),
            thermal: Calibration::PREMIUM_1_5.thermal,
            peak_a: Vec3::ZERO,
            continuous_a: Vec3::ZERO,
            winding_k: Vec3::ZERO,
            housing_k: Vec3::ZERO,
            squares: Vec3::ZERO,
            ticks: 0,
            allowed_a: Vec3::ZERO,
            too_hot: false,
        }
    }

    /// Takes ratings and time constants. How warm they are is not forgotten.
    pub fn configure(&mut self, calibration: &Calibration) {
        self.thermal = calibration.thermal;
        self.peak_a = calibration.peak_current_a;
        self.continuous_a = calibration.continuous_current_a;
        self.update_limits();
    }

    /// Estimated winding temperatures, °C.
    #[must_use]
    pub fn winding_c(&self) -> Vec3 {
        self.winding_k + self.housing_k + AIR_C
    }

    /// Lets `currents_a` flow for a tick.
    pub fn heat(&mut self, currents_a: Vec3) {
        self.squares += currents_a * currents_a;
        self.ticks += 1;
        if self.ticks >= self.step_ticks {
            self.advance();
        }
    }

    fn advance(&mut self) {
        let thermal = &self.thermal;
        let mean = self.squares / self.ticks as f32;
        let toward = |from: Vec3, k_per_w: f32, time_s: f32| {
            let step_s = STEP_MS as f32 * 1e-3;
            // K above the other node for A² flowing for ever, and part of the way.
            let end = mean * (thermal.resistance_ohm * k_per_w);
            from + (end - from) * (step_s / time_s)
        };
        self.winding_k = toward(self.winding_k, thermal.winding_k_per_w, thermal.winding_s);
        self.housing_k = toward(self.housing_k, thermal.housing_k_per_w, thermal.housing_s);
        self.squares = Vec3::ZERO;
        self.ticks = 0;
        self.update_limits();
    }

    fn update_limits(&mut self) {
        let winding_c = self.winding_c();
        let warm = (winding_c - DERATE_C) / (CONTINUOUS_C - DERATE_C);
        let less = self.peak_a - self.continuous_a;
        self.allowed_a = self.peak_a - warm.clamp(Vec3::ZERO, Vec3::ONE) * less;
        // Written so that what is not a number is too hot.
        self.too_hot = !winding_c.cmple(Vec3::splat(TRIP_C)).all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Asks for a current for some time, given what is allowed.
    fn after(rate: TickRate, seconds: u32, wanted_a: f32) -> (Motors, Vec3) {
        let mut motors = Motors::new(rate);
        motors.configure(&Calibration::PREMIUM_1_5);
        let mut given = Vec3::ZERO;
        for _ in 0..seconds * rate.hz() {
            given = Vec3::splat(wanted_a).min(motors.allowed_a);
            motors.heat(given);
        }
        (motors, given)
    }

    fn khz(khz: u32) -> TickRate {
        TickRate::new(khz * 1000).expect("in range")
    }

    #[test]
    fn without_a_calibration_there_is_no_current() {
        assert_eq!(Motors::new(TickRate::DEFAULT).allowed_a, Vec3::ZERO);
    }

    #[test]
    fn a_cool_motor_may_have_its_peak() {
        let (motors, given) = after(khz(1), 1, 5.5);
        assert_eq!(given.x, 5.5);
        assert!(motors.winding_c().x < DERATE_C);
    }

    #[test]
    fn asked_for_the_peak_for_ever_it_derates_and_never_trips() {
        let (motors, given) = after(khz(1), 3000, 5.5);
        assert!(!motors.too_hot, "{:?}", motors.winding_c());
        assert!(given.x < 1.4 && given.x >= 1.24, "{given}");
    }

    #[test]
    fn the_continuous_current_is_borne_for_ever() {
        let (motors, given) = after(khz(1), 4000, 1.24);
        assert_eq!(given.x, 1.24);
        assert!(motors.winding_c().x < CONTINUOUS_C);
        // 1.24² A² · 2.82 Ω · 17.1 K/W above the air.
        assert!(
            (motors.winding_c().x - 99.0).abs() < 0.5,
            "{:?}",
            motors.winding_c()
        );
    }

    #[test]
    fn as_warm_at_ten_kilohertz_as_at_one() {
        let (slow, _) = after(khz(1), 200, 1.3);
        let (fast, _) = after(khz(10), 200, 1.3);
        let difference = (slow.winding_c() - fast.winding_c()).abs().max_element();
        assert!(difference < 0.01, "{difference} K");
    }
}
