//! Temperatures of the motors, and the currents that they permit.
//!
//! A winding heats in seconds, the housing around it in minutes, so each motor has two nodes. The
//! winding's resistance is the hot one, which errs on the warm side.
//!
//! Both change so little in a tick at 10 kHz that single precision would lose it. So the heat of
//! the ticks is summed, and the temperatures are updated every 10 ms.
//!
//! A reset does not cool a motor. The model starts with the [`Temperatures`] that the board kept
//! over the reset, or with [`Temperatures::HOT`] without them.

use glam::Vec3;

use crate::phantom::{Calibration, Thermal};
use crate::rate::TickRate;

/// Temperature of the air, °C.
const AIR_C: f32 = 25.0;
/// Time between two updates of the temperatures, ms.
const STEP_MS: u32 = 10;

/// Winding temperature from which the current is reduced, °C.
pub const DERATE_C: f32 = 80.0;
/// Winding temperature at which only the continuous current is left, °C.
pub const CONTINUOUS_C: f32 = 100.0;
/// Winding temperature at which the guard trips, °C. With derating alone it is not reached.
pub const TRIP_C: f32 = 110.0;
/// Maximum excess of a winding over the temperatures kept before a reset, K: 0.2 s of an RE25's
/// peak current, 22 K a second. Temperatures are kept every 0.1 s, and a watchdog resets within
/// 0.06 s.
pub const RESET_MARGIN_K: f32 = 5.0;
/// Upper limit of a node above the one beside it, K, more than any can reach. The model stops there
/// with the amplifiers off: monitors without supply may report false currents for hours.
const MAX_K: Vec3 = Vec3::splat(200.0);

/// Excess of the two nodes of each motor over the air, K: the whole state of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Temperatures {
    /// Winding above housing, axes 1 to 3.
    pub winding_k: Vec3,
    /// Housing above air, axes 1 to 3.
    pub housing_k: Vec3,
}

impl Temperatures {
    /// Motors as cold as the air.
    pub const AIR: Self = Self {
        winding_k: Vec3::ZERO,
        housing_k: Vec3::ZERO,
    };

    /// Motors after hours of maximum work under derating: the winding at [`CONTINUOUS_C`], divided
    /// between the nodes by an RE25's 3.1 and 14 K/W. Derating keeps every motor at or below this
    /// (`derated_motor_never_exceeds_the_hot_start_temperatures`), so a reset cannot hide more.
    ///
    /// From here a motor has its continuous current at once, and its peak current after 70 s
    /// without load (`hot_motor_has_continuous_current_at_once_and_peak_later`).
    pub const HOT: Self = Self {
        winding_k: Vec3::splat((CONTINUOUS_C - AIR_C) * 3.1 / 17.1),
        housing_k: Vec3::splat((CONTINUOUS_C - AIR_C) * 14.0 / 17.1),
    };

    /// Returns the temperatures of the windings, °C.
    #[must_use]
    pub fn winding_c(&self) -> Vec3 {
        self.winding_k + self.housing_k + AIR_C
    }

    /// Returns the initial temperatures from those kept over a reset.
    ///
    /// The kept ones are up to [`RESET_MARGIN_K`] too low, because the motors had current after
    /// they were kept. Returns `None` if a number is outside of the model's range: the memory may
    /// be corrupt.
    #[must_use]
    pub fn after_reset(self) -> Option<Self> {
        let possible = |k: Vec3| k.cmpge(Vec3::ZERO).all() && k.cmple(MAX_K).all();
        let is_possible = possible(self.winding_k) && possible(self.housing_k);
        // Not above the end of derating: repeated resets alone must not trip the guard.
        let headroom = Vec3::splat(CONTINUOUS_C - AIR_C) - self.winding_k - self.housing_k;
        let margin = headroom.clamp(Vec3::ZERO, Vec3::splat(RESET_MARGIN_K));
        is_possible.then_some(Self {
            winding_k: self.winding_k + margin,
            ..self
        })
    }
}

/// Temperatures of the three motors above the air, and the permitted currents.
#[derive(Clone, Copy, Debug)]
pub struct Motors {
    /// Ticks between two updates of the temperatures.
    step_ticks: u32,
    thermal: Thermal,
    /// Maximum current of each axis while it is cool, A.
    pub(super) peak_a: Vec3,
    /// Continuous current of each axis, A.
    pub(super) continuous_a: Vec3,
    at: Temperatures,
    /// Σ I² since the last update, A², and its number of ticks.
    squares: Vec3,
    ticks: u32,
    /// The present current limit of each axis, A.
    pub(super) allowed_a: Vec3,
    /// True if a winding is too hot to continue.
    pub(super) too_hot: bool,
}

impl Motors {
    /// Creates motors as cold as the air, without a permitted current until configured.
    #[must_use]
    pub fn new(rate: TickRate) -> Self {
        Self {
            step_ticks: rate.ticks(STEP_MS),
            thermal: Calibration::PREMIUM_1_5.thermal,
            peak_a: Vec3::ZERO,
            continuous_a: Vec3::ZERO,
            at: Temperatures::AIR,
            squares: Vec3::ZERO,
            ticks: 0,
            allowed_a: Vec3::ZERO,
            too_hot: false,
        }
    }

    /// Sets ratings and time constants; the temperatures are kept.
    pub fn configure(&mut self, calibration: &Calibration) {
        self.thermal = calibration.thermal;
        self.peak_a = calibration.peak_current_a;
        self.continuous_a = calibration.continuous_current_a;
        self.update_limits();
    }

    /// Sets the temperatures.
    pub fn set_temperatures(&mut self, temperatures: Temperatures) {
        self.at = temperatures;
        self.update_limits();
    }

    /// Returns the temperatures, which a board keeps over a reset.
    #[must_use]
    pub const fn temperatures(&self) -> Temperatures {
        self.at
    }

    /// Returns the estimated winding temperatures, °C.
    #[must_use]
    pub fn winding_c(&self) -> Vec3 {
        self.at.winding_c()
    }

    /// Advances by a tick with the amplifiers off, in which `measured_a` may still flow.
    pub fn advance_off(&mut self, measured_a: Vec3) {
        self.heat(measured_a);
        // With the amplifiers on, the guard trips long before.
        self.at.winding_k = self.at.winding_k.min(MAX_K);
        self.at.housing_k = self.at.housing_k.min(MAX_K);
    }

    /// Advances by a tick with `currents_a`.
    // A few instructions, except in the one tick in ten that updates the temperatures.
    #[inline(always)]
    pub fn heat(&mut self, currents_a: Vec3) {
        self.squares += currents_a * currents_a;
        self.ticks += 1;
        if self.ticks >= self.step_ticks {
            self.advance();
        }
    }

    #[inline(never)]
    fn advance(&mut self) {
        let thermal = &self.thermal;
        let mean = self.squares / self.ticks as f32;
        let toward = |from: Vec3, k_per_w: f32, time_s: f32| {
            let step_s = STEP_MS as f32 * 1e-3;
            // K above the other node for A² flowing permanently; then the part of it in this
            // update.
            let end = mean * (thermal.resistance_ohm * k_per_w);
            from + (end - from) * (step_s / time_s)
        };
        self.at = Temperatures {
            winding_k: toward(
                self.at.winding_k,
                thermal.winding_k_per_w,
                thermal.winding_s,
            ),
            housing_k: toward(
                self.at.housing_k,
                thermal.housing_k_per_w,
                thermal.housing_s,
            ),
        };
        self.squares = Vec3::ZERO;
        self.ticks = 0;
        self.update_limits();
    }

    fn update_limits(&mut self) {
        let winding_c = self.winding_c();
        let warm = (winding_c - DERATE_C) / (CONTINUOUS_C - DERATE_C);
        let less = self.peak_a - self.continuous_a;
        self.allowed_a = self.peak_a - warm.clamp(Vec3::ZERO, Vec3::ONE) * less;
        // Written so that NaN counts as too hot.
        self.too_hot = !winding_c.cmple(Vec3::splat(TRIP_C)).all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Requests a current for some time, limited to the permitted one.
    fn after(rate: TickRate, seconds: u32, target_a: f32) -> (Motors, Vec3) {
        let mut motors = Motors::new(rate);
        motors.configure(&Calibration::PREMIUM_1_5);
        let mut allowed_a = Vec3::ZERO;
        for _ in 0..seconds * rate.hz() {
            allowed_a = Vec3::splat(target_a).min(motors.allowed_a);
            motors.heat(allowed_a);
        }
        (motors, allowed_a)
    }

    /// Seconds without load until a motor has its peak current again.
    fn seconds_to_peak(from: Temperatures) -> u32 {
        let mut motors = Motors::new(khz(1));
        motors.set_temperatures(from);
        motors.configure(&Calibration::PREMIUM_1_5);
        let cooled = |_: &u32| {
            for _ in 0..1_000 {
                motors.heat(Vec3::ZERO);
            }
            motors.allowed_a == motors.peak_a
        };
        (1..10_000).find(cooled).expect("it cools")
    }

    #[test]
    fn hot_motor_has_continuous_current_at_once_and_peak_later() {
        let mut motors = Motors::new(khz(1));
        motors.set_temperatures(Temperatures::HOT);
        motors.configure(&Calibration::PREMIUM_1_5);
        assert!((motors.winding_c().x - CONTINUOUS_C).abs() < 1e-3);
        assert!((motors.allowed_a.x - 1.24).abs() < 1e-3, "{motors:?}");
        assert!(!motors.too_hot);
        for _ in 0..10_000 {
            motors.heat(Vec3::ZERO);
        }
        // While the user is still zeroing the arm.
        assert!(motors.allowed_a.x > 2.5, "{}", motors.allowed_a);
        let seconds = seconds_to_peak(Temperatures::HOT);
        assert!((55..70).contains(&seconds), "{seconds}");
    }

    #[test]
    fn hot_motor_under_full_load_derates_and_never_trips() {
        let mut motors = Motors::new(khz(1));
        motors.set_temperatures(Temperatures::HOT);
        motors.configure(&Calibration::PREMIUM_1_5);
        for _ in 0..600_000 {
            motors.heat(Vec3::splat(5.5).min(motors.allowed_a));
            assert!(!motors.too_hot, "{:?}", motors.winding_c());
        }
    }

    /// With any motion of a hand, no node exceeds the temperatures that are assumed without
    /// information.
    ///
    /// Safety: 12.
    #[test]
    fn derated_motor_never_exceeds_the_hot_start_temperatures() {
        let mut motors = Motors::new(khz(1));
        motors.configure(&Calibration::PREMIUM_1_5);
        let hot = Temperatures::HOT;
        let hottest_c = (hot.winding_k + hot.housing_k).x + AIR_C;
        // A constant press on axis 1, in bursts on the others.
        for ms in 0..4_000_000_u32 {
            let requested = Vec3::new(
                5.5,
                if ms % 9_000 < 4_000 { 5.5 } else { 0.0 },
                if ms % 100_000 < 60_000 { 5.5 } else { 0.5 },
            );
            motors.heat(requested.min(motors.allowed_a));
            if ms % 10 == 0 {
                let housing = motors.at.housing_k.max_element();
                assert!(housing < hot.housing_k.x + 0.1, "{housing} K");
                let winding = motors.winding_c().max_element();
                assert!(winding < hottest_c + 0.1, "{winding} °C");
            }
        }
    }

    #[test]
    fn stored_temperatures_are_raised_after_a_reset() {
        let stored = Temperatures {
            winding_k: Vec3::new(0.0, 10.0, 20.0),
            housing_k: Vec3::new(0.0, 60.0, 60.0),
        };
        let start = stored.after_reset().expect("possible");
        let sum = start.winding_k + start.housing_k;
        // Never beyond the end of derating, and never colder either.
        assert!((sum - Vec3::new(5.0, 75.0, 80.0)).abs().max_element() < 1e-4);
        assert_eq!(start.housing_k, stored.housing_k);
    }

    /// Safety: 12.
    #[test]
    fn reset_margin_covers_the_heat_of_the_unrecorded_time() {
        let mut motors = Motors::new(khz(1));
        motors.configure(&Calibration::PREMIUM_1_5);
        for _ in 0..200 {
            motors.heat(Vec3::splat(5.5));
        }
        assert!(
            motors.at.winding_k.x < RESET_MARGIN_K,
            "{}",
            motors.at.winding_k
        );
        assert!(
            motors.at.winding_k.x > 0.8 * RESET_MARGIN_K,
            "{}",
            motors.at.winding_k
        );
    }

    #[test]
    fn impossible_stored_temperatures_are_rejected() {
        for bad in [f32::NAN, f32::INFINITY, -0.1, 201.0] {
            for axis in 0..3 {
                let mut stored = Temperatures::HOT;
                stored.winding_k[axis] = bad;
                assert_eq!(stored.after_reset(), None, "{bad}");
                let mut stored = Temperatures::HOT;
                stored.housing_k[axis] = bad;
                assert_eq!(stored.after_reset(), None, "{bad}");
            }
        }
    }

    fn khz(khz: u32) -> TickRate {
        TickRate::new(khz * 1000).expect("in range")
    }

    #[test]
    fn uncalibrated_motors_have_no_permitted_current() {
        assert_eq!(Motors::new(TickRate::DEFAULT).allowed_a, Vec3::ZERO);
    }

    #[test]
    fn cool_motor_may_have_its_peak_current() {
        let (motors, allowed) = after(khz(1), 1, 5.5);
        assert_eq!(allowed.x, 5.5);
        assert!(motors.winding_c().x < DERATE_C);
    }

    #[test]
    fn permanent_peak_request_derates_and_never_trips() {
        let (motors, allowed) = after(khz(1), 3000, 5.5);
        assert!(!motors.too_hot, "{:?}", motors.winding_c());
        assert!(allowed.x < 1.4 && allowed.x >= 1.24, "{allowed}");
    }

    #[test]
    fn continuous_current_is_permitted_without_limit() {
        let (motors, allowed) = after(khz(1), 4000, 1.24);
        assert_eq!(allowed.x, 1.24);
        assert!(motors.winding_c().x < CONTINUOUS_C);
        // 1.24² A² · 2.82 Ω · 17.1 K/W above the air.
        assert!(
            (motors.winding_c().x - 99.0).abs() < 0.5,
            "{:?}",
            motors.winding_c()
        );
    }

    #[test]
    fn temperatures_are_independent_of_the_tick_rate() {
        let (slow, _) = after(khz(1), 200, 1.3);
        let (fast, _) = after(khz(10), 200, 1.3);
        let difference = (slow.winding_c() - fast.winding_c()).abs().max_element();
        assert!(difference < 0.01, "{difference} K");
    }
}
