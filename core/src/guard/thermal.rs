//! How warm the motors are, and what current they may still be given.
//!
//! A winding heats in seconds, the housing around it in minutes, so two nodes
//! a motor (Maxon RE25 118743, data sheet): winding to housing 3.1 K/W and
//! 12 s, housing to air 14 K/W and 612 s. The winding's resistance is taken
//! hot, which errs on the warm side.

use glam::Vec3;

/// Winding resistance at 100 °C, Ω (2.18 Ω at 25 °C).
const RESISTANCE_OHM: f32 = 2.82;
/// Winding to housing, housing to air, K/W.
const TO_HOUSING: f32 = 3.1;
const TO_AIR: f32 = 14.0;
/// Time constants, s.
const WINDING_S: f32 = 12.0;
const HOUSING_S: f32 = 612.0;
/// Air, °C.
const AIR_C: f32 = 25.0;

/// From this winding temperature on the current is reduced, °C.
pub const DERATE_C: f32 = 80.0;
/// Here no more than the continuous current is left, °C.
pub const CONTINUOUS_C: f32 = 100.0;
/// Here the guard trips, °C. Derating alone never comes this far.
pub const TRIP_C: f32 = 110.0;

/// Peak and continuous current of an axis, A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rating {
    /// What a cool motor may be given.
    pub peak_a: f32,
    /// What it can bear for ever.
    pub continuous_a: f32,
}

/// Temperatures of the three motors above the air's, K.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motors {
    winding_k: Vec3,
    housing_k: Vec3,
}

impl Motors {
    /// Estimated winding temperatures, °C.
    #[must_use]
    pub fn winding_c(&self) -> Vec3 {
        self.winding_k + self.housing_k + AIR_C
    }

    /// Lets `currents_a` flow for `dt_s` seconds.
    pub fn heat(&mut self, currents_a: Vec3, dt_s: f32) {
        let watts = currents_a * currents_a * RESISTANCE_OHM;
        self.winding_k += (watts * TO_HOUSING - self.winding_k) * (dt_s / WINDING_S);
        self.housing_k += (watts * TO_AIR - self.housing_k) * (dt_s / HOUSING_S);
    }

    /// The most that each axis may be given now, A.
    #[must_use]
    pub fn allowed_a(&self, rating: Rating) -> Vec3 {
        let warm = (self.winding_c() - DERATE_C) / (CONTINUOUS_C - DERATE_C);
        let less = (rating.peak_a - rating.continuous_a).max(0.0);
        Vec3::splat(rating.peak_a) - warm.clamp(Vec3::ZERO, Vec3::ONE) * less
    }

    /// Whether a winding is too hot to go on.
    #[must_use]
    pub fn is_too_hot(&self) -> bool {
        self.winding_c().max_element() > TRIP_C
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RE25: Rating = Rating {
        peak_a: 5.5,
        continuous_a: 1.24,
    };

    /// Asks for a current for some time, given what is allowed.
    fn after(seconds: u32, wanted_a: f32) -> (Motors, Vec3) {
        let mut motors = Motors::default();
        let mut given = Vec3::ZERO;
        for _ in 0..seconds * 100 {
            given = Vec3::splat(wanted_a).min(motors.allowed_a(RE25));
            motors.heat(given, 0.01);
        }
        (motors, given)
    }

    #[test]
    fn a_cool_motor_may_have_its_peak() {
        let (motors, given) = after(1, 5.5);
        assert_eq!(given.x, 5.5);
        assert!(motors.winding_c().x < DERATE_C);
    }

    #[test]
    fn asked_for_the_peak_for_ever_it_derates_and_never_trips() {
        let (motors, given) = after(3000, 5.5);
        assert!(!motors.is_too_hot(), "{:?}", motors.winding_c());
        assert!(given.x < 1.4 && given.x >= 1.24, "{given}");
    }

    #[test]
    fn the_continuous_current_is_borne_for_ever() {
        let (motors, given) = after(4000, 1.24);
        assert_eq!(given.x, 1.24);
        assert!(motors.winding_c().x < CONTINUOUS_C);
    }
}
