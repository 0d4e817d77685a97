//! From joint angle to counts: an incremental encoder on the motor shaft, behind the cable ratio,
//! without an index.

use std::f64::consts::TAU;

use super::model::AxisDrive;

/// One joint's quadrature counter (HEDM-5500: 1,024 lines, 4,096 counts).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoder {
    counts_per_rad: f64,
    zero: i32,
}

impl Encoder {
    /// Creates a counter that reads zero at joint angle zero.
    #[must_use]
    pub fn new(axis: &AxisDrive) -> Self {
        Self {
            counts_per_rad: axis.sign * axis.counts_per_rev * axis.ratio / TAU,
            zero: 0,
        }
    }

    /// Returns the reading at a joint angle in radians: the nearest count, with an error of at most
    /// half a count.
    #[must_use]
    pub fn counts(&self, angle_rad: f64) -> i32 {
        self.absolute(angle_rad).wrapping_sub(self.zero)
    }

    /// Sets the counter to zero at this angle, as at power-up.
    pub fn power_up(&mut self, angle_rad: f64) {
        self.zero = self.absolute(angle_rad);
    }

    /// Returns the joint angle, radians, at which the counter reads `counts`.
    #[must_use]
    pub fn angle_rad(&self, counts: i32) -> f64 {
        f64::from(counts.wrapping_add(self.zero)) / self.counts_per_rad
    }

    fn absolute(&self, angle_rad: f64) -> i32 {
        // Half a turn of the joint is 27,000 counts: far inside i32.
        (angle_rad * self.counts_per_rad + 0.5).floor() as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom::{PhantomModel, kinematics};

    #[test]
    fn one_count_at_home_moves_the_tip_24_29_and_23_micrometres() {
        let model = PhantomModel::premium_1_5();
        let jacobian = kinematics::jacobian(&model, [0.0; 3]);
        for (joint, expected_um) in [24.0, 29.0, 23.0].into_iter().enumerate() {
            let count = Encoder::new(&model.drive[joint]).angle_rad(1);
            let moved: f64 = (0..3)
                .map(|row| (jacobian[row][joint] * count).powi(2))
                .sum();
            let um = moved.sqrt() * 1e6;
            assert!((um - expected_um).abs() < 0.5, "joint {joint}: {um} µm");
        }
    }

    #[test]
    fn reading_is_the_nearest_count_with_the_axis_sign() {
        let mut axis = PhantomModel::premium_1_5().drive[0];
        let count = Encoder::new(&axis).angle_rad(1);
        assert_eq!(Encoder::new(&axis).counts(0.49 * count), 0);
        assert_eq!(Encoder::new(&axis).counts(0.51 * count), 1);
        assert_eq!(Encoder::new(&axis).counts(-0.51 * count), -1);
        axis.sign = -1.0;
        assert_eq!(Encoder::new(&axis).counts(12.2 * count), -12);
    }

    #[test]
    fn counts_are_zero_at_power_up() {
        let axis = PhantomModel::premium_1_5().drive[1];
        let mut encoder = Encoder::new(&axis);
        encoder.power_up(0.7);
        assert_eq!(encoder.counts(0.7), 0);
        let moved = encoder.counts(0.7 + 100.0 * Encoder::new(&axis).angle_rad(1));
        assert_eq!(moved, 100);
    }
}
