//! Thermal model of a motor: winding and housing, two nodes.
//!
//! It changes nothing in the simulation: the guard must protect the motor, and tests use this model
//! to check that it does.

use super::model::Motor;

/// Relative rise of copper's resistance for each kelvin.
const COPPER_PER_K: f64 = 0.003_93;
/// Data sheets state resistance and limits at this temperature, °C.
const AMBIENT_C: f64 = 25.0;

/// Temperatures of one motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorTemperature {
    motor: Motor,
    winding_c: f64,
    housing_c: f64,
}

impl MotorTemperature {
    /// Creates a motor at 25 °C.
    #[must_use]
    pub fn new(motor: Motor) -> Self {
        Self {
            motor,
            winding_c: AMBIENT_C,
            housing_c: AMBIENT_C,
        }
    }

    /// Returns the winding temperature, °C.
    #[must_use]
    pub fn winding_c(&self) -> f64 {
        self.winding_c
    }

    /// Applies `current_a` for `dt_s` seconds (well below the winding's time constant of 12 s).
    pub fn advance(&mut self, current_a: f64, dt_s: f64) {
        let m = &self.motor;
        let warm = 1.0 + COPPER_PER_K * (self.winding_c - AMBIENT_C);
        let heat_w = current_a * current_a * m.resistance_ohm * warm;
        let to_housing_w = (self.winding_c - self.housing_c) / m.winding_k_per_w;
        let to_air_w = (self.housing_c - AMBIENT_C) / m.housing_k_per_w;
        let winding_j_per_k = m.winding_tau_s / m.winding_k_per_w;
        let housing_j_per_k = m.housing_tau_s / m.housing_k_per_w;
        self.winding_c += dt_s * (heat_w - to_housing_w) / winding_j_per_k;
        self.housing_c += dt_s * (to_housing_w - to_air_w) / housing_j_per_k;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn winding_after(current_a: f64, seconds: u32) -> f64 {
        let mut motor = MotorTemperature::new(Motor::maxon_118743());
        (0..seconds * 10).for_each(|_| motor.advance(current_a, 0.1));
        motor.winding_c()
    }

    /// Checks two independent entries of the data sheet: the continuous current heats the winding
    /// exactly to its limit.
    #[test]
    fn continuous_current_ends_at_the_winding_limit() {
        let motor = Motor::maxon_118743();
        let end = winding_after(motor.continuous_a, 10_000);
        assert!((end - motor.winding_max_c).abs() < 3.0, "{end} °C");
    }

    #[test]
    fn peak_current_burns_the_winding_within_seconds() {
        assert!(winding_after(5.5, 1) < 60.0);
        assert!(winding_after(5.5, 10) > 100.0);
    }
}
